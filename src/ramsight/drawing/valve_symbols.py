"""Symbols of ISO 1219-1 for valves: check, piloted check, relief, seat and directional valve.

Each is drawn as it rests without command, about its middle; ports are named as the part names its nodes.
"""

from __future__ import annotations

from ramsight.drawing.part_symbols import arrow_head
from ramsight.drawing.shapes import Area, Disc, Line, Point, Shape, Symbol, Word

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
