"""The zero of a reported torque: learned by a motor that stands and carries nothing, and by no other."""

from dataclasses import replace

import numpy as np
import pytest

from ramsight import machine
from ramsight.duty import DriveReport, report, simulate
from ramsight.duty.plan import one_way
from ramsight.duty.profile import Duty, Profile, constant
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

RIG = build(machine.load_machine("eha-valve-rig").unit("axis"), "axis")
ZERO, NOISE = RIG.assumptions.drive.zero, RIG.assumptions.drive.torque
FAST = 94.0  # rad/s


@pytest.fixture(scope="module")
def sensors():
    plain = RIG.assumptions.replace({"drive.zero": 0.0})
    return {"declared": kalman(RIG), "none": kalman(replace(RIG, assumptions=plain))}


@pytest.fixture(scope="module")
def run():
    speed = Profile([0, 2, 2.3, 5.3, 5.6, 9, 9.3, 11, 11.3, 14], [0, 0, FAST, FAST, 0, 0, -FAST, -FAST, 0, 0])
    return simulate(RIG, one_way(Duty(speed, constant(6e3), constant(308.15), 0.005), "valve"))


@pytest.fixture(scope="module")
def log(run):
    return report(run, DriveReport(torque_noise=NOISE, torque_step=0.0, speed_step=0.0))


def off(log, zero, where=slice(None)):
    """The log with a torque that reads too much [N m] from some samples on."""
    torque = log["motor_torque"].values.copy()
    torque[where] += zero
    return log.assign(motor_torque=("time", torque))


def at(track, time, name):
    return float(track[name].values[np.searchsorted(track["time"].values, time)])


def error(sensor, run, log, time=8.0):
    sensor.start(float(run["position"][0]), 1e-4)
    track = sensor.track(log)
    return at(track, time, "position") - float(np.interp(time, run["time"], run["position"]))


@pytest.mark.parametrize("zero", [ZERO, -ZERO])
def test_a_zero_that_is_learned_at_rest_moves_the_position_by_a_fraction(sensors, run, log, zero):
    moved = {name: error(one, run, off(log, zero)) - error(one, run, log) for name, one in sensors.items()}
    assert abs(moved["none"]) > 0.1e-3
    assert abs(moved["declared"]) < 0.3 * abs(moved["none"])


@pytest.mark.parametrize(("held", "learned"), [(1.0, 1.0), (3.0, 1.0), (10.0, 0.0)])
def test_a_zero_is_learned_as_far_as_it_can_be_one(sensors, run, log, held, learned):
    """A motor that reports ten times as much as its zero can be carries something: it teaches nothing."""
    sensor = sensors["declared"]
    sensor.start(float(run["position"][0]), 1e-4)
    sensor.track(off(log, held * ZERO).isel(time=slice(0, 90)))
    known = sensor.state["torque_zero.zero"]
    assert known == pytest.approx(learned * held * ZERO, abs=0.15 * ZERO)
    assert (sensor.state["torque_zero.variance"] < 0.05 * ZERO**2) == (learned > 0.0)


def test_a_zero_wanders_as_declared_and_no_farther_than_at_power_up(run, log):
    wandering = kalman(replace(RIG, assumptions=RIG.assumptions.replace({"drive.zero_walk": 0.02})))
    wandering.start(float(run["position"][0]), 1e-4)
    wandering.track(log.isel(time=slice(0, 90)))
    known = wandering.state["torque_zero.variance"]
    wandering.track(log.isel(time=slice(110, 160)))  # 1 s, while the motor turns
    assert wandering.state["torque_zero.variance"] == pytest.approx(min(known + 0.02**2 * 1.4, ZERO**2), rel=0.2)


@pytest.mark.parametrize(("torque", "status"), [(-5.5 * ZERO, True), (-ZERO, False)])
def test_a_one_way_motor_that_drives_the_other_way_at_rest_is_not_believed(sensors, run, log, torque, status):
    """A current's sensor that has lost its supply reads that: said within half a second, as long as it lasts."""
    sensor = sensors["declared"]
    sensor.start(float(run["position"][0]), 1e-4)
    time = log["time"].values
    lost = time > 7.0
    held = log["motor_torque"].values.copy()
    held[lost] = torque
    speed = log["motor_speed"].values.copy()
    speed[lost] = 0.0
    track = sensor.track(log.assign(motor_torque=("time", held), motor_speed=("time", speed)))
    said = track["status"].values[np.searchsorted(track["time"].values, 7.5) :] == Status.IMPLAUSIBLE_TORQUE
    assert said.all() if status else not said.any()
