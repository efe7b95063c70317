"""Stages of the control by themselves, at the boundaries where they decide."""

import ast
import math
from dataclasses import replace
from pathlib import Path

import pytest

from ramsight.closed_loop import thresholds as loop_thresholds
from ramsight.constant import constants_of
from ramsight.control import thresholds
from ramsight.control.activity import Event
from ramsight.control.actuation import Actuation, Tuning
from ramsight.control.block import stopping_ramp
from ramsight.control.moving import LeakTest, Steering, at_power_up, begun, landed, leak_tested, moved, ordered, steered
from ramsight.control.orders import Ask, LastOrder, Orders, Reason, read_orders
from ramsight.control.sensing import Sensed, reliance_on, sensed_at, smoothed_temperature, trust
from ramsight.control.sensing import may_home as homes
from ramsight.control.trajectory import Limits
from ramsight.engine.typed_state import leaves
from ramsight.expression import flag, scalar
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import OIL_TIME_CONSTANT

from .control_bench import number, numbers, sample_of
from .plant_bench import UNITS

BOOM, RAM = UNITS["mining-loader boom"], UNITS["press ram"]
DT, STROKE = 0.02, BOOM.cylinder.stroke
BY = Actuation.of(BOOM)


def true_of(conditions):
    return {name for name, holds in conditions.items() if number(holds)}


# Orders


def orders(last, **inputs):
    order, new = read_orders(last, sample_of(BOOM, **inputs).inputs, STROKE)
    return numbers(order), {name for name, holds in vars(new).items() if number(holds)}


AT = LastOrder(scalar(Ask.POSITION), scalar(0.3))


@pytest.mark.parametrize(
    ("last", "inputs", "new"),
    [
        (AT, {"target": 0.3}, set()),
        (AT, {"target": 0.31}, {"sent"}),
        (AT, {"target": 0.0}, {"sent"}),
        (AT, {"target": STROKE}, {"sent"}),
        (AT, {"target": -1e-9}, set()),
        (AT, {"target": STROKE + 1e-9}, set()),
        (AT, {"target": math.nan}, set()),
        (AT, {"ask": Ask.STEER, "target": math.nan}, {"steered"}),
        (replace(AT, ask=scalar(Ask.STEER)), {"ask": Ask.STEER}, set()),
        (replace(AT, ask=scalar(Ask.STEER)), {"target": 0.3}, {"sent"}),
        (AT, {"ask": Ask.HOME_LOWERED}, {"homed"}),
        (AT, {"ask": Ask.HOME_LIFTED}, {"homed", "lifted"}),
        (replace(AT, ask=scalar(Ask.HOME_LIFTED)), {"ask": Ask.HOME_LOWERED}, {"homed"}),
        (AT, {"ask": Ask.LEAK_TEST}, {"tested"}),
        (replace(AT, ask=scalar(Ask.STOP)), {"ask": Ask.STOP}, {"stopped"}),
    ],
)
def test_what_differs_from_the_sample_before_is_a_new_order(last, inputs, new):
    found, orders_ = orders(last, **{"target": 0.3} | {key: float(value) for key, value in inputs.items()})
    assert orders_ == new
    assert float(found.ask) == float(inputs.get("ask", Ask.POSITION))


def test_a_target_that_is_none_leaves_the_last_one_and_another_order_forgets_it():
    assert float(orders(AT, target=9.0)[0].target) == 0.3
    assert float(orders(AT, target=9.0, ask=float(Ask.STEER))[0].target) == thresholds.NO_PLACE


# The estimate


def test_without_a_report_the_last_estimate_goes_on_with_its_velocity():
    last = Sensed(*(scalar(value) for value in (0.2, 1e-3, 0.05, 1e5, 0.0, 1.1, 0.9)))
    inputs = sample_of(BOOM, position=0.4, velocity=-0.1, leak=2.0).inputs
    assert float(numbers(sensed_at(last, inputs, DT, 0.5)).position) == 0.4
    gone = numbers(sensed_at(last, replace(inputs, reported=scalar(0.0)), DT, 0.5))
    assert [float(one.value) for one in leaves(gone)] == pytest.approx([0.201, 1e-3, 0.05, 1e5, 0.0, 1.1, 0.9])


