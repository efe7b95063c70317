"""The self-calibrating sensor: the books of the oil, with factors it learns from every reference.

An extended Kalman filter over the position and the three factors by which a machine differs from its data sheet
(leakage, displacement, compliance). The books say how the piston moves, their derivatives say how a wrong factor shows
in the position, and every reference (an end stop that it recognises, a switch, a hand) corrects all four. Pressures
come from the torque at every sample, so they need no share in the covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from ramsight.plant.ddh import DdhUnit
from ramsight.sensor.books import Books, Factors, Tuning, keep_books
from ramsight.sensor.intake import Intake, take_in
from ramsight.sensor.judgement import Found, judge
from ramsight.sensor.stops import StopWatch
from ramsight.sensor.uncertainty import Covariance
from ramsight.sensor.virtual_sensor import IS_REFERENCED, SensorGraph, VirtualSensor

_TURNING = 3.0  # rad/s
_BOUNDS = {"leak": (0.3, 4.0), "displacement": (0.97, 1.03), "compliance": (0.4, 2.5)}
_GATE = 16.0  # a reference may be four standard deviations away ...
_GATE_MARGIN = 4e-3  # m, ... and this
_HARDLY_KNOWN = 15e-3  # m; with a standard deviation above it only sure signs of a stop count
_OUTSIDE = 0.02  # share of the stroke by which a reference may be beyond its end
_MISTRUST = 6.0  # a refused reference leaves the doubt that it may be right: its distance over this ...
_STOP_MISTRUST = 3.5  # ... and a stop, which nothing can feign twice, is believed the second time
_FEIGNED = 0.2  # share of the stroke; a stop farther away is an obstacle, not a stop
_VELOCITY_SMOOTHING = 0.1  # s
_FIRST_LOOK = 0.3  # s, after which the load is known again
_LEARNING_LOADS = 1.0 / 6.0  # share of the newest load change in their mean square
_LOAD_CHANGE = 0.25  # share of the relief pressure; a load change at rest, before any has been seen
_CLOSED_TURNING = 1.0  # rad/s; slowest turning against the closed valve that friction does not spoil
_CLOSED_STEADY = 0.25  # rad/s; a steady speed in steps of 1 rpm
_CLOSED_LEAST = 10e5  # Pa
_CLOSED_SHARE = 0.85  # of the chamber's pressure; a slow lift is near it
_CLOSED_DOUBT = 0.02  # of a leakage so measured, at best; nearly all of it is the torque's
_SPEED_DOUBT = 0.03  # rad/s, standard deviation of a speed in steps of 1 rpm
_CLOSED_SMOOTHING = 0.2  # s
_PRESSING = 3.0  # rad/s
_PRESSING_BEGINS = 0.15  # s, after which the pressure of the side that gave way is gone
_PRESSED = 1e6  # s; marks a visit that has told its compliance
_PRESSED_FULL = 0.9  # share of the relief setting up to which the volume is closed
_PRESSED_SLOWING = 20.0  # rad/s2; the motor is being stopped
_PRESSED_LEAST = 20e5  # Pa
_PRESSURE_NOISE = 3e5  # Pa, of a pressure from one torque sample
_PRESSED_DOUBT = 0.05  # of the compressed volume


@dataclass(frozen=True)
class Doubt:
    """What the filter assumes of the machine and of its own books, as standard deviations.

    Args:
        leak, displacement, compliance: how far a new machine is from its data sheet [1].
        leak_walk, displacement_walk, compliance_walk: how these change in time [1/sqrt(s)].
        walk: of the position while the motor turns [m/sqrt(s)].
        start: a movement's start adds this much [m].
        leave: leaving an end stop adds this much [m].
        stop: of an end stop as a reference [m].
        reference: of a switch or a position given by hand [m].
    """

    leak: float = 0.17
    displacement: float = 0.003
    compliance: float = 0.25
    leak_walk: float = 1e-4
    displacement_walk: float = 1e-6
    compliance_walk: float = 1e-4
    walk: float = 2e-5
    start: float = 0.3e-3
    leave: float = 0.7e-3
    stop: float = 0.5e-3
    reference: float = 1e-3


@dataclass
class _Belief:
    """Position and factors while a sample is worked in."""

    position: Any
    factors: list[Any]
    covariance: Covariance
    extra: dict[str, Any] = field(default_factory=dict)

    def correct(self, correction: list[Any]) -> None:
        self.position = self.position + correction[0]
        self.factors = [value + change for value, change in zip(self.factors, correction[1:], strict=True)]


def kalman(unit: DdhUnit, tuning: Tuning | None = None, doubt: Doubt | None = None) -> VirtualSensor:
    """The self-calibrating sensor of a unit.

    Args:
        unit: the unit's parts, as its data sheet has them.
        tuning: how it listens to the torque.
        doubt: what it assumes of the machine.

    Returns:
        A sensor with position, standard deviation, velocity, load and status, and beside them the chambers' pressures
        and the factors. It need not be told where the piston is: it says so until it knows.
    """
    tuning, doubt = tuning or Tuning(), doubt or Doubt()
    graph, lift = SensorGraph(), unit.lift_sign
    graph.initially("position", 0.5 * unit.cylinder.stroke)
    intake = take_in(graph, unit)
    factors = [graph.state(name, 1.0) for name in _BOUNDS]
    at_low, at_top = graph.state("at_low"), graph.state("at_top")
    up = lift * graph.motor_speed
    leaves_low = ca.logic_and(at_low, up >= _TURNING)
    leaves_top = ca.logic_and(at_top, up <= -_TURNING)
    on_low, on_top = (
        ca.logic_and(at, ca.logic_not(leaves)) for at, leaves in ((at_low, leaves_low), (at_top, leaves_top))
    )
    from_stop = graph.state("from_stop")
    books = keep_books(graph, unit, tuning, Factors(*factors), on_low, from_stop)
    stop_watch = StopWatch(graph, books, lift)

    std = (unit.cylinder.stroke, doubt.leak, doubt.displacement, doubt.compliance)
    belief = _Belief(graph.position, factors, Covariance(graph, std))
    on_stop = ca.logic_or(on_low, on_top)
    leaves = ca.logic_or(leaves_low, leaves_top)
    _predict(graph, books, intake, doubt, belief, on_stop, leaves)
    _test_leakage(graph, books, belief, lift)
    _compress(graph, books, belief, on_low, on_top, lift)
    found = _refer(graph, books, stop_watch, doubt, belief, unit, (at_low, at_top))
    low_1 = ca.logic_or(found.low, on_low)
    top_1 = ca.logic_or(found.top, on_top)
    graph.becomes("at_low", low_1)
    graph.becomes("at_top", top_1)
    stop_watch.close(ca.logic_or(found.sign, ca.logic_or(low_1, top_1)))
    on_stop_1 = ca.logic_or(low_1, top_1)
    resting, looked = _rest(graph, books, on_stop_1)
    graph.becomes("from_stop", ca.if_else(on_stop_1, 1.0, ca.if_else(looked, 0.0, from_stop)))
    return _report(graph, books, intake, belief, found, resting, unit, stop_watch, ca.logic_or(low_1, top_1))


def _predict(
    graph: SensorGraph, books: Books, intake: Intake, doubt: Doubt, belief: _Belief, on_stop: Any, leaves: Any
) -> None:
    """Move the position by the books' step, unless the piston is on a stop."""
    turned = graph.state("turned")
    starts = ca.logic_and(books.turning > 0.5, turned < 0.5)
    graph.becomes("turned", books.turning)
    free = ca.if_else(on_stop, 0.0, 1.0)
    belief.position = belief.position + free * books.step
    dt = graph.elapsed
    noise = free * doubt.walk**2 * dt * books.turning
    noise += ca.if_else(starts, doubt.start**2, 0.0) + ca.if_else(leaves, doubt.leave**2, 0.0)
    row = [books.by_position, books.by_leak, books.by_displacement, books.by_compliance]
    walks = (doubt.leak_walk, doubt.displacement_walk, doubt.compliance_walk)
    belief.covariance.predict([free * r for r in row], [noise, *(walk**2 * dt for walk in walks)])
    belief.covariance.grow(intake.drift)


