"""The self-calibrating sensor: the books of the oil, with factors it learns from every reference.

An extended Kalman filter over the position and the three factors by which a machine differs from its data sheet
(leakage, displacement, compliance). The books say how the piston moves, their derivatives say how a wrong factor shows
in the position, and every reference (an end stop that it recognises, a switch, a hand) corrects all four. Pressures
come from the torque at every sample, so they need no share in the covariance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.ddh import DdhUnit
from ramsight.plant.unit import opposite
from ramsight.sensor.belief import BOUNDS, Belief
from ramsight.sensor.books import Books, Factors, Tuning, keep_books
from ramsight.sensor.hearing import hear_compression, hear_decay, hear_leakage
from ramsight.sensor.intake import Intake, take_in
from ramsight.sensor.judgement import judge
from ramsight.sensor.references import Found, refer
from ramsight.sensor.resting import unseen_load
from ramsight.sensor.stops import StopWatch
from ramsight.sensor.uncertainty import Covariance
from ramsight.sensor.virtual_sensor import SensorGraph, VirtualSensor

_TURNING = 3.0  # rad/s; with which a piston leaves its stop
_SURELY_OPEN = 2.0  # standard deviations of the leakage by which a pump's flow has to exceed it
_VELOCITY_SMOOTHING = 0.1  # s
_ROOM = 1.0  # share of the stroke by which the position may run out of it, so that the next reference sees by how much
_FASTEST = 1.1  # share of the velocity at the highest motor speed that no correction exceeds


@dataclass(frozen=True)
class Doubt:
    """What the filter assumes of the machine and of its own books, as standard deviations.

    Args:
        leak, displacement, compliance: how far a new machine is from its data sheet [1].
        leak_walk, displacement_walk, compliance_walk: how these change in time [1/sqrt(s)].
        walk: of the position over the way it goes [m/sqrt(m)].
        start: pressure of the held chamber by which the books may err in a movement's start [Pa].
        leave: the same when leaving an end stop [Pa].
        stop: of an end stop as a reference [m].
        reference: of a switch or a position given by hand [m].
    """

    leak: float = 0.16
    displacement: float = 0.003
    compliance: float = 0.25
    leak_walk: float = 1e-4
    displacement_walk: float = 1e-6
    compliance_walk: float = 1e-4
    walk: float = 0.2e-3
    start: float = 0.8e5
    leave: float = 6e5
    stop: float = 0.22e-3
    reference: float = 1e-3


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
    factors = [graph.state(name, 1.0) for name in BOUNDS]
    std = (unit.cylinder.stroke, doubt.leak, doubt.displacement, doubt.compliance)
    belief = Belief(graph.position, factors, Covariance(graph, std))

    at_low, at_top, from_stop = (graph.state(name) for name in ("at_low", "at_top", "from_stop"))
    up = lift * graph.motor_speed
    leaves = ca.logic_or(ca.logic_and(at_low, up >= _TURNING), ca.logic_and(at_top, up <= -_TURNING))
    on_low, on_top = (ca.logic_and(at, ca.logic_not(leaves)) for at in (at_low, at_top))
    doubtful = _SURELY_OPEN * belief.leak_doubt
    books = keep_books(graph, unit, tuning, Factors(*factors), on_low, on_top, from_stop, doubtful)
    watch = StopWatch(graph, books, lift)

    _predict(graph, books, intake, doubt, belief, ca.logic_or(on_low, on_top), leaves)
    hear_leakage(graph, books, belief, lift)
    hear_compression(graph, books, belief, watch.signs.slow, on_low=on_low, on_top=on_top, lift=lift)
    hear_decay(graph, books, belief, seated=on_low)
    found = refer(
        graph, books, watch, belief, unit, at=(at_low, at_top), stop_std=doubt.stop, reference_std=doubt.reference
    )
    low, top = ca.logic_or(found.low, on_low), ca.logic_or(found.top, on_top)
    on_stop = ca.logic_or(low, top)
    graph.becomes("at_low", low)
    graph.becomes("at_top", top)
    watch.close(ca.logic_or(found.sign, on_stop))
    unseen, looked = unseen_load(graph, books, on_stop)
    graph.becomes("from_stop", ca.if_else(on_stop, 1.0, ca.if_else(looked, 0.0, from_stop)))
    near_stop = ca.logic_or(on_stop, from_stop)
    verdict = judge(graph, books, intake, found, belief.std, belief.position, unit, watch, near_stop)
    belief.covariance.grow(verdict.slipped)
    return _report(graph, books, intake, belief, found, unseen, verdict.code, unit, on_stop)


def _predict(
    graph: SensorGraph, books: Books, intake: Intake, doubt: Doubt, belief: Belief, on_stop: Any, leaves: Any
) -> None:
    """Move the position by the books' step, unless the piston is on a stop."""
    turned, dt = graph.state("turned"), graph.elapsed
    starts = ca.logic_and(books.turning > 0.5, turned < 0.5)
    graph.becomes("turned", books.turning)
    free = ca.if_else(on_stop, 0.0, 1.0)
    belief.position = belief.position + free * books.step
    jolt = ca.if_else(starts, doubt.start**2, 0.0) + ca.if_else(leaves, doubt.leave**2, 0.0)
    noise = free * doubt.walk**2 * ca.fabs(books.step) + jolt * (books.capacity / books.held.area) ** 2
    row = [books.by_position, books.by_leak, books.by_displacement, books.by_compliance]
    walks = (doubt.leak_walk, doubt.displacement_walk, doubt.compliance_walk)
    belief.covariance.predict([free * r for r in row], [noise, *(walk**2 * dt for walk in walks)])
    belief.covariance.grow(intake.drift)


