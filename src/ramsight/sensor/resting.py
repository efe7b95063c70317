"""A load that changes at rest moves the rod by what the oil gives way, and nothing tells the sensor."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.sensor.books import Books
from ramsight.sensor.virtual_sensor import SensorGraph

_FIRST_LOOK = 0.3  # s after the valve has opened, when the load is known again
_LEARNING = 1.0 / 6.0  # share of the newest load change in their mean square
_EXPECTED = 0.2  # share of the relief pressure; a load change before any has been seen


def unseen_load(graph: SensorGraph, books: Books, on_stop: Any) -> tuple[Any, Any]:
    """What a load change that has not been seen may add to the position's standard deviation.

    Args:
        graph: the sensor's graph; gains states, among them the mean square of the load changes seen so far.
        books: of this sample.
        on_stop: whether the piston is on an end stop, where a load does not move it.

    Returns:
        Standard deviation [m], 0 while the load is seen; whether it was seen anew at this sample.
    """
    opened_for, before, was_seen = (graph.state(name) for name in ("opened_for", "load_seen", "load_was_seen"))
    expected = _EXPECTED * books.held.side.relief.setting
    changes = graph.state("load_changes")  # mean square over the expected one, less 1: all states may begin at 0
    load = books.load / books.held.area
    opened_for_1 = ca.if_else(books.open > 0.5, opened_for + graph.elapsed, 0.0)
    sees = opened_for_1 > _FIRST_LOOK
    anew = ca.logic_and(sees, opened_for <= _FIRST_LOOK)
    learns = ca.logic_and(anew, was_seen)
    mean_square = 1.0 + changes
    learnt = mean_square + ca.if_else(learns, _LEARNING * (((load - before) / expected) ** 2 - mean_square), 0.0)
    graph.becomes("opened_for", opened_for_1)
    graph.becomes("load_changes", learnt - 1.0)
    graph.becomes("load_seen", ca.if_else(sees, load, before))
    graph.becomes("load_was_seen", ca.fmax(was_seen, sees))
    unseen = ca.logic_not(ca.logic_or(sees, on_stop))
    moved = books.capacity / books.held.area * expected * ca.sqrt(ca.fmax(learnt, 0.0))
    return ca.if_else(unseen, moved, 0.0), anew
