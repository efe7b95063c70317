"""What turns the motor beside homing: a move along a trajectory and its landing, a velocity by hand, a leak test."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from ramsight.control import trajectory
from ramsight.control.activity import Event
from ramsight.control.actuation import Actuation
from ramsight.control.decision import Sample, Wish
from ramsight.control.orders import Orders, Reason
from ramsight.control.thresholds import BLOCKED_TIME, CONTACT_RELEASE_WAY, NO_PLACE
from ramsight.control.trajectory import Trajectory
from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Condition, Flag, Real, Scalar, all_of, negated, scalar


@dataclass(frozen=True)
class Move:
    """State of a move."""

    trajectory: Trajectory  # its way
    direction: Scalar = leaf("1", 1.0)  # of the target, +1 or -1
    tries: Scalar = leaf("1")  # how often it may still be repeated
    blocked: Scalar = leaf("s")  # how long the load has been at the largest force
    left: Scalar = leaf("m", NO_PLACE)  # the stop that it leaves, or none
    stood: Scalar = leaf("s")  # how long the rod has stood at the target


def ordered(state: Move, orders: Orders, tries: int, position: Scalar, on_stop: Flag) -> Move:
    """After orders: a move that leaves a stop remembers where it was [m]."""
    left = ca.if_else(on_stop, position, NO_PLACE)
    return replace(
        state,
        tries=ca.if_else(orders.sent, float(tries), state.tries),
        blocked=ca.if_else(orders.any, 0.0, state.blocked),
        left=ca.if_else(orders.sent, left, state.left),
        stood=ca.if_else(orders.any, 0.0, state.stood),
    )


def begun(state: Move, now: Sample, when: Flag) -> Move:
    """At the first sample: the trajectory begins where the rod is, as fast as it goes."""
    direction = ca.if_else(now.target - now.sensed.position >= 0.0, 1.0, -1.0)
    way = _begun(state.trajectory, now, now.start_velocity)
    return replace(
        state, direction=ca.if_else(when, direction, state.direction), trajectory=chosen(when, way, state.trajectory)
    )


def _begun(way: Trajectory, now: Sample, velocity: Real) -> Trajectory:
    return trajectory.begun(way, now.sensed.position, velocity, now.by.period)


def moved(state: Move, now: Sample, when: Flag, felt: Scalar) -> tuple[Move, Wish, Scalar]:
    """Along the trajectory until the target is near.

    Args:
        felt: load on the way to the end stop that it may leave [N].

    Returns:
        The state, the wish, and the following error [m].
    """
    by, sensed = now.by, now.sensed
    margin = by.force_margin(state.direction, sensed.load)
    way = trajectory.advanced(
        state.trajectory, by.limits, by.unit.cylinder.stroke, now.acceleration, now.target, _fastest(now, margin),
        by.period,
    )  # fmt: skip
    way = chosen(when, way, state.trajectory)
    # What the drive cannot follow is not asked for.
    way = chosen(all_of(when, now.at_limit), _begun(way, now, sensed.velocity), way)
    waits = all_of(when, margin == 0.0)
    way = chosen(waits, _begun(way, now, 0.0), way)
    blocked = ca.if_else(waits, state.blocked + by.period, ca.if_else(when, 0.0, state.blocked))
    place, velocity = trajectory.setpoint(way, by.period)
    error = place - sensed.position
    rest = state.direction * (now.target - sensed.position)
    near = rest <= by.stopping_distance(now.motor_speed, state.direction, sensed.load)
    follows = all_of(when, negated(waits))
    load = _load_behind(by, place - state.left, state.direction, felt, sensed.load)
    tracks = ca.if_else(near, 0.0, by.tracking_speed(velocity, error, state.direction, load))
    wish = Wish(
        ca.if_else(waits, by.holding_speed(0.0, sensed.load), tracks),
        {Event.NEAR: all_of(follows, near)},
        {
            Reason.FORCE: all_of(waits, blocked > BLOCKED_TIME),
            Reason.ROD: all_of(follows, abs(error) > by.tuning.following_error_limit(by.limits)),
        },
    )
    return replace(state, trajectory=way, blocked=blocked), wish, error


def _fastest(now: Sample, margin: Real) -> Scalar:
    """Largest velocity of the trajectory [m/s]: by order, limits, reliance, largest force, and motor."""
    by = now.by
    share = ca.if_else(now.reliance.full, 1.0, by.tuning.slowed)
    allowed = ca.fmax(ca.fmin(now.inputs.speed, by.limits.speed), by.tuning.creeping)
    return margin * ca.fmin(share * allowed, by.reachable_velocity(now.sensed.load))


def _load_behind(by: Actuation, gone: Scalar, direction: Scalar, felt: Scalar, load: Scalar) -> Scalar:
    """The load [N] that the oil is to carry: on a stop, which carries some, the one that was felt on the way there.

    With the leakage under the load that is left the rod would stay on the stop while the motor turns: neither a move
    nor a rest, of which a sensor makes the wrong one.

    Args:
        gone: way of the trajectory from the stop that it leaves [m]; large where it leaves none.
        direction: of the move, +1 or -1.
        felt: load on the way to the stop [N].
        load: now [N].
    """
    leaves = all_of(abs(gone) < CONTACT_RELEASE_WAY, direction * by.unit.lift_sign > 0.0)
    return ca.if_else(leaves, ca.fmax(load, felt), load)


def landed(state: Move, now: Sample, when: Flag) -> tuple[Move, dict[Event, Flag]]:
    """Look at the target once more when the rod has stood for `Tuning.settling` and the reports' lag."""
    by, tuning = now.by, now.by.tuning
    stands: Condition = True if not by.holding.stands else now.motor_speed == 0.0
    stood = ca.if_else(when, ca.if_else(stands, state.stood + by.period, 0.0), state.stood)
    settled = all_of(when, stood >= tuning.settling + by.lag)
    missed = all_of(abs(now.target - now.sensed.position) > tuning.tolerance, state.tries > 0.0)
    again = all_of(settled, missed, negated(now.reliance.none))
    new = replace(
        state,
        tries=ca.if_else(again, state.tries - 1.0, state.tries),
        left=ca.if_else(again, NO_PLACE, state.left),
        stood=ca.if_else(again, 0.0, stood),
    )
    return new, {Event.MISSED: again, Event.SETTLED: all_of(settled, negated(again))}


