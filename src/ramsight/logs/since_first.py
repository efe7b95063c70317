"""Dates and times of day as seconds that go on: over midnight, noon and the hour, and in the order of day and month."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ramsight.constant import Constant
from ramsight.logs.stamps import form_of, other_order

_DAY = 86400.0
NEAR = Constant(600.0, "s", "between the rows before and after noon; a clock that was set back by hours is another")
MONTH_LEAP = Constant(27 * _DAY, "s", "a log that goes on for so long between two rows is rather one of another order")


class SinceFirst:
    """Counts stamps from the first.

    Args:
        first: the first stamp as it is written, which says what may begin again: a clock without a date at midnight,
            one without hours after each, one of twelve hours at noon. Of dates like 06/05/2025 the month comes first
            where the day first makes a leap of a month.
    """

    def __init__(self, first: str = "0:00:00") -> None:
        self._form = form_of(first)
        self._first = self._last = math.nan
        self._passed = 0.0
        self._is_month_first = False

    def __call__(self, stamps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Seconds since the first stamp of all.

        Args:
            stamps: as `stamp_seconds` gives them [s], shape (n,).

        Example:
            >>> SinceFirst()(np.array([86399.0, 1.0])).tolist(), SinceFirst("59:59")(np.array([3599.0, 1.0])).tolist()
            ([0.0, 2.0], [0.0, 2.0])
        """
        places = np.isfinite(stamps)
        known = stamps[places]
        if not known.size:
            return stamps
        if math.isnan(self._first):
            self._first = self._last = float(known[0])
        if self._form.is_order_open:
            known = self._in_order(known)
        passed = self._passed + np.cumsum(self._begun_again(known))
        self._last, self._passed = float(known[-1]), float(passed[-1])
        counted = stamps.copy()
        counted[places] = known + passed
        return counted - self._first

    def _in_order(self, known: NDArray[np.float64]) -> NDArray[np.float64]:
        """Stamps with the month first, from when on the day first makes a leap of a month."""
        changed = other_order(known)
        if not self._is_month_first:
            leaps = np.abs(np.diff(known, prepend=self._last)) > MONTH_LEAP
            before = other_order(np.array([self._last]))
            steps = np.abs(np.diff(np.concatenate([before, changed])))
            self._is_month_first = bool((leaps & (steps <= 2.0 * _DAY)).any())
            if self._is_month_first:  # what came before has one date, or the leap had been seen
                self._first, self._last = float(other_order(np.array([self._first]))[0]), float(before[0])
        return changed if self._is_month_first else known

    def _begun_again(self, known: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is to be added from each stamp on [s]."""
        steps = np.diff(known, prepend=self._last)
        added = np.zeros(len(known))
        for period in self._form.periods:
            if period == 0.5 * _DAY:
                again = (np.abs(steps + period) <= NEAR) & (known < period + NEAR)
            else:
                again = steps < -0.5 * period
            added[again & (added == 0.0)] = period
        return added
