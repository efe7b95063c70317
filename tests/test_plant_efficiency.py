"""Efficiency curves of the catalogue's pumps, as data sheets draw them."""

import itertools
import re

import numpy as np
import pytest

import ramsight
from ramsight.machine import catalogue

from .pump_curves import catalogue_pump, efficiency

PUMPS = [entry.name for entry in catalogue.entries() if entry.kind == "pump"]
PRESSURE = np.linspace(10e5, 250e5, 25)
SPEED, VISCOSITY = 1450 * np.pi / 30, 46e-6  # the nominal point of the data sheets


@pytest.mark.parametrize("name", PUMPS)
def test_a_pumps_curves_have_the_shape_of_a_data_sheets(name):
    pump = catalogue_pump(name)
    pressure = np.linspace(10e5, pump.nominal_pressure, 25)
    curve = efficiency(pump, pressure, SPEED, VISCOSITY)
    assert np.all(np.diff(curve.volumetric) < 0.0)  # more pressure leaks more
    np.testing.assert_allclose(np.diff(curve.volumetric, 2), 0.0, atol=1e-12)  # in a straight line, as eq. 9 has it
    assert np.all(np.diff(curve.hydromechanical) > 0.0)  # the no-load torque counts less and less
    assert np.all((curve.total > 0.3) & (curve.total < 1.0))
    assert curve.volumetric[-1] == pytest.approx(pump.volumetric_efficiency)
    idle = pump.no_load_torque / (pump.displacement * pump.nominal_pressure)
    assert curve.hydromechanical[-1] == pytest.approx(1.0 / (1.0 / pump.hydromechanical_efficiency + idle))
    best = curve.total.argmax()
    assert 0 < best < len(pressure)


@pytest.mark.parametrize("series", sorted({name.rpartition("-")[0] for name in PUMPS}))
def test_larger_pumps_of_a_series_are_more_efficient(series):
    of_series = sorted(name for name in PUMPS if name.rpartition("-")[0] == series)
    assert len(of_series) >= 3
    curves = [efficiency(catalogue_pump(name), PRESSURE, SPEED, VISCOSITY) for name in of_series]
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


@pytest.mark.parametrize("name", [name for name in PUMPS if name.startswith("generic-")])
def test_a_generic_pump_states_its_ranges_and_lifts_a_load(name):
    values, sources = catalogue.read(catalogue.find("pump", name))
    for key in ("volumetric_efficiency", "hydromechanical_efficiency"):
        low, high = map(float, re.match(r"\[G\] (0\.\d+) to (0\.\d+) ", sources[key]).groups())
        assert low < float(values[key]) < high < 1.0
    assert all(source.startswith("[G]") for source in sources.values())
    changes = {f"parts.{one}.model": name for one in ("pump_a", "pump_b")}
    press = ramsight.build(ramsight.load_machine("press").unit("ram").replace(changes), "ram")
    run = ramsight.simulate(press, load="50 kN", hold="0.2 s", start="100 mm")
    assert float(run["position"].max()) > 0.1 + 0.005
