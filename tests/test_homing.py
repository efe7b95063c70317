"""Homing: which way a stop is pressed, how hard, what is carried on it, and when a rod is held."""

import math
from dataclasses import replace

import pytest

from ramsight.control import homing
from ramsight.control.activity import Event
from ramsight.control.actuation import Actuation, Tuning
from ramsight.control.homing import Homing, approach, end_stop, homed, is_held, pressing_load, speed_on_stop
from ramsight.control.orders import Reason
from ramsight.control.thresholds import LOAD_AVERAGING, NO_PLACE
from ramsight.expression import flag, scalar
from ramsight.plant.limits import limits_of
from ramsight.sensor.status import Status

from .control_bench import number, numbers, sample_of
from .plant_bench import UNITS

RAM, BOOM, BUCKET = (UNITS[name] for name in ("press ram", "mining-loader boom", "mining-loader bucket"))
FELT = 5e4  # N
BY = Actuation.of(RAM)


@pytest.mark.parametrize("unit", [BOOM, RAM, BUCKET], ids=lambda unit: unit.name)
def test_end_stops_of_lifting_and_lowering(unit):
    ends = {True: unit.cylinder.stroke if unit.lift_sign > 0.0 else 0.0}
    assert end_stop(unit, lifted=True) == ends[True]
    assert end_stop(unit, lifted=False) == unit.cylinder.stroke - ends[True]


@pytest.mark.parametrize("unit", [RAM, BUCKET], ids=["extends", "retracts"])
def test_a_stop_is_pressed_with_a_share_of_the_load_at_relief_and_no_load_that_helps(unit):
    full, sign, share = limits_of(unit), unit.lift_sign, 0.25

    def pressed(direction, felt):
        return number(pressing_load(unit, share, scalar(direction), scalar(felt)))

    assert pressed(sign, FELT) == pytest.approx(FELT + share * full.load)
    assert pressed(sign, -FELT) == pytest.approx(share * full.load)
    assert pressed(-sign, FELT) == pytest.approx(-share * full.pull)
    assert pressed(-sign, -FELT) == pytest.approx(-FELT - share * full.pull)


@pytest.mark.parametrize("unit", [RAM, UNITS["eha-test-bench axis"]], ids=lambda unit: unit.name)
def test_a_load_that_presses_on_the_stop_is_carried_by_the_stop(unit):
    by, sign = Actuation.of(unit), unit.lift_sign

    def kept(direction, felt):
        return number(speed_on_stop(by, scalar(direction), scalar(felt)))

    assert kept(sign, FELT) == pytest.approx(number(by.speed_of(0.0, scalar(FELT))))
    assert kept(-sign, -FELT) == pytest.approx(number(by.speed_of(0.0, scalar(-FELT))))
    assert kept(sign, -FELT) == kept(-sign, FELT) == 0.0


def test_a_rod_goes_fast_only_while_the_stop_is_surely_far():
    limits, slow = BY.limits, homing.slow_velocity(BY)
    near = limits.landing_zone + 0.5 * limits.speed**2 / limits.acceleration
    step = limits.acceleration * BY.period

    def next_velocity(velocity, away, std=0.0, trusted=True):
        return number(approach(BY, scalar(velocity), scalar(away), scalar(std), limits.speed, trusted))

    assert next_velocity(0.0, 1.001 * near) == pytest.approx(step)
    assert next_velocity(slow, 1.001 * near) == pytest.approx(slow + step)
    assert next_velocity(slow, 0.999 * near) == slow
    assert next_velocity(slow, near + 1.0, 0.999 * 0.25) == pytest.approx(slow + step), "4 standard deviations"
    assert next_velocity(slow, near + 1.0, 1.001 * 0.25) == slow
    assert next_velocity(slow, 2.0 * near, trusted=False) == slow
    assert next_velocity(limits.speed, 0.0) == pytest.approx(limits.speed - step)