def _report(
    graph: SensorGraph,
    books: Books,
    intake: Intake,
    belief: Belief,
    found: Found,
    unseen: Any,
    status: Any,
    unit: DdhUnit,
    on_stop: Any,
) -> VirtualSensor:
    """What the sensor says of the sample, and its graph closed."""
    stroke = books.cylinder.stroke
    position = ca.fmin(ca.fmax(belief.position, -_ROOM * stroke), (1.0 + _ROOM) * stroke)
    graph.becomes("position", position)
    for name, value in zip(BOUNDS, belief.factors, strict=True):
        graph.becomes(name, value)
    belief.covariance.limit(stroke)
    belief.covariance.close()

    # Whatever is not a reference moves the position that is shown no faster than the piston can go.
    shown, started = graph.state("shown_position"), graph.held("started")
    reach = graph.parameters.add("fastest", _FASTEST * unit.max_velocity) * intake.passed
    wanted = ca.fmin(ca.fmax(ca.if_else(intake.usable, position, graph.position), 0.0), stroke)
    jumps = ca.logic_and(ca.logic_or(found.taken, ca.logic_not(started)), intake.usable)
    followed = ca.fmin(ca.fmax(wanted, shown - reach), shown + reach)
    shown_1 = ca.if_else(jumps, wanted, ca.if_else(started, followed, wanted))
    graph.becomes("shown_position", shown_1, always=True)

    speed, dt = graph.state("velocity"), graph.elapsed
    moving = ca.if_else(on_stop, 0.0, books.step / ca.fmax(dt, 1e-6))
    velocity = speed + dt / (_VELOCITY_SMOOTHING + dt) * (moving - speed)
    graph.becomes("velocity", velocity)
    std = ca.sqrt(belief.std**2 + unseen**2) + intake.unseen + ca.fabs(wanted - shown_1)

    above_tank = {unit.held: books.held_pressure, opposite(unit.held): books.other_pressure}
    more = {f"pressure_{side}": (above_tank[side] + unit.tank_pressure, "Pa") for side in "ab"}
    for k, name in enumerate(BOUNDS):
        more[f"{name}_factor"] = (belief.factors[k], "1")
        more[f"{name}_factor_std"] = (ca.sqrt(ca.fmax(belief.covariance[k + 1, k + 1], 0.0)), "1")
    return graph.sensor(
        "kalman", position=shown_1, velocity=velocity, load=books.load, std=std, status=status, more=more
    )
