"""The sheet's figures, each a `matplotlib.figure.Figure`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.optional import needing
from ramsight.signals import Dataset
from ramsight.study.datasheet.budget import Budget
from ramsight.study.datasheet.measuring import EDGES, GROUPS, PLACES, TAUGHT
from ramsight.tracking.figures import ERROR, ESTIMATE, STYLE, TRUTH, UNCERTAIN

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = (UNCERTAIN, ESTIMATE, ERROR, TRUTH, TRUTH)
_SHOWN = 12  # quantities of the budget, the largest


def figures(found: Dataset, budget: Budget | None) -> dict[str, tuple[Figure, str]]:
    """All figures of a sheet with their captions, by name.

    Args:
        budget: the error budget, or None.
    """
    with needing("study"):
        import matplotlib as mpl

    done = found.isel(machine=np.flatnonzero(found["outcome"].values == 0))
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        drawn = {
            "errors": (
                _errors(done),
                "Share of the time in which the error is larger, of all machines together; one line a number of "
                "references that came before. Dashed: whatever the sensor calls ok.",
            ),
            "machines": (
                _machines(done),
                "The machines: each one's 95 % error, in order. Where a line is steep the machines are alike.",
            ),
            "places": (
                _places(done),
                "Mean error at each place of the stroke after the third reference: middle machine, and what nine in "
                "ten lie within, extending and retracting.",
            ),
            "ageing": (_ageing(done), "How the error grows with time since the last reference, from the third one on."),
        }
        if np.isfinite(done["first_position"].values).any():
            drawn["first"] = (
                _first(done),
                "A sensor that is without a position at power-up: machines that know their position by then.",
            )
        if budget is not None:
            drawn["budget"] = (
                _budget(budget),
                "Which tolerance causes how much of the error's variance."
                if budget.indices is None
                else "Which tolerance causes how much of the error's variance: by itself (first order), with whatever "
                "it works together with (total), each with its 95 % interval, and by the linear budget.",
            )
    return drawn


def _axes(height: float = 3.2) -> tuple[Figure, Any]:
    with needing("study"):
        from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, height), layout="constrained")
    return figure, figure.subplots()


def _errors(done: Dataset) -> Figure:
    figure, axes = _axes()
    counts = done["errors"].values.sum(axis=0).astype(float)
    edges = 1e3 * EDGES[1:-1]
    for k, colour in enumerate(_COLOURS):
        if counts[k].sum() > 0.0:
            above = 1.0 - np.cumsum(counts[k])[:-1] / counts[k].sum()
            shown = np.where(above > 0.0, 100.0 * above, np.nan)
            axes.plot(edges, shown, color=colour, lw=1.6, ls="-" if k <= TAUGHT else "--", label=GROUPS[k])
    for share in (5.0, 0.3):
        axes.axhline(share, color=TRUTH, lw=0.6, ls=":")
        axes.text(990.0, 1.15 * share, f"{100.0 - share:g} % are within", fontsize=7, color=TRUTH, ha="right")
    axes.set(xscale="log", yscale="log", xlim=(1e-2, 1e3), ylim=(1e-3, 110.0))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set(xlabel="magnitude of the error [mm]", ylabel="share of the time [%]")
    axes.legend(loc="lower left")
    return figure


def _machines(done: Dataset) -> Figure:
    figure, axes = _axes()
    for k, colour in enumerate(_COLOURS):
        p95 = np.sort(done["p95"].values[:, k])
        p95 = 1e3 * p95[np.isfinite(p95)]
        if len(p95):
            share = 100.0 * (np.arange(len(p95)) + 0.5) / len(p95)
            axes.plot(share, p95, color=colour, lw=1.6, ls="-" if k <= TAUGHT else "--", label=GROUPS[k])
    axes.set(yscale="log", xlim=(0.0, 100.0))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set(xlabel="share of the machines [%]", ylabel="their 95 % error is within [mm]")
    axes.legend(loc="upper left")
    return figure


def _places(done: Dataset) -> Figure:
    figure, axes = _axes()
    profile = done["profile"].values
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(profile[..., 0] > 0, 1e3 * profile[..., 1] / profile[..., 0], np.nan)
    place = 100.0 * (np.arange(PLACES) + 0.5) / PLACES
    for direction, (word, colour) in enumerate((("extending", ESTIMATE), ("retracting", ERROR))):
        rows = mean[:, direction]
        held = np.isfinite(rows).any(axis=0)
        if held.any():
            low, middle, high = np.nanquantile(rows[:, held], [0.05, 0.5, 0.95], axis=0)
            axes.fill_between(place[held], low, high, color=colour, alpha=0.18, lw=0)
            axes.plot(place[held], middle, color=colour, lw=1.6, marker="o", ms=3, label=word)
    axes.axhline(0.0, color=TRUTH, lw=0.6)
    axes.set(xlabel="place on the stroke [%]", ylabel="mean error [mm]", xlim=(0.0, 100.0))
    if axes.get_legend_handles_labels()[0]:  # after three references, which not every machine comes to
        axes.legend(loc="best", ncols=2)
    return figure


def _ageing(done: Dataset) -> Figure:
    figure, axes = _axes(height=2.8)
    ageing, age = done["ageing"].values.sum(axis=0), done["age"].values
    held = ageing[:, 0] > 0
    mean = 1e3 * ageing[held, 1] / ageing[held, 0]
    square = 1e3 * np.sqrt(ageing[held, 2] / ageing[held, 0])
    axes.plot(age[held], square, color=ESTIMATE, lw=1.6, marker="o", ms=3, label="root of the mean square")
    axes.plot(age[held], mean, color=TRUTH, lw=1.6, marker="o", ms=3, label="mean magnitude")
    axes.set(ylim=(0.0, None), xlim=(0.0, None), xlabel="time since the last reference [s]", ylabel="error [mm]")
    axes.legend(loc="best")
    return figure


def _first(done: Dataset) -> Figure:
    figure, axes = _axes(height=2.6)
    first = done["first_position"].values
    known = np.sort(first[np.isfinite(first)])
    axes.step(known, 100.0 * np.arange(1, len(known) + 1) / len(first), where="post", color=ESTIMATE, lw=1.6)
    axes.set(ylim=(0.0, 102.0), xlim=(0.0, None), xlabel="time since power-up [s]", ylabel="share of the machines [%]")
    return figure


def _budget(budget: Budget) -> Figure:
    found, linear = budget.indices, budget.linear.shares
    order = np.argsort(-(linear if found is None else np.maximum(found.total, linear)))[:_SHOWN][::-1]
    figure, axes = _axes(height=0.9 + 0.34 * len(order))
    at = np.arange(len(order))
    rows = [] if found is None else [
        (0.22, found.total, found.total_half, ERROR, "total"),
        (-0.04, found.first, found.first_half, ESTIMATE, "first order"),
    ]  # fmt: skip
    for shift, share, half, colour, word in rows:
        error = {"ecolor": TRUTH, "elinewidth": 0.8, "capsize": 2}
        bars, ends = 100.0 * share[order], 100.0 * half[order]
        axes.barh(at + shift, bars, 0.26, xerr=ends, color=colour, label=word, error_kw=error)
    axes.barh(at - (0.28 if rows else 0.0), 100.0 * linear[order], 0.18, color=UNCERTAIN, label="linear budget")
    axes.set_yticks(at, [budget.names[k].replace("_", " ") for k in order])
    axes.axvline(0.0, color=TRUTH, lw=0.6)
    axes.set_xlabel("share of the error's variance [%]")
    axes.grid(axis="y", visible=False)
    axes.legend(loc="lower right")
    return figure
