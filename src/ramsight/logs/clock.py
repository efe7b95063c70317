"""Which column of a table is its clock, and in what unit: first guesses, which a person checks."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.logs.clock_units import is_time, unit_of, usual_step
from ramsight.logs.column_names import guess_clock, guess_date, guess_week, is_row_number
from ramsight.logs.digits import decimal
from ramsight.logs.mapped import ChannelMap, Timed
from ramsight.logs.source import TableSource

_STEP = r"(?:sampl|abtast|interval|period|zyklus|cycle|takt|raster|tick|increment|resolution|delta|[^a-z]rate|frequen)"
_NUMBER, _UNIT = r"(?P<number>[0-9]+(?:[.,][0-9]+)?)", r"(?P<unit>ns|us|µs|ms|s|hz|khz)"
_STATED = (
    re.compile(rf"{_STEP}[^0-9]*?{_NUMBER}[^0-9a-zµ]{{0,4}}{_UNIT}\b", re.IGNORECASE),
    re.compile(rf"{_STEP}[^0-9]*?[\[(]{_UNIT}[\])][^0-9a-z]{{0,6}}{_NUMBER}", re.IGNORECASE),
)


@dataclass(frozen=True)
class Clock:
    """The clock of a table as it is proposed."""

    timed: Timed  # its columns and unit; the unit "" and no period where that is asked for
    is_stamp: bool = False  # whether its cells are dates or times of day
    evidence: str = ""
    is_asked: bool = False  # whether a person has to state the unit or the period


def find_clock(source: TableSource, known: ChannelMap) -> Clock:
    """The clock of a table, by the map, by the names of columns or by what stands in them; sets it in the source.

    Without one the source gives its samples no time.
    """
    found = _stated(source, known.time) if known.time is not None else _guessed(source)
    has_time = bool(found.timed.channel or found.timed.period) and not found.is_asked
    source.time, source.is_clock_needed = (found.timed if has_time else None), has_time
    source.check_one_clock()
    return found


def _stated(source: TableSource, timed: Timed) -> Clock:
    source.check(timed.columns)
    is_stamp = bool(timed.channel and source.first_stamp(timed.channel))
    if is_stamp or timed.period is not None or timed.unit is not None:
        return Clock(timed, is_stamp)
    return _with_unit(source, timed)


def _guessed(source: TableSource) -> Clock:
    offered = {one.name: one for one in source.offered()}
    names = list(offered)
    stamped = {name: cell for name in names if (cell := source.first_stamp(name))}
    channel = guess_clock(names) or ""
    if channel and offered[channel].unit and not is_time(offered[channel].unit) and channel not in stamped:
        channel = ""  # a name that looks like a clock's, of something else
    if not channel or (channel in stamped and ":" not in stamped[channel]):
        channel = next((name for name, cell in stamped.items() if ":" in cell), channel or next(iter(stamped), ""))
    if channel in stamped:
        date = guess_date(names) if ":" in stamped[channel] and not _has_date(stamped[channel]) else None
        return Clock(Timed(channel, date=date if date in stamped and date != channel else None), is_stamp=True)
    if not channel:
        return _of_rows(source, names)
    week = guess_week(names)
    return _with_unit(source, Timed(channel, week=week if week != channel else None))


def _with_unit(source: TableSource, timed: Timed) -> Clock:
    """The clock with its unit as the file states it, or by its numbers."""
    said = source.unit_of(timed.channel)
    if said:
        return Clock(Timed(timed.channel, said, week=timed.week))
    unit = unit_of(source.first_numbers(timed.channel))
    if unit.name:
        return Clock(Timed(timed.channel, unit.name, week=timed.week), evidence=unit.evidence)
    return Clock(timed, evidence=f"{unit.evidence}, or {unit.runner_up}", is_asked=True)


def _of_rows(source: TableSource, names: list[str]) -> Clock:
    """Rows that are numbered, or have no clock: at the period that stands in the head of the file, if one does."""
    period, line = _period_in(source.head)
    number = next((name for name in names if is_row_number(name) and _counts(source.first_numbers(name))), "")
    stated = f"line {line} of the file states it" if line else ""
    if not number and not line:
        return Clock(Timed())
    return Clock(Timed(number, period=period), evidence=stated, is_asked=period is None)


def _period_in(head: list[str]) -> tuple[float | None, int]:
    """The period that lines before the header state [s], and the line; the first that names one."""
    for number, line in enumerate(head, start=1):
        if match := next((found for one in _STATED if (found := one.search(line))), None):
            value, unit = decimal(match["number"].replace(",", ".")), match["unit"].lower()
            second = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0}.get(unit)
            if value > 0.0:
                return value * second if second else 1.0 / (value * (1e3 if unit == "khz" else 1.0)), number
    return None, 0


def _counts(numbers: Array) -> bool:
    """Whether numbers go on by one, or by another whole number, from row to row."""
    known = numbers[np.isfinite(numbers)]
    return len(known) > 2 and usual_step(known) >= 1.0 and bool((np.diff(known) == np.diff(known)[0]).all())


def _has_date(cell: str) -> bool:
    return any(mark in cell.split(":")[0] for mark in "-./")
