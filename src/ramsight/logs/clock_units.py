"""In what unit the numbers of a clock are: by their size or their step, with the evidence and the runner-up."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ramsight.arrays import Array
from ramsight.constant import Constant
from ramsight.errors import DescriptionError
from ramsight.logs.digits import is_digits
from ramsight.units import parse

DAY = 86400.0  # s
SHORTEST_STEP = Constant(1e-4, "s", "between rows; a table of a drive's log is slower")
LONGEST_STEP = Constant(100.0, "s", "between rows; a table of a drive's log is faster")
USUAL_STEPS = (Constant(1e-3, "s", "between samples of a drive, at least"), Constant(0.5, "s", "the same, at most"))
TOO_FAST = Constant(2e-5, "s", "between rows, if they were seconds; no table is as fast")
_STEP_UNITS = ("s", "ms", "us", "100 ns", "ns")


class Size(NamedTuple):
    """Numbers that are times from 2000 to 2100, by their size."""

    unit: str
    words: str
    earliest: float
    latest: float


_UNIX = (946684800.0, 4102444800.0)
SIZES = (
    *(
        Size(unit, "time since 1970", _UNIX[0] / second, _UNIX[1] / second)
        for unit, second in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
    ),
    Size("100 ns", "Windows' time, steps of 100 ns since 1601", 1.25911584e17, 1.57469184e17),
    Size("us", "time since 1601", 1.25911584e16, 1.57469184e16),
    Size("100 ns", "ticks of .NET, steps of 100 ns since the year 1", 6.30822816e17, 6.62379552e17),
    Size("d", "days, as spreadsheets count them", 36526.0, 73051.0),
    Size("d", "days, as MATLAB counts them", 730486.0, 767012.0),
    Size("d", "days of the Julian date", 2451544.0, 2488071.0),
)
"""What a first number may be, each between 2000 and 2100."""


class Unit(NamedTuple):
    """The unit of a clock's numbers."""

    name: str  # as a map writes it; "" where it has to be asked for
    evidence: str = ""
    runner_up: str = ""  # what else it may be, "" if nothing is near


def second_of(unit: str) -> float:
    """Seconds for a number in a unit of time, which may be several: ``ms``, ``100 ns``, ``20 ms``.

    Raises:
        DescriptionError: it is no unit of time.

    Example:
        >>> second_of("ms"), second_of("100 ns")
        (0.001, 1e-07)
    """
    text = unit.strip()
    return parse(text if is_digits(text[:1]) else f"1 {text}", "s")


def is_time(unit: str) -> bool:
    """Whether a unit is one of time."""
    try:
        return second_of(unit) > 0.0
    except DescriptionError:
        return False


def unit_of(numbers: Array) -> Unit:
    """The unit of a clock's numbers where nothing states it.

    Args:
        numbers: the first of a clock, shape (n,); NaN where there is none.

    Example:
        >>> unit_of(1_763_700_000_000.0 + 20.0 * np.arange(9)).name, unit_of(133863461e9 + 2e5 * np.arange(9)).name
        ('ms', '100 ns')
        >>> unit_of(0.02 * np.arange(9)).name, unit_of(20.0 * np.arange(9)).name
        ('s', '')
    """
    known = numbers[np.isfinite(numbers)]
    if not known.size:
        return Unit("s")
    step = usual_step(known)
    for size in SIZES:
        if size.earliest < known[0] < size.latest and _is_step(step, size.unit):
            return Unit(size.unit, f"{size.words}, by size" + ("" if math.isnan(step) else " and step"))
    if 0.0 <= known[0] < 1.0 and known[-1] < 1.0 and step < TOO_FAST and _is_step(step, "d"):
        return Unit("d", "days, by size and step, as spreadsheets count a time of day")
    if math.isnan(step) or step < 2.0 or (known != np.round(known)).any():
        return Unit("s", "" if math.isnan(step) else f"rows are {step:.4g} apart")
    fitting = [unit for unit in _STEP_UNITS if USUAL_STEPS[0] <= step * second_of(unit) <= USUAL_STEPS[1]]
    likeliest = min(fitting, key=lambda unit: abs(math.log(step * second_of(unit) / 0.02)), default="s")
    others = [unit for unit in ("s", *fitting) if unit != likeliest]
    return Unit("", f'rows are {step:.9g} apart: "{likeliest}"', " or ".join(f'"{unit}"' for unit in others[:2]))


def _is_step(step: float, unit: str) -> bool:
    """Whether rows may be so far apart in a unit; days are none without a step."""
    return unit != "d" if math.isnan(step) else SHORTEST_STEP <= step * second_of(unit) <= LONGEST_STEP


def usual_step(known: Array) -> float:
    """The median of the distances of a clock's numbers, either way; NaN without any.

    Example:
        >>> usual_step(np.array([40.0, 20.0, 0.0]))
        20.0
    """
    steps = np.abs(np.diff(known[np.isfinite(known)]))
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else math.nan


def is_falling(numbers: Array) -> bool:
    """Whether the rows of a table are newest first, by its first numbers.

    Example:
        >>> is_falling(np.array([3.0, 2.0, 1.0, 0.0])), is_falling(np.array([3.0, 2.0]))
        (True, False)
    """
    steps = np.diff(numbers[np.isfinite(numbers)])
    steps = steps[steps != 0.0]
    return steps.size >= LEAST_STEPS and bool(np.mean(steps < 0.0) >= MOSTLY)


LEAST_STEPS = Constant(3, "1", "steps that show a direction")
MOSTLY = Constant(0.9, "1", "share of steps that show one")
