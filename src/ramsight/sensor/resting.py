"""A load that changes at rest moves the rod by what the oil gives way, and nothing tells the sensor."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.sensor.load import SEEN_AT, LoadStep
from ramsight.sensor.virtual_sensor import SensorGraph

_FIRST_LOOK = 0.3  # s after the torque shows the load again, when it is known
_LEARNING = 1.0 / 6.0  # share of the newest load change in their mean square
_TURNING = 1.0  # rad/s


def unseen_load(graph: SensorGraph, step: LoadStep, held: Any, expected: Any) -> Any:
    """What a load change that has not been seen may add to the position's standard deviation.

    Args:
        graph: the sensor's graph; gains states, among them the mean square of the load changes seen so far.
        step: of the load observer.
        held: whether the piston is held on a stop, where a load does not move it.
        expected: a load change before any has been seen [N].

    Returns:
        Standard deviation [m], 0 while the load is seen.
    """
    shown_for, before, was_seen = (graph.state(name) for name in ("load_shown_for", "load_seen", "load_was_seen"))
    changes = graph.state("load_changes")  # mean square over the expected one, less 1: all states may begin at 0
    shows = ca.logic_and(step.seen > SEEN_AT, ca.fabs(graph.motor_speed) > _TURNING)
    shown_for_1 = ca.if_else(shows, shown_for + graph.elapsed, 0.0)
    sees = shown_for_1 > _FIRST_LOOK
    learns = ca.logic_and(ca.logic_and(sees, shown_for <= _FIRST_LOOK), was_seen)
    mean_square = 1.0 + changes
    newest = ((step.load - before) / expected) ** 2
    learnt = mean_square + ca.if_else(learns, _LEARNING * (newest - mean_square), 0.0)
    graph.becomes("load_shown_for", shown_for_1)
    graph.becomes("load_changes", learnt - 1.0)
    graph.becomes("load_seen", ca.if_else(sees, step.load, before))
    graph.becomes("load_was_seen", ca.fmax(was_seen, sees))
    unseen = ca.logic_not(ca.logic_or(shows, held))
    return ca.if_else(unseen, step.give * expected * ca.sqrt(ca.fmax(learnt, 0.0)), 0.0)
