"""Efficiency curves of the catalogue's pumps, as data sheets draw them."""

import itertools

import numpy as np
import pytest

from ramsight.machine import catalogue
from ramsight.plant.efficiency import catalogue_pump, efficiency

PUMPS = [entry.name for entry in catalogue.entries() if entry.kind == "pump"]
PRESSURE = np.linspace(10e5, 250e5, 25)
SPEED, VISCOSITY = 1450 * np.pi / 30, 46e-6  # the nominal point of the data sheets


@pytest.mark.parametrize("name", PUMPS)
def test_a_pumps_curves_have_the_shape_of_a_data_sheets(name):
    pump = catalogue_pump(name)
    curve = efficiency(pump, PRESSURE, SPEED, VISCOSITY)
    assert np.all(np.diff(curve.volumetric) < 0.0)  # more pressure leaks more
    np.testing.assert_allclose(np.diff(curve.volumetric, 2), 0.0, atol=1e-12)  # in a straight line, as eq. 9 has it
    assert np.all(np.diff(curve.hydromechanical) > 0.0)  # the no-load torque counts less and less
    assert np.all((curve.total > 0.3) & (curve.total < 1.0))
    assert curve.volumetric[-1] == pytest.approx(pump.volumetric_efficiency)
    idle = pump.no_load_torque / (pump.displacement * 250e5)
    assert curve.hydromechanical[-1] == pytest.approx(1.0 / (1.0 / pump.hydromechanical_efficiency + idle))
    best = curve.total.argmax()
    assert 0 < best < len(PRESSURE)


def test_larger_pumps_are_more_efficient():
    curves = [efficiency(catalogue_pump(name), PRESSURE, SPEED, VISCOSITY) for name in sorted(PUMPS)]
    for smaller, larger in itertools.pairwise(curves):
        assert np.all(larger.volumetric >= smaller.volumetric - 1e-12)
        assert np.all(larger.hydromechanical >= smaller.hydromechanical - 1e-12)


def test_thin_oil_and_low_speed_leak_more():
    pump = catalogue_pump("PGI100-2-008", chambers=2, blocks=2)
    nominal, thin, slow = (
        efficiency(pump, [200e5], speed, viscosity).volumetric[0]
        for speed, viscosity in ((SPEED, VISCOSITY), (SPEED, 0.5 * VISCOSITY), (0.5 * SPEED, VISCOSITY))
    )
    assert 1.0 - thin == pytest.approx(2.0 * (1.0 - nominal))
    assert 1.0 - slow == pytest.approx(2.0 * (1.0 - nominal))


def test_efficiency_needs_a_pump_that_pumps():
    pump = catalogue_pump("PGI100-2-008")
    for pressure, speed in (([0.0], 100.0), ([1e5], 0.0), ([-1e5], 100.0)):
        with pytest.raises(ValueError, match="above zero"):
            efficiency(pump, pressure, speed, VISCOSITY)
