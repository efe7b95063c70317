"""A history shown: a page, a picture, lines of text, and a fleet as a table."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import one_line
from ramsight.histories.assessed import HEADLINE, Assessed, QuantityTrend, State, forecast_text
from ramsight.histories.record import shown
from ramsight.histories.trend import YEAR
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.output.html_page import page, row, table
from ramsight.tracking.figures import ESTIMATE, STYLE, TRUTH, UNCERTAIN, legend_above, save

if TYPE_CHECKING:
    from rich.table import Table

_CLASS = {State.PASSED: "bad", State.DATED: "fair", State.CHANGED: "fair", State.STEADY: "good", State.UNKNOWN: "open"}
_POINTS = 120  # of a drawing, at most: a screen shows no more
_CAUSES = 4
_LOOKS = 8
_STYLE = """
.spark { width: 9rem; height: 1.6rem; } .trend { width: 100%; max-width: 50rem; height: auto; }
svg .band { fill: #c8401e; opacity: .16; } svg .level { fill: none; stroke: #c8401e; stroke-width: 1.6; }
svg .dot { fill: #5b6875; opacity: .55; } svg .limit { stroke: #1f2a36; stroke-dasharray: 5 4; }
svg .event { stroke: #17603a; } svg .step { stroke: #7a5200; }
svg text { font: 11px system-ui, sans-serif; fill: #5b6875; }
details { border-top: 1px solid var(--line); padding: .6rem 0; } summary { cursor: pointer; font-weight: 600; }
a { color: inherit; }
"""


def fleet_page(found: Sequence[Assessed], title: str) -> str:
    """The page."""
    order = sorted(range(len(found)), key=lambda k: _urgency(found[k]))
    head = ("machine", "leakage of the data sheet's", "a year", "trend", "state", "limit")
    rows = [_row(found[k], k) for k in order]
    records = sum(len(one.history.records) for one in found)
    parts = [f"<h1>{escape(one_line(title))}</h1>", f"<p>{len(found)} machines, {records} records.</p>"]
    parts += [table("", head, rows), *_sisters(found), "<h2>Machines</h2>"]
    parts += [_machine(found[k], k) for k in order]
    return page(one_line(title), parts, _STYLE)


def _urgency(one: Assessed) -> tuple[int, float, str]:
    """What is due first stands first."""
    leak = one.quantities.get(HEADLINE)
    due = leak.forecast.middle if leak is not None and leak.forecast.is_dated else math.inf
    return list(State).index(one.state), due, one.history.kept.key.text


def _row(one: Assessed, number: int) -> str:
    leak = one.quantities.get(HEADLINE)
    level = "–" if leak is None else f"{leak.followed.value(leak.now):.2f} ± {_half(leak):.2f}"
    slope = "–" if leak is None else f"{round(100 * math.expm1(leak.forecast.slope)):+d} %"
    spark = "" if leak is None else _spark(leak)
    leaves = '<br><span class="source">leaves the others</span>' if one.among is not None and one.among.leaves else ""
    return (
        f'<tr><td><a href="#m{number}">{escape(one_line(one.history.kept.key.text))}</a>{leaves}</td><td>{level}</td>'
        f"<td>{slope}</td><td>{spark}</td><td>{_badge(one.state)}</td><td>{escape(one.date_text)}</td></tr>"
    )


def _half(trend: QuantityTrend) -> float:
    """Half of the interval of 95 % of what a quantity is now [1]."""
    size = trend.followed.value(trend.now) if trend.followed.is_factor else 1.0
    return TWO_SIDED_95 * trend.now_std * size


def _badge(state: State) -> str:
    return f'<span class="verdict {_CLASS[state]}">{escape(state.value)}</span>'


def _sisters(found: Sequence[Assessed]) -> Iterator[str]:
    """What the machines that are described alike have in common, and which leave the others."""
    groups = {id(one.sisters): one.sisters for one in found if one.sisters is not None}
    for key, group in groups.items():
        members = [one for one in found if id(one.sisters) == key]
        leaves = [one.history.kept.key.text for one in members if one.among is not None and one.among.leaves]
        pulled = 100 * float(np.median([one.among.shrinkage for one in members if one.among is not None]))
        name = f"{members[0].history.kept.key.machine}, {members[0].history.kept.key.unit}"
        said = (
            f"{name}: {len(members)} sister machines. Leakage {math.exp(group.mean):.2f} of the data sheet's, "
            f"{100 * group.spread:.0f} % between machines; what is said of one machine alone is moved to the others' "
            f"mean by {pulled:.0f} % in the median. "
        )
        said += f"These leave the others: {'; '.join(leaves)}." if leaves else "None leaves the others."
        yield f"<p>{escape(one_line(said))}</p>"


def _machine(one: Assessed, number: int) -> str:
    """The part of a machine."""
    records, events = one.history.records, one.history.events
    parts = [f"<summary>{escape(one_line(one.history.kept.key.text))} {_badge(one.state)}</summary>"]
    if records:
        begun, hours = shown(records[0].begun), sum(record.worked for record in records) / 3600.0
        span = f"{len(records)} records from {begun} to {shown(records[-1].begun)}, {hours:.1f} h of work."
        parts.append(f"<p>{span} Limit of the leakage: {escape(one.date_text)}.</p>")
    leak = one.quantities.get(HEADLINE)
    if leak is not None:
        parts.append(_drawing(leak, [event.at for event in events]))
    cells = [
        row((trend.followed.words, value_text(trend), change_text(trend), forecast_text(trend.forecast)))
        for trend in one.quantities.values()
    ]
    parts.append(table("", ("quantity", "now (95 %)", "since the first record", "limit"), cells))
    causes = [cause.text for cause in one.causes[:_CAUSES] if cause.probability >= 0.01]
    looks = one.looks
    more = [f"and {len(looks) - _LOOKS} more"] if len(looks) > _LOOKS else []
    lists = {
        "What has changed since the first record:": causes,
        "Events and steps:": happened(one),
        "Logs to look at:": looks[:_LOOKS] + more,
    }
    for words, lines in lists.items():
        if lines:
            parts.append(f"<p>{words}</p><ul>{''.join(f'<li>{escape(one_line(line))}</li>' for line in lines)}</ul>")
    return f'<details id="m{number}">{"".join(parts)}</details>'


def value_text(trend: QuantityTrend) -> str:
    """What a quantity is now, with its interval of 95 %."""
    return f"{trend.followed.value(trend.now):.3f} ± {_half(trend):.3f}"


def change_text(trend: QuantityTrend) -> str:
    """How it has changed since the first record, with the interval of 95 %."""
    if trend.followed.is_factor:
        return f"{100 * math.expm1(trend.change):+.1f} ± {100 * TWO_SIDED_95 * trend.change_std:.1f} %"
    return f"{trend.change:+.3f} ± {TWO_SIDED_95 * trend.change_std:.3f}"


def happened(one: Assessed) -> list[str]:
    """Declared events, and steps that were found."""
    events = [f"{shown(event.at)}: {event.kind} {event.note}".strip() for event in one.history.events]
    return [*events, *_steps(one)]


def _steps(one: Assessed) -> Iterator[str]:
    """Steps that were found, with their Bayes factors."""
    for name, trend in one.quantities.items():
        for step in trend.steps:
            if not step.is_declared:
                size = float(trend.level[step.record] - trend.level[step.record - 1])
                when = shown(float(trend.time[step.record]))
                yield f"{when}: {name} steps by {size:+.2f} (Bayes factor {step.factor:.2g})"


def _thinned(count: int) -> Array:
    """Places of as many records as a drawing shows."""
    return np.unique(np.linspace(0, count - 1, min(count, _POINTS)).astype(int))


class _Paper:
    """From time and level to a drawing."""

    def __init__(self, trend: QuantityTrend, width: float, height: float, margin: float, ahead: float) -> None:
        self.rows = _thinned(len(trend.time))
        self.band = TWO_SIDED_95 * trend.level_std[self.rows]
        level = trend.level[self.rows]
        limit = [] if math.isnan(trend.followed.limit) else [trend.followed.level(trend.followed.limit)]
        seen = np.concatenate([level - self.band, level + self.band, limit])
        self._low, self._high = float(seen.min()), float(seen.max())
        self._first, self._last = float(trend.time[0]), float(trend.time[-1]) + ahead
        self._size, self._margin = (width, height), margin

    def x(self, time: Array | float) -> Array:
        """Places of times."""
        share = (np.asarray(time) - self._first) / max(self._last - self._first, 1.0)
        return np.asarray(np.round(self._margin + share * (self._size[0] - 2.0 * self._margin), 1))

    def y(self, level: Array | float) -> Array:
        """Places of levels."""
        share = (np.asarray(level) - self._low) / max(self._high - self._low, 1e-3)
        return np.asarray(np.round(self._size[1] - self._margin - share * (self._size[1] - 2.0 * self._margin), 1))


def _path(x: Array, y: Array) -> str:
    return " ".join(f"{a:g},{b:g}" for a, b in zip(x.tolist(), y.tolist(), strict=True))


def _spark(trend: QuantityTrend) -> str:
    paper = _Paper(trend, 140.0, 24.0, 1.0, 0.0)
    rows = paper.rows[:: max(len(paper.rows) // 30, 1)]
    line = _path(paper.x(trend.time[rows]), paper.y(trend.level[rows]))
    return f'<svg class="spark" viewBox="0 0 140 24" role="img"><polyline class="level" points="{line}"/></svg>'


def _drawing(trend: QuantityTrend, events: Sequence[float]) -> str:
    """Records, trend with its band of 95 %, limit, events and steps."""
    width, height = 760.0, 230.0
    paper = _Paper(trend, width, height, 34.0, 0.08 * YEAR)
    rows, level = paper.rows, trend.level[paper.rows]
    x = paper.x(trend.time[rows])
    above, below = paper.y(level + paper.band), paper.y(level - paper.band)
    band = _path(np.concatenate([x, x[::-1]]), np.concatenate([above, below[::-1]]))
    value = np.log(trend.value[rows]) if trend.followed.is_factor else trend.value[rows]
    dots = "".join(
        f'<circle class="dot" r="2" cx="{a:g}" cy="{b:g}"/>'
        for a, b in zip(x, paper.y(value), strict=True)
        if 0.0 < b < height
    )
    marks = [("event", time, 20.0) for time in events if trend.time[0] <= time <= trend.time[-1]]
    marks += [("step", float(trend.time[step.record]), 20.0) for step in trend.steps if not step.is_declared]
    lines = "".join(
        f'<line class="{kind}" x1="{paper.x(at):g}" x2="{paper.x(at):g}" y1="{top:g}" y2="{height - 34:g}"/>'
        for kind, at, top in marks
    )
    limit = trend.followed.limit
    if not math.isnan(limit):
        y = paper.y(trend.followed.level(limit))
        lines += f'<line class="limit" x1="34" x2="{width - 34:g}" y1="{y:g}" y2="{y:g}"/>'
        lines += f'<text x="{width - 30:g}" y="{y + 4:g}">{limit:g}</text>'
    ends = "".join(
        f'<text x="{paper.x(t):g}" y="{height - 12:g}">{shown(t)}</text>' for t in (trend.time[0], trend.time[-1])
    )
    ends += "".join(
        f'<text x="2" y="{paper.y(v) + 4:g}">{trend.followed.value(v):.2f}</text>' for v in (level[0], level[-1])
    )
    return (
        f'<svg class="trend" viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(trend.followed.words)}">'
        f'<polygon class="band" points="{band}"/>{dots}<polyline class="level" points="{_path(x, paper.y(level))}"/>'
        f"{lines}{ends}</svg>"
    )


_LEAST = 3  # records of a quantity that is drawn


def history_figure(one: Assessed, path: str | Path) -> None:
    """Draw what each log says, the trends with their bands of 95 %, limits, events and steps."""
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


_LINES = 10  # under a heading


def machine_text(one: Assessed) -> str:
    """A machine as lines of text."""
    records = one.history.records
    lines = [f"{one.history.kept.key.text}: {one.state.value}; {len(records)} records"]
    lines.append(f"  limit of the leakage: {one.date_text}")
    for name, trend in one.quantities.items():
        lines.append(
            f"  {name}: {value_text(trend)}, since the first record {change_text(trend)} ({trend.followed.words})"
        )
    causes = [cause.text for cause in one.causes[:_CAUSES] if cause.probability >= 0.01]
    for title, said in (
        ("what has changed", causes),
        ("events and steps", happened(one)),
        ("logs to look at", one.looks),
    ):
        if said:
            lines.append(f"  {title}:")
            lines += [f"    {line}" for line in said[:_LINES]]
            lines += [f"    and {len(said) - _LINES} more"] if len(said) > _LINES else []
    if one.among is not None:
        away = "leaves the others" if one.among.leaves else "as the others"
        lines.append(f"  among its sisters: {away} (chance of one so far away: {100 * one.among.chance:.2g} %)")
    return "\n".join(lines)


def fleet_table(found: Sequence[Assessed]) -> Table:
    """A row a machine."""
    from rich.table import Table

    table = Table("machine", "records", "leakage", "state", "limit", "among its sisters")
    for one in found:
        leak = one.quantities.get(HEADLINE)
        among = "" if one.among is None else "leaves the others" if one.among.leaves else "as the others"
        value = "–" if leak is None else value_text(leak)
        table.add_row(
            one.history.kept.key.text, str(len(one.history.records)), value, one.state.value, one.date_text, among
        )
    return table
