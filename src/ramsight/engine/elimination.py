"""Sparse elimination of (c I - J) k = b, written out symbolically so that only the entries that exist are touched.

Pivots stay on the diagonal: c = 1/(h gamma) is large against the entries of a dissipative system where it has to be.
The order of elimination is the one of least fill (Markowitz), and among those the one in which fewest pivots wait for
each other: a processor divides for two of them at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True)
class Elimination:
    """The factorisation and the solution as SX functions."""

    factor: ca.Function  # (J nonzeros, c) -> factors
    solve: ca.Function  # (factors, b) -> k
    n_factors: int  # number of entries of the factors


def _order(rows: list[set[int]]) -> list[int]:
    """Pivots in the order of least Markowitz count, then of how many others each has to wait for, then by index."""
    rows = [set(row) for row in rows]
    left = set(range(len(rows)))
    order, waits = [], [0] * len(rows)
    while left:
        count = {i: (len(rows[i] & left) - 1) * (sum(i in rows[r] for r in left) - 1) for i in left}
        pivot = min(left, key=lambda i: (count[i], waits[i], i))
        order.append(pivot)
        left.remove(pivot)
        for r in left:
            if pivot in rows[r]:
                rows[r] |= rows[pivot] & left
                waits[r] = max(waits[r], waits[pivot] + 1)
    return order


def eliminate(sparsity: ca.Sparsity) -> Elimination:
    """Write out factorisation and solution for a Jacobian of this sparsity (n by n).

    Example:
        >>> import casadi as ca
        >>> e = eliminate(ca.Sparsity.dense(2, 2))
        >>> w = e.factor([0.0, 1.0, 2.0, 0.0], 3.0)   # J = [[0, 2], [1, 0]], c = 3
        >>> [round(float(v), 12) for v in ca.vertsplit(e.solve(w, [7.0, 0.0]))]   # 3a - 2b = 7, -a + 3b = 0
        [3.0, 1.0]
    """
    n = sparsity.size1()
    jacobian = ca.SX.sym("j", sparsity.nnz())
    c = ca.SX.sym("c")
    row_of, column_of = sparsity.get_triplet()
    entries: dict[tuple[int, int], Any] = {(i, i): c for i in range(n)}
    for k, (i, j) in enumerate(zip(row_of, column_of, strict=True)):
        entries[i, j] = entries.get((i, j), 0.0) - jacobian[k]
    pattern = [{j for (i, j) in entries if i == row} for row in range(n)]
    order = _order(pattern)
    rank = {pivot: position for position, pivot in enumerate(order)}
    for pivot in order:
        inverse = 1.0 / entries[pivot, pivot]
        later = sorted(j for j in pattern[pivot] if rank[j] > rank[pivot])
        for i in order[rank[pivot] + 1 :]:
            if pivot not in pattern[i]:
                continue
            for j in later:
                # The inverse last: it is known last, and the next pivot waits for this.
                update = entries[i, pivot] * entries[pivot, j] * inverse
                entries[i, j] = entries[i, j] - update if j in pattern[i] else -update
                pattern[i].add(j)
        entries[pivot, pivot] = inverse
        for j in later:
            entries[pivot, j] = entries[pivot, j] * inverse
    places = sorted(entries)
    factors = ca.SX.sym("w", len(places))
    w = {place: factors[k] for k, place in enumerate(places)}
    b = ca.SX.sym("b", n)
    k_ = [b[i] for i in range(n)]
    for i in order:
        for j in sorted(pattern[i], key=rank.__getitem__):
            if rank[j] < rank[i]:
                k_[i] = k_[i] - w[i, j] * k_[j]
        k_[i] = k_[i] * w[i, i]
    for i in reversed(order):
        for j in sorted(pattern[i], key=rank.__getitem__, reverse=True):
            if rank[j] > rank[i]:
                k_[i] = k_[i] - w[i, j] * k_[j]
    options = {"cse": True}
    factor = ca.Function(
        "factor", [jacobian, c], [ca.vertcat(*(entries[place] for place in places))], ["jac", "c"], ["w"], options
    )
    solve = ca.Function("solve", [factors, b], [ca.vertcat(*k_)], ["w", "b"], ["b_new"], options)
    return Elimination(factor, solve, len(places))
