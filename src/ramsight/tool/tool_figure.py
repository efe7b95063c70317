"""A picture of where the tool was."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.signals import Samples
from ramsight.tracking.figures import ESTIMATE, SCREEN, legend_above, save, shade_status

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
