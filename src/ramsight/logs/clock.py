"""Which column of a table is its clock, and in what unit: first guesses, which a person checks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.constant import Constant
from ramsight.errors import DescriptionError
from ramsight.logs.arrival import usual_distance
from ramsight.logs.guess import epoch_unit, guess_clock, guess_date
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import TableSource
from ramsight.logs.source_csv import CsvSource
from ramsight.units import parse

DAY = 86400.0  # s
EARLIEST_DAY = Constant(36526.0, "d", "the first day of 2000 where spreadsheets count from 1900 on")
LATEST_DAY = Constant(73051.0, "d", "the first day of 2100")
SHORTEST_STEP = Constant(1e-4, "s", "between rows; a table of a drive's log is slower")
LONGEST_STEP = Constant(100.0, "s", "between rows; a table of a drive's log is faster")
TOO_FAST = Constant(2e-5, "s", "between rows, if they were seconds; no table is as fast")


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
    if said:
        return Clock(channel, said, date)
    numbers = source.first_numbers(channel)
    if is_in_days(numbers):
        return Clock(channel, "d", date, to_check="days, by size and step, as spreadsheets count them")
    epoch = epoch_unit(float(next(iter(numbers[np.isfinite(numbers)]), np.nan)))
    return Clock(channel, epoch or "s", date, to_check="time since 1970, by its size" if epoch else "")


def is_in_days(numbers: NDArray[np.float64]) -> bool:
    """Whether numbers are days, as a spreadsheet counts them from 1900 on, or of one day.

    Args:
        numbers: the first of a clock, shape (n,); NaN where there is none.

    Example:
        >>> is_in_days(45986.25 + np.arange(5) * 0.02 / 86400.0), is_in_days(45986.25 + np.arange(5) * 0.02)
        (True, False)
    """
    known = numbers[np.isfinite(numbers)]
    step = usual_distance(known) if known.size else math.nan
    if not SHORTEST_STEP <= step * DAY <= LONGEST_STEP:
        return False
    return bool(EARLIEST_DAY < known[0] < LATEST_DAY or (0.0 <= known[0] < 1.0 and known[-1] < 1.0 and step < TOO_FAST))


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
