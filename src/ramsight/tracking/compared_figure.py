"""Two sensors of one position, as a picture and as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ramsight.optional import needing
from ramsight.output import open_table
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.signals import Dataset
from ramsight.tracking.comparing import Verdict
from ramsight.tracking.figures import ERROR, ESTIMATE, STYLE, TRUTH, UNCERTAIN, legend_above, save, shade

_SHADES = {Verdict.APART: UNCERTAIN, Verdict.OTHER_WRONG: ESTIMATE, Verdict.VIRTUAL_WRONG: "#8a94a0"}


def write_compared(both: Dataset, path: str | Path) -> None:
    """Write both positions, the bound and the verdicts.

    Args:
        both: the track of `ramsight.compare`.
        path: .csv, .csv.gz or .parquet.

    Raises:
        OutputError: it cannot be written.
    """
    columns = {
        "time_s": both["time"].values,
        "position_m": both["position"].values,
        "position_bound_m": both[BOUND].values,
        "other_position_m": both["other_position"].values,
        "status": both["status"].values,
        "verdict": both["verdict"].values,
    }
    with open_table(path, formats={name: "%.9g" for name in columns if name.endswith(("_s", "_m"))}) as table:
        table.append(columns)


def compared_figure(both: Dataset, title: str, path: str | Path) -> None:
    """Draw both positions, and their difference within what it may be.

    Args:
        both: the track of `ramsight.compare`.
        title: above the picture.
        path: .png, .svg or .pdf.
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    time, bound = both["time"].values, 1e3 * both[BOUND].values
    virtual, other = 1e3 * both["position"].values, 1e3 * both["other_position"].values
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 4.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.2, 1.0])
        above.plot(time, other, color=TRUTH, lw=2.2, label="real sensor")
        above.plot(time, virtual, color=ESTIMATE, lw=1.0, label="virtual sensor")
        above.set_ylabel("position\n[mm]")
        below.plot(time, other - virtual, color=ERROR, lw=0.9, label="real less virtual")
        below.fill_between(time, -bound, bound, color=ESTIMATE, alpha=0.18, lw=0, label="the virtual one's bound")
        shown = np.concatenate([[1.0], np.abs(other - virtual)])
        reach = 1.3 * max(float(np.nanmax(shown)), float(np.median(bound)))
        below.set(ylim=(-reach, reach), ylabel="difference\n[mm]", xlabel="time [s]")
        for axes in (above, below):
            for verdict, colour in _SHADES.items():
                there = both["verdict"].values == verdict
                shade(axes, time, there, colour, verdict.name.lower().replace("_", " "), alpha=0.3)
            legend_above(axes, ncols=5)
        figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
    save(figure, path)
