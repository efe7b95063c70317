"""Values of a description from runs with a measured position: they stay within what can be."""

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.calibration import fit_track as fitting
from ramsight.calibration.fit_track import MeasuredRun
from ramsight.calibration.free_values import FreeValue, free_values, with_values

RIG = machine.load("eha-valve-rig")
GIVE = "parts.hose_a.effective_bulk_modulus"


def free(*keys):
    return tuple(one for one in free_values(RIG.unit("axis")) if one.key in keys)


@pytest.fixture(scope="module")
def run():
    """A run of the rig, with its position."""
    simulated = ramsight.simulate(RIG, unit="axis", load=2e3, cycles=1)
    return MeasuredRun("light", ramsight.drive_report(simulated, seed=1), simulated[["position"]])


def test_a_value_goes_no_further_than_a_description_may(run):
    (give,) = free(GIVE)
    model = fitting._Model(RIG, "axis", [run], (give,))
    near = np.array([0.3, 0.0, 0.0])
    np.testing.assert_array_equal(model.possible(near), near)
    far = model.possible(np.array([-20.0, 0.0, 0.0]))
    assert give.at(far[0]) == pytest.approx(1e6, rel=1e-3), "the least that a hose may have"
    with_values(RIG, "axis", {give.key: give.at(float(far[0]))})


def test_an_efficiency_is_found_by_what_it_lacks():
    one = FreeValue("parts.pump.volumetric_efficiency", 0.9, 0.7, loss=True)
    assert one.at(0.0) == pytest.approx(0.9)
    assert one.at(np.log(2.0)) == pytest.approx(0.8)
