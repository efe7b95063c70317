"""A symbol: its shapes, and the ports at which lines come to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ramsight.drawing.shapes import Box, Point, Shape, around, points_of, through


@dataclass(frozen=True)
class Symbol:
    """Shapes and ports of one part; as made, its first port is above and the other below its middle.

    Attributes:
        shapes: what is drawn.
        ports: where lines come to it, by the name that the part has for the node there.
    """

    shapes: tuple[Shape, ...]
    ports: Mapping[str, Point]

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