def _test_leakage(graph: SensorGraph, books: Books, belief: _Belief, lift: float) -> None:
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
    below = ca.logic_and(pressure > _CLOSED_LEAST, pressure < _CLOSED_SHARE * books.held_pressure)
    tells = ca.logic_and(ca.logic_and(closed, settled), ca.logic_and(below, books.known > 0.5))
    measured = books.held.delivered(w) / (books.leakage * ca.fmax(pressure, _CLOSED_LEAST))
    relative = _CLOSED_DOUBT**2 + (_SPEED_DOUBT / ca.fmax(ca.fabs(w), _CLOSED_TURNING)) ** 2
    variance = (measured**2 * relative) / ca.fmax(dt, 1e-6)  # samples of a second together are one measurement
    belief.correct(belief.covariance.update([0.0, 1.0, 0.0, 0.0], measured - leak, variance, tells))
    graph.becomes("leak_tested", ca.fmax(graph.state("leak_tested"), tells))


def _compress(graph: SensorGraph, books: Books, belief: _Belief, on_low: Any, on_top: Any, lift: float) -> None:
    """On a stop nothing moves, and what a pump delivers is compressed: 0 = V_pumped - V_leaked - C dp.

    On the lifted end's stop in the held chamber, on the lowered end's in the other one, which the torque then tells.
    """
    w, dt, angle = graph.motor_speed, graph.elapsed, graph.angle
    names = ("pressed_for", "pressed_from", "pressed_last", "pressed_oil", "pressed_leaked")
    pressed_for, first, last, oil, leaked = (graph.state(name) for name in names)
    lowers = ca.logic_and(on_low, lift * w < -_PRESSING)
    lifts = ca.logic_and(on_top, lift * w > _PRESSING)
    presses = ca.logic_or(lowers, lifts)
    pressure = ca.if_else(on_low, books.other_pressure, books.manifold_pressure)
    capacity = ca.if_else(on_low, books.other_capacity, books.capacity + books.held.manifold_capacity)
    leakage = ca.if_else(on_low, books.other_leakage, books.leakage) * belief.factors[0]
    delivered = ca.if_else(on_low, books.other.delivered(angle), books.held.delivered(angle))
    begins = pressed_for < _PRESSING_BEGINS
    done = pressed_for >= _PRESSED
    counts = ca.logic_and(presses, ca.logic_not(ca.logic_or(begins, done)))
    oil_1 = ca.if_else(counts, oil + delivered, 0.0)
    leaked_1 = ca.if_else(counts, leaked + 0.5 * (last + pressure) * leakage * dt, 0.0)
    first_1 = ca.if_else(begins, pressure, first)
    relief = books.held.side.relief.setting
    full = pressure > _PRESSED_FULL * relief
    slows = ca.fabs(w) < ca.fabs(graph.last_speed) - _PRESSED_SLOWING * dt
    rise = pressure - first_1
    tells = ca.logic_and(ca.logic_and(counts, ca.logic_or(full, slows)), rise > _PRESSED_LEAST)
    pressed_1 = ca.if_else(ca.logic_or(tells, ca.logic_and(counts, full)), _PRESSED, pressed_for + dt)
    graph.becomes("pressed_for", ca.if_else(presses, ca.if_else(done, _PRESSED, pressed_1), 0.0))
    graph.becomes("pressed_from", first_1)
    graph.becomes("pressed_last", pressure)
    graph.becomes("pressed_oil", oil_1)
    graph.becomes("pressed_leaked", leaked_1)
    leak, displacement, compliance = belief.factors
    compressed = capacity * rise
    row = [0.0, -leaked_1 / leak, oil_1 / displacement, -compressed / compliance]
    variance = (capacity * _PRESSURE_NOISE) ** 2 + (_PRESSED_DOUBT * compressed) ** 2
    belief.correct(belief.covariance.update(row, -(oil_1 - leaked_1 - compressed), variance, tells))


