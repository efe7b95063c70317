"""One wrong value of the drive among good ones: the piston stays where it is, and what lasts is believed."""

import numpy as np
import pytest

from ramsight.logs import read_log, read_truth
from ramsight.machine import load_machine
from ramsight.plant.ddh import build_ddh
from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman


@pytest.fixture(scope="module")
def sensor():
    return kalman(build_ddh("boom", load_machine("mining-loader").unit("boom")))


def error_with(trace, sensor, sample, leap, lasting=1):
    """Distance from the truth [m] with a torque that leaps by so much [N m] at a sample."""
    case = trace("boom_258kN_40C")
    log, truth = read_log(case.log), read_truth(case.truth)["position"].values
    log["motor_torque"].values[sample : sample + lasting] += leap
    sensor.start(float(truth[0]), 1e-3)
    return sensor.track(log)["position"].values - truth


@pytest.mark.parametrize("sample", [59, 85, 129, 300, 500, 900, 1100])
@pytest.mark.parametrize("leap", [-100.0, -79.0, -50.0, 45.0, 50.0, 70.0, 100.0])
def test_one_wrong_torque_moves_nothing(trace, sensor, sample, leap):
    """Before a torque was confirmed, 50 N m at sample 129 moved the piston by 13 mm, and it stayed there."""
    here = slice(sample + 25, sample + 100)
    moved = error_with(trace, sensor, sample, leap)[here] - error_with(trace, sensor, sample, 0.0)[here]
    assert np.abs(moved).max() < 0.5e-3


def test_a_torque_that_lasts_is_believed_with_its_second_sample(sensor):
    at_relief = limits_of(build_ddh("boom", load_machine("mining-loader").unit("boom"))).torque
    sensor.start(0.2, 1e-3)
    for k in range(50):
        before = sensor.step(0.02 * k, 100.0, 0.2 * at_relief, 313.15)
    first = sensor.step(1.0, 100.0, 0.8 * at_relief, 313.15)
    second = sensor.step(1.02, 100.0, 0.8 * at_relief, 313.15)
    assert first.load == pytest.approx(before.load, rel=0.05)
    assert second.load > 2.0 * before.load
