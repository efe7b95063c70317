"""The picture of the README: a loader that lifts, the force of its rods by the motor's torque, and six weighings."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import ramsight
from ramsight.drawing.mechanism.bodies import hull, shapes
from ramsight.drawing.mechanism.scenery import ROCK, scenery
from ramsight.duty.linked_duty import simulate_linked, unit_run
from ramsight.duty.loading import lifting
from ramsight.normal import TWO_SIDED_95
from ramsight.output import atomic_path
from ramsight.plant.linkage import Mechanism
from ramsight.plant.linked import build_linked
from ramsight.tracking.figures import AS_IT_CAME, ESTIMATE, SCREEN, TRUTH

ROOT = Path(__file__).parents[1]
MACHINE, LEVEL, START = "mining-loader", 0.25, 0.07
MASSES, KNOWN = (5200.0, 6100.0, 3400.0, 7500.0, 5800.0, 4700.0), 5000.0
"""Of the shift of docs/tutorials/weigh-what-you-lift.md [kg]."""
TORQUE = 1.02
"""What its drive reports over the true torque."""
POSES = (0.07, 0.34, 0.62)
CROWN = 0.25  # m, of a heap above the edges of a bucket
STEEL, PAINT, CYLINDER, TYRE = "#8b939c", "#d9a441", "#b03030", "#3d4248"


@dataclass(frozen=True)
class Shift:
    """A shift as its drive reports it, and what was weighed."""

    track: Any  # of the boom
    plain: Any  # weighed by the description alone
    taught: Any  # weighed after one known mass


def shift() -> Shift:
    """Six lifts, and one of a known mass."""
    loader = build_linked(ramsight.load_machine(MACHINE))
    logs = []
    for masses in (MASSES, (KNOWN,)):
        log = ramsight.drive_report(unit_run(simulate_linked(loader, lifting(loader, masses)), "boom"))
        log["motor_torque"] *= TORQUE
        logs.append(log)
    how = {"start": START, "at": {"bucket": LEVEL}}
    log, known = logs
    return Shift(
        ramsight.track(MACHINE, log, unit="boom", start=START),
        ramsight.weigh(MACHINE, log, **how),
        ramsight.weigh(MACHINE, log, **how, known=[(KNOWN, known)]),
    )


def heap(inside: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Outline of the rock in a full bucket, with a crown over its edges, shape (n, 2)."""
    edge = inside[np.argmax(inside[:, 1])]
    way = tip - edge
    across = np.array([-way[1], way[0]]) * np.sign(way[0]) / np.linalg.norm(way)
    share = np.linspace(0.0, 1.0, 24)[:, None]
    crown = edge + share * way + 4.0 * CROWN * share * (1.0 - share) * across
    return hull(np.vstack([inside, crown]))


def draw_loader(axes: Any, mechanism: Mechanism, boom: float, *, shown: float) -> None:
    """The arm with a full bucket at a position of the boom's piston [m], as solid as it is to be shown."""
    from matplotlib.patches import Polygon

    seen = shapes(mechanism, [boom, LEVEL])
    assert seen.bucket is not None, "a loader has a bucket"
    colours = {"boom": PAINT, "lever": STEEL, "bucket": "#59616a"}
    style = {"closed": True, "alpha": shown, "lw": 1.2}
    axes.add_patch(Polygon(heap(seen.bucket.inside, seen.tip), fc=ROCK, ec="none", zorder=3, alpha=shown, closed=True))
    for name, outline in seen.bodies.items():
        axes.add_patch(Polygon(outline, fc=colours[name], ec=TRUTH, zorder=4, joinstyle="round", **style))
    for link in seen.links:
        axes.plot(*link.T, color=TRUTH, lw=2.4, alpha=shown, zorder=2)
    for strut in seen.struts:
        for begin, end, width, colour in (
            (strut.barrel_end, strut.rod, 2.6, STEEL), (strut.base, strut.barrel_end, 6.5, CYLINDER),
        ):  # fmt: skip
            axes.plot(*np.array([begin, end]).T, color=colour, lw=width, alpha=shown, zorder=5, solid_capstyle="butt")
    pins = np.array([*seen.pivots, *(strut.base for strut in seen.struts), *(strut.rod for strut in seen.struts)])
    axes.plot(*pins.T, "o", ms=4, mfc="white", mec=TRUTH, alpha=shown, zorder=6)