def _refer(
    graph: SensorGraph,
    books: Books,
    watch: StopWatch,
    doubt: Doubt,
    belief: _Belief,
    unit: DdhUnit,
    at: tuple[Any, Any],
) -> Found:
    """Take the reference of this sample, if there is one that can be true."""
    stroke, lift = books.cylinder.stroke, unit.lift_sign
    referenced, disputed = graph.state(IS_REFERENCED), graph.state("disputed")
    variance = belief.covariance[0, 0]
    signs = watch.signs
    # The slow filter lags behind a pressure that a stop changes fast: what is compressed meanwhile is no travel.
    ahead = -lift * books.capacity / books.held.area * books.behind
    hardly = ca.logic_or(variance > _HARDLY_KNOWN**2, ca.logic_not(referenced))
    low_end, top_end = (0.0, stroke) if lift > 0.0 else (stroke, 0.0)

    def near(innovation: Any, std: float) -> Any:
        gate = _GATE * (variance + std**2) + _GATE_MARGIN**2
        return ca.logic_or(innovation**2 < gate, ca.logic_not(referenced))

    def stop(end: Any, sign: Any, sure: Any, there: Any) -> tuple[Any, Any, Any]:
        innovation = end - (belief.position + ahead)
        shows = ca.if_else(hardly, sure, sign)
        is_near = near(innovation, doubt.stop)
        new = ca.logic_not(there)
        taken = ca.logic_and(ca.logic_and(shows, is_near), new)
        feigned = ca.fabs(innovation) < _FEIGNED * stroke
        refused = ca.logic_and(ca.logic_and(sure, new), ca.logic_and(ca.logic_not(is_near), feigned))
        return innovation, taken, refused

    to_low, low, low_refused = stop(low_end, signs.low, signs.surely_low, at[0])
    to_top, top, top_refused = stop(top_end, signs.top, signs.surely_top, at[1])
    to_given = graph.reference - belief.position
    inside = ca.logic_and(graph.reference > -_OUTSIDE * stroke, graph.reference < (1.0 + _OUTSIDE) * stroke)
    given = ca.logic_and(graph.referenced, ca.logic_and(inside, near(to_given, doubt.reference)))
    given_refused = ca.logic_and(graph.referenced, ca.logic_not(given))
    by_stop = ca.logic_and(ca.logic_or(low, top), ca.logic_not(given))
    taken = ca.logic_or(by_stop, given)

    innovation = ca.if_else(given, to_given, ca.if_else(low, to_low, to_top))
    std_of = ca.if_else(given, doubt.reference, doubt.stop)
    belief.position = belief.position + ca.if_else(by_stop, ahead, 0.0)
    belief.correct(belief.covariance.update([1.0, 0.0, 0.0, 0.0], innovation, std_of**2, taken))
    belief.factors = [
        ca.fmin(ca.fmax(value, least), most)
        for value, (least, most) in zip(belief.factors, _BOUNDS.values(), strict=True)
    ]

    refused = ca.logic_or(given_refused, ca.logic_or(low_refused, top_refused))
    distance = ca.if_else(
        given_refused,
        ca.if_else(inside, ca.fabs(to_given) / _MISTRUST, 0.0),
        ca.if_else(low_refused, ca.fabs(to_low), ca.fabs(to_top)) / _STOP_MISTRUST,
    )
    # A visit to a stop lasts many samples; its doubt counts from the next visit on.
    waits = graph.state("refused_for")
    pending = graph.state("refused_distance")
    ends = ca.logic_and(ca.logic_not(refused), ca.logic_and(waits > 0.0, ca.logic_not(watch.signs.moving)))
    graph.becomes("refused_for", ca.if_else(refused, waits + 1.0, ca.if_else(ends, 0.0, waits)))
    graph.becomes("refused_distance", ca.if_else(refused, ca.fmax(pending, distance), ca.if_else(ends, 0.0, pending)))
    belief.covariance.raise_to(0, ca.if_else(ca.logic_and(ends, ca.logic_not(taken)), pending**2, 0.0))
    disputed_1 = ca.if_else(taken, 0.0, ca.fmax(disputed, refused))
    graph.becomes("disputed", disputed_1)
    graph.becomes(IS_REFERENCED, ca.fmax(referenced, taken))
    return Found(
        taken=taken,
        refused=refused,
        low=ca.logic_and(low, by_stop),
        top=ca.logic_and(top, by_stop),
        sign=ca.logic_or(
            ca.logic_and(signs.low, near(to_low, doubt.stop)), ca.logic_and(signs.top, near(to_top, doubt.stop))
        ),
        disputed=disputed_1,
        referenced=ca.fmax(referenced, taken),
    )


