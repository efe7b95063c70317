"""What a machine tells of itself without any reference: its leakage, and how much its oil gives way."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.sensor.belief import Belief
from ramsight.sensor.books import STANDING, Books
from ramsight.sensor.virtual_sensor import SensorGraph

_CLOSED_TURNING = 1.0  # rad/s; slowest turning against the closed valve that friction does not spoil
_CLOSED_STEADY = 0.25  # rad/s; a steady speed in steps of 1 rpm
_CLOSED_LEAST = 10e5  # Pa
_CLOSED_SHARE = 0.85  # of the chamber's pressure; a slow lift is near it
_CLOSED_DOUBT = 0.02  # of a leakage so measured, at best; nearly all of it is the torque's
_CLOSED_BEST = 0.012  # of all stretches between two lifts together
_SPEED_DOUBT = 0.03  # rad/s, standard deviation of a speed in steps of 1 rpm
_CLOSED_SMOOTHING = 0.2  # s
_PRESSING = 3.0  # rad/s
_EMPTIED = 1.3  # share of the oil under pressure that the pump draws until the held side is surely empty
_PRESSED_FULL = 0.9  # share of the relief setting up to which the volume is closed
_PRESSED_LEAST = 20e5  # Pa
_DECAY_BEGINS = 0.8  # s at rest, after which the motor's and the valves' last movements are over
_DECAY_SMOOTHING = 0.2  # s
_DECAY_LEAST, _DECAY_SHARE = 10e5, 0.2  # Pa and share by which the pressure has to fall to tell
_DECAY_LOWEST = 15e5  # Pa
_DECAY_NOISE = 1.5e5  # Pa, of the smoothed pressures' difference
_DECAY_DOUBT = 0.1  # of a leakage so measured: it is the other pump's, and the first thing that is known of it
_PRESSURE_NOISE = 3e5  # Pa, of a pressure from one torque sample
_PRESSED_DOUBT = 0.02  # of the compressed volume


def hear_leakage(graph: SensorGraph, books: Books, belief: Belief, lift: float) -> None:
    """While the motor turns slowly against the closed valve, its flow is its leakage: D w = k K dp."""
    slow, closed_for = graph.state("closed_pressure"), graph.state("closed_for")
    w, dt = graph.motor_speed, graph.elapsed
    steady = ca.fabs(w - graph.last_speed) < _CLOSED_STEADY
    closed = ca.logic_and(ca.logic_and(lift * w > _CLOSED_TURNING, books.open < 0.5), steady)
    share = ca.if_else(closed_for > 0.0, dt / (_CLOSED_SMOOTHING + dt), 1.0)
    pressure = slow + share * (books.manifold_pressure - slow)
    leak = belief.factors[0]
    graph.becomes("closed_pressure", pressure)
    graph.becomes("closed_for", ca.if_else(closed, closed_for + dt, 0.0))
    filling = books.held.manifold_capacity / (books.leakage * leak)
    settled = closed_for > 5.0 * filling + 2.0 * _CLOSED_SMOOTHING
    tells = ca.logic_and(ca.logic_and(closed, settled), pressure > _CLOSED_LEAST)
    # Within the doubt of the leakage it may be a slow lift after all.
    excess = books.held.delivered(w) - books.leakage * leak * pressure
    belief.covariance.grow(ca.if_else(tells, ca.fmax(excess, 0.0) * dt / books.held.area, 0.0))
    measured = books.held.delivered(w) / (books.leakage * ca.fmax(pressure, _CLOSED_LEAST))
    relative = _CLOSED_DOUBT**2 + (_SPEED_DOUBT / ca.fmax(ca.fabs(w), _CLOSED_TURNING)) ** 2
    # Samples of a second together are one measurement. It counts once the load is known to have been higher: a slow
    # lift looks the same.
    names = ("tested_weight", "tested_leak", "tested_pressure")
    weight, mean, highest = (graph.state(name) for name in names)
    more = ca.if_else(tells, dt / (measured**2 * relative), 0.0)
    weight_1 = ca.fmin(weight + more, 1.0 / _CLOSED_BEST**2)
    mean_1 = mean + more / ca.fmax(weight_1, 1e-9) * (measured - mean)
    highest_1 = ca.fmax(highest, ca.if_else(tells, pressure, 0.0))
    seen = ca.logic_and(ca.logic_and(books.known > 0.5, books.open > 0.5), weight_1 > 0.0)
    below = highest_1 < _CLOSED_SHARE * books.held_pressure
    counts = ca.logic_and(seen, below)
    variance = 1.0 / ca.fmax(weight_1, 1e-9)
    belief.measure([0.0, 1.0, 0.0, 0.0], mean_1 - leak, variance, counts)
    for name, value in zip(names, (weight_1, mean_1, highest_1), strict=True):
        graph.becomes(name, ca.if_else(seen, 0.0, value))


def hear_compression(
    graph: SensorGraph, books: Books, belief: Belief, slow: Any, *, on_low: Any, on_top: Any, lift: float
) -> None:
    """On a stop nothing moves, and what a pump delivers is compressed: 0 = V_pumped - V_leaked - C dp.

    On the lifted end's stop in the held chamber; on the lowered end's in the other one, which the torque tells once the
    held one is empty. One press a visit: when the motor turns anew the valves are not as they were.

    Args:
        graph: the sensor's graph; gains states.
        books: of this sample.
        belief: its compliance is corrected.
        slow: pressure of the held manifold before the stop [Pa].
        on_low: whether the piston is on the stop of the lowered end.
        on_top: whether it is on that of the lifted end.
        lift: +1 if extension lifts, else -1.
    """
    w, dt, angle = graph.motor_speed, graph.elapsed, graph.angle
    names = ("press_counts", "press_over", "press_drawn", "press_from", "press_last", "press_oil", "press_leaked")
    counted, over, drawn, first, last, oil, leaked = (graph.state(name) for name in names)
    turns_low = ca.logic_and(on_low, lift * w < -_PRESSING)
    presses = ca.logic_or(turns_low, ca.logic_and(on_top, lift * w > _PRESSING))
    on_stop = ca.logic_or(on_low, on_top)
    pressure = ca.if_else(on_low, books.other_pressure, books.manifold_pressure)
    held_capacity = books.capacity + books.held.manifold_capacity
    capacity = ca.if_else(on_low, books.other_capacity, held_capacity)
    leakage = ca.if_else(on_low, books.other_leakage, books.leakage) * belief.factors[0]
    delivered = ca.if_else(on_low, books.other.delivered(angle), books.held.delivered(angle))

    drawn_1 = ca.if_else(turns_low, drawn - books.held.delivered(angle), 0.0)
    ready = ca.logic_or(on_top, drawn_1 > _EMPTIED * held_capacity * slow)
    may = ca.logic_and(ca.logic_and(presses, ready), ca.logic_not(over))
    counts = ca.logic_and(may, counted)
    oil_1 = ca.if_else(counts, oil + delivered, 0.0)
    leaked_1 = ca.if_else(counts, leaked + 0.5 * (last + pressure) * leakage * dt, 0.0)
    first_1 = ca.if_else(counts, first, pressure)
    full = pressure > _PRESSED_FULL * books.held.side.relief.setting
    # The last sample before the motor stands, if it slows as it does now.
    slows = ca.fabs(w) + 1.5 * (ca.fabs(w) - ca.fabs(graph.last_speed)) < _PRESSING
    rise = pressure - first_1
    ends = ca.logic_and(may, ca.logic_or(full, slows))
    tells = ca.logic_and(ca.logic_and(counts, ends), rise > _PRESSED_LEAST)
    stopped = ca.logic_and(counted, ca.logic_not(presses))
    values = (may, ca.logic_and(on_stop, ca.logic_or(over, ca.logic_or(ends, stopped))), drawn_1, first_1, pressure)
    for name, value in zip(names, (*values, oil_1, leaked_1), strict=True):
        graph.becomes(name, value)

    leak, displacement, compliance = belief.factors
    compressed = capacity * rise
    row = [0.0, -leaked_1 / leak, oil_1 / displacement, -compressed / compliance]
    variance = (capacity * _PRESSURE_NOISE) ** 2 + (_PRESSED_DOUBT * compressed) ** 2
    # Its own errors are those of the compressed volume; leakage and displacement are not to take them up.
    belief.measure(row, -(oil_1 - leaked_1 - compressed), variance, tells, only=[3])


def hear_decay(graph: SensorGraph, books: Books, belief: Belief, *, seated: Any) -> None:
    """Seated on the lowered end at rest, the other side's pressure goes as the pump leaks: C dp = -K p dt.

    Args:
        graph: the sensor's graph; gains states.
        books: of this sample.
        belief: its leakage is corrected.
        seated: whether the piston is on the stop of the lowered end.
    """
    dt, pressure = graph.elapsed, books.other_pressure
    standing_for, smooth, first, leaked = (
        graph.state(name) for name in ("decay_for", "decay_pressure", "decay_from", "decay_leaked")
    )
    stands = ca.logic_and(seated, ca.fabs(graph.motor_speed) < STANDING)
    smooth_1 = ca.if_else(standing_for > 0.0, smooth + dt / (_DECAY_SMOOTHING + dt) * (pressure - smooth), pressure)
    settles = standing_for < _DECAY_BEGINS
    leak, _, compliance = belief.factors
    leaked_1 = ca.if_else(settles, 0.0, leaked + 0.5 * (smooth + smooth_1) * books.other_leakage * leak * dt)
    first_1 = ca.if_else(settles, smooth_1, first)
    fallen = first_1 - smooth_1
    least = ca.fmax(_DECAY_LEAST, _DECAY_SHARE * first_1)
    tells = ca.logic_and(ca.logic_and(stands, fallen > least), smooth_1 > _DECAY_LOWEST)
    # What has told begins anew from where it is.
    graph.becomes("decay_for", ca.if_else(stands, standing_for + dt, 0.0))
    graph.becomes("decay_pressure", smooth_1)
    graph.becomes("decay_from", ca.if_else(tells, smooth_1, first_1))
    graph.becomes("decay_leaked", ca.if_else(tells, 0.0, leaked_1))
    given = books.other_capacity * fallen
    row = [0.0, leaked_1 / leak, 0.0, -given / compliance]
    variance = (books.other_capacity * _DECAY_NOISE) ** 2 + (_DECAY_DOUBT * given) ** 2
    belief.measure(row, given - leaked_1, variance, tells, only=[1])
