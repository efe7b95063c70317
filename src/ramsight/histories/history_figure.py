"""A machine's trends as a picture."""

from __future__ import annotations

import math
import textwrap
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.histories.assessed import Assessed, QuantityTrend
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.tracking.figures import ESTIMATE, STYLE, TRUTH, UNCERTAIN, legend_above, save

_LEAST = 3  # records of a quantity that is drawn


def history_figure(one: Assessed, path: str | Path) -> None:
    """Draw what each log says, the trends with their bands of 95 %, limits, events and steps.

    Args:
        one: the machine.
        path: .png, .svg or .pdf.
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
        from matplotlib.figure import Figure

    drawn = [trend for trend in one.quantities.values() if len(trend.time) >= _LEAST] or list(one.quantities.values())
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 1.2 + 1.7 * max(len(drawn), 1)), layout="constrained")
        axes = figure.subplots(max(len(drawn), 1), 1, sharex=True, squeeze=False)[:, 0]
        for place, trend in zip(axes, drawn, strict=False):
            _draw(place, trend, one)
        dates = AutoDateLocator(maxticks=9)  # type: ignore[no-untyped-call]
        axes[-1].xaxis.set_major_locator(dates)
        axes[-1].xaxis.set_major_formatter(ConciseDateFormatter(dates))  # type: ignore[no-untyped-call]
        axes[-1].set_xlabel("date (UTC)")
        legend_above(axes[0], ncols=4)
        title = f"{one.history.kept.key.text}: {one.state.value}"
        figure.suptitle(title.replace("$", r"\$"), x=0.01, ha="left", fontsize=9, fontweight="bold")
    save(figure, path)


def _draw(axes: Any, trend: QuantityTrend, one: Assessed) -> None:
    when = [datetime.fromtimestamp(t, UTC) for t in trend.time]
    value = np.exp if trend.followed.is_factor else np.asarray
    axes.errorbar(when, trend.value, trend.std, fmt=".", color=TRUTH, ms=3, lw=0.6, alpha=0.6, label="a log")
    band = TWO_SIDED_95 * trend.level_std
    axes.plot(when, value(trend.level), color=ESTIMATE, lw=1.4, label="trend")
    axes.fill_between(when, value(trend.level - band), value(trend.level + band), color=ESTIMATE, alpha=0.18, lw=0)
    if not math.isnan(trend.followed.limit):
        axes.axhline(trend.followed.limit, color="#1f2a36", ls="--", lw=0.9, label="limit")
    for event in one.history.events:
        axes.axvline(datetime.fromtimestamp(event.at, UTC), color="#17603a", lw=0.9, label=event.kind)
    for step in trend.steps:
        if not step.is_declared:
            axes.axvline(when[step.record], color=UNCERTAIN, lw=1.2, label="step found")
    axes.set_ylabel(textwrap.fill(f"{trend.followed.words} [1]", 24), fontsize=8)
