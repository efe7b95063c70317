"""References: which of them can be true, and what follows from one that is, or is not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.ddh import DdhUnit
from ramsight.sensor.belief import Belief
from ramsight.sensor.books import Books
from ramsight.sensor.stops import Signs, StopWatch
from ramsight.sensor.virtual_sensor import IS_REFERENCED, SensorGraph

_GATE = 16.0  # a reference may be four standard deviations away ...
_GATE_MARGIN = 4e-3  # m, ... and this
_WELL_KNOWN = 15e-3  # m; with a larger standard deviation only likely signs of a stop count, ...
_ROUGHLY_KNOWN = 0.1  # share of the stroke; ... and with this one only sure ones
_SLIDES = 0.03  # share of the stroke that a position may run out of it while nothing presses
_BEYOND, _BEYOND_LEAST = 3.0, 1e-3  # standard deviations and m outside the stroke: the piston is on its stop
_OUTSIDE = 0.02  # share of the stroke by which a reference may be beyond its end
_MISTRUST = 6.0  # a refused reference leaves the doubt that it may be right after all: its distance over this ...
_STOP_MISTRUST = 3.5  # ... and so much for a stop, which is then believed the second time
_FEIGNED = 0.2  # share of the stroke; a stop farther away is an obstacle, not a stop


@dataclass(frozen=True)
class Found:
    """What became of references at a sample.

    Attributes:
        taken: one was accepted.
        low, top: the stop of the lowered or lifted end was recognised.
        sign: the pressure looks as on a stop where the piston may be.
        disputed: one was refused, and none has been accepted since.
        referenced: whether the position has ever been known.
    """

    taken: Any
    low: Any
    top: Any
    sign: Any
    disputed: Any
    referenced: Any


@dataclass(frozen=True)
class _Claim:
    """A reference that offers itself: what it would correct [m], whether it can be true, whether it is taken."""

    innovation: Any
    near: Any
    taken: Any
    refused: Any


def refer(
    graph: SensorGraph,
    books: Books,
    watch: StopWatch,
    belief: Belief,
    unit: DdhUnit,
    *,
    at: tuple[Any, Any],
    stop_std: float,
    reference_std: float,
) -> Found:
    """Take the reference of this sample, if there is one that can be true.

    Args:
        graph: the sensor's graph; gains states.
        books: of this sample.
        watch: the pressure's signs.
        belief: is corrected.
        unit: the unit's parts.
        at: whether the piston is on the stop of the lowered and of the lifted end already; a visit counts once.
        stop_std: standard deviation of a stop [m].
        reference_std: of a switch or a hand [m].
    """
    stroke, lift, signs = books.cylinder.stroke, unit.lift_sign, watch.signs
    referenced, variance = graph.state(IS_REFERENCED), belief.covariance[0, 0]
    well = ca.logic_and(referenced, variance < _WELL_KNOWN**2)
    roughly = ca.logic_and(referenced, variance < (_ROUGHLY_KNOWN * stroke) ** 2)
    # The slow filter lags behind a pressure that a stop changes fast: what is compressed meanwhile is no travel.
    gives = -lift * books.capacity / books.held.area
    ahead_low, ahead_top = gives * _collapsed(graph, books, signs), gives * books.behind

    def is_near(innovation: Any, std: float) -> Any:
        gate = _GATE * (variance + std**2) + _GATE_MARGIN**2
        return ca.logic_or(innovation**2 < gate, ca.logic_not(referenced))

    def stop(end: Any, ahead: Any, signs: tuple[Any, Any, Any], there: Any) -> _Claim:
        innovation = end - (belief.position + ahead)
        near, new = is_near(innovation, stop_std), ca.logic_not(there)
        shown, likely, sure = signs
        seen = ca.if_else(well, shown, ca.logic_or(sure, ca.logic_and(roughly, likely)))
        taken = ca.logic_and(ca.logic_and(seen, near), new)
        feigned = ca.fabs(innovation) < _FEIGNED * stroke
        refused = ca.logic_and(ca.logic_and(sure, new), ca.logic_and(ca.logic_not(near), feigned))
        return _Claim(innovation, near, taken, refused)

    low_end, top_end = (0.0, stroke) if lift > 0.0 else (stroke, 0.0)
    low = stop(low_end, ahead_low, (signs.low, signs.likely_low, signs.surely_low), at[0])
    top = stop(top_end, ahead_top, (signs.top, signs.likely_top, signs.surely_top), at[1])
    to_given = graph.reference - belief.position
    inside = ca.logic_and(graph.reference > -_OUTSIDE * stroke, graph.reference < (1.0 + _OUTSIDE) * stroke)
    near = is_near(to_given, reference_std)
    taken = ca.logic_and(graph.referenced, ca.logic_and(inside, near))
    given = _Claim(to_given, near, taken, ca.logic_and(graph.referenced, ca.logic_not(taken)))

    by_stop = ca.logic_and(ca.logic_or(low.taken, top.taken), ca.logic_not(given.taken))
    found = ca.logic_or(by_stop, given.taken)
    innovation = ca.if_else(given.taken, given.innovation, ca.if_else(low.taken, low.innovation, top.innovation))
    std = ca.if_else(given.taken, reference_std, stop_std)
    belief.position = belief.position + ca.if_else(by_stop, ca.if_else(low.taken, ahead_low, ahead_top), 0.0)
    # Compliance shows in the position too little and too late to be told from leakage; stops tell it better.
    belief.measure([1.0, 0.0, 0.0, 0.0], innovation, std**2, found, only=[0, 1, 2])

    # A well-known position that leaves the stroke is on its stop, whatever the pressure says.
    ends = ca.fmin(ca.fmax(belief.position, 0.0), stroke)
    excess = ca.fabs(belief.position - ends)
    held = ca.logic_and(well, excess > _BEYOND * belief.std + _BEYOND_LEAST)
    # If that goes on without a stop's pressure, what the books count is wrong.
    slid = graph.state("slid")
    slid_1 = ca.if_else(found, 0.0, slid + ca.if_else(held, excess, 0.0))
    graph.becomes("slid", slid_1)
    belief.position = ca.if_else(held, ends, belief.position)

    by_given = ca.if_else(inside, ca.fabs(given.innovation) / _MISTRUST, 0.0)
    by_stops = ca.fabs(ca.if_else(low.refused, low.innovation, top.innovation)) / _STOP_MISTRUST
    refused = ca.logic_or(given.refused, ca.logic_or(low.refused, top.refused))
    contradicted = ca.logic_or(refused, slid_1 > _SLIDES * stroke)
    _mistrust(graph, watch, belief, refused, ca.if_else(given.refused, by_given, by_stops), found)
    disputed = graph.state("disputed")
    disputed_1 = ca.if_else(found, 0.0, ca.fmax(disputed, contradicted))
    graph.becomes("disputed", disputed_1)
    known = ca.fmax(referenced, found)
    graph.becomes(IS_REFERENCED, known)
    return Found(
        taken=found,
        low=ca.logic_and(low.taken, by_stop),
        top=ca.logic_and(top.taken, by_stop),
        sign=ca.logic_or(ca.logic_and(signs.low, low.near), ca.logic_and(signs.top, top.near)),
        disputed=disputed_1,
        referenced=known,
    )


def _collapsed(graph: SensorGraph, books: Books, signs: Signs) -> Any:
    """By how much the held chamber's pressure has left the books behind on the lowered end's stop [Pa].

    What falls on one side rises on the other, each in its closed volume, and the torque tells of both together.
    """
    direction = books.held.direction(graph.motor_speed)
    torques = books.other.torque_per_pressure(direction) / books.held.torque_per_pressure(direction)
    flows = books.other.delivered(1.0) / books.held.delivered(1.0)
    volumes = (books.capacity + books.held.manifold_capacity) / books.other_capacity
    fallen = (signs.slow - books.manifold_pressure) / (1.0 + torques * flows * volumes)
    behind = books.behind + signs.slow - fallen - books.manifold_pressure
    return ca.fmax(behind, -books.held_pressure)


def _mistrust(graph: SensorGraph, watch: StopWatch, belief: Belief, refused: Any, doubt: Any, found: Any) -> None:
    """Let a refusal raise the position's standard deviation to `doubt` [m], once its visit is over.

    A visit lasts many samples; if each counted, the second would be believed because of the first.
    """
    waiting, pending = graph.state("refusal_waits"), graph.state("refusal_doubt")
    over = ca.logic_and(ca.logic_and(waiting, ca.logic_not(refused)), ca.logic_not(watch.signs.moving))
    keeps = ca.if_else(over, 0.0, waiting)
    graph.becomes("refusal_waits", ca.if_else(refused, 1.0, keeps))
    graph.becomes("refusal_doubt", ca.if_else(refused, ca.fmax(pending, doubt), ca.if_else(over, 0.0, pending)))
    belief.covariance.raise_to(0, ca.if_else(ca.logic_and(over, ca.logic_not(found)), pending**2, 0.0))
