"""What a drawing is made of: lines, filled shapes, circles, words and symbols with ports, turned and moved."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

Point = tuple[float, float]
Box = tuple[float, float, float, float]
"""Left, top, right, bottom."""


@dataclass(frozen=True)
class Line:
    """A line through points; its style is "line", "thin" or "pilot" (dashed)."""

    points: tuple[Point, ...]
    style: str = "line"


@dataclass(frozen=True)
class Area:
    """A closed shape; its fill is "ink", "paper" or "load"."""

    points: tuple[Point, ...]
    fill: str = "paper"


@dataclass(frozen=True)
class Disc:
    """A circle; its fill is "ink", "paper" or "none"."""

    centre: Point
    radius: float
    fill: str = "paper"


@dataclass(frozen=True)
class Word:
    """A line of text, upright whatever it belongs to."""

    at: Point  # on its base line: where it begins, its middle, or where it ends
    text: str
    kind: str = "value"  # "title", "name", "value", "node", "port" or "letter"
    anchor: str = "start"  # "start", "middle" or "end"

    @property
    def box(self) -> Box:
        """The rectangle that it takes, estimated: a letter is 0.56 of its height wide, as sans-serif ones are."""
        size = SIZES[self.kind]
        width = 0.56 * size * len(self.text)
        left = self.at[0] - {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor] * width
        return left, self.at[1] - 0.8 * size, left + width, self.at[1] + 0.2 * size


SIZES = {"title": 17.0, "name": 12.0, "value": 11.0, "node": 9.5, "port": 12.0, "letter": 20.0}
"""Height of the letters; ISO 1219-2 asks for at least 2.5 mm, which is 10 here, of all but notes."""

Shape = Line | Area | Disc | Word


def arc(centre: Point, radius: float, begin: float, end: float) -> tuple[Point, ...]:
    """Points of an arc between two angles [degrees, from right towards down]."""
    count = max(2, math.ceil(abs(end - begin) / 10.0))
    angles = [math.radians(begin + (end - begin) * k / count) for k in range(count + 1)]
    return tuple((centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles)


def through(change: Callable[[Point], Point], shape: Shape) -> Shape:
    """A shape with its points changed; sizes stay."""
    if isinstance(shape, Disc):
        return replace(shape, centre=change(shape.centre))
    if isinstance(shape, Word):
        return replace(shape, at=change(shape.at))
    return replace(shape, points=tuple(change(point) for point in shape.points))


def points_of(shape: Shape) -> Iterable[Point]:
    """The points between which a shape lies."""
    if isinstance(shape, Disc):
        (x, y), r = shape.centre, shape.radius
        return (x - r, y - r), (x + r, y + r)
    if isinstance(shape, Word):
        left, top, right, bottom = shape.box
        return (left, top), (right, bottom)
    return shape.points


def around(points: Iterable[Point]) -> Box:
    """The smallest rectangle around points."""
    xs, ys = zip(*points, strict=True)
    return min(xs), min(ys), max(xs), max(ys)


@dataclass(frozen=True)
class Symbol:
    """Shapes and ports of one part; as made, its first port is above and the other below its middle."""

    shapes: tuple[Shape, ...]
    ports: Mapping[str, Point]  # where lines come to it, by the name that the part has for the node there

    @property
    def box(self) -> Box:
        """The rectangle that it takes."""
        inside = [point for shape in self.shapes for point in points_of(shape)]
        return around([*inside, *self.ports.values()])

    def moved(self, x: float, y: float) -> Symbol:
        """The symbol with its middle at another place."""
        return self._through(lambda p: (p[0] + x, p[1] + y))

    def upside_down(self) -> Symbol:
        """The symbol with top and bottom changed."""
        return self._through(lambda p: (p[0], -p[1]))

    def mirrored(self) -> Symbol:
        """The symbol with left and right changed."""
        return self._through(lambda p: (-p[0], p[1]))

    def lying(self) -> Symbol:
        """The symbol turned so that what was above is left."""
        return self._through(lambda p: (p[1], -p[0]))

    def _through(self, change: Callable[[Point], Point]) -> Symbol:
        shapes = tuple(through(change, shape) for shape in self.shapes)
        return Symbol(shapes, {name: change(port) for name, port in self.ports.items()})
