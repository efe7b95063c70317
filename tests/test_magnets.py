"""Warm magnets: a drive that reports too much torque, and a sensor that is told how warm the motor is."""

from dataclasses import replace

import numpy as np
import pytest

from ramsight import machine
from ramsight.duty import Magnets, report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.work_day import work_day
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

LOADER = machine.load_machine("mining-loader")
DESCRIBED = build(LOADER.unit("boom"), "boom")
PLAIN = replace(DESCRIBED, assumptions=DESCRIBED.assumptions.replace({"machine.leak": 1e-3}))  # no stop teaches any
TOLD = replace(PLAIN, assumptions=PLAIN.assumptions.replace({"motor_temperature.std": 0.01}))
RISE = 60.0  # K
MAGNETS = Magnets(torque=60.0, first=RISE, time_constant=1e6)


@pytest.fixture(scope="module")
def day():
    """A day without a stop, of a motor whose magnets are warm; and what its drive reports."""
    run = simulate(PLAIN, work_day(PLAIN, (100e3, 350e3), 313.15, duration=120.0, visit_every=1e3, seed=3))
    return run, report(run, replace(declared_report(TOLD, 3), magnets=MAGNETS))


@pytest.fixture(scope="module")
def sensors():
    return {"told": kalman(TOLD), "untold": kalman(PLAIN)}


def tracked(sensor, run, log):
    sensor.start(float(run["position"][0]))
    return sensor.track(log)


def load_over_true(track, run):
    fast = np.abs(run["motor_speed"].values) > 50.0
    return float(np.median((track["load"].values / run["load"].values)[fast]))


def test_the_temperature_takes_the_load_that_is_not_there(day, sensors):
    run, log = day
    untold, told = (tracked(sensors[name], run, log) for name in ("untold", "told"))
    assert load_over_true(untold, run) == pytest.approx(1.0 / (1.0 - 1.1e-3 * RISE), abs=0.01)
    assert load_over_true(told, run) == pytest.approx(1.0, abs=0.01)
    error = {name: np.abs(track["position"] - run["position"]) for name, track in (("a", untold), ("b", told))}
    assert float(error["b"].max()) < 0.75 * float(error["a"].max())


def test_a_temperature_that_is_missing_is_the_last_one_and_none_at_first(day, sensors):
    run, log = day
    missing = log["motor_temperature"].values.copy()
    missing[100:] = np.nan
    kept = tracked(sensors["told"], run, log.assign(motor_temperature=("time", missing)))
    whole = tracked(sensors["told"], run, log)
    np.testing.assert_allclose(kept["position"], whole["position"], atol=1e-12)
    for absurd in (np.nan, 1e10, 20.0, 600.0):
        none = tracked(sensors["told"], run, log.assign(motor_temperature=("time", np.full(len(missing), absurd))))
        assert load_over_true(none, run) == pytest.approx(1.0 / (1.0 - 1.1e-3 * RISE), abs=0.01)


def test_a_temperature_that_flickers_hides_no_torque_that_stands_still(day, sensors):
    run, log = day
    flickers = log["motor_temperature"].values + 0.4 * (-1.0) ** np.arange(log.sizes["time"])
    stuck = log["motor_torque"].values.copy()
    stuck[2000:] = stuck[2000]
    wrong = log.assign(motor_temperature=("time", flickers), motor_torque=("time", stuck))
    assert Status.INPUT_STUCK in tracked(sensors["told"], run, wrong)["status"].values


def test_what_is_left_of_the_gain_is_assumed(day, sensors):
    run, log = day
    less = kalman(PLAIN, PLAIN.assumptions.replace({"motor_temperature.std": 0.001}))
    assert float(tracked(sensors["told"], run, log)["position_std"][-1]) > float(
        tracked(less, run, log)["position_std"][-1]
    )
