"""Tables in which every channel has a clock of its own, as scopes of drives and PLCs write them."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from ramsight.constant import Constant
from ramsight.logs.clock_units import is_time
from ramsight.logs.column_names import guess_clock

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


def are_two_clocks(first: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
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
