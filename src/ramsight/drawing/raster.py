"""A sheet as PNG or PDF, by matplotlib."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.drawing.circuit_drawing import DOT, Sheet
from ramsight.drawing.shapes import SIZES, Area, Disc, Line, Shape, Word
from ramsight.optional import needing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PER_INCH = 4.0 * 25.4  # units of a drawing an inch: a quarter of a millimetre each
_INK, _PAPER, _QUIET, _LOAD = "#1b2733", "#ffffff", "#5b6875", "#d9dee4"
_POINTS = 72.0 / _PER_INCH  # a unit of the drawing in points
_FILLS = {"ink": _INK, "paper": _PAPER, "load": _LOAD, "none": "none"}


def save(sheet: Sheet, path: Path) -> None:
    """Write a sheet to a file, at the size that its SVG has on paper; a PNG has 240 pixels an inch."""
    with needing("figures"):
        from matplotlib.figure import Figure

    left, top, right, bottom = sheet.box
    figure = Figure(figsize=((right - left) / _PER_INCH, (bottom - top) / _PER_INCH))
    paint(figure.add_axes((0.0, 0.0, 1.0, 1.0)), sheet)
    figure.savefig(path, dpi=240, format=path.suffix.removeprefix("."))


def paint(axes: Axes, sheet: Sheet, *, width: float | None = None) -> None:
    """Draw a sheet into axes that fill a figure.

    Args:
        axes: matplotlib's.
        sheet: the drawing.
        width: of the figure [inch], by which lines and words are scaled; by default that of the sheet on paper.
    """
    left, top, right, bottom = sheet.box
    scale = 1.0 if width is None else width * _PER_INCH / (right - left)
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.set_axis_off()
    for wire in sheet.wires:
        _draw(axes, Line((wire.begin, wire.end), wire.style), scale)
    for _, point in sheet.junctions:
        _draw(axes, Disc(point, DOT, "ink"), scale)
    for shape in (*sheet.others, *(s for one in sheet.placed for s in (*one.symbol.shapes, *one.words)), *sheet.words):
        _draw(axes, shape, scale)


def _draw(axes: Axes, shape: Shape, scale: float) -> None:
    """One shape, over those before it."""
    unit = scale * _POINTS
    with needing("figures"):
        from matplotlib.patches import Circle, Polygon

    order = 2.0 + 1e-3 * len(axes.get_children())
    match shape:
        case Line():
            width, dashes = (1.6, "-") if shape.style == "line" else (1.1, "-" if shape.style == "thin" else "--")
            axes.plot(*zip(*shape.points, strict=True), dashes, color=_INK, lw=width * unit, zorder=order)
        case Area():
            axes.add_patch(Polygon(shape.points, fc=_FILLS[shape.fill], ec=_INK, lw=1.6 * unit, zorder=order))
        case Disc():
            axes.add_patch(
                Circle(shape.centre, shape.radius, fc=_FILLS[shape.fill], ec=_INK, lw=1.6 * unit, zorder=order)
            )
        case Word():
            across = {"start": "left", "middle": "center", "end": "right"}[shape.anchor]
            axes.text(
                *shape.at,
                shape.text,
                size=SIZES[shape.kind] * unit,
                ha=across,
                va="baseline",
                color=_QUIET if shape.kind == "node" else _INK,
                style="italic" if shape.kind == "node" else "normal",
                weight="bold" if shape.kind in ("title", "name", "port") else "normal",
                zorder=order,
                parse_math=False,
            )
