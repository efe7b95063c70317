"""The parts of a sensor's step one after the other: exported C is read as the pipe that the sensor is."""

from __future__ import annotations

from dataclasses import replace

from ramsight.engine.graph import Graph, side_by_side


def live_marks(graph: Graph, first: int) -> set[tuple[int, int]]:
    """Elements of a function's marks that its results need as well.

    Args:
        graph: of the function.
        first: its first output that is a mark.

    Returns:
        Their places, output and element.
    """
    marks = [(place, node) for place, node in graph.results if place[0] >= first]
    needed = replace(graph, results=[one for one in graph.results if one[0][0] < first]).live()
    return {place for place, node in marks if node in needed}


def by_section(graph: Graph, first: int, count: int) -> tuple[Graph, list[int]]:
    """A graph whose operations stand by the parts of the step that they belong to, without the marks.

    An operation belongs to the first mark that needs it; what no mark needs comes last. What an operation needs belongs
    to the same part or to one before, so that the order is one in which all of it can be done.

    Args:
        graph: of a function whose outputs from `first` on are marks: what each part of the step leads to.
        first: its first output that is a mark.
        count: how many outputs are marks.

    Returns:
        The graph, and of each operation the number of its part, 0 to `count`.
    """
    parts = [count] * len(graph.nodes)
    for mark in reversed(range(count)):
        leads = replace(graph, results=[one for one in graph.results if one[0][0] == first + mark])
        for node in leads.live():
            parts[node] = mark
    order = side_by_side(graph, parts)
    results = [one for one in graph.results if one[0][0] < first]
    return replace(graph, results=results).reordered(order), [parts[k] for k in order]