def test_a_rod_whose_position_is_unknown_goes_on_from_the_middle_within_the_stroke():
    last = Sensed(*(scalar(value) for value in (0.49, math.nan, 0.6, 1e5, 30.0, 1.1, 0.9)))
    unknown = sample_of(BOOM, position=math.nan, status=30.0).inputs
    assert float(numbers(sensed_at(last, unknown, DT, 0.5)).position) == 0.5, "the whole of it was gone through"
    first = replace(last, position=scalar(thresholds.NO_POSITION))
    assert float(numbers(sensed_at(first, unknown, DT, 0.5)).position) == 0.25
    back = replace(last, velocity=scalar(-0.5))
    assert float(numbers(sensed_at(back, unknown, DT, 0.5)).position) == pytest.approx(0.49 - 0.5 * DT)


@pytest.mark.parametrize(("reported", "accepted"), [(243.15, False), (243.16, True), (383.14, True), (383.15, False)])
def test_a_thermometer_is_smoothed_and_believed_where_oil_can_be(reported, accepted):
    inputs = sample_of(BOOM, oil_temperature=reported).inputs
    share = DT / (OIL_TIME_CONSTANT + DT) if accepted else 0.0
    assert number(smoothed_temperature(scalar(313.15), inputs, DT)) == pytest.approx(
        313.15 + share * (reported - 313.15)
    )
    silent = replace(inputs, reported=scalar(0.0))
    assert number(smoothed_temperature(scalar(313.15), silent, DT)) == 313.15
    assert number(smoothed_temperature(scalar(313.15), replace(inputs, oil_temperature=scalar(math.nan)), DT)) == 313.15


@pytest.mark.parametrize("status", [*Status, 9999.0])
def test_a_status_allows_what_it_is_judged_to_and_no_status_nothing(status):
    found = true_of(vars(reliance_on(scalar(float(status)))))
    if not isinstance(status, Status):
        assert found == {"none"}
    else:
        assert found - {"homing"} == {trust(status).name.lower()}
        assert ("homing" in found) is homes(status)


# Moves


def move(unit=BOOM, tries=5, **sample):
    """The first sample of a move."""
    now = sample_of(unit, **sample)
    state = at_power_up(now.by)
    state = begun(replace(state, tries=scalar(tries)), now, flag(True))
    return state, now


def test_a_move_begins_where_the_rod_is_as_fast_as_it_goes_towards_the_target():
    state, _ = move(target=0.5, velocity=0.01, motor_speed=50.0)
    assert number(state.direction) == 1.0
    assert number(state.trajectory.points[0] - state.trajectory.points[1]) == pytest.approx(0.01 * DT)
    state, _ = move(target=0.1, velocity=0.01, motor_speed=0.0)
    assert number(state.direction) == -1.0
    assert number(state.trajectory.velocity) == 0.0, "the motor stands"


def after(state, now, felt=0.0):
    new, wish, error = moved(state, now, flag(True), scalar(felt))
    return numbers(new), number(wish.speed), true_of({**wish.events, **wish.failures}), number(error)


def test_a_target_is_near_when_the_way_left_is_the_way_to_standstill():
    way = number(BY.stopping_distance(scalar(40.0), scalar(1.0), scalar(2e5)))
    for share, happens in ((0.999, {Event.NEAR}), (1.001, set())):
        *_, events, _ = after(*move(target=0.3 + share * way, motor_speed=40.0))
        assert events == happens


def test_a_rod_that_is_too_far_from_its_trajectory_is_a_failure():
    state, now = move(target=0.5)
    limit = Tuning.following_error_limit(BY.limits)
    for share, happens in ((0.99, set()), (1.01, {Reason.ROD})):
        here = replace(now, sensed=replace(now.sensed, position=scalar(0.3 - share * limit)))
        _, _, events, error = after(state, here)
        assert events == happens
        assert error == pytest.approx(share * limit, rel=0.01)