def at_power_up(by: Actuation) -> Move:
    """The state at power-up."""
    return Move(trajectory.at_rest(by.limits, by.period), scalar(1.0))


@dataclass(frozen=True)
class LeakTest:
    """State of a leak test: its motor speed, and the time since it began."""

    speed: Scalar = leaf("rad/s")
    time: Scalar = leaf("s")


def leak_tested(state: LeakTest, now: Sample, when: Flag, begins: Flag) -> tuple[LeakTest, Wish]:
    """Turn until the time is over."""
    by, first = now.by, all_of(when, begins)
    share = by.unit.lift_sign * by.tuning.leak_test_share(by.unit)
    speed = ca.if_else(first, share * by.leakage(now.sensed.load), state.speed)
    time = ca.if_else(when, ca.if_else(first, 0.0, state.time) + by.period, state.time)
    over = all_of(when, time > by.tuning.leak_test_time)
    return LeakTest(speed, time), Wish(ca.if_else(over, 0.0, speed), {Event.OVER: over})


@dataclass(frozen=True)
class Steering:
    """State: the velocity until now."""

    velocity: Scalar = leaf("m/s")


def steered(state: Steering, now: Sample, when: Flag) -> tuple[Steering, Flag, Scalar]:
    """The velocity that is asked for, within the limits.

    Without a position that may be relied on the rod goes as slowly as in homing, and the places of the stops are
    unknown.

    Returns:
        The state, whether the rod goes, and the motor speed for that [rad/s].
    """
    by, load, none = now.by, now.sensed.load, now.reliance.none
    share = ca.if_else(none, by.tuning.homing_share, ca.if_else(now.reliance.full, 1.0, by.tuning.slowed))
    fastest = ca.fmin(share * by.limits.speed, by.reachable_velocity(load))
    wanted, position = now.inputs.steering, now.sensed.position
    velocity = by.steered_velocity(state.velocity, wanted, position, fastest, negated(none))
    direction = ca.if_else(velocity > 0.0, 1.0, -1.0)
    margin = by.force_margin(direction, load)
    velocity = ca.if_else(margin == 0.0, 0.0, velocity)
    speed = by.driving_speed(margin * abs(velocity), direction, load)
    return Steering(ca.if_else(when, velocity, state.velocity)), velocity != 0.0, speed
