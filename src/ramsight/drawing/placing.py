"""How symbols are turned, mirrored and moved to where they are wanted, and the cylinder in its proportions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ramsight.drawing import part_symbols
from ramsight.drawing.elements import Element
from ramsight.drawing.shapes import Shape, Symbol, Word, through
from ramsight.plant.cylinder import Cylinder

_SECOND_ROD = 0.55  # diameter over the bore's of a rod with another one at its other side


def upright(element: Element, top: str) -> Symbol:
    """A symbol whose port of one node is above."""
    symbol = element.symbol
    above = min((p for p in symbol.ports if p in ("inlet", "outlet")), key=lambda p: symbol.ports[p][1])
    return symbol if element.ends[above] == top else symbol.upside_down()


def lying(element: Element, left: str) -> Symbol:
    """A symbol that lies, with its port of one node at its left."""
    symbol = element.symbol.lying()
    first = min((p for p in symbol.ports if p in ("inlet", "outlet")), key=lambda p: symbol.ports[p][0])
    return symbol if element.ends[first] == left else symbol.mirrored()


def swapped(symbol: Symbol) -> Symbol:
    """A directional valve with its ports A and B exchanged, their letters too."""
    letters = {"A": "B", "B": "A"}
    shapes = (replace(s, text=letters.get(s.text, s.text)) if isinstance(s, Word) else s for s in symbol.shapes)
    ports = {**symbol.ports, "port_a": symbol.ports["port_b"], "port_b": symbol.ports["port_a"]}
    return Symbol(tuple(shapes), ports)


def moved(shapes: Sequence[Shape], x: float, y: float) -> list[Shape]:
    """Shapes that belong to no part, at another place."""
    return [through(lambda p: (p[0] + x, p[1] + y), shape) for shape in shapes]


def cylinder_symbol(c: Cylinder, port_a: float, port_b: float) -> Symbol:
    """The cylinder with rods whose thickness makes its areas true in their ratio.

    Areas alone do not tell a second rod: there is one, at side A, if area B is not the smaller one.
    """
    if c.area_b < c.area_a:
        rod, rod_a = math.sqrt(1.0 - c.area_b / c.area_a), 0.0
    else:
        rod, rod_a = _SECOND_ROD, math.sqrt(1.0 - c.area_a / c.area_b * (1.0 - _SECOND_ROD**2))
    cushions = c.cushion_length_a is not None, c.cushion_length_b is not None
    return part_symbols.cylinder(port_a, port_b, rod, rod_a, cushions)
