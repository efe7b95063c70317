"""A cylinder's position control as one step of a recursion: state and inputs in, motor speed out.

The same graph runs live, in C and in FMUs. A sample passes from stage to stage as values: the estimate, the orders,
the watch over the drive, then each activity with a state of its own. Which activity follows which stands in the table
of `ramsight.control.activity`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import lru_cache

import casadi as ca

from ramsight.control import drive_watch, homing, moving
from ramsight.control.activity import STOPS, Activity, ActivityState, Event, fail, follow
from ramsight.control.actuation import Actuation, Tuning
from ramsight.control.decision import Sample, Wish
from ramsight.control.drive_watch import Declaration, Report, Verdict, WatchState
from ramsight.control.homing import Homing
from ramsight.control.moving import LeakTest, Move, Steering
from ramsight.control.orders import OUTPUTS, STOPPED_BY, Inputs, LastOrder, Orders, Reason, read_orders
from ramsight.control.sensing import Sensed, reliance_on, sensed_at, smoothed_temperature
from ramsight.control.thresholds import LARGEST_NUMBER, NO_PLACE, STANDSTILL_ROUNDING, STOPPING_TIME
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.engine.recursion import Recursion, recursion_of
from ramsight.engine.typed_state import leaf, symbols
from ramsight.expression import Condition, Flag, Real, Scalar, all_of, any_of, flag, negated, scalar, scalar_symbol
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit

VERDICTS = tuple(Verdict)
LIVE_OUTPUTS = ("following_error", "notice")
"""Further outputs of the live control: the following error [m], and what slows the cylinder."""


class Notice(IntEnum):
    """What slows the cylinder: as before, an uncertain sensor, or the drive, by DRIVE and the place in `VERDICTS`."""

    AS_BEFORE = -1
    SENSOR = 0
    DRIVE = 1


@dataclass(frozen=True)
class ControlState:
    """All that a control knows."""

    activity: ActivityState  # the activity
    order: LastOrder  # what was asked for last
    sensed: Sensed  # the estimate of the last sample
    watch: WatchState  # over the drive
    move: Move  # to a target
    steering: Steering  # by hand
    homing: Homing  # to an end stop
    leak_test: LeakTest | None  # none where no valve holds the load
    place: Scalar = leaf("m", NO_PLACE)  # where a rod at rest is held, or none
    motor_speed: Scalar = leaf("rad/s")  # commanded until now
    oil_temperature: Scalar = leaf("K", T40)  # its noise averaged


@dataclass(frozen=True, eq=False)
class Block:
    """A control as a recursion."""

    # recursion: its graph; the inputs are `INPUTS`, the outputs `OUTPUTS` and `LIVE_OUTPUTS`, the parameter is the
    # largest acceleration of a move [m/s2]
    recursion: Recursion
    initial: ControlState  # state at power-up: at rest, with no target
    by: Actuation  # the cylinder's motor speeds, limits, tuning and period
    response: DriveResponse  # how its drive is declared to follow


def position_block(
    unit: HydraulicUnit,
    limits: Limits | None = None,
    tuning: Tuning | None = None,
    period: float = SAMPLE_PERIOD,
    response: DriveResponse = IDEAL,
) -> Block:
    """The position control of a unit, with its watch over the drive, as a graph.

    Args:
        unit: the unit's parts, as its data sheet has them.
        limits: what the cylinder may do; by default `Limits.of(unit)`.
        tuning: how it is driven.
        period: of the samples [s].
        response: how the drive is declared to follow.

    Raises:
        DescriptionError: the motor cannot turn as fast as a valve of the unit asks for before it opens.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> block = position_block(build(machine.load_machine("mining-loader").unit("boom"), "boom"))
        >>> len(block.recursion.state) < 100, block.recursion.outputs[:4]
        (True, ('motor_speed', 'activity', 'reason', 'reference'))
    """
    return _made(unit, limits, tuning, period, response)


@lru_cache(maxsize=16)
def _made(
    unit: HydraulicUnit, limits: Limits | None, tuning: Tuning | None, period: float, response: DriveResponse
) -> Block:
    """The block, once for equal arguments: it does not change, and takes a tenth of a second to make."""
    by, declared = Actuation.of(unit, limits, tuning, period, response), Declaration.of(unit, response, period)
    initial = ControlState(
        ActivityState(), LastOrder(), Sensed(), drive_watch.unwatched(declared), moving.at_power_up(by), Steering(),
        Homing(), LeakTest() if by.holding.stands else None,
    )  # fmt: skip
    acceleration = scalar_symbol("acceleration")

    def stage(state: ControlState, inputs: Inputs) -> tuple[ControlState, Sequence[Real]]:
        return _stepped(state, inputs, acceleration, by, declared)

    outputs = (*OUTPUTS, *LIVE_OUTPUTS)
    return Block(recursion_of(initial, symbols(Inputs()), outputs, stage, (acceleration,)), initial, by, response)


def _stepped(
    state: ControlState, inputs: Inputs, acceleration: Scalar, by: Actuation, declared: Declaration
) -> tuple[ControlState, Sequence[Real]]:
    """A sample: what is known, what is asked for, what may go on, what each activity asks for, what follows it."""
    sensed = sensed_at(state.sensed, inputs, by.period, float(by.unit.cylinder.stroke))
    temperature = smoothed_temperature(state.oil_temperature, inputs, by.period)
    by = replace(by, leak=sensed.leak, displacement=sensed.displacement, temperature=temperature)
    order, orders = read_orders(state.order, inputs, by.unit.cylinder.stroke)
    report = Report(inputs.reported != 0.0, inputs.reported_speed, inputs.reported_torque)
    watch, found = drive_watch.look(
        drive_watch.reset(state.watch, orders.any), declared, report, state.motor_speed
    )  # fmt: skip
    underway = zip(found.underway, declared.times, strict=False)
    pending = by.pending_travel(found.pending, underway, sensed.load)
    reliance = reliance_on(sensed.status)
    reliance = replace(reliance, full=all_of(reliance.full, negated(found.verdicts[Verdict.SLOW])))
    here = replace(sensed, position=sensed.position + pending)
    now = Sample(
        by, inputs, here, reliance, found.verdicts[Verdict.AT_LIMIT], state.motor_speed, order.target, acceleration
    )
    on_stop = all_of(state.activity.is_any_of(Activity.RESTING), state.homing.end != NO_PLACE)
    activity = _ordered(state.activity, orders, tests=state.leak_test is not None)
    place = ca.if_else(orders.any, NO_PLACE, state.place)
    activity, notice = _judged(activity, place, now, orders.stopped, sensed.position, found.verdicts)
    move = moving.ordered(state.move, orders, by.tuning.tries, here.position, on_stop)
    home = homing.ordered(state.homing, orders, by.unit)
    new, speed, error = _done(_begun(replace(state, activity=activity, place=place, move=move, homing=home), now), now)
    home, reference = homing.referenced(new.homing, by, new.activity.is_any_of(Activity.RESTING), speed)
    new = replace(
        new, order=order, sensed=sensed, watch=watch, homing=home, motor_speed=speed, oil_temperature=temperature
    )
    return new, (speed, new.activity.number, new.activity.reason, reference, error, notice)


def _ordered(activity: ActivityState, orders: Orders, *, tests: bool) -> ActivityState:
    """The activity that is asked for; `tests`: whether the unit has leak tests."""
    events = [(None, Event.SENT, orders.sent), (None, Event.STEERED, orders.steered), (None, Event.HOMED, orders.homed)]
    events += [(None, Event.TESTED, orders.tested)] if tests else []
    return follow(replace(activity, reason=ca.if_else(orders.any, float(Reason.NONE), activity.reason)), events)


def stopping_ramp(speed: Scalar, period: float) -> Scalar:
    """Change of the motor's speed [rad/s2] that stops it within `STOPPING_TIME` from a speed [rad/s]."""
    return (1.0 + STANDSTILL_ROUNDING) * abs(speed) / max(STOPPING_TIME - period, period)