def _rest(graph: SensorGraph, books: Books, on_stop: Any) -> tuple[Any, Any]:
    """Standard deviation [m] that a load change at rest, which nothing shows, may add; whether it was seen just now."""
    opened_for, seen, spread = (
        graph.state("opened_for"),
        graph.state("load_seen"),
        graph.state("load_spread", 0.0),
    )
    relief = books.held.side.relief.setting
    load = books.load / books.held.area
    opened_for_1 = ca.if_else(books.open > 0.5, opened_for + graph.elapsed, 0.0)
    looks = ca.logic_and(opened_for_1 > _FIRST_LOOK, opened_for <= _FIRST_LOOK)
    had = graph.state("load_had")
    learns = ca.logic_and(looks, had > 0.5)
    mean_square = ca.if_else(spread > 0.0, spread, (_LOAD_CHANGE * relief) ** 2)
    learnt = mean_square + ca.if_else(learns, _LEARNING_LOADS * ((load - seen) ** 2 - mean_square), 0.0)
    graph.becomes("opened_for", opened_for_1)
    graph.becomes("load_spread", learnt)
    graph.becomes("load_seen", ca.if_else(opened_for_1 > _FIRST_LOOK, load, seen))
    graph.becomes("load_had", ca.fmax(had, opened_for_1 > _FIRST_LOOK))
    unseen = ca.logic_and(opened_for_1 <= _FIRST_LOOK, ca.logic_not(on_stop))
    return ca.if_else(unseen, books.capacity / books.held.area * ca.sqrt(learnt), 0.0), looks


