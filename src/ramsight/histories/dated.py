"""When a log was recorded: as it is passed, by its own clock, by the file's name, or by the file's time."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime
from pathlib import Path

_DAY = r"(?<!\d)(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)"
_TIME = r"[T _.-]?([0-2]\d)[-_.:h]?([0-5]\d)(?:[-_.:m]?([0-5]\d))?"
_STAMP = re.compile(rf"{_DAY}(?:{_TIME})?(?!\d)")
_CLOCK = (9.4e8, 4.1e9)  # s since 1970, from 1999 to 2099: a time in a log that is a date


def instant(text: str) -> float:
    """A time as ISO 8601 has it [s since 1970]; UTC unless it says otherwise.

    Raises:
        ValueError: it is none.

    Example:
        >>> instant("1970-01-02"), instant("1970-01-01T01:00:00+01:00")
        (86400.0, 0.0)
    """
    found = datetime.fromisoformat(text)
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def shown(seconds: float) -> str:
    """The day of a time [s since 1970].

    Example:
        >>> shown(86400.0)
        '1970-01-02'
    """
    return datetime.fromtimestamp(seconds, UTC).date().isoformat()


def begun(path: Path, first: float, at: float | None = None) -> tuple[float, str]:
    """When a log begins [s since 1970], and what says so.

    Args:
        first: time of its first sample, by its own clock [s].
        at: when, as it was passed [s since 1970]; None if it was not.

    Example:
        >>> begun(Path("boom_2026-03-01T0630.csv"), 0.0)
        (1772346600.0, 'name')
        >>> begun(Path("boom_20260301.csv"), 1.7e9)
        (1700000000.0, 'log')
    """
    if at is not None:
        return at, "option"
    if math.isfinite(first) and _CLOCK[0] < first < _CLOCK[1]:
        return first, "log"
    named = named_time(path.name)
    return (path.stat().st_mtime, "file") if named is None else (named, "name")


def named_time(name: str) -> float | None:
    """The time in a file's name [s since 1970, UTC]; None if there is none.

    Example:
        >>> named_time("day_2026-02-30.csv") is None, named_time("run 123456.csv") is None
        (True, True)
    """
    for found in _STAMP.finditer(name):
        try:
            year, month, day, hour, minute, second = (int(one or 0) for one in found.groups())
            return datetime(year, month, day, hour, minute, second, tzinfo=UTC).timestamp()
        except ValueError:
            continue
    return None
