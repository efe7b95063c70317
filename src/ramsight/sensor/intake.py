"""What a sensor lets in of what the drive reports: samples that cannot be are replaced or passed over, and named.

A sample without a usable speed or time is as if it had never come: every state keeps its value, and the next good
sample counts the time from the last good one. Without a usable torque the last one is used. A torque that leaps while
the motor turns waits for the next sample to confirm it: one wrong value would press oil over the relief valve of the
simulated circuit, or empty a chamber, and the piston would not come back. No fault can move the circuit's volume
balance by more than the time that has passed allows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.limits import Limits
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.virtual_sensor import LAST_SHAFT_ANGLE, SHAFT_ANGLE, SHAFT_BEGUN, SensorGraph

_NUMBER = 1e12  # beyond, or no number, there is none
_USUAL, _LATE = 0.1, 0.15  # s; samples may come 1 ... 100 ms apart
_SOONEST = 8e-3  # s; samples closer together are passed over, for the circuit's pressures settle in some 10 ms
# Share of the highest speed that a motor may have had unseen between two samples, whatever both say [G].
_UNSEEN = 0.02
# Share of both speeds around a gap, added up, by which the angle counted over it may be off [G]: half their mean.
_BRIDGE_ERROR = 0.25
_LONGEST_GAP = 3600.0  # s; an hour of turning unseen is more than any stroke, so a longer gap leaves no less known
_BRIDGED = 0.5  # s; a longer gap is not counted, because nothing says what happened in it
_RESET = 1.0  # s; a clock that goes back by more was set anew, by less the sample came out of order
_OVERSPEED = 1.5  # share of the highest speed that no motor reaches
_OVERTORQUE = 1.5  # share of the torque at relief pressure on both sides
_COLDEST, _HOTTEST = 203.15, 423.15  # K; -70 ... 150 degC, beyond which a thermometer is broken
WARMING = 5.0  # s; oil does not change its temperature faster, a thermometer's noise does
_LEAP = 10.0  # K; from the filtered temperature
_INSISTING, _LONGEST = 10.0, 600.0  # s; a leap is believed once it has lasted as long as what was before, within these
_LEARNING = 0.005  # share of a sample in the habit of changing
_HABIT = 0.8  # a torque that has changed from sample to sample so often does not stand still
_SURE = 20.0  # expected changes that did not come; exp(-20) by chance
_TURNING = 3.0  # rad/s
_TORQUE_LEAP = 0.45  # share of the torque at relief pressure; where a motor turns, 0.27 is the most in recorded days
_RUNNING = 0.03  # share of the highest speed; slower, friction turns and a load is taken up within a sample
_BLIND = 0.3  # share of the relief pressure by which the pressure may change while the torque is lost


@dataclass(frozen=True)
class Intake:
    """Conditions of the sample, and by how much the position has become less certain.

    Attributes:
        usable: whether the sample counts at all.
        lost: speed, torque or time is missing.
        replaced: the speed is missing, and the shaft's counter takes its place.
        overspeed, overtorque: a value that cannot be.
        stuck: the torque stands still.
        frozen: time does not advance.
        gap: samples are missing before this one.
        cold: temperature is missing or cannot be.
        passed: time since the last sample by the clock, 0 if it does not advance [s].
        drift: by how much the position's standard deviation grows [m].
        unseen: how far the piston may have moved since the last sample that counted [m].
    """

    usable: Any
    lost: Any
    replaced: Any
    overspeed: Any
    overtorque: Any
    stuck: Any
    frozen: Any
    gap: Any
    cold: Any
    passed: Any
    drift: Any
    unseen: Any


def _within(value: Any, limit: Any) -> Any:
    """Whether a value is a number and within limits; a comparison with NaN is false."""
    return ca.logic_and(value > -limit, value < limit)


@dataclass(frozen=True)
class _Clock:
    """What the time of a sample says.

    Attributes:
        number: whether there is one.
        raw: since the last sample that counted [s].
        back: whether it was set back.
        forward: whether it goes on, or is the first.
        jump: whether it went so far that nothing says what happened in between.
        counted: whether the time since the last sample counts.
    """

    number: Any
    raw: Any
    back: Any
    forward: Any
    jump: Any
    counted: Any


def take_in(graph: SensorGraph, unit: HydraulicUnit, limits: Limits) -> Intake:
    """Put checked inputs in the place of a graph's raw ones, and let unusable samples pass by.

    Args:
        graph: the sensor's graph, before its laws are written.
        unit: the unit's parts.
        limits: of the unit.
    """
    add = graph.parameters.add
    started, last_speed = graph.held("started"), graph.held("motor_speed")
    fastest = add("max_speed", limits.max_speed)
    travel = add("travel_per_radian", unit.travel_per_radian)
    clock = _clock(graph)
    w, replaced = _speed(graph, clock, fastest)
    speed_ok = _within(w, _OVERSPEED * fastest)
    usable = ca.logic_and(ca.logic_and(clock.number, speed_ok), ca.logic_or(clock.forward, clock.back))
    elapsed = ca.if_else(ca.logic_and(usable, clock.counted), clock.raw, 0.0)
    passed, stands = _ticks(graph, clock)
    torque, torque_ok, stuck = _torque(graph, limits, w, fastest)
    temperature, warm_ok = _temperature(graph, elapsed)
    no_number = ca.logic_not(ca.logic_and(_within(w, _NUMBER), _within(graph.motor_torque, _NUMBER)))

    graph.elapsed = elapsed
    graph.motor_torque = torque
    graph.motor_speed = ca.if_else(speed_ok, w, last_speed)
    graph.last_speed = ca.if_else(clock.counted, last_speed, graph.motor_speed)
    graph.mean_speed = 0.5 * (graph.last_speed + graph.motor_speed)
    graph.angle = graph.mean_speed * elapsed
    graph.oil_temperature = temperature
    graph.becomes("motor_speed", graph.motor_speed)
    graph.becomes("time", graph.time)
    graph.becomes("started", 1.0)
    # A sample that comes too soon after the last one that counted adds nothing.
    soon = ca.logic_and(ca.logic_and(clock.counted, clock.raw < _SOONEST), ca.logic_not(graph.referenced))
    graph.pass_over(ca.logic_or(ca.logic_not(usable), soon))

    blind = ca.logic_or(stuck, ca.logic_not(torque_ok)) * add("blind_velocity", _BLIND * limits.leak_velocity) * elapsed
    drift, unseen = _not_seen(graph, clock, fastest)
    return Intake(
        usable=usable,
        lost=ca.logic_or(ca.logic_not(clock.number), no_number),
        replaced=replaced,
        overspeed=ca.logic_not(speed_ok),
        overtorque=ca.logic_not(torque_ok),
        stuck=stuck,
        frozen=ca.logic_and(started, ca.logic_or(clock.raw <= 0.0, stands)),
        gap=ca.logic_and(started, ca.logic_or(clock.raw > _LATE, clock.back)),
        cold=ca.logic_not(warm_ok),
        passed=passed,
        drift=ca.if_else(usable, travel * drift + blind, 0.0),
        unseen=ca.if_else(usable, 0.0, travel * unseen),
    )


def _clock(graph: SensorGraph) -> _Clock:
    started, last_time = graph.held("started"), graph.held("time")
    number = _within(graph.time, _NUMBER)
    raw = ca.if_else(number, graph.time - last_time, 0.0)
    back = ca.logic_and(started, raw < -_RESET)
    forward = ca.logic_or(ca.logic_not(started), raw > 0.0)
    jump = ca.logic_or(raw > _BRIDGED, back)
    counted = ca.logic_and(started, ca.logic_not(ca.logic_or(jump, raw <= 0.0)))
    return _Clock(number, raw, back, forward, jump, counted)


def _ticks(graph: SensorGraph, now: _Clock) -> tuple[Any, Any]:
    """Time since the last sample of all [s], and whether the clock stands.

    Against the last sample of all: one that came too soon is passed over, and the clock may stand from there on.
    """
    clock, clocked = graph.state("clock"), graph.state("clocked")
    both = ca.logic_and(now.number, clocked)
    tick = ca.if_else(both, graph.time - clock, 0.0)
    graph.becomes("clock", ca.if_else(now.number, graph.time, clock), always=True)
    graph.becomes("clocked", ca.fmax(clocked, now.number), always=True)
    return ca.fmax(tick, 0.0), ca.logic_and(both, tick <= 0.0)


def _speed(graph: SensorGraph, clock: _Clock, fastest: Any) -> tuple[Any, Any]:
    """The motor's speed, by the shaft's counter where none is reported; and whether it is [rad/s]."""
    w = graph.motor_speed
    if SHAFT_ANGLE not in graph.measured:
        return w, 0.0
    angle, last = graph.measured[SHAFT_ANGLE], graph.held(LAST_SHAFT_ANGLE)
    by_counter = (angle - last) / ca.fmax(clock.raw, 1e-3)
    known = ca.logic_and(ca.logic_and(graph.held(SHAFT_BEGUN), clock.counted), _within(by_counter, fastest))
    replaced = ca.logic_and(known, ca.logic_not(_within(w, _NUMBER)))
    return ca.if_else(replaced, by_counter, w), replaced


def _torque(graph: SensorGraph, limits: Limits, w: Any, fastest: Any) -> tuple[Any, Any, Any]:
    """The torque that is used [N m], whether the reported one can be, and whether it stands still."""
    torque, add = graph.motor_torque, graph.parameters.add
    started, last_speed = graph.held("started"), graph.held("motor_speed")
    torque_ok = _within(torque, add("max_torque", _OVERTORQUE * limits.largest_torque))
    last_torque, habit, repeats = (
        graph.state("motor_torque"),
        graph.state("torque_habit"),
        graph.state("torque_repeats"),
    )
    changed = torque != last_torque
    turning = ca.fabs(w) > _TURNING
    habit_1 = ca.if_else(repeats > 3.0, habit, habit + _LEARNING * (changed - habit))
    repeats_1 = ca.if_else(ca.logic_and(turning, ca.logic_not(changed)), repeats + 1.0, 0.0)
    stuck = ca.logic_and(habit_1 > _HABIT, repeats_1 * habit_1 > _SURE)
    graph.becomes("torque_habit", habit_1)
    graph.becomes("torque_repeats", repeats_1)
    waited = graph.state("torque_waits")
    running = ca.logic_and(ca.fabs(last_speed) > _RUNNING * fastest, last_speed * w > 0.0)
    leaps = ca.fabs(torque - last_torque) > add("torque_leap", _TORQUE_LEAP * limits.torque)
    waits = ca.logic_and(ca.logic_and(started, ca.logic_not(waited)), ca.logic_and(running, leaps))
    graph.becomes("torque_waits", waits)
    used = ca.if_else(ca.logic_and(torque_ok, ca.logic_not(waits)), torque, last_torque)
    graph.becomes("motor_torque", used)
    return used, torque_ok, stuck


def _temperature(graph: SensorGraph, elapsed: Any) -> tuple[Any, Any]:
    """The oil's temperature, filtered [K], and whether the reported one can be."""
    warmth, filtered = graph.oil_temperature, graph.state("oil_temperature")
    possible = ca.logic_and(warmth > _COLDEST, warmth < _HOTTEST)
    leap_for, good_for = graph.state("temperature_leap_for"), graph.state("temperature_good_for")
    believed = leap_for > ca.fmax(_INSISTING, ca.fmin(good_for, _LONGEST))
    known = ca.logic_and(filtered > _COLDEST, ca.logic_not(believed))
    leap = ca.logic_and(possible, ca.logic_and(known, ca.fabs(warmth - filtered) > _LEAP))
    graph.becomes("temperature_leap_for", ca.if_else(leap, leap_for + elapsed, 0.0))
    graph.becomes("temperature_good_for", ca.if_else(leap, good_for, ca.if_else(known, good_for + elapsed, 0.0)))
    warm_ok = ca.logic_and(possible, ca.logic_not(leap))
    share = ca.if_else(known, elapsed / (WARMING + elapsed), 1.0)
    held = ca.if_else(known, filtered, T40)
    temperature = ca.if_else(warm_ok, held + share * (warmth - held), held)
    graph.becomes("oil_temperature", ca.if_else(ca.logic_or(known, warm_ok), temperature, 0.0))
    return temperature, warm_ok


def _not_seen(graph: SensorGraph, clock: _Clock, fastest: Any) -> tuple[Any, Any]:
    """Angles that the shaft may have turned unseen [rad]: in a gap before the sample, and up to one that is no use."""
    last_speed = graph.held("motor_speed")
    speeds = ca.fabs(last_speed) + ca.fabs(graph.motor_speed)
    gap_for = ca.if_else(graph.held("started"), ca.if_else(clock.back, _BRIDGED, clock.raw), 0.0)
    not_counted = ca.if_else(clock.jump, (0.5 * speeds + _UNSEEN * fastest) * ca.fmin(gap_for, _LONGEST_GAP), 0.0)
    bridged = (_BRIDGE_ERROR * speeds + _UNSEEN * fastest) * ca.fmax(graph.elapsed - _USUAL, 0.0)
    unseen = (ca.fabs(last_speed) + _UNSEEN * fastest) * ca.fmax(clock.raw, 0.0)
    return not_counted + bridged, unseen
