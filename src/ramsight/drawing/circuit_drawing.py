"""A finished drawing: symbols at their places, lines of each node between them, and words."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

from ramsight.drawing.elements import Element
from ramsight.drawing.shapes import Box, Point, Shape, Symbol, Word, around, points_of

MARGIN = 18.0
DOT = 3.0  # radius of what joins lines


@dataclass(frozen=True)
class Placed:
    """A part where it is drawn."""

    name: str
    kind: str
    symbol: Symbol  # turned and moved to its place
    ends: dict[str, str]  # node at each port
    words: tuple[Word, ...]


@dataclass(frozen=True)
class Wire:
    """A straight line of a node, level or upright; style "line", or "pilot" for what only signals."""

    node: str
    begin: Point
    end: Point
    style: str = "line"

    @property
    def is_level(self) -> bool:
        """Whether it runs from left to right; else it is upright."""
        return self.begin[1] == self.end[1]


@dataclass
class Sheet:
    """A drawing."""

    title: str
    placed: list[Placed] = field(default_factory=list)
    wires: list[Wire] = field(default_factory=list)
    others: list[Shape] = field(default_factory=list)  # shapes that belong to no part, such as shafts
    words: list[Word] = field(default_factory=list)  # names of nodes, the title

    def put(self, element: Element, symbol: Symbol, words: tuple[Word, ...]) -> Symbol:
        """Add a part; gives its symbol back."""
        self.placed.append(Placed(element.name, element.kind, symbol, dict(element.ends), words))
        return symbol

    def run(self, node: str, *points: Point, style: str = "line") -> None:
        """Add a node's line through points, each level with or upright over the one before."""
        for begin, end in pairwise(points):
            if begin != end:
                self.wires.append(Wire(node, begin, end, style))

    @property
    def box(self) -> Box:
        """The rectangle of everything, with a margin."""
        points: list[Point] = [point for wire in self.wires for point in (wire.begin, wire.end)]
        for one in self.placed:
            left, top, right, bottom = one.symbol.box
            points += [(left, top), (right, bottom)]
            points += [point for word in one.words for point in points_of(word)]
        points += [point for shape in (*self.others, *self.words) for point in points_of(shape)]
        left, top, right, bottom = around(points)
        return left - MARGIN, top - MARGIN, right + MARGIN, bottom + MARGIN

    def tidy(self) -> None:
        """Join the pieces of a node's lines that lie on one another or go on straight."""
        kinds = sorted({(wire.node, wire.style) for wire in self.wires})
        self.wires = [
            wire
            for node, style in kinds
            for wire in _joined([w for w in self.wires if (w.node, w.style) == (node, style)])
        ]

    @property
    def junctions(self) -> list[tuple[str, Point]]:
        """Dots where three or more lines of a node meet; lines that only cross have none."""
        found = []
        for node in sorted({wire.node for wire in self.wires}):
            own = [wire for wire in self.wires if wire.node == node]
            ends = [one.symbol.ports[port] for one in self.placed for port, at in one.ends.items() if at == node]
            level, upright = ([w for w in own if w.is_level is way] for way in (True, False))
            meets = {(v.begin[0], h.begin[1]) for h in level for v in upright} | set(ends)
            for point in sorted(meets):
                arms = sum(1 if point in (w.begin, w.end) else 2 for w in own if is_on(point, w))
                if arms + ends.count(point) > 2:
                    found.append((node, point))
        return found


def _joined(wires: list[Wire]) -> list[Wire]:
    """The same lines in as few pieces as can be."""
    found = []
    for level in (True, False):
        along, across = (0, 1) if level else (1, 0)
        those = [wire for wire in wires if wire.is_level is level]
        for height in sorted({wire.begin[across] for wire in those}):
            spans = sorted(
                sorted((wire.begin[along], wire.end[along])) for wire in those if wire.begin[across] == height
            )
            whole = [spans[0]]
            for begin, end in spans[1:]:
                if begin <= whole[-1][1]:
                    whole[-1][1] = max(whole[-1][1], end)
                else:
                    whole.append([begin, end])
            for begin, end in whole:
                points = ((begin, height), (end, height)) if level else ((height, begin), (height, end))
                found.append(Wire(wires[0].node, *points, style=wires[0].style))
    return found


def is_on(point: Point, wire: Wire) -> bool:
    """Whether a point lies on a line, its ends among it."""
    (x, y), (x0, y0), (x1, y1) = point, wire.begin, wire.end
    return min(x0, x1) <= x <= max(x0, x1) and min(y0, y1) <= y <= max(y0, y1)
