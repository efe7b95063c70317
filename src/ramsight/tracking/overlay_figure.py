"""Runs laid over each other, as a picture and as a table."""

from __future__ import annotations

from pathlib import Path

from ramsight.output import open_table
from ramsight.tracking.figures import (
    AS_IT_CAME,
    ERROR,
    ESTIMATE,
    SCREEN,
    TRUTH,
    UNCERTAIN,
    Look,
    legend_above,
    save,
    shade,
    verbatim,
)
from ramsight.tracking.overlay import ALIGNMENTS, Overlay

_COLOURS = (TRUTH, ESTIMATE, ERROR, "#3f8f5f", "#7a4fa3", UNCERTAIN, AS_IT_CAME)
_DASHES = ("-", "--", ":")


def write_overlay(runs: Overlay, path: str | Path) -> None:
    """Write all positions, the ends of their bands, differences, and whether bands overlap; a row a sample.

    Args:
        runs: that are laid over each other.
        path: .csv, .csv.gz or .parquet.

    Raises:
        OutputError: it cannot be written.
    """
    columns = {"time_s": runs.time}
    for k in range(len(runs.names)):
        of = {"position": runs.position, "position_low": runs.low, "position_high": runs.high}
        columns |= {f"{name}_{k + 1}_m": one[k] for name, one in of.items()}
    for k, (off, overlap) in enumerate(zip(runs.difference, runs.overlap, strict=True), start=2):
        columns |= {f"difference_{k}_m": off, f"overlap_{k}": overlap}
    with open_table(path, formats={name: "%.9g" for name in columns if name.endswith(("_s", "_m"))}) as table:
        table.append(columns)


def overlay_figure(runs: Overlay, title: str, path: str | Path, look: Look = SCREEN) -> None:
    """Draw the positions with their bands, the differences with what the bands allow, and where the readings are.

    Args:
        runs: that are laid over each other.
        title: above the picture.
        path: .png, .svg or .pdf.
        look: its width and style.
    """
    with look.context():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7.2, 5.0), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.4, 1.0])
        for k, (name, *of) in enumerate(zip(runs.names, runs.position, runs.low, runs.high, strict=True)):
            colour, dash = _COLOURS[k % len(_COLOURS)], _DASHES[k // len(_COLOURS) % len(_DASHES)]
            position, low, high = (1e3 * one for one in of)
            above.fill_between(runs.time, low, high, color=colour, alpha=0.15, lw=0.0)
            above.plot(runs.time, position, color=colour, ls=dash, lw=1.1, label=verbatim(name))
            if k > 0:
                least, most = (1e3 * end[k - 1] for end in (runs.difference_low, runs.difference_high))
                below.fill_between(runs.time, least, most, color=colour, alpha=0.15, lw=0.0)
                below.plot(runs.time, 1e3 * runs.difference[k - 1], color=colour, ls=dash, lw=0.9)
        below.axhline(0.0, color=TRUTH, lw=0.6)
        apart = (runs.overlap == 0.0).any(axis=0)
        shade(below, runs.time, apart, UNCERTAIN, "bands do not overlap", alpha=0.35)
        for one in runs.readings:
            for axes in (above, below):
                axes.axvline(one.time, color=AS_IT_CAME, lw=0.8, ls="--")
        above.set_ylabel("position\n[mm]")
        below.set(ylabel=f"less {verbatim(runs.names[0])}\n[mm]", xlabel=f"time since {ALIGNMENTS[runs.align]} [s]")
        legend_above(above, ncols=look.beside(3))
        if apart.any():
            legend_above(below)
        if not look.is_for_print:
            figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
        look.fit(figure)
        save(figure, path)
