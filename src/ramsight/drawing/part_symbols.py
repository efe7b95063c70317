"""Symbols of ISO 1219-1 for what turns, moves, carries, stores and measures.

Each function draws one symbol about its middle; ports are named as the part names its nodes.
"""

from __future__ import annotations

import math

from ramsight.drawing.shapes import Area, Disc, Line, Point, Shape, Symbol, Word, arc

PUMP_RADIUS = 27.0
MOTOR_RADIUS = 25.0
SHAFT = 2.5  # half the distance of a shaft's two lines
BARREL = 66.0  # outer height of a cylinder
ROD_BEYOND = 70.0  # that is seen of a rod


def arrow_head(tip: Point, towards: Point, length: float = 8.0) -> Area:
    """A filled arrow head whose tip points away from a place."""
    dx, dy = tip[0] - towards[0], tip[1] - towards[1]
    size = math.hypot(dx, dy)
    ux, uy = dx / size, dy / size
    base = tip[0] - length * ux, tip[1] - length * uy
    half = 0.35 * length
    return Area((tip, (base[0] - half * uy, base[1] + half * ux), (base[0] + half * uy, base[1] - half * ux)), "ink")


def pump(*, reversible: bool) -> Symbol:
    """A pump of fixed displacement; reversible: it delivers either way, as a pump-motor with two directions of flow."""
    r = PUMP_RADIUS
    up = Area(((0.0, -r), (-8.5, 13.0 - r), (8.5, 13.0 - r)), "ink")
    down = Area(((0.0, r), (-8.5, r - 13.0), (8.5, r - 13.0)), "ink")
    return Symbol((Disc((0.0, 0.0), r), up, *((down,) if reversible else ())), {"outlet": (0.0, -r), "inlet": (0.0, r)})


def load_sensing_pump() -> Symbol:
    """A pump of variable displacement that turns one way; the dashed line beside it is what its control answers."""
    r = PUMP_RADIUS
    fixed = pump(reversible=False)
    tilted = Line(((-r - 6.0, r - 2.0), (r + 6.0, 2.0 - r)), "thin"), arrow_head((r + 6.0, 2.0 - r), (-r, r), 9.0)
    line = Line(((0.7 * r, 0.7 * r), (r + 4.0, 0.7 * r), (r + 4.0, r + 8.0)), "pilot")
    return Symbol((*fixed.shapes, *tilted, line), {**fixed.ports, "pilot": (r + 4.0, r + 8.0)})


def motor() -> Symbol:
    """An electric motor."""
    return Symbol((Disc((0.0, 0.0), MOTOR_RADIUS), Word((0.0, 7.0), "M", "letter", "middle")), {})


def shaft(begin: float, end: float, *, both_ways: bool) -> tuple[Shape, ...]:
    """A level shaft at height 0 with the arrow of its rotation: on the front of the shaft, one head or two."""
    middle = 0.5 * (begin + end)
    rim = arc((middle - 4.0, 0.0), 13.0, -62.0, 62.0)
    heads = [arrow_head(rim[0], rim[2], 7.0), *([arrow_head(rim[-1], rim[-3], 7.0)] if both_ways else [])]
    lines = (Line(((begin, side * SHAFT), (end, side * SHAFT)), "thin") for side in (-1.0, 1.0))
    return (*lines, Line(rim, "thin"), *heads)


def cylinder(
    port_a: float, port_b: float, rod: float, rod_a: float, cushions: tuple[bool, bool] = (False, False)
) -> Symbol:
    """A double-acting cylinder that lies, its ports below; rods in their true proportion to the bore.

    Args:
        port_a: where the piston side's port is along it.
        port_b: where the rod side's is.
        rod: diameter over the bore's.
        rod_a: of a second rod through the A side; 0 for none.
        cushions: whether there are end cushions on side A and side B.
    """
    half, left, right = 0.5 * BARREL, port_a - 30.0, port_b + 30.0
    piston = left + 0.42 * (right - left)
    shapes: list[Shape] = [Area(((left, -half), (right, -half), (right, half), (left, half)))]
    for diameter, begin, end in ((rod, piston, right + ROD_BEYOND), (rod_a, left - ROD_BEYOND, piston)):
        if diameter > 0.0:
            h = half * diameter
            shapes.append(Area(((begin, -h), (end, -h), (end, h), (begin, h))))
    shapes.append(Area(((piston - 7, -half), (piston + 7, -half), (piston + 7, half), (piston - 7, half))))
    for there, x, towards in zip(cushions, (piston - 7.0, piston + 7.0), (-1.0, 1.0), strict=True):
        if there:
            end, h = x + towards * 9.0, 0.5 * half
            shapes.append(Area(((x, -h), (end, -h), (end, h), (x, h))))
    return Symbol(tuple(shapes), {"node_a": (port_a, half), "node_b": (port_b, half)})


