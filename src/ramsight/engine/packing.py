"""What takes long and does not wait for others of its kind, of one run: four of them in one vector operation.

A processor divides four numbers in the time of one. A step has hundreds of divisions, roots and logarithms, each
written where it is needed; in another order most of them stand beside others of their kind.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from graphlib import TopologicalSorter

import casadi as ca

from ramsight.engine.graph import Graph

AT_ONCE = 4
"""Numbers in a vector: one register of AVX, two of SSE2 or NEON."""
_ALIKE = ((ca.OP_DIV, ca.OP_INV), (ca.OP_SQRT,), (ca.OP_EXP,), (ca.OP_LOG,), (ca.OP_TANH,), (ca.OP_POW, ca.OP_CONSTPOW))
_KINDS = {code: kind for kind, codes in enumerate(_ALIKE) for code in codes}


def packed(graph: Graph, order: Sequence[int]) -> list[tuple[int, ...]]:
    """The same operations in another order, each behind those that it needs, those of a kind together where possible.

    What takes long waits until there are four of its kind, or until all that is left waits for such.

    Example:
        >>> from ramsight.engine.cache import instructions
        >>> from ramsight.engine.graph import graph_of
        >>> x = ca.SX.sym("x", 4)
        >>> graph = graph_of(instructions(ca.Function("f", [x], [x[0] / x[1] + x[2] / x[3]])))
        >>> [len(group) for group in packed(graph, range(len(graph.nodes)))]
        [1, 1, 1, 1, 2, 1]
    """
    place = {node: n for n, node in enumerate(order)}
    needs = {n: [place[s] for s in graph.nodes[node].sources if s in place] for n, node in enumerate(order)}
    sorter = TopologicalSorter(needs)
    sorter.prepare()
    ready = sorted(sorter.get_ready())
    waiting: list[list[int]] = [[] for _ in _ALIKE]
    found: list[tuple[int, ...]] = []

    def done(group: list[int]) -> None:
        found.append(tuple(order[n] for n in group))
        sorter.done(*group)
        for n in sorter.get_ready():
            heapq.heappush(ready, n)

    while ready or any(waiting):
        if not ready:
            kind = max(waiting, key=len)
            group, kind[:] = kind[:AT_ONCE], kind[AT_ONCE:]
            done(group)
            continue
        n = heapq.heappop(ready)
        which = _KINDS.get(graph.nodes[order[n]].code)
        if which is None:
            done([n])
            continue
        kind = waiting[which]
        kind.append(n)
        if len(kind) == AT_ONCE:
            group, kind[:] = kind[:], []
            done(group)
    return found
