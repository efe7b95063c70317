"""Homing: go to an end stop, press on it until the sensor has accepted it as a reference, and rest there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from ramsight.control import thresholds as limit
from ramsight.control.activity import Event
from ramsight.control.actuation import Actuation
from ramsight.control.decision import Sample, Wish
from ramsight.control.orders import Orders, Reason
from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Real, Scalar, all_of, any_of, negated, within
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit


@dataclass(frozen=True)
class Homing:
    """State of a visit to an end stop."""

    end: Scalar = leaf("m", limit.NO_PLACE)  # the stop that is sought or stood on, or none
    time: Scalar = leaf("s")  # since the beginning
    velocity: Scalar = leaf("m/s")  # towards the stop
    stood: Scalar = leaf("s")  # how long the rod has been held
    felt: Scalar = leaf("N")  # load on the way, its noise averaged
    found: Flag = leaf("1")  # whether the sensor is to take the stop as a reference

    @property
    def direction(self) -> Scalar:
        """Of the stop, +1 or -1."""
        return ca.if_else(self.end > 0.0, 1.0, -1.0)


def end_stop(unit: HydraulicUnit, *, lifted: bool) -> float:
    """Where the end stop of lifting, or that of lowering, is [m].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> ram = build(machine.load_machine("press").unit("ram"), "ram")
        >>> end_stop(ram, lifted=True) - end_stop(ram, lifted=False) == ram.lift_sign * ram.cylinder.stroke
        True
    """
    return float(unit.cylinder.stroke) if lifted == (unit.lift_sign > 0.0) else 0.0


def ordered(state: Homing, orders: Orders, unit: HydraulicUnit) -> Homing:
    """After orders: a new one ends the rest on a stop, homing begins again."""
    end = ca.if_else(orders.lifted, end_stop(unit, lifted=True), end_stop(unit, lifted=False))
    return replace(
        state,
        end=ca.if_else(orders.homed, end, ca.if_else(orders.any, limit.NO_PLACE, state.end)),
        time=ca.if_else(orders.homed, 0.0, state.time),
        velocity=ca.if_else(orders.homed, 0.0, state.velocity),
        stood=ca.if_else(orders.homed, 0.0, state.stood),
    )


def homed(state: Homing, now: Sample, when: Flag) -> tuple[Homing, Wish]:
    """Fast while the stop is known to be far, then slowly, then press."""
    by, sensed, slow = now.by, now.sensed, slow_velocity(now.by)
    away = abs(state.end - sensed.position)
    fast = ca.fmax(ca.fmin(now.inputs.speed, by.limits.speed), slow)
    velocity = approach(by, state.velocity, away, sensed.position_std, fast, negated(now.reliance.none))
    time = state.time + by.period
    held = is_held(by, time, sensed.velocity)
    new = replace(
        state,
        time=ca.if_else(when, time, state.time),
        velocity=ca.if_else(when, velocity, state.velocity),
        stood=ca.if_else(when, ca.if_else(held, state.stood + by.period, 0.0), state.stood),
        felt=ca.if_else(all_of(when, negated(held)), averaged(by, state.felt, sensed.load), state.felt),
    )
    pressed = all_of(when, new.stood > by.tuning.pressing)
    found = all_of(pressed, away < by.limits.landing_zone)
    speed = pressing_speed(by, new, sensed.load)
    wish = Wish(
        ca.if_else(found, 0.0, speed),
        {Event.PRESSED: found},
        {
            Reason.NO_REFERENCE: all_of(pressed, negated(found)),
            Reason.NOT_FOUND: all_of(when, negated(pressed), new.time > longest_search(by)),
        },
    )
    return replace(new, found=any_of(found, new.found)), wish


def slow_velocity(by: Actuation) -> float:
    """Velocity near a stop, and on the way to one that may be anywhere [m/s]."""
    return by.tuning.homing_share * by.limits.speed


def longest_search(by: Actuation) -> float:
    """Time after which the search for a stop ends [s]."""
    way = limit.SEARCH_FACTOR * by.unit.cylinder.stroke / slow_velocity(by)
    return float(way + limit.SEARCH_PRESSINGS * by.tuning.pressing)


def approach(by: Actuation, velocity: Real, away: Real, std: Real, fast: Real, trusted: Condition) -> Scalar:
    """The next velocity [m/s]: fast while the stop is far with `FAR_SIGMAS`, then slow.

    Args:
        velocity: until now [m/s].
        away: distance of the stop [m].
        std: the position's standard deviation [m].
        fast: velocity where it is far [m/s].
    """
    limits, change = by.limits, by.limits.acceleration * by.period
    far = away - limits.landing_zone - limit.FAR_SIGMAS * std > 0.5 * limits.speed**2 / limits.acceleration
    return within(ca.if_else(all_of(trusted, far), fast, slow_velocity(by)), velocity - change, velocity + change)


def is_held(by: Actuation, time: Scalar, velocity: Scalar) -> Flag:
    """Whether something holds the rod: a velocity [m/s] at a time since the beginning [s], when it surely moves."""
    sets_out = by.limits.speed / by.limits.acceleration + limit.PRESSURE_TIME + by.lag
    return all_of(time > sets_out, abs(velocity) < limit.HELD_SPEED_SHARE * slow_velocity(by))


def averaged(by: Actuation, felt: Scalar, load: Scalar) -> Scalar:
    """The load on the way [N] behind a low pass of `LOAD_AVERAGING`."""
    return felt + by.period / (limit.LOAD_AVERAGING + by.period) * (load - felt)


def pressing_speed(by: Actuation, state: Homing, load: Real) -> Scalar:
    """The motor's speed [rad/s] on the way to a stop, and on it, under a load [N].

    Where a pump holds the load its pressure goes with its speed: a stop that is run into gives way by a millimetre.
    """
    goes = by.driving_speed(state.velocity, state.direction, load)
    if by.holding.stands:
        return goes
    pressed = by.speed_of(0.0, pressing_load(by.unit, by.tuning.pressing_share, state.direction, state.felt))
    return ca.if_else(state.stood > by.tuning.contact_time, pressed, goes)


def pressing_load(unit: HydraulicUnit, share: float, direction: Real, felt: Real) -> Scalar:
    """The load [N] with which a stop in a direction is pressed, where one of `felt` [N] was felt on the way there."""
    way, full = direction * unit.lift_sign, limits_of(unit)  # way: +1 at the end of lifting, -1 at that of lowering
    return way * (ca.fmax(way * felt, 0.0) + ca.if_else(way > 0.0, share * full.load, share * full.pull))


def speed_on_stop(by: Actuation, direction: Real, felt: Real) -> Scalar:
    """The motor's speed [rad/s] of a rod that a pump holds on a stop, which hides its load.

    The stop carries a load that presses on it; else the pump carries the one that was felt on the way, `felt` [N].
    """
    pulls = direction * by.unit.lift_sign * felt > 0.0
    return ca.if_else(pulls, by.speed_of(0.0, felt), 0.0)


def referenced(state: Homing, by: Actuation, rests: Flag, speed: Real) -> tuple[Homing, Scalar]:
    """The stop's place [m] for the sensor, once, when homing is over: behind a valve the motor stands by then."""
    waits = all_of(state.found, rests)
    over = waits if not by.holding.stands else all_of(waits, speed == 0.0)
    return replace(state, found=all_of(waits, negated(over))), ca.if_else(over, state.end, limit.NO_PLACE)
