"""What a step writes over what stood there: where a state stays as it was, nothing.

A sensor's graph says of each state what it becomes, `if_else(contact, new, old)` among it. A usual sample leaves nearly
half of its hundreds of states as they were; to read, choose and write them again would take a sixth of its time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

import casadi as ca

from ramsight.engine.graph import SELECT, Graph, Node

_LEAST = 8  # results behind one condition; a branch that is foreseen wrongly costs more than as many choices

Place = tuple[int, int]
"""Of a result: output and element."""


@dataclass
class Writes:
    """Results that are written together."""

    # place and node of each that is written wherever these are
    always: list[tuple[Place, int]] = field(default_factory=list)
    # by condition what is written beside them where it holds, and where it does not
    cases: dict[int, tuple[Writes, Writes]] = field(default_factory=dict)

    def nodes(self) -> Iterator[int]:
        """All nodes that are written somewhere."""
        yield from (node for _, node in self.always)
        for both in self.cases.values():
            for one in both:
                yield from one.nodes()


def writes(graph: Graph, kept: Mapping[int, int], whole: Collection[int] = ()) -> Writes:
    """What is written of a graph's results, and when.

    Args:
        whole: nodes that are written as they are, not looked into: they are known in one case of a branch alone.

    Example:
        >>> from ramsight.engine.cache import instructions
        >>> from ramsight.engine.graph import graph_of
        >>> a, x = ca.SX.sym("a"), ca.SX.sym("x", 9)
        >>> step = ca.Function("f", [a, x], [ca.if_else(a > 0, 2.0 * x, x)])
        >>> found = writes(graph_of(instructions(step)), {0: 1})
        >>> len(found.always), [(len(then.always), len(otherwise.always)) for then, otherwise in found.cases.values()]
        (0, [(9, 0)])
    """
    behind: Counter[tuple[int, ...]] = Counter()

    def splits(place: Place, node: int) -> bool:
        """Whether one case of a choice leaves what stood there."""
        if node in whole or graph.nodes[node].code != SELECT or place[0] not in kept:
            return False
        return any(stays(place, value) or splits(place, value) for value in graph.nodes[node].sources[1:])

    def stays(place: Place, node: int) -> bool:
        return graph.nodes[node] == Node(ca.OP_INPUT, place=(kept.get(place[0], -1), place[1]))

    def count(place: Place, node: int, path: tuple[int, ...]) -> None:
        if splits(place, node):
            condition, *values = graph.nodes[node].sources
            behind[*path, condition] += 1
            for value in values:
                count(place, value, (*path, condition))

    def put(to: Writes, place: Place, node: int, path: tuple[int, ...]) -> None:
        if stays(place, node):
            return
        if not splits(place, node) or behind[*path, graph.nodes[node].sources[0]] < _LEAST:
            to.always.append((place, node))
            return
        condition, *values = graph.nodes[node].sources
        for case, value in zip(to.cases.setdefault(condition, (Writes(), Writes())), values, strict=True):
            put(case, place, value, (*path, condition))

    found = Writes()
    for place, node in graph.results:
        count(place, node, ())
    for place, node in graph.results:
        put(found, place, node, ())
    return found
