"""The operations of an SX function as a graph, before they become machine code or C.

What CasADi writes as a sum of two products with a condition is the choice that was meant, and where several numbers are
divided by the same one it is inverted once: a division takes as long as ten multiplications.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

Program = Sequence[Sequence[Any]]
"""Elementary operations in order, `[operation, target, sources, constant]` (`engine.cache.instructions`)."""

SELECT = -1
"""Beside CasADi's codes: first if the condition, else second."""
_DIVISIONS = (ca.OP_DIV, ca.OP_INV)
_FREE = (ca.OP_INPUT, ca.OP_CONST)
# Cycles until a result can be used, on today's processors (Fog, Instruction tables, Technical University of Denmark):
# what takes long there takes long everywhere.
_USUAL = 4
_CYCLES = {ca.OP_DIV: 14, ca.OP_INV: 14, ca.OP_SQRT: 18} | dict.fromkeys(
    (ca.OP_EXP, ca.OP_LOG, ca.OP_TANH, ca.OP_SIN, ca.OP_COS, ca.OP_POW, ca.OP_CONSTPOW), 50
)
# Cycles that a processor looks ahead, some hundred instructions: what can be done within them may stand in any order.
_AHEAD = 100


@dataclass(frozen=True)
class Node:
    """An operation."""

    code: int  # CasADi's, or `SELECT`
    sources: tuple[int, ...] = ()  # places of its operands in the graph
    place: tuple[int, int] = (0, 0)  # of an input, argument and element
    value: float = 0.0


@dataclass
class Graph:
    """Operations, each behind those that it needs."""

    nodes: list[Node] = field(default_factory=list)  # they; all are needed for a result
    # place of an output and of the node that it is
    results: list[tuple[tuple[int, int], int]] = field(default_factory=list)

    def add(self, node: Node) -> int:
        """Add a node; its place."""
        self.nodes.append(node)
        return len(self.nodes) - 1

    def chosen(self, x: int, y: int) -> Node | None:
        """CasADi's if_else is a sum of what is zero unless and what is zero if; this is what was meant."""
        if any(self.nodes[k].code != ca.OP_IF_ELSE_ZERO for k in (x, y)):
            return None
        for one, other in ((x, y), (y, x)):
            (condition, value), (against, instead) = self.nodes[one].sources, self.nodes[other].sources
            if self.nodes[against].code == ca.OP_NOT and self.nodes[against].sources[0] == condition:
                return Node(SELECT, (condition, value, instead))
        return None

    def reordered(self, order: Sequence[int]) -> Graph:
        """The same with its nodes in another order, each still behind those that it needs."""
        place = {old: new for new, old in enumerate(order)}
        nodes = [replace(self.nodes[k], sources=tuple(place[s] for s in self.nodes[k].sources)) for k in order]
        return Graph(nodes, [(output, place[node]) for output, node in self.results])

    def ready(self) -> list[int]:
        """After how many cycles each node is known where nothing else has to be waited for.

        Example:
            >>> from ramsight.engine.cache import instructions
            >>> a, b = ca.SX.sym("a"), ca.SX.sym("b")
            >>> graph_of(instructions(ca.Function("f", [a, b], [ca.sqrt(a) + b]))).ready()
            [0, 18, 0, 22]
        """
        known = [0] * len(self.nodes)
        for k, node in enumerate(self.nodes):
            takes = 0 if node.code in _FREE else _CYCLES.get(node.code, _USUAL)
            known[k] = takes + max((known[source] for source in node.sources), default=0)
        return known

    def live(self) -> set[int]:
        """Nodes that a result depends on."""
        found: set[int] = set()
        left = [node for _, node in self.results]
        while left:
            node = left.pop()
            if node not in found:
                found.add(node)
                left.extend(self.nodes[node].sources)
        return found


def graph_of(program: Program) -> Graph:
    """The graph of a program.

    Example:
        >>> from ramsight.engine.cache import instructions
        >>> a, b, c = (ca.SX.sym(name) for name in "abc")
        >>> graph = graph_of(instructions(ca.Function("f", [a, b, c], [a / c, b / c])))
        >>> [node.code == ca.OP_INV for node in graph.nodes].count(True)
        1
    """
    return _needed(_simplified(_read(program)))


