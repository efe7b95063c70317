"""A history in words: a machine as lines, a fleet as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ramsight.histories.assessed import HEADLINE, Assessed
from ramsight.histories.history_page import change_text, happened, value_text

if TYPE_CHECKING:
    from rich.table import Table

_CAUSES = 4
_LOOKS = 10


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
            lines += [f"    {line}" for line in said[:_LOOKS]]
            lines += [f"    and {len(said) - _LOOKS} more"] if len(said) > _LOOKS else []
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
