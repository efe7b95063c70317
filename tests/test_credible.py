"""A measured position is taken for true only where a piston can have it."""

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

import ramsight
from ramsight.errors import LogWarning
from ramsight.plant.limits import limits_of
from ramsight.signals import Signals
from ramsight.tracking.credible import (
    credible_run,
    credible_truth,
    frozen_positions,
    possible_positions,
    possible_pressures,
    possible_truth,
)
from ramsight.tracking.track_errors import ComparisonError

BOOM = ramsight.build("mining-loader", unit="boom")
STROKE = float(BOOM.cylinder.stroke)
TIME = np.arange(0.0, 60.0, 0.02)


def work(time=TIME):
    """Out and back within the stroke, as fast as this machine goes."""
    return STROKE * (0.5 - 0.4 * np.cos(2.0 * np.pi * time / 40.0))


def test_a_piston_at_work_is_believed_everywhere():
    assert possible_positions(TIME, work(), BOOM).all()
    coarse = np.round(work() / 1e-3) * 1e-3
    assert possible_positions(TIME, coarse, BOOM).all()


@settings(max_examples=25, deadline=None)
@given(st.integers(50, 2800), st.integers(1, 60), st.sampled_from([-2.0, -0.01, 0.01, 2.0]))
def test_a_glitch_is_left_out_and_the_rest_stays(begins, lasts, by):
    position = work()
    glitch = slice(begins, begins + lasts)
    position[glitch] = position[begins] + np.sign(by) * (0.3 + abs(by))
    good = possible_positions(TIME, position, BOOM)
    assert not good[glitch].any()
    assert good.mean() > 1.0 - (lasts + 20) / len(TIME)


@pytest.mark.parametrize("slope", [0.05, 1.0])
def test_from_a_position_that_runs_away_and_wraps_nothing_comes_back(slope):
    """A counter of 16 bits at a quarter of a millimetre: up to 8.19 m, on from - 8.19 m."""
    position = work()
    begins = 1500
    away = position[begins] + slope * 8.0 * (TIME[begins:] - TIME[begins])
    position[begins:] = (away + 8.19) % 16.38 - 8.19
    if slope < 0.1:  # slow enough for a piston, until it leaves the stroke; the wrap then shows the fault
        position[2500:] -= 16.38
    truth = xarray.Dataset({"position": ("time", position)}, coords={"time": TIME})
    with pytest.warns(LogWarning, match=r"truth.csv, column position: from .* to 59\.98 s is where this piston"):
        left = credible_truth(Signals.of(truth), BOOM, "truth.csv")
    assert np.abs(left["position"].values - STROKE / 2).max() < 0.55 * STROKE
    assert left["time"].values[-1] < 33.0
    possible_truth(left, STROKE)


def test_a_position_in_millimetres_is_no_fault_of_a_sensor(recwarn):
    """It is refused as before, with the unit that fits."""
    truth = xarray.Dataset({"position": ("time", 1e3 * work())}, coords={"time": TIME})
    left = credible_truth(Signals.of(truth), BOOM, "truth.csv")
    assert not recwarn.list
    with pytest.raises(ComparisonError, match="is it in mm"):
        possible_truth(left, STROKE)


def lifting(torque):
    """A log of a motor that lifts for twenty seconds."""
    speed = np.where((TIME > 10.0) & (TIME < 30.0), 0.3 * BOOM.max_speed * BOOM.lift_sign, 0.0)
    columns = {"motor_speed": ("time", speed), "motor_torque": ("time", np.full(len(TIME), torque))}
    return xarray.Dataset(columns, coords={"time": TIME})


@pytest.mark.parametrize(("share", "frozen"), [(0.4, True), (1.0, False)])
def test_a_position_that_stands_while_oil_is_delivered_is_frozen_unless_it_is_held(share, frozen):
    still = np.full(len(TIME), 0.4 * STROKE)
    found = frozen_positions(lifting(share * limits_of(BOOM).torque), still, BOOM)
    assert found.any() == frozen


def test_a_pressure_below_vacuum_or_beyond_relief_for_long_is_left_out_with_its_time():
    highest = limits_of(BOOM).pressure
    pressure = np.full(len(TIME), 0.3 * highest)
    pressure[1000] = -highest  # a spike
    assert possible_pressures(TIME, pressure, BOOM).mean() > 0.98
    pressure[2000:] = -0.1 * highest
    measured = xarray.Dataset({"position": ("time", work()), "pressure_a": ("time", pressure)}, coords={"time": TIME})
    with pytest.warns(LogWarning, match=r"run 3, column pressure_a: from 40.* to 59.98 s .*below vacuum"):
        left = credible_run(lifting(1.0), measured, BOOM, "run 3")
    assert np.isnan(left["pressure_a"].values[2050:]).all()
    assert np.isfinite(left["position"].values).all()
