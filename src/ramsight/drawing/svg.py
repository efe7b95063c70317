"""A sheet as a file: SVG, PNG or PDF."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.drawing.circuit_drawing import DOT, Placed, Sheet, Wire
from ramsight.drawing.shapes import SIZES, Area, Disc, Line, Point, Shape, Word
from ramsight.optional import needing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PER_MM = 4.0  # units of a drawing a millimetre of paper
STYLE = """
.drawing { --ink: #1b2733; --paper: #fff; --quiet: #5b6875; --load: #d9dee4;
  font-family: "DejaVu Sans", Arial, sans-serif; }
.drawing polyline, .drawing polygon, .drawing circle, .drawing line {
  stroke: var(--ink); stroke-width: 1.6; fill: none; stroke-linejoin: round; stroke-linecap: round; }
.drawing .thin { stroke-width: 1.1; }
.drawing .pilot { stroke-width: 1.1; stroke-dasharray: 5 3; }
.drawing .ink { fill: var(--ink); }
.drawing .paper { fill: var(--paper); }
.drawing .filled { fill: var(--load); }
.drawing text { fill: var(--ink); stroke: none; }
.drawing .dot { fill: var(--ink); }
.drawing .title { font-weight: bold; }
.drawing .name, .drawing .port { font-weight: bold; }
.drawing .node-name { fill: var(--quiet); font-style: italic; }
"""
_SIZES = "".join(f".drawing .size-{kind} {{ font-size: {size:g}px; }}\n" for kind, size in SIZES.items())


def text(sheet: Sheet, sections: Mapping[str, str] | None = None) -> str:
    """The SVG of a sheet, at a quarter of a millimetre a unit.

    Groups of parts have the id ``part-NAME`` and the class of their kind, lines of nodes ``data-node``.

    Args:
        sections: by part, what it leads to: such a part is a button with that as ``data-section``, and no part has an
            id. None for a picture.
    """
    left, top, right, bottom = sheet.box
    width, height = right - left, bottom - top
    body = [f'<rect class="sheet" x="{left:g}" y="{top:g}" width="{width:g}" height="{height:g}" fill="var(--paper)"/>']
    for node in sorted({wire.node for wire in sheet.wires}):
        lines = "".join(_wire(wire) for wire in sheet.wires if wire.node == node)
        dots = "".join(
            f'<circle class="dot" cx="{x:g}" cy="{y:g}" r="{DOT:g}"/>' for at, (x, y) in sheet.junctions if at == node
        )
        body.append(f'<g class="node" data-node="{escape(node)}"><title>{escape(node)}</title>{lines}{dots}</g>')
    body += [_shape(shape) for shape in sheet.others]
    body += [_part(part, sections) for part in sheet.placed]
    body += [_shape(word) for word in sheet.words]
    role = "img" if sections is None else "group"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="drawing" role="{role}" aria-label="{escape(sheet.title)}" '
        f'width="{width / _PER_MM:.1f}mm" height="{height / _PER_MM:.1f}mm" '
        f'viewBox="{left:g} {top:g} {width:g} {height:g}">\n'
        f"<title>{escape(sheet.title)}</title>\n<style>{STYLE}{_SIZES}</style>\n" + "\n".join(body) + "\n</svg>\n"
    )


def _part(part: Placed, sections: Mapping[str, str] | None) -> str:
    """A part's group; as a button it has a surface that can be hit, between its lines, too."""
    kind = escape(part.kind.replace(" ", "-").lower())
    inside = "".join(map(_shape, (*part.symbol.shapes, *part.words)))
    title = f"<title>{escape(part.kind)} {escape(part.name)}</title>"
    if sections is None:
        return f'<g class="part {kind}" id="part-{escape(part.name)}">{title}{inside}</g>'
    if part.name not in sections:
        return f'<g class="part {kind}">{title}{inside}</g>'
    named, section = escape(f"{part.name}, {part.kind}: to its values"), escape(sections[part.name])
    left, top, right, bottom = part.symbol.box
    surface = f'<rect class="surface" x="{left:g}" y="{top:g}" width="{right - left:g}" height="{bottom - top:g}"/>'
    button = f'role="button" tabindex="0" aria-label="{named}" data-section="{section}"'
    return f'<g class="part {kind}" {button}>{title}{surface}{inside}</g>'


def _wire(wire: Wire) -> str:
    return f'<polyline class="{wire.style}" points="{_points((wire.begin, wire.end))}"/>'


def _points(points: tuple[Point, ...]) -> str:
    return " ".join(f"{x:.6g},{y:.6g}" for x, y in points)


def _shape(shape: Shape) -> str:
    match shape:
        case Line():
            return f'<polyline class="{shape.style}" points="{_points(shape.points)}"/>'
        case Area():
            fill = "filled" if shape.fill == "load" else shape.fill
            return f'<polygon class="{fill}" points="{_points(shape.points)}"/>'
        case Disc():
            (x, y), r = shape.centre, shape.radius
            return f'<circle class="{shape.fill}" cx="{x:.6g}" cy="{y:.6g}" r="{r:g}"/>'
        case Word():
            (x, y), kind = shape.at, "node-name" if shape.kind == "node" else shape.kind
            return (
                f'<text class="{kind} size-{shape.kind}" x="{x:.6g}" y="{y:.6g}" text-anchor="{shape.anchor}">'
                f"{escape(shape.text)}</text>"
            )


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