def _judged(
    activity: ActivityState, place: Scalar, now: Sample, asked: Flag, position: Scalar, verdicts: dict[Verdict, Flag]
) -> tuple[ActivityState, Scalar]:
    """Stop if the estimate or the drive is not to be relied on; and what slows the cylinder down.

    A rod that is steered, homed or only kept up needs no position. A drive may stall where it is steered or homed.
    """
    by, ramp = now.by, stopping_ramp(now.motor_speed, now.by.period)
    rests, presses = activity.is_any_of(Activity.RESTING), activity.is_any_of(Activity.MANUAL, Activity.HOMING)
    placeless: Condition = place == NO_PLACE if by.holding.stands else True
    homes = all_of(any_of(presses, all_of(rests, placeless)), now.reliance.homing)
    # A sensor that knows no position says so, and gives none; before its first report there is NO_POSITION.
    reported = all_of(now.inputs.reported != 0.0, negated(now.reliance.none))
    missing = all_of(reported, negated(abs(now.inputs.position) <= LARGEST_NUMBER))
    unusable = any_of(all_of(now.reliance.none, negated(homes)), missing, negated(abs(position) <= LARGEST_NUMBER))
    matters = any_of(negated(rests), now.motor_speed != 0.0)
    slowing = {verdict: holds for verdict, holds in verdicts.items() if not verdict.stops or verdict is Verdict.STALLED}
    notice: Scalar = scalar(Notice.DRIVE + VERDICTS.index(Verdict.OBEYS))
    for verdict, holds in slowing.items():
        notice = ca.if_else(holds, float(Notice.DRIVE + VERDICTS.index(verdict)), notice)
    notice = ca.if_else(all_of(now.reliance.slow, negated(homes)), float(Notice.SENSOR), notice)
    notice = ca.if_else(any_of(unusable, activity.is_any_of(*STOPS)), float(Notice.AS_BEFORE), notice)
    reasons = {Reason.ASKED: asked, Reason.SENSOR: all_of(unusable, matters)}
    for verdict, reason in STOPPED_BY.items():
        stops = all_of(verdicts[verdict], negated(unusable))
        reasons[reason] = all_of(stops, negated(presses)) if verdict is Verdict.STALLED else stops
    return fail(activity, reasons, ramp), notice


