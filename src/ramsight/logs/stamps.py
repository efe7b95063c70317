"""Dates and times of day as text, in the spellings of loggers and spreadsheets."""

from __future__ import annotations

import math
import re
from datetime import date
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ramsight.arrays import Array

_DATE = r"(?:([0-9]{4})[-/.]([0-9]{1,2})[-/.]([0-9]{1,2})|([0-9]{1,2})([-/.])([0-9]{1,2})[-/.]([0-9]{4}|[0-9]{2}))"
_ZONE = r"(Z|UTC|[+-][0-9]{2}:?[0-9]{2})"
_TIME = rf"([0-9]{{1,3}}):([0-9]{{1,2}})(?::([0-9]{{1,2}}))?(?:[.,]([0-9]{{1,9}}))?\s*([AaPp][Mm])?\s*{_ZONE}?"
_STAMP = re.compile(rf"({_DATE})(?:[T ]\s*{_TIME})?|{_TIME}")
_HOUR, _DAY = 3600.0, 86400.0


def stamp_seconds(text: str) -> float:
    """Seconds of a date and a time of day, or of one of the two.

    Without a date, two numbers are minutes and seconds. The day comes before the month, unless the year comes first or
    the number in the middle is no month.

    Args:
        text: ``2025-11-21T06:30:00.25Z``, ``21.11.2025 06:30:00,25``, ``06:30:00.25``, ``30:00.25``; "" is unknown.

    Returns:
        Seconds since 1970 [s]; since midnight without a date; NaN if unknown.

    Raises:
        ValueError: the text is no date and no time of day.

    Example:
        >>> stamp_seconds("1970-01-02 00:00:01.5"), stamp_seconds("01:30,5"), stamp_seconds("1:00:00 PM")
        (86401.5, 90.5, 46800.0)
    """
    text = text.strip()
    if not text:
        return math.nan
    match = _STAMP.fullmatch(text)
    if match is None:
        raise ValueError(text)
    found = match.groups()
    if found[0] is None:
        return _time_of_day(found[14:], has_date=False)
    day = _DAY * _day(found[0])
    return day + (_time_of_day(found[8:14], has_date=True) if found[8] is not None else 0.0)


@lru_cache(maxsize=64)
def _day(text: str) -> int:
    """Days since 1970."""
    first, second, third = (int(part) for part in re.split(r"[-/.]", text))
    year, month, day = (first, second, third) if len(re.split(r"[-/.]", text)[0]) == 4 else (third, second, first)
    if month > 12:
        month, day = day, month
    return date(year + 2000 if year < 100 else year, month, day).toordinal() - date(1970, 1, 1).toordinal()


def _time_of_day(parts: tuple[str | None, ...], *, has_date: bool) -> float:
    first, second, third, fraction, half, zone = parts
    if third is None and not has_date and half is None:
        hours, minutes, seconds = 0, int(first or 0), int(second or 0)
    else:
        hours, minutes, seconds = int(first or 0), int(second or 0), int(third or 0)
    if half is not None:
        hours = hours % 12 + (12 if half.lower() == "pm" else 0)
    since = 3600.0 * hours + 60.0 * minutes + seconds + (float(f"0.{fraction}") if fraction else 0.0)
    if zone and zone[0] in "+-":
        digits = zone[1:].replace(":", "")
        since -= float(f"{zone[0]}1") * (3600.0 * int(digits[:2]) + 60.0 * int(digits[2:]))
    return since


def is_stamp(text: str) -> bool:
    """Whether a text is a date, a time of day, or both.

    Example:
        >>> is_stamp("21.11.2025 06:30"), is_stamp("0.25")
        (True, False)
    """
    try:
        return not math.isnan(stamp_seconds(text))
    except ValueError:
        return False


class Form(NamedTuple):
    """How stamps are written, as far as it says what they mean."""

    periods: tuple[float, ...]  # after which a clock without a date begins again [s]
    is_order_open: bool  # whether the day or the month may come first
    is_local: bool = False  # whether it has no zone, and hours: summer time changes it


def form_of(text: str) -> Form:
    """How a stamp is written.

    Example:
        >>> form_of("59:59.98").periods, form_of("12:59:59").periods, form_of("06/05/2025 11:59 PM").is_order_open
        ((3600.0,), (86400.0, 43200.0), True)
    """
    match = _STAMP.fullmatch(text.strip())
    if match is None:
        return Form((_DAY,), False)
    found = match.groups()
    if found[0] is not None:
        return Form((), found[1] is None and found[5] in ("/", "-"), found[8] is not None and found[13] is None)
    _, _, seconds, _, half, zone = found[14:]
    if seconds is None and half is None:
        return Form((_HOUR,), False)
    return Form((_DAY,) if half is not None else (_DAY, 0.5 * _DAY), False, zone is None)


def other_order(stamps: Array) -> Array:
    """Stamps [s] with day and month changed for each other, the same where the day is no month.

    Example:
        >>> other_order(np.array([stamp_seconds("06/05/2025")])) == stamp_seconds("05/06/2025")
        array([ True])
    """
    days = np.floor(stamps / _DAY)
    changed = {day: _other_day(int(day)) for day in np.unique(days)}
    return np.asarray(stamps + _DAY * np.array([changed[day] - day for day in days]))


def _other_day(day: int) -> int:
    known = date.fromordinal(day + date(1970, 1, 1).toordinal())
    if known.day > 12:
        return day
    return date(known.year, known.day, known.month).toordinal() - date(1970, 1, 1).toordinal()