def load(at: float, *, outwards: bool, either: bool) -> tuple[Shape, ...]:
    """The mass at a rod's end and the way that a positive load pushes it; either: it resists both ways."""
    block = Area(((at, -24.0), (at + 26.0, -24.0), (at + 26.0, 24.0), (at, 24.0)), "load")
    begin, end = at + 32.0, at + 66.0
    heads = [arrow_head((end, 0.0), (begin, 0.0), 11.0)] if outwards or either else []
    heads += [arrow_head((begin, 0.0), (end, 0.0), 11.0)] if either or not outwards else []
    return block, Line(((begin + 3.0, 0.0), (end - 3.0, 0.0))), *heads


def hose() -> Symbol:
    """A flexible line."""
    bow = tuple((-13.0 * math.sin(math.pi * k / 12), -26.0 + 52.0 * k / 12) for k in range(13))
    ends = Disc((0.0, -26.0), 2.6, "ink"), Disc((0.0, 26.0), 2.6, "ink")
    return Symbol((Line(bow), *ends), {"outlet": (0.0, -26.0), "inlet": (0.0, 26.0)})


def accumulator() -> Symbol:
    """A gas-loaded accumulator with a separator, its port below."""
    top, bottom = arc((0.0, -14.0), 15.0, 180.0, 360.0), arc((0.0, 14.0), 15.0, 0.0, 180.0)
    gas = Area(((-6.0, -22.0), (6.0, -22.0), (0.0, -12.0)))
    return Symbol(
        (Area((*top, *bottom)), Line(((-15.0, 0.0), (15.0, 0.0))), gas, Line(((0.0, 29.0), (0.0, 38.0)))),
        {"node": (0.0, 38.0)},
    )


def tank() -> Symbol:
    """A tank with a line that ends below the oil's level."""
    walls = Line(((-22.0, 2.0), (-22.0, 20.0), (22.0, 20.0), (22.0, 2.0)))
    return Symbol((walls, Line(((0.0, -8.0), (0.0, 14.0)))), {"node": (0.0, -8.0)})


def orifice() -> Symbol:
    """An orifice whose flow does not depend on viscosity: two edges on the line."""
    edges = (Line(((s * 10.0, -9.0), (s * 3.0, 0.0), (s * 10.0, 9.0))) for s in (-1.0, 1.0))
    return Symbol((Line(((0.0, -16.0), (0.0, 16.0))), *edges), {"outlet": (0.0, -16.0), "inlet": (0.0, 16.0)})


def pressure_sensor() -> Symbol:
    """A pressure transducer, beside the line that it belongs to."""
    return Symbol((Disc((0.0, 0.0), 13.0), Word((0.0, 4.0), "p", "name", "middle")), {"node": (-13.0, 0.0)})


def thermometer() -> Symbol:
    """A thermometer, above its line."""
    stem = Line(((0.0, -8.0), (0.0, 3.0)))
    return Symbol((Disc((0.0, 0.0), 13.0), stem, Disc((0.0, 5.0), 2.8, "ink")), {"node": (0.0, 13.0)})


def box() -> Symbol:
    """A part that has no symbol of its own: a box between two nodes."""
    square = Area(((-20.0, -20.0), (20.0, -20.0), (20.0, 20.0), (-20.0, 20.0)))
    return Symbol((square, Word((0.0, 7.0), "?", "letter", "middle")), {"outlet": (0.0, -20.0), "inlet": (0.0, 20.0)})