def draw_machine(axes: Any, found: Shift) -> None:
    """The loader in three poses of a lift, with what the first one weighed."""
    from matplotlib.patches import Circle, Polygon

    mechanism = build_linked(ramsight.load_machine(MACHINE)).mechanism
    place = scenery(shapes(mechanism, [POSES[0], LEVEL]).frame)
    axes.axhline(0.0, color="#8a7a60", lw=1.5, zorder=1)
    axes.add_patch(Polygon(place.chassis, fc=PAINT, ec=TRUTH, lw=1.2, zorder=2, joinstyle="round"))
    for wheel in place.wheels:
        axes.add_patch(Circle(wheel, place.radius, fc=TYRE, ec=TRUTH, lw=1.2, zorder=6))
        axes.add_patch(Circle(wheel, 0.45 * place.radius, fc="#c9ced4", ec="none", zorder=7))
    for boom, shown in zip(POSES, (0.16, 0.3, 1.0), strict=True):
        draw_loader(axes, mechanism, boom, shown=shown)
    one = found.taught.weighings[0]
    half = TWO_SIDED_95 * one.std
    axes.text(-4.4, 4.45, f"{one.mass:.0f} ± {half:.0f} kg", fontsize=19, weight="bold", color=ESTIMATE)
    share = f"{100 * one.rated_share:.0f} % of the load that is rated at this reach"
    axes.text(-4.4, 3.85, f"{share}\nby the motor's torque: no pressure sensor, no scale", fontsize=9, color=TRUTH)
    axes.set(xlim=(-4.6, 4.3), ylim=(-0.2, 5.0), aspect="equal")
    axes.axis("off")


def draw_force(axes: Any, found: Shift) -> None:
    """The force of the boom's rods in the first cycle, and when it was weighed."""
    track, one = found.track, found.taught.weighings[0]
    time = track["time"].values
    rows = time < 27.0
    load, half = 1e-3 * track["load"].values[rows], 1e-3 * TWO_SIDED_95 * track["load_std"].values[rows]
    begin, end = one.time - 0.5 * one.duration, one.time + 0.5 * one.duration
    axes.axvspan(begin, end, color=ESTIMATE, alpha=0.12, lw=0)
    axes.fill_between(time[rows], load - half, load + half, color=AS_IT_CAME, alpha=0.35, lw=0)
    axes.plot(time[rows], load, color=TRUTH, lw=1.1)
    axes.set(xlim=(0.0, 27.0), ylim=(0.0, 420.0), ylabel="force of the\nboom's rods [kN]", xlabel="time [s]")
    axes.text(0.5 * (begin + end), 396.0, "weighed here", ha="center", va="top", color=ESTIMATE)


def draw_lifts(axes: Any, found: Shift) -> None:
    """What six lifts weighed, less what they were."""
    number = np.arange(1, len(MASSES) + 1)
    for weighed, shift_by, colour, label in (
        (found.plain, -0.12, AS_IT_CAME, "by the description"),
        (found.taught, 0.12, ESTIMATE, "after one lift of a known mass"),
    ):
        off = np.array([one.mass for one in weighed.weighings]) - MASSES
        half = TWO_SIDED_95 * np.array([one.std for one in weighed.weighings])
        axes.errorbar(number + shift_by, off, half, fmt="o", ms=4.5, capsize=3, lw=1.6, color=colour, label=label)
    axes.axhline(0.0, color=TRUTH, lw=1.0)
    axes.set_xticks(number, [f"{1e-3 * mass:.1f} t" for mass in MASSES])
    axes.set(
        xlabel="six lifts, by their true masses", ylabel="weighed less true [kg]\nwith 95 % bands", ylim=(-330, 780)
    )
    axes.grid(visible=False, axis="x")
    axes.legend(loc="upper left", ncols=2, borderaxespad=0.2, fontsize=8, columnspacing=1.2)


def main(file: Path) -> None:
    """Make it."""
    from matplotlib.figure import Figure

    found = shift()
    with SCREEN.context():
        figure = Figure(figsize=(11.0, 4.4), layout="constrained")
        places = figure.subplot_mosaic([["machine", "force"], ["machine", "lifts"]], width_ratios=(1.45, 1.0))
        draw_machine(places["machine"], found)
        draw_force(places["force"], found)
        draw_lifts(places["lifts"], found)
        with atomic_path(file) as draft:
            figure.savefig(draft, dpi=130)


if __name__ == "__main__":
    main(ROOT / "docs/images/weigh.png")