def _begun(state: ControlState, now: Sample) -> ControlState:
    """The first sample of an activity."""
    activity, home = state.activity, state.homing
    feels = all_of(activity.begins, activity.is_any_of(Activity.HOMING))
    steers = all_of(activity.begins, activity.is_any_of(Activity.MANUAL))
    return replace(
        state,
        move=moving.begun(state.move, now, all_of(activity.begins, activity.is_any_of(Activity.MOVING))),
        steering=Steering(ca.if_else(steers, now.start_velocity, state.steering.velocity)),
        homing=replace(home, felt=ca.if_else(feels, now.sensed.load, home.felt)),
    )


def _done(state: ControlState, now: Sample) -> tuple[ControlState, Scalar, Scalar]:
    """What the activity asks for, and which one follows it: state, motor speed [rad/s], following error [m]."""
    activity = state.activity
    active = {one: activity.is_any_of(one) for one in Activity}
    move, moves, error = moving.moved(state.move, now, active[Activity.MOVING], state.homing.felt)
    hand, goes, hand_speed = moving.steered(state.steering, now, active[Activity.MANUAL])
    place = ca.if_else(all_of(active[Activity.MANUAL], goes), NO_PLACE, state.place)
    place, held = _held(replace(state, place=place, steering=hand), now)
    move, lands = moving.landed(move, now, active[Activity.LANDING])
    home, homes = homing.homed(state.homing, now, active[Activity.HOMING])
    wishes = {
        Activity.MOVING: moves,
        Activity.MANUAL: Wish(ca.if_else(goes, hand_speed, held)),
        Activity.LANDING: Wish(held, lands),
        Activity.RESTING: Wish(held),
        Activity.HOMING: homes,
    }
    test = state.leak_test
    if test is not None:
        test, wishes[Activity.LEAK_TEST] = moving.leak_tested(test, now, active[Activity.LEAK_TEST], activity.begins)
    after, failed = _followed(activity, wishes, now)
    place = ca.if_else(lands[Event.MISSED], NO_PLACE, place)
    place = ca.if_else(all_of(moves.events[Event.NEAR], negated(failed)), now.target, place)
    stops = any_of(active[Activity.STOPPING], failed)
    speed = _speed(stops, after.ramp, [(active[one], wish.speed) for one, wish in wishes.items()], now)
    new = replace(
        state, activity=after, move=move, steering=hand, homing=home, leak_test=test, place=place
    )  # fmt: skip
    return new, speed, error


