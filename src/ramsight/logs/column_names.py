"""What columns are by their names alone: clocks, dates, weeks, row numbers, series and their values."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ramsight.arrays import Array
from ramsight.constant import Constant
from ramsight.logs.clock_units import is_time

_CLOCK = re.compile(
    r"((utc|gmt|gps|local|plc|log|system|sampl(e|ing)|trace|rel(ative)?|abs(olute)?|elapsed|mess)[ _-]?)?"
    r"(_*(date|datum|day|tag)?[ _/-]?(time|zeit|uhrzeit)([ _]?stamps?)?|timestamps?|t|ts|elapsed|seconds|datetime"
    r"|x_value|x[ _-]?axis|__index_level_0__|(gps[ _]?)?(i?tow|time of week|sow|seconds? of week)"
    r"|temps|heure|tiempo|hora|tempo|ora)([ _\[(].*)?",
    re.IGNORECASE,
)
_WEEK = re.compile(r"(gps[ _-]?)?(week|wn|wno|woche)([ _-]?(no|number))?\.?([ _\[(].*)?", re.IGNORECASE)
_SERIES = re.compile(
    r"_?(series|variable|signal|channel|tag|metric|field|parameter|measurement|sensor|item|point|messstelle|kanal)"
    r"([ _]?(name|id))?|(var|tag|name|variablen)[ _]?(name)?|bezeichnung",
    re.IGNORECASE,
)
_VALUE = re.compile(r"_?((var|tag|item)[ _]?)?(value|wert|messwert|reading|valeur|valor)s?([ _\[(].*)?", re.IGNORECASE)
_ROW_NUMBER = re.compile(
    r"(n[or]|num(ber)?|ind(ex|ice)|idx|sample(s| ?n[or]| ?num(ber)?| ?index)?|samples?|records?|rows?|points?|punkt|lfd"
    r"\.? ?nr|#|n°|messpunkt|zeile)\.?",
    re.IGNORECASE,
)
_DATE = re.compile(r"(date|datum|day|tag|jour|fecha|data)([ _\[(].*)?", re.IGNORECASE)


def guess_clock(names: Sequence[str]) -> str | None:
    """The column that is the clock, by its name.

    Example:
        >>> guess_clock(["n_ist", "Zeit [ms]"])
        'Zeit [ms]'
    """
    return next((name for name in names if _CLOCK.fullmatch(name)), None)


def guess_date(names: Sequence[str]) -> str | None:
    """The column that is the date, by its name.

    Example:
        >>> guess_date(["Datum", "Uhrzeit"])
        'Datum'
    """
    return next((name for name in names if _DATE.fullmatch(name)), None)


def guess_week(names: Sequence[str]) -> str | None:
    """The column that is the week, by its name, beside a time of the week.

    Example:
        >>> guess_week(["GPS week", "TOW [s]"]), guess_week(["Weekday"])
        ('GPS week', None)
    """
    return next((name for name in names if _WEEK.fullmatch(name)), None)


def is_series_name(name: str) -> bool:
    """Whether a column says which series a row is of, by its name.

    Example:
        >>> is_series_name("Series"), is_series_name("VarName"), is_series_name("_measurement"), is_series_name("n_ist")
        (True, True, True, False)
    """
    return _SERIES.fullmatch(name.strip()) is not None


def is_value_name(name: str) -> bool:
    """Whether a column has the values of several series, by its name.

    Example:
        >>> is_value_name("Value"), is_value_name("_value"), is_value_name("motor_speed_rpm")
        (True, True, False)
    """
    return _VALUE.fullmatch(name.strip()) is not None


def is_row_number(name: str) -> bool:
    """Whether a column numbers the rows, by its name.

    Example:
        >>> is_row_number("No."), is_row_number("Sample number"), is_row_number("n")
        (True, True, False)
    """
    return _ROW_NUMBER.fullmatch(name.strip()) is not None


APART = Constant(0.02, "1", "of the time that passed: two clocks of one recorder differ by less, two rates by more")
_NUMBER = re.compile(r"[ ._#-]*\(?[0-9]*\)?(?=\s*(?:[\[(].*)?$)")


def is_clock_like(name: str, unit: str) -> bool:
    """Whether a column may be a clock, by its unit or by its name without a number at its end.

    Example:
        >>> is_clock_like("Time.1", ""), is_clock_like("x2", "s"), is_clock_like("n_ist", "1/min")
        (True, True, False)
    """
    if unit:
        return is_time(unit)
    return guess_clock([_NUMBER.sub("", name, count=1)]) is not None


def are_two_clocks(first: Array, other: Array) -> bool:
    """Whether two columns both rise with every row, but not by the same.

    Args:
        first: times of the one [s], shape (n,); NaN where there is none.
        other: times of the other [s], shape (n,).

    Example:
        >>> time = np.arange(10.0)
        >>> are_two_clocks(time, 2.0 * time), are_two_clocks(time, time + 1000.0)
        (True, False)
    """
    both = np.isfinite(first) & np.isfinite(other)
    a, b = first[both], other[both]
    if len(a) < 3 or not (np.diff(a) > 0.0).all() or not (np.diff(b) > 0.0).all():
        return False
    passed = max(a[-1] - a[0], b[-1] - b[0])
    return bool(np.abs((b - b[0]) - (a - a[0])).max() > APART * passed)
