"""Dates and times of day as text, in the spellings of loggers and spreadsheets."""

from __future__ import annotations

import math
import re
from datetime import date
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_DATE = r"(?:(\d{4})[-/.](\d{1,2})[-/.](\d{1,2})|(\d{1,2})([-/.])(\d{1,2})[-/.](\d{4}|\d{2}))"
_TIME = r"(\d{1,3}):(\d{1,2})(?::(\d{1,2}))?(?:[.,](\d{1,9}))?\s*([AaPp][Mm])?\s*(Z|UTC|[+-]\d{2}:?\d{2})?"
_STAMP = re.compile(rf"({_DATE})(?:[T ]\s*{_TIME})?|{_TIME}")
_DAY = 86400.0


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


class SinceFirst:
    """Counts stamps from the first, over midnight where they have no date."""

    def __init__(self) -> None:
        self._first = self._last = math.nan
        self._days = 0.0

    def __call__(self, stamps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds since the first stamp of all.

        Args:
            stamps: as `stamp_seconds` gives them [s], shape (n,).

        Example:
            >>> SinceFirst()(np.array([86399.0, 1.0])).tolist()
            [0.0, 2.0]
        """
        known = stamps[np.isfinite(stamps)]
        if not known.size:
            return stamps
        if math.isnan(self._first):
            self._first = self._last = float(known[0])
        counted = stamps.copy()
        if known.max() < 2.0 * _DAY:  # times of day: a fall of more than half a day is midnight
            falls = np.diff(known, prepend=self._last) < -0.5 * _DAY
            self._last = float(known[-1])
            counted[np.isfinite(stamps)] += self._days + _DAY * np.cumsum(falls)
            self._days += _DAY * float(falls.sum())
        return counted - self._first