def _report(
    graph: SensorGraph,
    books: Books,
    intake: Intake,
    belief: _Belief,
    found: Found,
    resting: Any,
    unit: DdhUnit,
    watch: StopWatch,
    on_stop: Any,
) -> VirtualSensor:
    """What the sensor says of the sample, and its graph closed."""
    stroke = books.cylinder.stroke
    own = ca.sqrt(ca.fmax(belief.covariance[0, 0], 0.0))
    status = judge(graph, books, intake, found, own, belief.position, unit, watch, on_stop)
    belief.covariance.grow(status.slipped)
    position = ca.fmin(ca.fmax(belief.position, -0.1 * stroke), 1.1 * stroke)
    graph.becomes("position", position)
    for name, value in zip(_BOUNDS, belief.factors, strict=True):
        graph.becomes(name, value)
    belief.covariance.close()

    # Corrections between references reach the outside no faster than the piston can move.
    shown, first = graph.state("shown_position"), graph.held("started")
    reach = graph.parameters.add("max_velocity", 1.1 * unit.max_velocity) * intake.passed
    wanted = ca.fmin(ca.fmax(ca.if_else(intake.usable, position, graph.position), 0.0), stroke)
    jumps = ca.logic_and(ca.logic_or(found.taken, ca.logic_not(first)), intake.usable)
    shown_1 = ca.if_else(jumps, wanted, ca.fmin(ca.fmax(wanted, shown - reach), shown + reach))
    graph.becomes("shown_position", shown_1, always=True)
    speed = graph.state("velocity")
    share = graph.elapsed / (_VELOCITY_SMOOTHING + graph.elapsed)
    moving = ca.if_else(on_stop, 0.0, books.step / ca.fmax(graph.elapsed, 1e-6))
    velocity = ca.if_else(graph.elapsed > 0.0, speed + share * (moving - speed), speed)
    graph.becomes("velocity", velocity)
    behind = ca.fabs(wanted - shown_1)
    total = ca.sqrt(own**2 + resting**2) + intake.unseen + behind
    held, other = books.held_pressure + unit.tank_pressure, books.other_pressure + unit.tank_pressure
    a, b = (held, other) if unit.held == "a" else (other, held)
    more = {"pressure_a": (a, "Pa"), "pressure_b": (b, "Pa")}
    for k, name in enumerate(_BOUNDS):
        more[f"{name}_factor"] = (belief.factors[k], "1")
        more[f"{name}_factor_std"] = (ca.sqrt(ca.fmax(belief.covariance[k + 1, k + 1], 0.0)), "1")
    return graph.sensor(
        "kalman", position=shown_1, velocity=velocity, load=books.load, std=total, status=status.code, more=more
    )