def side_by_side(graph: Graph, parts: Sequence[int] | None = None) -> list[int]:
    """An order of the nodes in which chains that do not need each other stand side by side.

    CasADi writes one after the other; a processor that waits for a root or a quotient in one of them does not look as
    far ahead as to find the next.

    Args:
        parts: number of each node's part, never less than that of what it needs; parts stay together.
    """
    ready, part = graph.ready(), parts or [0] * len(graph.nodes)
    return sorted(range(len(graph.nodes)), key=lambda k: (part[k], ready[k] // _AHEAD, k))


def _read(program: Program) -> Graph:
    graph = Graph()
    current: dict[int, int] = {}
    inputs: dict[tuple[int, int], int] = {}
    for code, target, sources, value in program:
        if code == ca.OP_OUTPUT:
            graph.results.append(((target[0], target[1]), current[sources[0]]))
        elif code == ca.OP_INPUT:
            place = (sources[0], sources[1])
            if place not in inputs:
                inputs[place] = graph.add(Node(code, place=place))
            current[target[0]] = inputs[place]
        elif code == ca.OP_CONST:
            current[target[0]] = graph.add(Node(code, value=value))
        else:
            operands = tuple(current[s] for s in sources)
            chosen = graph.chosen(*operands) if code == ca.OP_ADD else None
            current[target[0]] = graph.add(chosen or Node(code, operands))
    return graph


def _simplified(old: Graph) -> Graph:
    """The same with shared inverses, and without choices by what a condition is not.

    A constant that is divided by has one, and so has each number that is divided by more than once.
    """
    live = old.live()
    divisors = Counter(n.sources[-1] for k, n in enumerate(old.nodes) if k in live and n.code in _DIVISIONS)
    new, place, inverses = Graph(), dict[int, int](), dict[int, int]()

    def inverse(divisor: int) -> int:
        if divisor not in inverses:
            node = old.nodes[divisor]
            constant = Node(ca.OP_CONST, value=1.0 / node.value) if _invertible(node) else None
            inverses[divisor] = new.add(constant or Node(ca.OP_INV, (place[divisor],)))
        return inverses[divisor]

    for k, node in enumerate(old.nodes):
        by = node.sources[-1] if node.code in _DIVISIONS else None
        if k not in live:
            continue
        if node.code == SELECT and place[node.sources[1]] == place[node.sources[2]]:  # the same in either case
            place[k] = place[node.sources[1]]
            continue
        if by is not None and (divisors[by] > 1 or _invertible(old.nodes[by])):
            inverted = inverse(by)
            shares = node.code == ca.OP_INV
            place[k] = inverted if shares else new.add(Node(ca.OP_MUL, (place[node.sources[0]], inverted)))
        else:
            moved = Node(node.code, tuple(place[s] for s in node.sources), node.place, node.value)
            place[k] = new.add(_not_negated(new, moved))
    new.results = [(output, place[k]) for output, k in old.results]
    return new


def _not_negated(graph: Graph, node: Node) -> Node:
    """A choice by the condition itself where it is one by what the condition is not."""
    if node.code not in (SELECT, ca.OP_IF_ELSE_ZERO) or graph.nodes[node.sources[0]].code != ca.OP_NOT:
        return node
    condition, then, *otherwise = node.sources
    instead = otherwise[0] if otherwise else graph.add(Node(ca.OP_CONST))
    return _not_negated(graph, Node(SELECT, (graph.nodes[condition].sources[0], instead, then)))


def _invertible(node: Node) -> bool:
    return node.code == ca.OP_CONST and node.value != 0.0 and math.isfinite(node.value)


def _needed(old: Graph) -> Graph:
    """The same without what no result depends on."""
    live, new, place = old.live(), Graph(), dict[int, int]()
    for k, node in enumerate(old.nodes):
        if k in live:
            place[k] = new.add(Node(node.code, tuple(place[s] for s in node.sources), node.place, node.value))
    new.results = [(output, place[k]) for output, k in old.results]
    return new
