"""What flows through each line of a drawing: which parts' flows, with which sign, for whoever shows oil that moves.

A node's lines are a tree whose ends are ports. What passes a line is what all ports on one side of it bring. The little
that the node's oil is compressed by stays where it is: both sides are asked, and their mean is taken. Cylinder, tank
and accumulator take what the others bring, and so does a line that ends at the node's name: of a line between such an
end and the rest only the other side is asked.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from ramsight.drawing.circuit_drawing import Placed, Sheet, Wire, is_on
from ramsight.drawing.shapes import Point
from ramsight.plant.directional import DirectionalValve
from ramsight.plant.hose import Hose
from ramsight.plant.unit import HydraulicUnit

Flows = dict[str, float]
Ports = Mapping[Point, list[Flows | None]]
_TAKES_THE_REST = {"cylinder", "tank", "accumulator"}


@dataclass(frozen=True)
class Chain:
    """A line from one branching, or port, to the next."""

    node: str
    points: tuple[Point, ...]
    # what passes it in this direction: a sum of flows of parts, by the circuit's names without `.flow`, each with its
    # factor
    flows: Mapping[str, float]


def chains(sheet: Sheet, unit: HydraulicUnit) -> list[Chain]:
    """The lines of a drawing through which oil flows.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.drawing import drawn
        >>> from ramsight.plant.build import build
        >>> press = build(machine.load_machine("press").unit("ram"), "ram")
        >>> [dict(chain.flows) for chain in chains(drawn(press), press) if chain.node == "chamber_a"]
        [{'pipe_a': -1.0}]
    """
    parts = {part.name: part for part in unit.parts()}
    found = []
    for node in sorted({wire.node for wire in sheet.wires}):
        wires = [wire for wire in sheet.wires if wire.node == node and wire.style != "pilot"]
        ports = _ports(sheet, node, parts)
        found += _of_node(node, wires, ports)
    return found


def _ports(sheet: Sheet, node: str, parts: Mapping[str, Any]) -> dict[Point, list[Flows | None]]:
    """What each port of a node brings into it; None of one that takes the rest."""
    found: dict[Point, list[Flows | None]] = defaultdict(list)
    for placed in sheet.placed:
        for port, at in placed.ends.items():
            if at == node:
                found[placed.symbol.ports[port]].append(_brought(placed, port, parts.get(placed.name)))
    return found


def _brought(placed: Placed, port: str, part: Any) -> Flows | None:
    if placed.kind in _TAKES_THE_REST:
        return None
    if port == "pilot" or placed.kind == "sensor":
        return {}
    if isinstance(part, DirectionalValve):
        own, sums = placed.ends[port], {}
        for edge, source, target, *_ in part.edges(0.0):
            if own in (source, target):
                sums[f"{part.name}.{edge}"] = -1.0 if source == own else 1.0
        return sums
    inwards = -1.0 if port == "inlet" else 1.0
    if isinstance(part, Hose) and part.segments:
        return {f"{part.name}.{1 if port == 'inlet' else part.segments}": inwards}
    return {placed.name: inwards}


def _of_node(node: str, wires: list[Wire], ports: Ports) -> list[Chain]:
    neighbours = _graph(wires, ports)
    named: Ports = {at: [None] for at, others in neighbours.items() if len(others) == 1 and at not in ports}
    ports = {**ports, **named}
    found, seen = [], set()
    for begin in neighbours:
        if len(neighbours[begin]) == 2 and begin not in ports:
            continue
        for second in neighbours[begin]:
            points = _along(neighbours, ports, begin, second)
            if (points[-1], points[-2]) in seen:
                continue
            seen.add((points[0], points[1]))
            flows = _passing(neighbours, ports, points)
            if flows:
                found.append(Chain(node, tuple(points), flows))
    return found


def _graph(wires: list[Wire], ports: Ports) -> dict[Point, list[Point]]:
    """Which points of lines are next to each other; lines that only cross have none in common."""
    ends = {point for wire in wires for point in (wire.begin, wire.end)} | set(ports)
    found: dict[Point, list[Point]] = defaultdict(list)
    for wire in wires:
        on = sorted(point for point in ends if is_on(point, wire))
        for begin, end in pairwise(on):
            found[begin].append(end)
            found[end].append(begin)
    return dict(found)


def _along(neighbours: Mapping[Point, list[Point]], ports: Ports, begin: Point, second: Point) -> list[Point]:
    """From a branching over the next point to the next branching, port or loose end."""
    points = [begin, second]
    while len(neighbours[points[-1]]) == 2 and points[-1] not in ports:
        points.append(next(point for point in neighbours[points[-1]] if point != points[-2]))
    return points


def _passing(neighbours: Mapping[Point, list[Point]], ports: Ports, points: list[Point]) -> Flows:
    """What passes a chain; nothing where that is unknown."""
    behind = _side(neighbours, ports, points[0], points[1])
    ahead = _side(neighbours, ports, points[-1], points[-2])
    if behind is None and ahead is None:
        return {}
    weights = [(behind, 1.0), (ahead, -1.0)]
    share = 0.5 if behind is not None and ahead is not None else 1.0
    total: Flows = defaultdict(float)
    for flows, sign in weights:
        for name, factor in (flows or {}).items():
            total[name] += share * sign * factor
    return {name: factor for name, factor in total.items() if factor}


def _side(neighbours: Mapping[Point, list[Point]], ports: Ports, begin: Point, without: Point) -> Flows | None:
    """What all ports on one side of a line bring; None if one of them takes the rest."""
    total: Flows = defaultdict(float)
    waiting, seen = [begin], {begin, without}
    while waiting:
        at = waiting.pop()
        for flows in ports.get(at, ()):
            if flows is None:
                return None
            for name, factor in flows.items():
                total[name] += factor
        for point in neighbours[at]:
            if point not in seen:
                seen.add(point)
                waiting.append(point)
    return dict(total)
