"""What a motor speed does with a cylinder: leakage in both directions, what was learned of it, valves, and landings."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.control.activity import Activity
from ramsight.control.actuation import Actuation, Tuning
from ramsight.control.position import PositionControl
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_response import DriveResponse
from ramsight.duty.live import LiveUnit, Reported
from ramsight.machine.assumption_description import SURE_START, AssumedMachine, Assumptions
from ramsight.plant.holding import Holding
from ramsight.plant.limits import limits_of
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .control_bench import Evaluated
from .plant_bench import UNITS

DT, WARM, LOAD = 0.02, 313.15, 200e3
BOOM, RAM, BUCKET = UNITS["mining-loader boom"], UNITS["press ram"], UNITS["mining-loader bucket"]


def actuation(unit, **changes):
    return Evaluated(Actuation.of(unit, **changes))


def measured(unit, speed, load):
    """Velocity of the true rod from its middle under a load, its motor turning steadily for a while [m/s]."""
    live = LiveUnit(unit, 0.5 * unit.cylinder.stroke, load)
    for _ in range(60):
        before = live.now.position[unit.name]
        live.advance(speed, load)
    return (live.now.position[unit.name] - before) / DT


@pytest.mark.parametrize("name", ["mining-loader boom", "press ram", "eha-test-bench axis"])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_rod_goes_as_fast_as_is_asked_for_lifting_and_lowering(name, direction):
    """Lowered, the load presses oil through the pump beside what it delivers: the motor has to turn that much less."""
    unit = UNITS[name]
    by, pace, load = actuation(unit), 0.3 * Limits.of(unit).speed, 0.4 * limits_of(unit).load
    found = measured(unit, by.driving_speed(pace, direction, load), load)
    assert found == pytest.approx(direction * pace, rel=0.03)
    assert abs(by.leakage(load)) > 0.05 * abs(by.driving_speed(pace, direction, load))


def test_what_was_learned_of_the_machine_is_used():
    plain = actuation(BOOM)
    learned = Evaluated(replace(plain.of, leak=1.3, displacement=0.98))
    assert learned.leakage(LOAD) == pytest.approx(1.3 * plain.leakage(LOAD))
    turns = plain.speed_of(0.01, LOAD) - plain.leakage(LOAD)
    assert learned.speed_of(0.01, LOAD) == pytest.approx(turns / 0.98 + 1.3 * plain.leakage(LOAD))


def test_a_control_goes_by_what_its_sensor_has_learned():
    speeds = []
    for leak in (1.0, 1.3):
        control, speed = PositionControl(BOOM), 0.0
        control.move_to(0.6)
        for k in range(40):
            there = Estimate(0.1 + 1e-4 * k, 1e-4, 0.0, LOAD, Status.OK)
            speed = control.step(there, Reported(k * DT, speed, k, WARM), leak=leak).motor_speed
        speeds.append(speed)
    expected = 0.3 * actuation(BOOM).leakage(LOAD)
    assert speeds[1] - speeds[0] == pytest.approx(expected, rel=1e-6)


def test_a_trajectory_is_no_faster_than_the_motor_beside_the_leakage():
    for unit in (BOOM, RAM):
        by, fast = actuation(unit), 0.9 * unit.max_speed
        reach = by.reachable_velocity(LOAD)
        assert abs(by.speed_of(reach, LOAD)) == pytest.approx(fast)
        assert by.reachable_velocity(2.0 * LOAD) < reach
        control, speed = PositionControl(unit, Limits(1.0, 2.0, 0.1, 0.02)), 0.0
        control.move_to(0.39)
        places = [0.05]
        for k in range(200):  # the rod is where the trajectory has it
            speed = control.step(
                Estimate(places[-1], 1e-4, 0.0, LOAD, Status.OK), Reported(k * DT, speed, k, WARM)
            ).motor_speed
            places.append(control.state["move.trajectory.points[0]"])
            if places[-1] > 0.3:
                break
        velocities = np.diff(places[2:]) / DT
        assert 0.99 * reach < velocities.max() <= reach + 1e-12
        assert control.activity is Activity.MOVING


def landed(control, off, samples):
    """A control sent to 0.3 m whose rod rests `off` from it whenever it has landed; what it does, sample by sample."""
    control.move_to(0.3)
    found, speed = [], 0.0
    for k in range(samples):
        x = 0.3 if k and control.activity is Activity.MOVING and found[-1] is Activity.MOVING else 0.3 + off
        speed = control.step(Estimate(x, 1e-4, 0.0, LOAD, Status.OK), Reported(k * DT, speed, k, WARM)).motor_speed
        found.append(control.activity)
    return found


def test_a_target_that_was_missed_is_sought_anew_but_not_for_ever():
    tuning = Tuning()
    near = landed(PositionControl(BOOM), 0.8 * tuning.tolerance, 200)
    assert near[-1] is Activity.RESTING
    sought = [now for before, now in pairwise(near) if now is Activity.MOVING is not before]
    assert sought == []
    control = PositionControl(BOOM)
    missed = landed(control, 2.0 * tuning.tolerance, 2000)
    sought = [now for before, now in pairwise(missed) if now is Activity.MOVING is not before]
    assert len(sought) == tuning.tries
    assert missed[-1] is Activity.RESTING


@pytest.mark.parametrize("name", ["mining-loader boom", "press ram", "mining-loader bucket"])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_way_to_standstill_is_what_the_rod_goes(name, direction):
    unit, by = UNITS[name], actuation(UNITS[name])
    load = LOAD if name != "mining-loader bucket" else 76e3
    live, speed = LiveUnit(unit, 0.25, load), by.driving_speed(0.4 * Limits.of(unit).speed, direction, load)
    for _ in range(60):
        live.advance(speed, load)
    begins, left, stands = live.now.position[unit.name], speed, unit.lift_sign * by.leakage(load)
    goal = 0.0 if by.holding.valves else stands
    while left != goal:
        left = max(left - 12.0, goal) if left > goal else min(left + 12.0, goal)
        live.advance(left, load)
    for _ in range(10):
        live.advance(goal, load)
    way = direction * (live.now.position[unit.name] - begins)
    rate = 0.4 * Limits.of(unit).speed
    assert by.stopping_distance(speed, direction, load) - 0.5 * DT * rate == pytest.approx(way, abs=0.2 * way + 5e-5)


def test_what_is_on_its_way_is_the_angle_less_what_leaks_meanwhile():
    late = actuation(BOOM, response=DriveResponse(report_delay=0.1))
    speeds = (60.0, 80.0, 100.0, 120.0, 140.0)  # on its way to a standstill, the newest first
    angle = 0.02 * sum(speeds)
    way = late.pending_travel(angle, [(speed, 0.02) for speed in speeds], LOAD)
    velocity = (100.0 - late.leakage(LOAD)) * late.holding.travel_per_radian(LOAD)
    assert way == pytest.approx(velocity * 0.1)
    assert math.isfinite(late.pending_travel(1.0, [(10.0, 0.1)], math.nan))
    assert actuation(BOOM).pending_travel(1.0, [(10.0, 0.1)], LOAD) == 0.0


def test_nothing_is_on_its_way_to_a_rod_that_a_valve_holds():
    """What is left of an angle by rounding must not bring a tenth of a second's leakage with it."""
    late = actuation(BOOM, response=DriveResponse(report_delay=0.1))
    leaks = late.leakage(LOAD)
    assert leaks > 1.0
    for speed in (0.0, 0.9 * leaks, -0.9 * late.holding.opening_speed):
        assert late.pending_travel(0.1 * speed + 1e-15, [(speed, 0.1)], LOAD) == pytest.approx(0.0, abs=1e-12)
    lowered = late.pending_travel(-5.0, [(-50.0, 0.1)], LOAD)
    assert lowered == pytest.approx(-(5.0 + 0.1 * leaks) * late.holding.travel_per_radian(LOAD))
    press = actuation(RAM, response=DriveResponse(report_delay=0.1))  # its pump holds it, and turns for the leakage
    at_rest = press.leakage(LOAD)
    assert press.pending_travel(0.1 * at_rest, [(at_rest, 0.1)], LOAD) == pytest.approx(0.0, abs=1e-12)
    assert press.pending_travel(0.0, [(0.0, 0.1)], LOAD) < 0.0  # and sinks where it does not


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.2])
def test_a_landing_is_as_near_with_a_drive_that_is_late(delay):
    drive = DriveResponse(command_delay=0.5 * delay, report_delay=0.5 * delay)
    sure = BUCKET.assumptions.replace({**SURE_START, "machine.leak": 1e-3})  # no stop teaches anything
    loop = UnitLoop(BUCKET, BUCKET, 0.25, 70e3, LoopSettings(known=True, drive=drive, assumptions=sure))
    off, landings = [], 0
    for target in (0.35, 0.15, 0.3):
        begun = len(loop.time)
        loop.go({"bucket": target})
        record = loop.records["bucket"]
        off.append(abs(record.estimate[-1].position - target))
        went = record.activity[begun:]
        landings += sum(a is not b and b is Activity.LANDING for a, b in pairwise(went))
    assert max(off) < 0.15e-3
    assert landings == 3  # none is sought anew


