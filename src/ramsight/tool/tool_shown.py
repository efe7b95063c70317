"""What the tool did, shown: where it was as a picture, its weighings as a table of the terminal and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.signals import Samples
from ramsight.tool.weighing_events import Quality, Weighing
from ramsight.tracking.figures import AS_IT_CAME, ESTIMATE, SCREEN, legend_above, save, shade_status

if TYPE_CHECKING:
    from rich.table import Table


def weighings_table(found: Sequence[Weighing], *, rated: bool) -> Table:
    """A row a weighing."""
    from rich.table import Table

    table = Table("time", "cycle", "direction", "mass", "95 % band", "quality")
    if rated:
        table.add_column("of rated load")
    for one in found:
        mass = f"{one.mass:.0f} kg" if np.isfinite(one.mass) else "–"
        band = f"± {TWO_SIDED_95 * one.std:.0f} kg" if np.isfinite(one.std) else "–"
        quality = "good" if one.is_good else f"bad: {one.quality.value}"
        cells = [f"{one.time:.1f} s", str(one.cycle), one.direction, mass, band, quality]
        table.add_row(*cells, *([_of_rated(one)] if rated else ()))
    return table


def _of_rated(one: Weighing) -> str:
    status = one.rated_status.name.lower()
    if not np.isfinite(one.rated_share):
        return status
    half = TWO_SIDED_95 * one.rated_share_std
    return f"{100 * one.rated_share:.0f} ± {100 * half:.0f} %, {status}"


def draw_weighings(found: Sequence[Weighing], logs: Sequence[int], path: str | Path) -> None:
    """Draw masses with their 95 % bands over the time of their logs, bad ones apart, into a file."""
    with needing("figures"):
        from matplotlib.figure import Figure

    numbers = sorted(set(logs)) or [0]
    with SCREEN.context():
        figure = Figure(figsize=(7.2, 1.2 + 2.2 * len(numbers)), layout="constrained")
        axes = figure.subplots(len(numbers), 1, squeeze=False)[:, 0]
        for place, number in zip(axes, numbers, strict=True):
            for good, colour, mark, label in ((True, ESTIMATE, "o", "good"), (False, AS_IT_CAME, "x", "bad")):
                rows = [one for one, log in zip(found, logs, strict=True) if log == number and one.is_good is good]
                if not rows:
                    continue
                times, masses = ([getattr(one, name) for one in rows] for name in ("time", "mass"))
                half = [TWO_SIDED_95 * one.std for one in rows]
                place.errorbar(times, masses, half, fmt=mark, color=colour, ms=4, lw=1.0, capsize=2, label=label)
            for one, log in zip(found, logs, strict=True):
                if log == number and not one.is_good and np.isfinite(one.mass):
                    words = one.quality.value.partition(":")[0] if one.quality is not Quality.DIGGING else "digging"
                    place.annotate(words, (one.time, one.mass), xytext=(4, 4), textcoords="offset points", fontsize=7)
            place.set_ylabel("mass [kg]")
        axes[-1].set_xlabel("time [s]")
        legend_above(axes[0], ncols=2)
        save(figure, path)


_ROWS = {"height": (1.0, "height [m]"), "reach": (1.0, "reach [m]"), "angle": (np.degrees(1.0), "angle [°]")}


def draw_tool(track: Samples, title: str, path: str | Path) -> None:
    """Draw height, reach and angle with their 95 % bands into a file: .png, .svg or .pdf.

    Args:
        track: with the columns of `TOOL` and a status.
    """
    with needing("figures"):
        from matplotlib.figure import Figure

    time = track["time"].values
    with SCREEN.context():
        figure = Figure(figsize=(7.2, 5.4), layout="constrained")
        axes = figure.subplots(len(_ROWS), 1, sharex=True)
        for place, (name, (scale, label)) in zip(axes, _ROWS.items(), strict=True):
            value, std = scale * track[f"tool_{name}"].values, scale * track[f"tool_{name}_std"].values
            half = TWO_SIDED_95 * std
            place.fill_between(time, value - half, value + half, color=ESTIMATE, alpha=0.2, lw=0.0, label="95 % band")
            place.plot(time, value, color=ESTIMATE, lw=1.1, label="tool")
            place.set_ylabel(label)
            shade_status(place, time, track["status"].values)
        axes[-1].set_xlabel("time [s]")
        legend_above(axes[0], ncols=4)
        figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
        figure.align_ylabels()
        save(figure, path)
