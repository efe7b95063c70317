"""Real branches for what is seldom needed: operations that only one case of a condition uses run in that case alone.

A graph chooses between two values that are both computed. Where much is computed for one of them and for nothing else,
as what a sensor learns at a contact, it becomes the body of a branch; little is cheaper without one.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.graph import SELECT, Graph

_LEAST = 60  # operations; a branch that is foreseen wrongly costs about twenty
# What one counts as, in operations: others count as one.
_WEIGHTS = dict.fromkeys((ca.OP_DIV, ca.OP_INV, ca.OP_SQRT), 5)
_WEIGHTS |= dict.fromkeys((ca.OP_EXP, ca.OP_LOG, ca.OP_TANH, ca.OP_POW, ca.OP_CONSTPOW), 20)
_FREE = {ca.OP_INPUT, ca.OP_CONST}


@dataclass(frozen=True)
class Branch:
    """Operations that wait for a condition."""

    condition: int  # its place in the graph
    then: tuple[int, ...]  # operations that only its truth needs, in order
    otherwise: tuple[int, ...]  # operations that only its being false needs
    # the choices behind them, by place: what each is then and otherwise; None is zero
    chosen: dict[int, tuple[int, int | None]]

    def all(self) -> set[int]:
        """Every operation of the branch."""
        return {*self.then, *self.otherwise, *self.chosen}


def choice(graph: Graph, place: int) -> tuple[int, int, int | None] | None:
    """Condition and both values of a choice, None for a zero; None if it is no choice."""
    node = graph.nodes[place]
    if node.code == SELECT:
        condition, then, otherwise = node.sources
        return condition, then, otherwise
    if node.code == ca.OP_IF_ELSE_ZERO:
        return node.sources[0], node.sources[1], None
    return None


def schedule(graph: Graph, parts: Sequence[int] | None = None, varying: Collection[int] = ()) -> list[int | Branch]:
    """All operations in an order in which they can be done, the seldom ones in branches.

    Args:
        parts: number of each operation's part, never less than that of what it needs; no branch has choices of two
            parts. By default all of it is one.
        varying: conditions that no branch is made of, as they are of several runs.
    """
    users: dict[int, list[int]] = defaultdict(list)
    for k, node in enumerate(graph.nodes):
        for source in node.sources:
            users[source].append(k)
    for _, k in graph.results:
        users[k].append(-1)
    groups = _groups(graph, users, parts or [0] * len(graph.nodes))
    # Branches that can be ordered all together can be one after the other: a circle of some is one of all.
    found = _scheduled(graph, users, groups, varying, one_by_one=False)
    return found or _scheduled(graph, users, groups, varying, one_by_one=True) or []


def _scheduled(
    graph: Graph,
    users: dict[int, list[int]],
    groups: list[tuple[int, list[int]]],
    varying: Collection[int],
    *,
    one_by_one: bool,
) -> list[int | Branch] | None:
    """All operations in order, with the branches that are worth it; None if they would have to wait for each other.

    Args:
        one_by_one: whether a branch that has to wait for itself is left out.
    """
    branches: list[Branch] = []
    taken: set[int] = set()
    for condition, members in groups:
        branch = _branch_without_parts(graph, users, condition, members, taken, groups)
        if (
            condition in varying
            or _cost(graph, branch) < _LEAST
            or (one_by_one and _ordered(graph, [*branches, branch]) is None)
        ):
            continue
        branches.append(branch)
        taken |= branch.all()
    return _ordered(graph, branches)


def _groups(graph: Graph, users: dict[int, list[int]], parts: Sequence[int]) -> list[tuple[int, list[int]]]:
    """Choices that could be one branch, those that leave most out first."""
    together: dict[tuple[int, int], list[int]] = defaultdict(list)
    for k in range(len(graph.nodes)):
        found = choice(graph, k)
        if found is not None:
            together[found[0], parts[k]].append(k)
    costly = []
    for (condition, _), members in together.items():
        if _cost(graph, _branch(graph, users, condition, members, set())) < _LEAST:
            continue
        for level in _levels(graph, members):
            cost = _cost(graph, _branch(graph, users, condition, level, set()))
            if not _keeps(graph, level):
                costly.append((-cost, condition, level))
    return [(condition, members) for _, condition, members in sorted(costly)]


def _keeps(graph: Graph, members: list[int]) -> bool:
    """Whether the choices are between new results and what was read: a step that is undone, which is seldom."""
    results = {k for _, k in graph.results}
    choices = [found for found in (choice(graph, k) for k in members) if found is not None]
    read = [[k is not None and graph.nodes[k].code == ca.OP_INPUT for k in found[1:]] for found in choices]
    return results.issuperset(members) and any(all(one[case] for one in read) for case in (0, 1))


def _levels(graph: Graph, members: list[int]) -> list[list[int]]:
    """Choices by how many others of them stand before each: those of one level do not depend on each other."""
    among, first = set(members), min(members)
    depth = [0] * len(graph.nodes)
    levels: dict[int, list[int]] = defaultdict(list)
    for k in range(first, max(members) + 1):  # what stands before the first of them depends on none
        deepest = 0
        for source in graph.nodes[k].sources:
            if source >= first:
                deepest = max(deepest, depth[source] + (source in among))
        depth[k] = deepest
        if k in among:
            levels[deepest].append(k)
    return [levels[depth] for depth in sorted(levels)]


def _branch(
    graph: Graph,
    users: dict[int, list[int]],
    condition: int,
    members: Iterable[int],
    taken: set[int],
    left: Collection[int] = (),
) -> Branch:
    """The choices with all that nothing else needs, but without what is left to others and what these need."""
    chosen = {}
    for k in members:
        found = choice(graph, k)
        if found is not None and k not in taken:
            chosen[k] = found[1:]
    others = taken.union(left)
    then = _only_for(graph, users, chosen, 0, others)
    otherwise = _only_for(graph, users, chosen, 1, others | then)
    return Branch(condition, tuple(sorted(then)), tuple(sorted(otherwise)), chosen)


def _branch_without_parts(
    graph: Graph,
    users: dict[int, list[int]],
    condition: int,
    members: Iterable[int],
    taken: set[int],
    groups: Sequence[tuple[int, list[int]]],
) -> Branch:
    """A branch that has no part of another one in it: what that leaves out would have to be worked out for the rest."""
    left: set[int] = set()
    while True:
        branch = _branch(graph, users, condition, members, taken, left)
        inside = branch.all()
        parts = (inside.intersection(other) for _, other in groups if not inside.issuperset(other))
        more = set().union(*parts) - set(branch.chosen)
        if not more:
            return branch
        left |= more


def _only_for(
    graph: Graph, users: dict[int, list[int]], chosen: dict[int, tuple[int, int | None]], case: int, taken: set[int]
) -> set[int]:
    """Nodes that nothing needs but one case of the choices."""
    found: set[int] = set()
    left: list[int | None] = [values[case] for values in chosen.values()]

    def is_only(node: int, user: int) -> bool:
        if user in found:
            return True
        return user in chosen and chosen[user][case] == node and graph.nodes[user].sources.count(node) == 1

    while left:
        k = left.pop()
        if k is None or k in found or k in taken or k in chosen:
            continue
        if all(is_only(k, user) for user in users[k]):
            found.add(k)
            left.extend(graph.nodes[k].sources)
    return found


def _cost(graph: Graph, branch: Branch) -> int:
    """What a branch leaves out at most [operations]."""

    def of(nodes: tuple[int, ...]) -> int:
        codes = [graph.nodes[k].code for k in nodes]
        return sum(0 if code in _FREE else _WEIGHTS.get(code, 1) for code in codes)

    return max(of(branch.then), of(branch.otherwise))


def _ordered(graph: Graph, branches: list[Branch]) -> list[int | Branch] | None:
    """Operations and branches, each behind what it needs; None if two would have to wait for each other."""
    unit = list(range(len(graph.nodes)))  # a branch is one unit, named by its last choice
    by_name = {max(branch.chosen): branch for branch in branches}
    for name, branch in by_name.items():
        for k in branch.all():
            unit[k] = name
    needs: dict[int, set[int]] = {}
    followers: dict[int, list[int]] = defaultdict(list)
    for name in dict.fromkeys(unit):
        inside = by_name[name].all() if name in by_name else {name}
        needs[name] = {unit[source] for k in inside for source in graph.nodes[k].sources} - {name}
        for source in needs[name]:
            followers[source].append(name)
    ready = [name for name, before in needs.items() if not before]
    heapq.heapify(ready)
    order: list[int | Branch] = []
    while ready:
        name = heapq.heappop(ready)
        order.append(by_name.get(name, name))
        for follower in followers[name]:
            needs[follower].discard(name)
            if not needs[follower]:
                heapq.heappush(ready, follower)
    return order if len(order) == len(needs) else None
