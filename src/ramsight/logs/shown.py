"""What was found in a log, as a table for a terminal."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from ramsight.errors import plain
from ramsight.logs.inspect import Channel, Inspection

_EXTENDED = 1 << 31
_MOST = 2000  # channels of one file in the table; those with a use come before all others

_MOST_CLOCKS = 20


def inspection_table(found: Inspection) -> RenderableType:
    """The channels of a log, or the frames of one that nobody explained."""
    parts: list[RenderableType] = []
    if found.clock is not None:
        parts.append(Text(_clock(found)))
    parts += [Text(plain(one)) for one in found.clocks[:_MOST_CLOCKS]]
    if found.channels:
        table = _empty("channel", "unit", "samples", "missing", "rate", "least", "most", "use")
        shown = found.channels
        if len(shown) > _MOST:
            shown = sorted(shown, key=lambda one: not one.role)[:_MOST]
        for one in shown:
            table.add_row(*_cells(one))
        parts.append(table)
        if len(found.channels) > len(shown):
            parts.append(Text(f"and {len(found.channels) - len(shown)} more"))
        parts += [Text(f"{plain(one.name)}: {plain(one.note)}") for one in shown if not one.samples and ":" in one.note]
    if found.frames and not found.channels:
        table = _empty("frame", "", "count", "bytes")
        for key, (count, length) in found.frames.items():
            kind = "extended" if key & _EXTENDED else ""
            table.add_row(f"0x{key & ~_EXTENDED:X}", kind, str(count), str(length))
        parts.append(table)
    return Group(*parts)


def _clock(found: Inspection) -> str:
    """The clock of a table, what it is taken from, and from when to when it goes."""
    assert found.clock is not None
    timed, evidence = found.clock.timed, found.clock.evidence
    if not timed.channel and timed.period is None:
        return "clock: not found; the channel map has to name it, or state how far rows are apart"
    named = plain(" ".join(timed.columns)) or "rows"
    said = f"{1e3 * timed.period:.9g} ms" if timed.period else plain(timed.unit or "s")
    if found.clock.is_asked:
        what = f"its unit is open: {evidence}" if evidence else "it numbers the rows, and nothing says their period"
        return f"clock: {named}; {what}; the channel map has to state it"
    spans = [one for one in found.channels if one.samples]
    first, last = min((one.first for one in spans), default=0.0), max((one.last for one in spans), default=0.0)
    return f"clock: {named} [{said}], from {first:.9g} s to {last:.9g} s" + (f"; {evidence}" if evidence else "")


def _empty(*headings: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for heading in headings:
        left = heading in ("channel", "unit", "use", "frame", "")
        table.add_column(heading, justify="left" if left else "right", no_wrap=heading != "channel", overflow="fold")
    return table


def _cells(one: Channel) -> list[Text]:
    rate = f"{one.rate:.4g} Hz" if math.isfinite(one.rate) else "-"
    numbers = [f"{value:.6g}" if math.isfinite(value) else "-" for value in (one.least, one.most)]
    use = one.role or one.note.partition(":")[0]
    cells = [one.name, one.unit, str(one.samples), str(one.missing) if one.missing else "", rate, *numbers, use]
    return [Text(plain(cell), style="bold" if one.role else "") for cell in cells]