def test_a_rod_is_held_when_it_is_slow_after_it_has_set_out():
    slow, sets_out = homing.slow_velocity(BY), BY.limits.speed / BY.limits.acceleration + 0.2
    cases = {
        (1.001 * sets_out, 0.299 * slow): True, (1.001 * sets_out, -0.299 * slow): True,
        (0.999 * sets_out, 0.0): False, (1.001 * sets_out, -0.301 * slow): False,
    }  # fmt: skip
    for (time, velocity), held in cases.items():
        assert bool(number(is_held(BY, scalar(time), scalar(velocity)))) is held


STANDS = Homing(end=scalar(0.0), time=scalar(9.0), stood=scalar(1.0), felt=scalar(FELT))


def step(state, unit=RAM, **sample):
    after, wish = homed(state, sample_of(unit, **sample), flag(True))
    happens = {one for one, holds in {**wish.events, **wish.failures}.items() if number(holds)}
    return numbers(after), number(wish.speed), happens


def test_a_rod_that_stands_presses_where_a_pump_holds_the_load_and_is_counted():
    contact = Tuning().contact_time
    before, after = (replace(STANDS, stood=scalar(contact + off)) for off in (-0.03, -0.01))
    now, speed, happens = step(before, position=0.001)
    assert float(now.stood) == pytest.approx(contact - 0.01)
    assert happens == set()
    goes = number(BY.driving_speed(scalar(float(now.velocity)), scalar(-1.0), scalar(2e5)))
    assert speed == pytest.approx(goes)
    _, presses, _ = step(after, position=0.001)
    assert presses == pytest.approx(number(BY.speed_of(0.0, pressing_load(RAM, 0.25, scalar(-1.0), scalar(FELT)))))
    behind = Actuation.of(BOOM)
    now, speed, _ = step(after, BOOM, position=0.001)
    assert speed == pytest.approx(number(behind.driving_speed(scalar(float(now.velocity)), scalar(-1.0), scalar(2e5))))


def test_a_rod_that_moves_feels_its_load_and_counts_again():
    now, *_ = step(STANDS, velocity=-BY.limits.speed)
    assert float(now.stood) == 0.0
    assert float(now.felt) == pytest.approx(FELT + 0.02 / (LOAD_AVERAGING + 0.02) * (2e5 - FELT))


@pytest.mark.parametrize(("off", "happens"), [(-0.03, set()), (-0.01, {Event.PRESSED})])
def test_a_stop_is_found_after_it_was_pressed_for_long_enough(off, happens):
    state = replace(STANDS, stood=scalar(Tuning().pressing + off))
    assert step(state, position=0.999 * BY.limits.landing_zone)[2] == happens


def test_what_holds_a_rod_beyond_the_landing_zone_is_no_stop():
    state = replace(STANDS, stood=scalar(Tuning().pressing))
    now, _, happens = step(state, position=1.001 * BY.limits.landing_zone, status=Status.NOT_REFERENCED)
    assert happens == {Reason.NO_REFERENCE}
    assert not float(now.found)


def test_a_stop_that_is_not_found_is_given_up():
    longest = homing.longest_search(BY)
    assert longest == pytest.approx(1.5 * RAM.cylinder.stroke / homing.slow_velocity(BY) + 6.0)
    for off, happens in ((-0.03, set()), (-0.01, {Reason.NOT_FOUND})):
        assert step(replace(STANDS, time=scalar(longest + off)), velocity=-1.0)[2] == happens


@pytest.mark.parametrize("unit", [RAM, BOOM], ids=["pump", "valve"])
def test_the_sensor_gets_its_reference_once_and_behind_a_valve_when_the_motor_stands(unit):
    by, state = Actuation.of(unit), replace(STANDS, found=scalar(1.0))

    def told(speed, rests=True):
        after, place = homing.referenced(state, by, flag(rests), scalar(speed))
        return bool(number(after.found)), number(place)

    assert told(0.0) == (False, 0.0)
    assert told(5.0) == ((True, NO_PLACE) if by.holding.stands else (False, 0.0))
    assert told(0.0, rests=False) == (False, NO_PLACE)
    assert math.isfinite(NO_PLACE)
