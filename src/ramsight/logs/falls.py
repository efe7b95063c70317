"""Clocks that go back: reset, or a part of a log that is there twice."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import warn_of_log

OUT_OF_ORDER = 1.0
"""By how much time may go back [s] where samples came out of order; by more, the clock was set or samples repeat."""


class Falls:
    """Counts where time goes back by more than samples that came out of order.

    Args:
        file: the log, for the warning.
    """

    def __init__(self, file: str) -> None:
        self._file, self._last = file, math.nan
        self._count, self._first = 0, (0.0, 0.0)

    def count(self, before: float, after: float) -> None:
        """Count a place where the clock was set from one time back to another [s]."""
        self._first = self._first if self._count else (before, after)
        self._count += 1

    def take(self, time: float) -> None:
        """Take the next time [s]."""
        if time < self._last - OUT_OF_ORDER:
            self.count(self._last, time)
        if time == time:
            self._last = time

    def take_all(self, time: NDArray[np.float64]) -> None:
        """Take the next times [s], shape (n,)."""
        known = np.concatenate([[self._last], time[np.isfinite(time)]])
        for place in np.flatnonzero(np.diff(known) < -OUT_OF_ORDER):
            self.count(float(known[place]), float(known[place + 1]))
        self._last = float(known[-1])

    def warn(self) -> None:
        """Warn if there were any."""
        if self._count:
            often = "once" if self._count == 1 else f"{self._count} times, first"
            warn_of_log(
                f"time goes back {often} from {self._first[0]:.12g} s to {self._first[1]:.12g} s:"
                " was the clock set, or is a part of the log there twice?",
                file=self._file,
            )
