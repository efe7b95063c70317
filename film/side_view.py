"""A mechanism drawn to scale: the side view in its drawing pose, and where else it can go."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ramsight.arrays import Array
from ramsight.drawing.mechanism.bodies import Shapes, shapes
from ramsight.drawing.mechanism.bucket import DENSITY, WIDTH, Bucket
from ramsight.drawing.mechanism.scenery import COLOURS, GHOST, ROCK, Scenery, heap_radius
from ramsight.optional import needing
from ramsight.output import atomic_path
from ramsight.plant.linkage import joints, tip
from ramsight.plant.linked import LinkedMachine

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POSES = 41  # of the tip's way
_INK, _STEEL, _TYRE = "#222222", "#d9c48f", "#4a4f55"


def mechanism_figure(
    machine: LinkedMachine, path: Path, *, at: ArrayLike | None = None, ghosts: Sequence[ArrayLike] | None = None
) -> None:
    """Draw a machine's mechanism to scale, with names, pins and centres of mass.

    Args:
        machine: the machine.
        path: .png, .svg or .pdf.
        at: cylinder positions [m] of the pose that is drawn fully; by default the middles of the strokes.
        ghosts: of the poses that are drawn faintly; by default the first cylinder's ends, the others as in `at`.
    """
    with needing("figures"):
        from matplotlib.figure import Figure

    strokes = np.array([unit.cylinder.stroke for unit in machine.units])
    main = 0.5 * strokes if at is None else np.asarray(at, dtype=np.float64)
    first = np.eye(len(strokes))[0]
    others = [main + first * (end - main) for end in (0.0 * strokes, strokes)] if ghosts is None else ghosts
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    axes = figure.add_subplot(aspect="equal")
    for other in others:
        draw_shapes(axes, shapes(machine.mechanism, other), 0.25)
    whole = shapes(machine.mechanism, main)
    draw_shapes(axes, whole)
    name_parts(axes, whole)
    way = np.column_stack([np.linspace(0.0, strokes[0], _POSES)] + [np.full(_POSES, x) for x in main[1:]])
    axes.plot(*tip(machine.mechanism, joints(machine.mechanism, way)).T, ":", color=_INK, lw=1.0)
    draw_ground(axes)
    axes.margins(0.06)
    axes.set(xlabel="forward [m]", ylabel="up [m]", title=f"{machine.name}: mechanism, to scale")
    axes.grid(color="#dddddd", lw=0.5)
    axes.set_axisbelow(True)
    with atomic_path(path) as draft:
        figure.savefig(draft, dpi=130, format=path.suffix.removeprefix("."))


def draw_shapes(axes: Axes, seen: Shapes, strength: float = 1.0, *, ghost: bool = False) -> None:
    """Draw a mechanism into axes of equal scales.

    Args:
        axes: matplotlib's.
        seen: the mechanism in one pose.
        strength: 1 for full colour, less for a faint one.
        ghost: dashed outlines in one colour, as of an estimate.
    """
    if ghost:
        dashed: dict[str, Any] = {"color": GHOST, "lw": 1.2, "ls": "--", "zorder": 6}
        for places in (*seen.bodies.values(), *seen.links):
            axes.plot(*np.vstack([places, places[:1]]).T, **dashed)
        for strut in seen.struts:
            axes.plot(*np.array([strut.base, strut.rod]).T, **dashed)
        return
    for colour, places in zip(COLOURS * len(seen.bodies), seen.bodies.values(), strict=False):
        axes.fill(*places.T, facecolor=colour, edgecolor=colour, alpha=0.45 * strength, lw=2.0, zorder=2)
    for places in seen.links:
        axes.plot(*places.T, "-", color=_INK, lw=2.0, alpha=strength, zorder=3)
    for strut in seen.struts:
        axes.plot(*np.array([strut.barrel_end, strut.rod]).T, "-", color="#777777", lw=3.0, alpha=strength, zorder=3)
        axes.plot(*np.array([strut.base, strut.barrel_end]).T, "-", color="#b03030", lw=7.0, alpha=strength, zorder=4)
    for place in (*seen.pivots, *seen.frame, *(end for strut in seen.struts for end in (strut.base, strut.rod))):
        axes.plot(*place, "o", color="white", mec=_INK, ms=5.0, alpha=strength, zorder=5)


def draw_scenery(axes: Axes, around: Scenery) -> None:
    """Draw chassis, wheels and ground into axes of equal scales, behind all else."""
    with needing("figures"):
        from matplotlib.patches import Circle

    axes.fill(*around.chassis.T, facecolor=_STEEL, edgecolor=_INK, lw=1.0, zorder=0)
    for wheel in around.wheels:
        axes.add_patch(Circle(_pair(wheel), around.radius, facecolor=_TYRE, zorder=0.5))
        axes.add_patch(Circle(_pair(wheel), 0.45 * around.radius, facecolor=_STEEL, zorder=0.6))


def draw_ground(axes: Axes) -> None:
    """Draw the ground, z = 0."""
    axes.axhline(0.0, color="#8a7a66", lw=1.5)


def draw_rock(axes: Axes, seen: Shapes, payload: float) -> None:
    """Draw a payload [kg] by its volume: in the bucket, or as a round heap where it acts."""
    with needing("figures"):
        from matplotlib.patches import Circle

    if payload > 0.0 and seen.bucket is not None:
        axes.fill(*rock(seen.bucket, payload).T, facecolor=ROCK, alpha=0.75, zorder=1)
    elif payload > 0.0 and seen.load is not None:
        axes.add_patch(Circle(_pair(seen.load), heap_radius(payload), color=ROCK, alpha=0.6, zorder=1))


def rock(shell: Bucket, payload: float) -> Array:
    """Outline of so much rock [kg] in a bucket, over the bucket's width; shape (corners, 2).

    Less than a struck bucket lies in its back corner; more is heaped on it.
    """
    middle = len(shell.inside) // 2  # its back corner
    wanted = max(payload, 0.0) / (DENSITY * WIDTH)
    if wanted <= shell.struck:
        corner = shell.inside[middle]
        return np.asarray(corner + np.sqrt(wanted / shell.struck) * (shell.inside - corner))
    lip, top = shell.inside[0], shell.inside[-1]
    chord = top - lip
    size = float(np.linalg.norm(chord))
    out = np.array([chord[1], -chord[0]]) / size
    if float(out @ (shell.inside[middle] - lip)) > 0.0:
        out = -out
    share = np.linspace(1.0, 0.0, 2 * middle)[:, None]
    # The corners of a parabola hold a little less than the parabola does.
    full = 4.0 * share * (1.0 - share)
    held = float(np.trapezoid(full[::-1, 0], share[::-1, 0])) * size
    heap = lip + share * chord + full * ((wanted - shell.struck) / held) * out
    return np.concatenate([shell.inside, heap[1:-1]])


def name_parts(axes: Axes, seen: Shapes) -> None:
    """Write the names of bodies, cylinders, payload and tip beside them.

    Args:
        axes: matplotlib's.
        seen: the mechanism in the pose that is drawn.
    """
    for name, place in seen.centres.items():
        axes.plot(*place, "P", color=_INK, ms=6.0, zorder=6)
        axes.annotate(name, _pair(place), (4, -11), textcoords="offset points", fontsize=8, zorder=7)
    for strut in seen.struts:
        middle = 0.5 * (strut.base + strut.rod)
        low = any(np.array_equal(strut.base, pin) for pin in seen.frame)  # its name goes where no body is
        axes.annotate(
            f"cylinder of {strut.name}",
            _pair(middle),
            (10, -12) if low else (0, 7),
            textcoords="offset points",
            ha="left" if low else "center",
            color="#b03030",
            fontsize=8,
        )
    if seen.load is not None:
        axes.plot(*seen.load, "v", color="#1b5fc9", ms=7.0, zorder=6)
        axes.annotate("payload", _pair(seen.load), (6, 6), textcoords="offset points", color="#1b5fc9", fontsize=8)
    axes.annotate("tip", _pair(seen.tip), (4, -12), textcoords="offset points", fontsize=8)
    for place in seen.frame:
        axes.plot(*place, "s", color="none", mec=_INK, ms=9.0, zorder=6)


def _pair(place: Array) -> tuple[float, float]:
    return float(place[0]), float(place[1])
