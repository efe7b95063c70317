"""Clocks as seconds that go on: over midnight and summer time, where a counter is full, with day and month in order."""

from __future__ import annotations

import math

import numpy as np

from ramsight.arrays import Array
from ramsight.constant import Constant
from ramsight.errors import warn_of_log
from ramsight.logs.clock_units import DAY as _DAY
from ramsight.logs.clock_units import usual_step
from ramsight.logs.stamps import form_of, other_order

NEAR = Constant(600.0, "s", "between the rows before and after noon; a clock that was set back by hours is another")
MONTH_LEAP = Constant(27 * _DAY, "s", "a log that goes on for so long between two rows is rather one of another order")


FEW = Constant(5.0, "1", "usual steps within which a clock that begins again goes on; later, samples are missing")
_HOUR, _WEEK = 3600.0, 7 * _DAY
TURNS = tuple(sorted({
    *(2.0**bits * tick for bits in (16, 24, 31, 32) for tick in (1.0, 1e-3, 1e-6, 1e-7)),
    1.0, 60.0, _HOUR, 0.5 * _DAY, _DAY, _WEEK,
}))  # fmt: skip
"""After how long a clock of numbers may begin again [s]: full counters of usual steps; seconds of a minute, an hour, a
day, a week (as GPS counts them)."""
BITS = (8, 10, 12, 16, 20, 24, 31, 32, 48, 64)
"""Bits of counters that begin again, in the clock's own steps."""


class GoesOn:
    """Numbers of a clock that go on where it begins again; in the clock's unit.

    A clock begins again where the step to the next number is a few usual ones but for a whole turn, and the number
    after it is near zero, or near the negative end of a counter with a sign.

    Args:
        second: seconds for one of the clock's numbers [s].
        is_local: whether it is the time of a place, which summer time changes.
    """

    def __init__(self, file: str, second: float, *, is_local: bool = False) -> None:
        self._file, self._hour = file, _HOUR / second
        self._turns = np.unique([*(2.0**bits for bits in BITS), *(turn / second for turn in TURNS)])
        self._is_local = is_local
        self._last, self._passed, self._usual = math.nan, 0.0, math.nan

    def __call__(self, numbers: Array) -> Array:
        """The numbers with what has passed before.

        Args:
            numbers: the next of the clock, shape (n,); NaN where there is none.

        Example:
            >>> GoesOn("log.csv", 1e-3)(np.array([65500.0, 65520.0, 4.0, 24.0])).tolist()
            [65500.0, 65520.0, 65540.0, 65560.0]
        """
        places = np.isfinite(numbers)
        known = numbers[places]
        if not known.size:
            return numbers
        if known.size > 1 or math.isnan(self._usual):
            self._usual = float(np.nan_to_num(usual_step(known), nan=self._usual))
        steps = np.diff(known, prepend=known[0] if math.isnan(self._last) else self._last)
        added = np.zeros(len(known))
        for place in np.flatnonzero(steps < 0.0):
            added[place] = self._turn(float(steps[place]), float(known[place]))
        if self._is_local:
            added += summer_time(steps, known, self._usual, self._hour, self._file)
        passed = self._passed + np.cumsum(added)
        self._last, self._passed = float(known[-1]), float(passed[-1])
        found = numbers.copy()
        found[places] = known + passed
        return found

    def _turn(self, step: float, after: float) -> float:
        """What is to be added after a step back, 0 where the clock did not begin again."""
        few = FEW * self._usual
        for turn in self._turns:
            begins = 0.0 <= after <= few or 0.0 <= after + 0.5 * turn <= few
            if begins and few < turn and 0.0 < step + turn <= few:
                return float(turn)
        return 0.0


def summer_time(steps: Array, known: Array, usual: float, hour: float, file: str) -> Array:
    """What is to be added where a local clock goes on or back by an hour to the sample, at a full hour; with a warning.

    Args:
        steps: to each number from the one before, shape (n,).
        known: the numbers, shape (n,).
    """
    added = np.zeros(len(known))
    for place in np.flatnonzero(np.abs(np.abs(steps) - hour) <= FEW * usual):
        way = math.copysign(hour, float(steps[place]))
        rest, after = float(steps[place]) - way, float(known[place]) % hour
        if 0.0 < rest <= FEW * usual and min(after, hour - after) <= FEW * usual and FEW * usual < 0.1 * hour:
            added[place] = -way
            warn_of_log(
                f"the clock goes {'on' if way > 0 else 'back'} by one hour to the sample, at a full hour: a change of"
                " summer time, by all appearances; it is read without the hour",
                file=file,
            )
    return added


class SinceFirst:
    """Counts stamps from the first.

    Args:
        first: the first stamp as it is written, which says what may begin again: a clock without a date at midnight,
            one without hours after each, one of twelve hours at noon. Of dates like 06/05/2025 the month comes first
            where the day first makes a leap of a month. A clock without a zone is local, and has summer time.
    """

    def __init__(self, first: str = "0:00:00", file: str = "") -> None:
        self._form, self._file, self._usual = form_of(first), file, math.nan
        self._first = self._last = math.nan
        self._passed = 0.0
        self._is_month_first = False

    def __call__(self, stamps: Array) -> Array:
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
        self._usual = float(np.nan_to_num(usual_step(known), nan=self._usual))
        steps = np.diff(known, prepend=self._last)
        added = self._begun_again(steps, known)
        if self._form.is_local:
            added += summer_time(np.where(added == 0.0, steps, 0.0), known, self._usual, _HOUR, self._file)
        passed = self._passed + np.cumsum(added)
        self._last, self._passed = float(known[-1]), float(passed[-1])
        counted = stamps.copy()
        counted[places] = known + passed
        return counted - self._first

    def _in_order(self, known: Array) -> Array:
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

    def _begun_again(self, steps: Array, known: Array) -> Array:
        """What is to be added from each stamp on [s]."""
        added = np.zeros(len(known))
        for period in self._form.periods:
            if period == 0.5 * _DAY:
                again = (np.abs(steps + period) <= NEAR) & (known < period + NEAR)
            else:
                again = steps < -0.5 * period
            added[again & (added == 0.0)] = period
        return added
