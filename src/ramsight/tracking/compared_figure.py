"""Several runs or sensors side by side, as pictures and as tables."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.errors import DescriptionError
from ramsight.optional import needing
from ramsight.output import open_table
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.signals import Dataset
from ramsight.tracking import figures
from ramsight.tracking.comparing import Verdict
from ramsight.tracking.overlay import ALIGNMENTS, Overlay
from ramsight.units import to_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHADES = {Verdict.APART: figures.UNCERTAIN, Verdict.OTHER_WRONG: figures.ESTIMATE, Verdict.VIRTUAL_WRONG: "#8a94a0"}


def write_compared(both: Dataset, path: str | Path) -> None:
    """Write both positions, the bound and the verdicts.

    Args:
        both: the track of `ramsight.compare`.

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
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    time, bound = both["time"].values, 1e3 * both[BOUND].values
    virtual, other = 1e3 * both["position"].values, 1e3 * both["other_position"].values
    with mpl.rc_context(figures.STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 4.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.2, 1.0])
        above.plot(time, other, color=figures.TRUTH, lw=2.2, label="real sensor")
        above.plot(time, virtual, color=figures.ESTIMATE, lw=1.0, label="virtual sensor")
        above.set_ylabel("position\n[mm]")
        below.plot(time, other - virtual, color=figures.ERROR, lw=0.9, label="real less virtual")
        below.fill_between(
            time, -bound, bound, color=figures.ESTIMATE, alpha=0.18, lw=0, label="the virtual one's bound"
        )
        shown = np.concatenate([[1.0], np.abs(other - virtual)])
        reach = 1.3 * max(float(np.nanmax(shown)), float(np.median(bound)))
        below.set(ylim=(-reach, reach), ylabel="difference\n[mm]", xlabel="time [s]")
        for axes in (above, below):
            for verdict, colour in _SHADES.items():
                there = both["verdict"].values == verdict
                figures.shade(axes, time, there, colour, verdict.name.lower().replace("_", " "), alpha=0.3)
            figures.legend_above(axes, ncols=5)
        figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
    figures.save(figure, path)


_COLOURS = (figures.TRUTH, figures.ESTIMATE, figures.ERROR, "#3f8f5f", "#7a4fa3", figures.UNCERTAIN, figures.AS_IT_CAME)
_DASHES = ("-", "--", ":")


def write_overlay(runs: Overlay, path: str | Path) -> None:
    """Write all positions, the ends of their bands, differences, and whether bands overlap; a row a sample.

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


def overlay_figure(runs: Overlay, title: str, path: str | Path, look: figures.Look = figures.SCREEN) -> None:
    """Draw the positions with their bands, the differences with what the bands allow, and where the readings are."""
    with look.context():
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7.2, 5.0), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[1.4, 1.0])
        for k, (name, *of) in enumerate(zip(runs.names, runs.position, runs.low, runs.high, strict=True)):
            colour, dash = _COLOURS[k % len(_COLOURS)], _DASHES[k // len(_COLOURS) % len(_DASHES)]
            position, low, high = (1e3 * one for one in of)
            above.fill_between(runs.time, low, high, color=colour, alpha=0.15, lw=0.0)
            above.plot(runs.time, position, color=colour, ls=dash, lw=1.1, label=figures.verbatim(name))
            if k > 0:
                least, most = (1e3 * end[k - 1] for end in (runs.difference_low, runs.difference_high))
                below.fill_between(runs.time, least, most, color=colour, alpha=0.15, lw=0.0)
                below.plot(runs.time, 1e3 * runs.difference[k - 1], color=colour, ls=dash, lw=0.9)
        below.axhline(0.0, color=figures.TRUTH, lw=0.6)
        apart = (runs.overlap == 0.0).any(axis=0)
        figures.shade(below, runs.time, apart, figures.UNCERTAIN, "bands do not overlap", alpha=0.35)
        for one in runs.readings:
            for axes in (above, below):
                axes.axvline(one.time, color=figures.AS_IT_CAME, lw=0.8, ls="--")
        above.set_ylabel("position\n[mm]")
        below.set(
            ylabel=f"less {figures.verbatim(runs.names[0])}\n[mm]", xlabel=f"time since {ALIGNMENTS[runs.align]} [s]"
        )
        figures.legend_above(above, ncols=look.beside(3))
        if apart.any():
            figures.legend_above(below)
        if not look.is_for_print:
            figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
        look.fit(figure)
        figures.save(figure, path)


_KEPT = (
    "motor_torque_most", "motor_power_most", "energy.shaft_given", "relief_share", "pressure_most",
)  # fmt: skip
_SHOWN = {"Pa": "bar", "m": "mm", "rad/s": "rpm", "K": "degC", "N": "kN", "W": "kW", "J": "kJ"}
_OTHERWISE = "position_final"
_MOST = 6  # panels in a row or a column that can be read


@dataclass(frozen=True)
class _Quantity:
    """Values over all runs in the unit in which they are shown, shape (runs,), and what they are."""

    values: Any
    label: str


def draw_sweep(runs: Dataset, title: str) -> Figure:
    """A panel for each kept figure over each value that differs between the runs, a dot a run.

    Args:
        runs: a Dataset as `ramsight.simulate_many` returns it.

    Raises:
        DescriptionError: no value differs between the runs.
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    across = [_quantity(runs, str(name)) for name in runs.coords if _differs(runs, str(name))][:_MOST]
    if not across:
        raise DescriptionError("has nothing that differs from run to run", key="dataset", allowed="several runs")
    down = [_quantity(runs, name) for name in _KEPT if name in runs] or [_quantity(runs, _OTHERWISE)]
    lost = int((runs["outcome"] != "done").sum())
    with mpl.rc_context(figures.STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(1.2 + 2.6 * len(across), 0.8 + 1.7 * len(down)), layout="constrained")
        axes = figure.subplots(len(down), len(across), sharex="col", sharey="row", squeeze=False)
        for row, shown in zip(axes, down, strict=True):
            row[0].set_ylabel(shown.label)
            for panel, over in zip(row, across, strict=True):
                panel.plot(over.values, shown.values, ".", ms=3.0, color=figures.ERROR, alpha=0.6)
        for panel, over in zip(axes[-1], across, strict=True):
            panel.set_xlabel(over.label)
        figure.suptitle(title + (f"; {lost} did not reach their end" if lost else ""), x=0.01, ha="left", weight="bold")
    return figure


def _differs(runs: Dataset, name: str) -> bool:
    values = runs[name].values
    return values.dtype.kind == "f" and values.size > 1 and bool(np.ptp(values) > 0.0)


def _quantity(runs: Dataset, name: str) -> _Quantity:
    whole = runs["outcome"]
    values = runs[name].broadcast_like(whole).transpose(*whole.dims).values.ravel()
    si = str(runs[name].attrs.get("units", "1"))  # of a coordinate that somebody added
    unit = _SHOWN.get(si, si)
    zero, one = to_si(0.0, unit), to_si(1.0, unit)
    words = name.removesuffix("_most").replace("_", " ").replace(".", " ")
    return _Quantity((values - zero) / (one - zero), f"{words}\n[{unit}]")
