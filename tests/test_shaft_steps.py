"""Steps of the reported speed that no torque goes with are found, and those of a motor that is driven are not."""

from pathlib import Path

import numpy as np
import pytest

from ramsight.deploy.encoder.liveness import ShaftSteps
from ramsight.logs import read_log

PERIOD, FASTEST, INERTIA = 0.02, 300.0, 0.01
TRACES = Path(__file__).parent / "traces"


def found_at(speeds, torques, times=None, inertia=INERTIA):
    """The reports at which a step is found."""
    shaft = ShaftSteps(FASTEST, inertia)
    times = PERIOD * np.arange(len(speeds)) if times is None else times
    seen = zip(times, speeds, torques, strict=True)
    return [k for k, (at, speed, torque) in enumerate(seen) if shaft.take(at, speed, torque, PERIOD)]


def noisy(count):
    """A torque that goes on [N m]."""
    return 20.0 + np.random.default_rng(1).normal(0.0, 0.5, count)


@pytest.mark.parametrize(
    ("speeds", "found"),
    [
        ([100.0, 100.0, 0.0, 0.0, 0.0], [3]),
        ([100.0, 100.0, -100.0, -101.0, -100.0], [3]),
        ([-100.0, -99.0, 99.0, 99.0, 99.0], [3]),
        ([100.0, 100.0, 153.6, 153.6, 153.6], [3]),  # a bit is stuck
        ([25.0, 25.0, -25.0, -25.0, -25.0], [3]),
        ([0.0, 0.0, 100.0, 100.0, 100.0], [3]),
        ([100.0, 100.0, 0.0, 100.0, 100.0], []),  # one frame may be disturbed
        ([100.0, 60.0, 20.0, -20.0, -20.0], []),  # a ramp
        ([100.0, 100.0, 75.0, 75.0, 75.0], []),  # so fast a motor stops
    ],
)
def test_a_step_without_a_torque_is_none_of_a_shaft(speeds, found):
    assert found_at(speeds, noisy(len(speeds))) == found


@pytest.mark.parametrize("which", [2, 3])
@pytest.mark.parametrize(("share", "found"), [(0.4, [3]), (0.6, [])])
def test_a_torque_of_half_of_what_the_step_takes_explains_it(which, share, found):
    torques = np.full(4, 20.0) + 0.01 * np.arange(4)
    torques[which] -= share * INERTIA * 100.0 / PERIOD
    assert found_at([100.0, 100.0, 0.0, 0.0], torques) == found


def test_an_unknown_inertia_tells_nothing():
    assert found_at([100.0, 100.0, 0.0, 0.0], noisy(4), inertia=0.0) == []


def test_a_gap_is_not_a_step():
    assert found_at([100.0, 100.0, 0.0, 0.0], noisy(4), times=[0.0, 0.02, 0.07, 0.09]) == []


def test_reports_that_repeat_count_once():
    """A drive that sends twice what it has measured once has ramps that look like steps between steady speeds."""
    speeds = np.repeat([0.0, 0.0, 40.0, 80.0, 120.0, 120.0], 2)
    torques = np.repeat([0.0, 0.1, 20.1, 20.0, 19.9, 0.0], 2)
    assert found_at(speeds, torques, times=0.5 * PERIOD * np.arange(12)) == []
    once = [100.0, 100.0, 0.0, 0.0, 0.0]
    assert found_at(once, [20.0, 20.1, 20.2, 20.2, 20.3]) == [4]


STEEP = ["lift_worn", "boom_dig", "boom_exchange", "bucket_free_air", "boom_asbuilt1_workday"]
"""Logs of drives that go from rest to 2400 1/min within 60 ms, and one of ramps."""


@pytest.mark.parametrize("name", STEEP)
def test_no_motor_of_a_recorded_log_steps_without_a_torque(name):
    """Not even where the drive sends all that it has measured twice."""
    (path,) = TRACES.rglob(f"{name}.csv.gz")
    log = read_log(str(path))
    rows = [log[one].values.tolist() for one in ("time", "motor_speed", "motor_torque")]
    for times, inertia in ((1, 0.008), (2, 0.008), (1, 0.02)):
        shaft, period = ShaftSteps(400.0, inertia), PERIOD / times
        for at, speed, torque in zip(*rows, strict=True):
            for k in range(times):
                assert not shaft.take(at + period * k, speed, torque, period), at
