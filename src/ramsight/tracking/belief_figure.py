"""What the sensor knows at some instants of a log: the probability of the piston's place, over the cylinder."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.arrays import Array
from ramsight.hindsight.smoother import Forward, silent
from ramsight.hindsight.trace import Tracer, probabilities
from ramsight.logs.channel_map import AnyMap
from ramsight.logs.opening import open_signals
from ramsight.optional import needing
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kind import Kind
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import HIGHEST, LOWEST, POSITION, STATUS, log_inputs
from ramsight.signals import Samples, Signals, joined
from ramsight.tracking.figures import ESTIMATE, SCREEN, TRUTH, Look, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = {
    Kind.DESCRIBED: "#2a6f97", Kind.LEAKS: "#7a9e3f", Kind.LOW: "#e9b44c", Kind.TOP: "#b0703c",
    Kind.UNKNOWN_POSITION: "#8a94a0",
}  # fmt: skip
_ANYWHERE = 0.24  # of the stroke, from which standard deviation on a place may be any
_POINTS = 1201
_AFTER = 0.5  # s after a measurement


@dataclass(frozen=True)
class Instant:
    """What the sensor knows at an instant."""

    time: float  # [s]
    why: str
    position: float  # that is shown [m]; NaN while it is unknown
    # low, high: ends of its 95 % band [m]
    low: float
    high: float
    status: Status
    # places, stds: of each hypothesis [m]
    places: Array
    stds: Array
    chances: Array

    def density(self, x: Array, stroke: float) -> Array:
        """Of each hypothesis over places in the cylinder [1/m], shape (hypotheses, places)."""
        found = np.empty((len(self.places), len(x)))
        for k, (place, std) in enumerate(zip(self.places, self.stds, strict=True)):
            wide = max(std, 0.5 * stroke / _POINTS)
            one = np.ones_like(x) if std > _ANYWHERE * stroke else np.exp(-0.5 * ((x - place) / wide) ** 2)
            found[k] = self.chances[k] * one / max(np.trapezoid(one, x), np.finfo(float).tiny)
        return found


def instants(tracer: Tracer, pieces: Iterable[Signals], start: float | None, std: float) -> list[Instant]:
    """What a sensor knows before and after the first measurements of the place in a log, and at its end.

    Args:
        start: of the piston [m]; None if unknown.
        std: its standard deviation [m].
    """
    log = joined(list(pieces))
    time = log["time"].values
    tracer.sensor.start(start, std)
    begun = np.array(list(tracer.sensor.state.values()))
    gone = Forward.through(tracer, log_inputs(tracer.sensor, log), time, begun, (POSITION,), silent)
    low = gone.said[POSITION]
    stroke, wanted, met = float(tracer.unit.cylinder.stroke), {0: "at first"}, dict[str, float]()
    for k in (one.sample for one in gone.innovations.measured if one.accepted):
        end = "extended end" if low[k] > 0.95 * stroke else "retracted end" if low[k] < 0.05 * stroke else "reference"
        if end not in met:
            if met:
                before, when = list(met.items())[-1]
                wanted[int(np.searchsorted(time, 0.5 * (when + time[k])))] = f"on the way from the {before}"
            met[end] = float(time[k])
            wanted[int(np.searchsorted(time, time[k] + _AFTER))] = f"after the {end} was met"
    wanted[len(time) - 1] = "at the end of the log"
    found = []
    for k, why in sorted(wanted.items()):
        k = min(k, len(time) - 1)
        found.append(_instant(tracer, gone.row(k), float(time[k]), why))
    return found


def _instant(tracer: Tracer, row: Array, time: float, why: str) -> Instant:
    """What a row of the trace says."""
    trace = tracer.trace(row[None], np.zeros((1, 2)))
    said = dict(zip(tracer.names, row, strict=False))
    beside = trace.aside["others"][0] + trace.aside["unseen"][0] ** 2
    return Instant(
        time=time,
        why=why,
        position=float(said[POSITION]),
        low=float(said[LOWEST]),
        high=float(said[HIGHEST]),
        status=Status(int(said[STATUS])),
        places=trace.mean[0, :, 0],
        stds=np.sqrt(trace.after(0, np.arange(tracer.layout.hypotheses))[:, 0, 0] + beside),
        chances=probabilities(tracer.log_weight(row[None])[0]),
    )


def tracked_belief(
    unit: HydraulicUnit,
    log: Path,
    channel_map: AnyMap | None,
    start: tuple[float | None, float],
    true: Samples | None,
    title: str,
    path: str | Path,
    look: Look = SCREEN,
) -> None:
    """Draw what a sensor knew at some instants of a log into a file.

    Args:
        start: of the piston, None if unknown, and its standard deviation [m].
        true: with `position` [m], or None.
    """
    tracer = Tracer.of(unit)
    found = instants(tracer, open_signals(log, channel_map), *start)
    with look.context():
        save(draw_belief(found, tracer, true, title, look), path)


def draw_belief(found: list[Instant], tracer: Tracer, true: Samples | None, title: str, look: Look = SCREEN) -> Figure:
    """The picture of `tracked_belief`: a cylinder an instant, and on it the probability of the piston's place.

    Args:
        true: with `position` [m], or None.
    """
    with needing("figures"):
        from matplotlib.figure import Figure
        from matplotlib.patches import Patch

    stroke = float(tracer.unit.cylinder.stroke)
    with look.context():
        figure = Figure(figsize=(7.2, 0.7 + 1.15 * len(found)), layout="constrained")
        axes = np.atleast_1d(figure.subplots(len(found), 1, sharex=True))
        for one, at in zip(axes, found, strict=True):
            known = None if true is None else float(np.interp(at.time, true["time"].values, true["position"].values))
            _draw_cylinder(one, at, stroke, tracer, known)
        axes[-1].set_xlabel("place of the piston [mm]")
        handles = [Patch(color=_COLOURS[kind], alpha=0.6, label=kind.words) for kind in tracer.kinds]
        figure.legend(handles=handles, loc="outside lower center", ncols=look.beside(2), fontsize=7)
        if not look.is_for_print:
            figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
        look.fit(figure)
    return figure


def _draw_cylinder(axes: Any, at: Instant, stroke: float, tracer: Tracer, true: float | None) -> None:
    """One instant: barrel, piston and rod below, the hill above."""
    from matplotlib.patches import Rectangle

    width, x = 1e3 * stroke, np.linspace(0.0, stroke, _POINTS)
    hills = at.density(x, stroke)
    whole, under = np.maximum(hills.sum(axis=0), np.finfo(float).tiny), np.zeros_like(x)
    # By the root of its density a hypothesis is seen that is unlikely, and spread over centimetres.
    for kind, hill in zip(tracer.kinds, hills / np.sqrt(whole * whole.max()), strict=True):
        axes.fill_between(1e3 * x, under, under + hill, color=_COLOURS[kind], alpha=0.6, lw=0.0)
        under = under + hill
    axes.add_patch(Rectangle((0.0, -0.62), width, 0.5, fill=False, lw=1.2, color=TRUTH))
    if np.isfinite(at.position):
        place = 1e3 * at.position
        axes.add_patch(Rectangle((place - 0.008 * width, -0.62), 0.016 * width, 0.5, color=ESTIMATE))
        axes.add_patch(Rectangle((place, -0.43), 1.06 * width - place, 0.12, color=TRUTH, alpha=0.35, lw=0.0))
        axes.plot(1e3 * np.array([at.low, at.high]), [-0.8, -0.8], color=ESTIMATE, lw=2.2, solid_capstyle="butt")
    if true is not None:
        axes.plot([1e3 * true] * 2, [-0.68, -0.06], color=TRUTH, lw=1.0, ls=":")
    half = 0.5e3 * (at.high - at.low)
    says = (
        "anywhere"
        if not np.isfinite(at.position)
        else f"{1e3 * at.position:.1f} ± {half:.{1 if half < 10.0 else 0}f} mm"
    )
    axes.set_title(f"{at.time:.0f} s, {at.why}: {says}; {at.status.text}", loc="left", fontsize=8)
    axes.set(ylim=(-1.0, 1.05), xlim=(-0.02 * width, 1.06 * width))
    axes.set_yticks([])
    axes.xaxis.set_ticks_position("none" if not axes.get_subplotspec().is_last_row() else "bottom")
    axes.spines["bottom"].set_visible(axes.get_subplotspec().is_last_row())
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