def test_no_more_is_asked_of_a_motor_than_it_is_declared_to_do():
    assert actuation(BOOM).slope == Tuning().motor_acceleration
    assert actuation(BOOM, response=DriveResponse(acceleration=200.0)).slope == 200.0


def test_a_leak_test_stays_below_the_load_of_a_pump_that_leaks_less_than_it_is_taken_for():
    assert Tuning.leak_test_share(BOOM) == pytest.approx(1.0 - 2.6 * BOOM.assumptions.machine.leak)
    sure = replace(BOOM, assumptions=Assumptions(machine=AssumedMachine(leak=0.03)))
    assert Tuning.leak_test_share(sure) > Tuning.leak_test_share(BOOM)
    unsure = replace(BOOM, assumptions=Assumptions(machine=AssumedMachine(leak=0.5)))
    assert Tuning.leak_test_share(unsure) == pytest.approx(0.2)


def test_a_rod_that_is_lowered_behind_a_valve_stands_as_soon_as_the_motor_does():
    by = actuation(BOOM)
    velocity = by.leakage(LOAD) * by.holding.travel_per_radian(LOAD)
    assert by.stopping_distance(0.0, -1.0, LOAD) == pytest.approx(0.5 * DT * velocity)
    assert by.stopping_distance(by.leakage(LOAD), 1.0, LOAD) == pytest.approx(0.0)
    held = actuation(RAM)
    assert held.stopping_distance(held.leakage(LOAD), -1.0, LOAD) == pytest.approx(0.0)
    assert held.stopping_distance(0.0, -1.0, LOAD) > 0.5 * DT * held.leakage(LOAD) * held.holding.travel_per_radian(
        LOAD
    )


def test_a_sensor_of_a_late_drive_is_told_where_the_rod_was_at_the_beginning():
    """What such a drive reports first is of before: a pump that holds its load was not sinking then."""
    axis, errors = UNITS["eha-test-bench axis"], []
    load = 0.4 * limits_of(axis).load
    for delay in (0.0, 0.1):
        loop = UnitLoop(axis, axis, 0.1, load, LoopSettings(known=True, drive=DriveResponse(report_delay=delay)))
        loop.rest(3.0)
        errors.append(loop.records["axis"].estimate[-1].position - loop.now.position["axis"])
    sinks = actuation(axis).leakage(load) * Holding(axis).travel_per_radian(load) * 0.1
    assert sinks > 0.3e-3
    assert abs(errors[1] - errors[0]) < 0.4 * sinks