def _held(state: ControlState, now: Sample) -> tuple[Scalar, Scalar]:
    """The place where a rod at rest is held, and the motor speed for that [rad/s].

    Behind a valve the motor stands. A pump turns for the leakage and brings the rod back; where no place is set, it
    is the first at which the position may be relied on. On an end stop the sensor feels what presses on the stop.
    """
    by, activity, place = now.by, state.activity, state.place
    if by.holding.stands:
        return place, scalar(0.0)
    trusted, rests = negated(now.reliance.none), activity.is_any_of(Activity.RESTING, Activity.LANDING)
    keeps = any_of(rests, all_of(activity.is_any_of(Activity.MANUAL), state.steering.velocity == 0.0))
    place = ca.if_else(all_of(keeps, trusted, place == NO_PLACE), now.sensed.position, place)
    back = ca.if_else(trusted, by.return_velocity(place - now.sensed.position), 0.0)
    on_stop = all_of(activity.is_any_of(Activity.RESTING), state.homing.end != NO_PLACE)
    kept = homing.speed_on_stop(by, state.homing.direction, state.homing.felt)
    return place, ca.if_else(on_stop, kept, by.holding_speed(back, now.sensed.load))


def _followed(activity: ActivityState, wishes: dict[Activity, Wish], now: Sample) -> tuple[ActivityState, Flag]:
    """The activity after the sample, and whether it failed: failures come before events."""
    stands = abs(now.motor_speed) <= activity.ramp * now.by.period + STANDSTILL_ROUNDING
    events = [(one, event, happens) for one, wish in wishes.items() for event, happens in wish.events.items()]
    events += [(Activity.STOPPING, Event.STANDS, all_of(activity.is_any_of(Activity.STOPPING), stands))]
    failures = {reason: holds for wish in wishes.values() for reason, holds in wish.failures.items()}
    after = follow(replace(activity, begins=flag(False)), events)
    return fail(after, failures, stopping_ramp(now.motor_speed, now.by.period)), any_of(*failures.values())


def _speed(stops: Flag, ramp: Scalar, wishes: Sequence[tuple[Flag, Real]], now: Sample) -> Scalar:
    """The next motor speed [rad/s]: what the activity asks for, within the largest change; in a stop, to standstill.

    Args:
        ramp: of the motor's speed then [rad/s2].
        wishes: of each activity, whether it is the one, and its motor speed [rad/s].
    """
    wish: Real = scalar(0.0)
    for active, speed in wishes:
        wish = ca.if_else(active, speed, wish)
    slope = ca.if_else(stops, ramp, now.by.slope)
    return now.by.ramped(now.motor_speed, ca.if_else(stops, 0.0, wish), slope)