def test_a_load_at_the_largest_force_is_waited_for_and_fails_after_a_second():
    by = Actuation.of(BOOM, Limits.of(BOOM, force=2e5))
    state, now = move(by=by, target=0.5, load=2.0001e5)
    for before, happens in ((1.0 - 2.1 * DT, set()), (1.0 - 0.9 * DT, {Reason.FORCE})):
        new, speed, events, _ = after(replace(state, blocked=scalar(before)), now)
        assert (speed, events) == (0.0, happens)
        assert float(new.blocked) == pytest.approx(before + DT)
    new, speed, events, _ = after(state, *move(by=by, target=0.5, load=1.9e5)[1:])
    assert speed > 0.0
    assert float(new.blocked) == 0.0


@pytest.mark.parametrize(("load", "margin"), [(1.8e5, 1.0), (1.9e5, 0.5), (2.0e5, 0.0), (3.0e5, 0.0)])
def test_the_last_tenth_before_the_largest_force_slows_a_motion_against_it(load, margin):
    by = Actuation.of(BOOM, Limits.of(BOOM, force=2e5))
    assert number(by.force_margin(scalar(1.0), scalar(load))) == pytest.approx(margin)
    assert number(by.force_margin(scalar(-1.0), scalar(load))) == 1.0
    assert BY.force_margin(scalar(1.0), scalar(load)) == 1.0


def test_a_move_off_a_stop_carries_the_load_that_was_felt_before():
    state, now = move(target=0.5, load=0.0)
    for left, more in ((0.3, True), (0.294, False), (thresholds.NO_PLACE, False)):
        plain = after(replace(state, left=scalar(left)), now, 0.0)[1]
        assert (after(replace(state, left=scalar(left)), now, 2e5)[1] > plain + 1.0) is more


def test_an_order_gives_a_move_its_tries_and_the_stop_that_it_leaves():
    sent = Orders(*(flag(name == "sent") for name in ("sent", "steered", "homed", "tested", "stopped", "lifted")))
    state = replace(at_power_up(BY), stood=scalar(1.0), blocked=scalar(1.0))
    new = numbers(ordered(state, sent, 5, scalar(0.7), flag(True)))
    assert [float(one) for one in (new.tries, new.left, new.stood, new.blocked)] == [5.0, 0.7, 0.0, 0.0]
    assert float(numbers(ordered(state, sent, 5, scalar(0.7), flag(False))).left) == thresholds.NO_PLACE
    none = replace(sent, sent=flag(False))
    assert float(numbers(ordered(state, none, 5, scalar(0.7), flag(True))).stood) == 1.0


SETTLED = Tuning().settling


@pytest.mark.parametrize(
    ("stood", "off", "tries", "status", "happens"),
    [
        (SETTLED - 1.5 * DT, 1e-3, 5, Status.OK, set()),
        (SETTLED - 0.5 * DT, 1e-3, 5, Status.OK, {Event.MISSED}),
        (SETTLED - 0.5 * DT, -1e-3, 1, Status.OK, {Event.MISSED}),
        (SETTLED - 0.5 * DT, 1e-3, 0, Status.OK, {Event.SETTLED}),
        (SETTLED - 0.5 * DT, 1e-3, 5, Status.NOT_REFERENCED, {Event.SETTLED}),
        (SETTLED - 0.5 * DT, 0.499e-3, 5, Status.OK, {Event.SETTLED}),
        (SETTLED - 0.5 * DT, 0.501e-3, 5, Status.OK, {Event.MISSED}),
    ],
)
def test_a_landing_looks_at_its_target_when_the_rod_has_settled(stood, off, tries, status, happens):
    state, now = move(target=0.3 + off, tries=tries, status=status)
    new, events = landed(replace(state, stood=scalar(stood)), now, flag(True))
    assert true_of(events) == happens
    assert number(new.tries) == tries - (Event.MISSED in happens)
    turning = replace(now, motor_speed=scalar(1.0))
    assert number(landed(replace(state, stood=scalar(stood)), turning, flag(True))[0].stood) == 0.0


