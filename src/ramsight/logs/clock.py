"""Which column of a table is its clock, and in what unit: first guesses, which a person checks."""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.errors import DescriptionError
from ramsight.logs.guess import epoch_unit, guess_clock, guess_date
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import TableSource
from ramsight.logs.source_csv import CsvSource
from ramsight.units import parse


@dataclass(frozen=True)
class Clock:
    """The clock of a table.

    Args:
        channel: its column, "" if none was found.
        unit: of its numbers.
        date: a column of dates beside it.
        is_stamp: whether its cells are dates or times of day.
        to_check: what a person has to check.
    """

    channel: str
    unit: str
    date: str | None = None
    is_stamp: bool = False
    to_check: str = ""


def find_clock(source: TableSource, known: ChannelMap) -> Clock:
    """The clock of a table, by the map, by the names of columns or by what stands in them; sets it in the source.

    Without one the source gives its samples no time.

    Args:
        source: the table.
        known: what is known of it.
    """
    found = _find(source, known)
    source.clock, source.clock_unit, source.date = found.channel or None, found.unit, found.date
    source.is_clock_needed = bool(found.channel)
    source.check_one_clock()
    return found


def _find(source: TableSource, known: ChannelMap) -> Clock:
    offered = {one.name: one for one in source.offered()}
    names = list(offered)
    date = known.date
    if known.time is not None:
        channel = known.time.channel
        source.check([channel])
    else:
        stamped = _stamped(source, names)
        channel = guess_clock(names) or next((name for name in names if name in stamped), "")
        if channel in stamped and ":" in stamped[channel] and not _has_date(stamped[channel]):
            date = next((name for name in [guess_date(names)] if name in stamped and name != channel), None)
    if not channel:
        return Clock("", "")
    if channel in _stamped(source, [channel]):
        return Clock(channel, "s", date, is_stamp=True)
    if known.time is None and offered[channel].unit and not _is_time(offered[channel].unit):
        return Clock("", "")  # a name that looks like a clock's, of something else
    said = (known.time.unit if known.time is not None else None) or offered[channel].unit
    epoch = "" if said else epoch_unit(source.first_number(channel))
    to_check = "" if said or not epoch else "time since 1970, by its size"
    return Clock(channel, said or epoch or "s", date, to_check=to_check)


def _stamped(source: TableSource, names: list[str]) -> dict[str, str]:
    """Columns whose first cell is a date or a time of day, and that cell."""
    if not isinstance(source, CsvSource):
        return {}
    return {name: cell for name in names if (cell := source.first_stamp(name))}


def _is_time(unit: str) -> bool:
    try:
        parse(f"1 {unit}", "s")
    except DescriptionError:
        return False
    return True


def _has_date(cell: str) -> bool:
    return any(mark in cell.split(":")[0] for mark in "-./")
