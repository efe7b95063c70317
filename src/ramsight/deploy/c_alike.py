"""Operations that a step does alike for several of a kind, as a sensor does for its hypotheses: found, to stand once.

The graph of a step has the same operations for each hypothesis. Here those that correspond become one node, an
operation *of each*; what they need that differs is gathered for them, and what is needed of one is taken from it. Which
operations correspond decides how much becomes one, and never a result: any that have the same code may.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.engine.branches import choice
from ramsight.engine.graph import Graph, Node

GATHER = -2
"""Beside CasADi's codes: an operand of each, from operands that do not correspond."""
TAKE = -3
"""Beside CasADi's codes: what is of one of them, its number as the value."""
_GIVEN = (ca.OP_INPUT, ca.OP_CONST)

Row = tuple[int, ...]


@dataclass(frozen=True)
class Collapsed:
    """A graph in which operations that are alike are one."""

    graph: Graph  # of operations, with `GATHER` and `TAKE`
    parts: list[int]  # of each node the number of its part
    each: frozenset[int] = frozenset()  # nodes that stand for one operation of each


def collapsed(graph: Graph, parts: Sequence[int], rows: Sequence[Row]) -> Collapsed:
    """A graph with what is done alike as one.

    Args:
        parts: number of each one's part, never less than that of what it needs.
        rows: what corresponds, a node of each a row, what comes first in the step first; the operations that lead
            there are compared backwards. A result that is chosen between a new value and an old one stands for the new.
    """
    if not rows:
        return Collapsed(graph, list(parts))
    found = _Finder(graph, parts).found(rows)
    while True:
        order, stuck = _ordered(graph, parts, found)
        if not stuck:
            return _built(graph, parts, found, order)
        found = [row for k, row in enumerate(found) if k not in stuck]


@dataclass
class _Finder:
    """The search for operations that correspond."""

    graph: Graph
    parts: Sequence[int]
    rows: list[Row] = field(default_factory=list)
    row_of: dict[int, int] = field(default_factory=dict)

    def found(self, known: Sequence[Row]) -> list[Row]:
        """Rows of corresponding operations: those that lead to known ones, and that follow from them."""
        for one in known:
            left = [self._new(one)]
            while left:
                row = left.pop()
                if self._alike(row):
                    self._add(row)
                    left.extend(zip(*(self.graph.nodes[k].sources for k in row), strict=True))
        while self._followed(len(known[0])):
            pass
        return self.rows

    def _new(self, row: Row) -> Row:
        """The new values where results are chosen between them and old ones."""
        kept = {node for _, node in self.graph.results}
        found = []
        for k in row:
            chosen = choice(self.graph, k) if k in kept else None
            new = [s for s in (chosen or (k, k))[1:] if s is not None and self.graph.nodes[s].code != ca.OP_INPUT]
            found.append(new[0] if len(new) == 1 else k)
        return tuple(found)

    def _alike(self, row: Row) -> bool:
        """Whether operations can be one."""
        kinds = {(self.graph.nodes[k].code, self.parts[k], len(self.graph.nodes[k].sources)) for k in row}
        free = not any(k in self.row_of for k in row) and len(set(row)) == len(row)
        return free and len(kinds) == 1 and self.graph.nodes[row[0]].code not in _GIVEN

    def _add(self, row: Row) -> None:
        self.row_of |= dict.fromkeys(row, len(self.rows))
        self.rows.append(row)

    def _followed(self, count: int) -> bool:
        """Whether operations were found that do the same with what corresponds."""
        place = {k: one for row in self.rows for one, k in enumerate(row)}
        kept = {node for _, node in self.graph.results}
        found: dict[tuple[object, ...], dict[int, int]] = defaultdict(dict)
        for k, node in enumerate(self.graph.nodes):
            ones = {place[source] for source in node.sources if source in place}
            if len(ones) != 1 or k in self.row_of or k in kept:
                continue
            key = tuple((True, self.row_of[s]) if s in place else (False, s) for s in node.sources)
            found[node.code, self.parts[k], key][ones.pop()] = k
        before = len(self.rows)
        for alike in found.values():
            if len(alike) == count:
                self._add(tuple(alike[one] for one in range(count)))
        return len(self.rows) > before


def _ordered(graph: Graph, parts: Sequence[int], rows: Sequence[Row]) -> tuple[list[int], set[int]]:
    """Nodes and rows (as -1 - row) in an order in which they can be done; rows that would wait for each other."""
    unit = list(range(len(graph.nodes)))
    for k, row in enumerate(rows):
        for member in row:
            unit[member] = -1 - k
    rank: dict[int, tuple[int, int]] = {}
    needs: dict[int, set[int]] = defaultdict(set)
    followers: dict[int, list[int]] = defaultdict(list)
    for k, node in enumerate(graph.nodes):
        rank[unit[k]] = (parts[k], k)  # of the last of a row
        needs[unit[k]] |= {unit[source] for source in node.sources}
    for name, before in needs.items():
        for source in before:
            followers[source].append(name)
    ready = [(rank[name], name) for name, before in needs.items() if not before]
    heapq.heapify(ready)
    order = []
    while ready:
        _, name = heapq.heappop(ready)
        order.append(name)
        for follower in followers[name]:
            needs[follower].discard(name)
            if not needs[follower]:
                heapq.heappush(ready, (rank[follower], follower))
    done = set(order)
    return order, {-1 - name for name in needs if name < 0 and name not in done}


def _built(graph: Graph, parts: Sequence[int], rows: Sequence[Row], order: Sequence[int]) -> Collapsed:
    new, part, each = Graph(), list[int](), set[int]()
    made: dict[object, int] = {}
    place = {k: (row, one) for row, members in enumerate(rows) for one, k in enumerate(members)}

    def add(name: object, node: Node, of: int) -> int:
        if name not in made:
            made[name] = new.add(node)
            part.append(of)
        return made[name]

    def single(k: int, of: int) -> int:
        """A node for those that need one value."""
        if k not in place:
            return made[k]
        row, one = place[k]
        return add(("take", k), Node(TAKE, (made[-1 - row],), value=float(one)), parts[k])

    def operand(row: Row, of: int) -> int:
        """A node for an operation of each."""
        if row[0] in place and rows[place[row[0]][0]] == row:
            return made[-1 - place[row[0]][0]]
        if len(set(row)) == 1:
            return single(row[0], of)
        sources = tuple(single(k, of) for k in row)
        gathered = add(("gather", row), Node(GATHER, sources), max(parts[k] for k in row))
        each.add(gathered)
        return gathered

    for name in order:
        if name >= 0:
            node = graph.nodes[name]
            add(name, replace(node, sources=tuple(single(k, parts[name]) for k in node.sources)), parts[name])
        else:
            row = rows[-1 - name]
            of, columns = parts[row[0]], zip(*(graph.nodes[k].sources for k in row), strict=True)
            node = Node(graph.nodes[row[0]].code, tuple(operand(column, of) for column in columns))
            each.add(add(name, node, of))
    new.results = [(output, single(k, parts[k])) for output, k in graph.results]
    return Collapsed(new, part, frozenset(each))


def takes(graph: Graph) -> Iterator[tuple[int, int]]:
    """Nodes that are taken of one, with the node that they are of."""
    return ((k, node.sources[0]) for k, node in enumerate(graph.nodes) if node.code == TAKE)