def test_a_landing_waits_for_the_reports_that_are_still_to_come():
    state, now = move(target=0.301)
    state, late = replace(state, stood=scalar(SETTLED + 0.03)), replace(now, by=replace(BY, lag=0.1))
    assert true_of(landed(state, late, flag(True))[1]) == set()
    state = replace(state, stood=scalar(SETTLED + 0.09))
    assert true_of(landed(state, late, flag(True))[1]) == {Event.MISSED}


# By hand, leak tests, stops


@pytest.mark.parametrize(("load", "goes"), [(2.99e5, True), (3.01e5, False)])
def test_a_hand_goes_no_further_against_the_largest_force(load, goes):
    by = replace(BY, limits=replace(BY.limits, force=3e5))
    up = BOOM.lift_sign * 0.01
    now = sample_of(BOOM, by=by, steering=up, load=load)
    state, went, _ = steered(Steering(scalar(up)), now, flag(True))
    assert number(went) == float(goes)
    assert number(state.velocity) == pytest.approx(up if goes else 0.0)


@pytest.mark.parametrize(
    ("status", "share"), [(Status.OK, 1.0), (Status.REFERENCE_DUE, 0.5), (Status.NOT_REFERENCED, 0.3)]
)
def test_a_hand_is_as_fast_as_the_position_is_known(status, share):
    by, fast = BY, scalar(BY.limits.speed)
    state, goes, speed = steered(Steering(fast), sample_of(BOOM, status=status, steering=9.0), flag(True))
    step = by.limits.acceleration * DT
    assert number(state.velocity) == pytest.approx(max(share * by.limits.speed, by.limits.speed - step))
    assert number(goes) == 1.0
    assert number(speed) > 0.0
    still, goes, _ = steered(Steering(scalar(0.0)), sample_of(BOOM, status=status), flag(True))
    assert (number(still.velocity), number(goes)) == (0.0, 0.0)
    assert number(steered(Steering(fast), sample_of(BOOM), flag(False))[0].velocity) == BY.limits.speed


def test_a_leak_test_turns_slower_than_the_rod_would_lift_until_its_time_is_over():
    state, wish = leak_tested(LeakTest(), sample_of(BOOM), flag(True), flag(True))
    lifts = number(BY.leakage(scalar(2e5)))
    assert number(wish.speed) == pytest.approx(Tuning.leak_test_share(BOOM) * lifts * BOOM.lift_sign)
    assert number(state.time) == DT
    again = leak_tested(LeakTest(scalar(1.0), scalar(8.0)), sample_of(BOOM), flag(True), flag(True))[0]
    assert number(again.time) == DT, "the time of an earlier test is over"
    for before, over in ((8.0 - 1.5 * DT, set()), (8.0 - 0.5 * DT, {Event.OVER})):
        later = LeakTest(state.speed, scalar(before))
        now, wish = leak_tested(later, sample_of(BOOM, load=9e5), flag(True), flag(False))
        assert true_of(wish.events) == over
        assert number(now.speed) == pytest.approx(number(state.speed)), "the first sample's load counts"
        assert bool(number(wish.speed)) is not bool(over)


@pytest.mark.parametrize(("period", "time"), [(0.02, 0.14), (0.1, 0.1), (0.2, 0.2)])
def test_a_stop_takes_its_time_less_a_sample_and_a_sample_at_least(period, time):
    assert number(stopping_ramp(scalar(-70.0), period)) == pytest.approx(70.0 / time)


# Numbers


def test_no_number_stands_at_the_head_of_another_module():
    rooms = (Path(table.__file__).parent for table in (thresholds, loop_thresholds))
    for file in (file for room in rooms for file in room.glob("*.py")):
        for node in ast.parse(file.read_text()).body if file.name != "thresholds.py" else ():
            value = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
            number_ = isinstance(value, ast.Constant | ast.UnaryOp | ast.BinOp)
            assert not number_ or (isinstance(value, ast.Constant) and isinstance(value.value, str)), file.name


def test_a_tuning_has_its_defaults_from_the_table():
    found = {float(one) for one in constants_of(thresholds).values()}
    assert {float(value) for value in vars(Tuning()).values()} <= found
