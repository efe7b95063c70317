"""Symbols of parts and valves after ISO 1219-1.

Each function draws one symbol about its middle, a valve as it rests without command; ports are named as the part names
its nodes.
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
        rod_a: of a second rod through the A side; 0 for none.
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


_HALF = 20.0  # of a valve's square
_WIDE = 25.0  # of a directional valve's


def _square(x: float, half: float) -> Area:
    return Area(((x - half, -half), (x + half, -half), (x + half, half), (x - half, half)))


def _spring(begin: Point, end: Point, width: float = 5.0, turns: int = 5) -> Line:
    """A zigzag from one point to another, level or upright."""
    (x0, y0), (x1, y1) = begin, end
    across = (0.0, width) if y0 == y1 else (width, 0.0)
    points = [begin]
    for k in range(turns):
        share, side = (k + 0.5) / turns, 1.0 if k % 2 == 0 else -1.0
        points.append((x0 + share * (x1 - x0) + side * across[0], y0 + share * (y1 - y0) + side * across[1]))
    return Line((*points, end), "thin")


def _seat() -> tuple[Shape, ...]:
    """A ball on its seat that oil lifts from below."""
    return Line(((-11.0, -5.0), (0.0, 8.0), (11.0, -5.0))), Disc((0.0, -3.0), 7.0)


def check(*, spring: bool) -> Symbol:
    """A check valve, with its spring if it has one: free upwards."""
    above = _spring((0.0, -10.0), (0.0, -26.0)) if spring else Line(((0.0, -10.0), (0.0, -26.0)))
    return Symbol((*_seat(), above, Line(((0.0, 8.0), (0.0, 22.0)))), {"outlet": (0.0, -26.0), "inlet": (0.0, 22.0)})


def pilot_check(*, spring: bool) -> Symbol:
    """A check valve that a pilot pressure opens the other way too: the dashed line from the left lifts the ball."""
    above = _spring((0.0, -10.0), (0.0, -20.0), 4.0, 4) if spring else Line(((0.0, -10.0), (0.0, -20.0)))
    lines = Line(((0.0, 8.0), (0.0, 28.0))), Line(((0.0, -20.0), (0.0, -28.0)))
    pilot = Line(((-30.0, 13.0), (-4.0, 13.0), (-4.0, 6.0)), "pilot")
    ports = {"outlet": (0.0, -28.0), "inlet": (0.0, 28.0), "pilot": (-30.0, 13.0)}
    return Symbol((_square(0.0, _HALF), *_seat(), above, *lines, pilot), ports)


def relief() -> Symbol:
    """A direct-acting relief valve, from above to below: the pressure above it works against its spring."""
    arrow = Line(((-8.0, -20.0), (-8.0, 20.0))), arrow_head((-8.0, 20.0), (-8.0, 0.0))
    pilot = Line(((0.0, -28.0), (-30.0, -28.0), (-30.0, 0.0), (-20.0, 0.0)), "pilot")
    adjusted = Line(((23.0, 12.0), (41.0, -12.0)), "thin"), arrow_head((41.0, -12.0), (23.0, 12.0), 7.0)
    lines = Line(((0.0, -34.0), (0.0, -20.0))), Line(((0.0, 20.0), (0.0, 34.0)))
    return Symbol(
        (_square(0.0, _HALF), *arrow, pilot, _spring((20.0, 0.0), (44.0, 0.0), 6.0), *adjusted, *lines),
        {"inlet": (0.0, -34.0), "outlet": (0.0, 34.0)},
    )


def _solenoid(x: float, side: float) -> tuple[Shape, ...]:
    """A solenoid at a valve's end; side is -1 at its left, 1 at its right."""
    far = x + side * 18.0
    return (
        Area(((x, -9.0), (far, -9.0), (far, 9.0), (x, 9.0))),
        Line(((x + side * 5.0, 9.0), (x + side * 13.0, -9.0)), "thin"),
    )


def safety() -> Symbol:
    """A 2/2 seat valve: at rest a check valve that is free upwards, with its solenoid on open both ways."""
    inside = (*_seat(), Line(((0.0, -10.0), (0.0, -20.0))), Line(((0.0, 8.0), (0.0, 20.0))))
    both = (
        Line(((-40.0, -20.0), (-40.0, 20.0))),
        arrow_head((-40.0, -20.0), (-40.0, 0.0)),
        arrow_head((-40.0, 20.0), (-40.0, 0.0)),
    )
    lines = Line(((0.0, -28.0), (0.0, -20.0))), Line(((0.0, 20.0), (0.0, 28.0)))
    return Symbol(
        (
            _square(0.0, _HALF),
            _square(-2.0 * _HALF, _HALF),
            *inside,
            *both,
            *_solenoid(-3.0 * _HALF, -1.0),
            _spring((_HALF, 0.0), (_HALF + 20.0, 0.0)),
            *lines,
        ),
        {"outlet": (0.0, -28.0), "inlet": (0.0, 28.0)},
    )


def directional() -> Symbol:
    """A 4/2 valve with a solenoid at either end, drawn at command 1: from P to A and from B to T."""
    w, near = _WIDE, 12.0
    shapes: list[Shape] = [_square(-w, w), _square(w, w)]
    straight = (((-w - near, w), (-w - near, -w)), ((-w + near, -w), (-w + near, w)))
    crossed = (((w - near, w), (w + near, -w)), ((w - near, -w), (w + near, w)))
    for begin, end in (*straight, *crossed):
        shapes += [Line((begin, end)), arrow_head(end, begin)]
    shapes += [*_solenoid(-2.0 * w, -1.0), *_solenoid(2.0 * w, 1.0)]
    ports = {
        "port_a": (-w - near, -w - 8.0),
        "port_b": (-w + near, -w - 8.0),
        "pump_port": (-w - near, w + 8.0),
        "tank_port": (-w + near, w + 8.0),
    }
    for x, y in ports.values():
        shapes.append(Line(((x, y), (x, w if y > 0.0 else -w))))
    for text, x in (("1", -2.0 * w - 9.0), ("−1", 2.0 * w + 9.0)):
        shapes.append(Word((x, -14.0), text, "value", "middle"))
    for letter, (x, y), side in zip("ABPT", ports.values(), (-1.0, 1.0, -1.0, 1.0), strict=True):
        anchor = "end" if side < 0.0 else "start"
        shapes.append(Word((x + side * 4.0, y + (9.0 if y > 0.0 else -1.0)), letter, "port", anchor))
    return Symbol(tuple(shapes), ports)


def metering() -> Symbol:
    """A proportional directional valve, the lines above and below it; a dashed line leaves for the pump's control."""
    plain, w = directional(), _WIDE
    lines = [Line(((-2.0 * w, y), (2.0 * w, y)), "thin") for y in (-w - 4.0, w + 4.0)]
    sensed = Line(((1.6 * w, w), (1.6 * w, w + 16.0)), "pilot")
    return Symbol((*plain.shapes, *lines, sensed), {**plain.ports, "pilot": (1.6 * w, w + 16.0)})
