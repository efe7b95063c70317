"""A periodic schedule that does not drift: every time is counted from the first."""

from __future__ import annotations

import math

_EARLY = 1e-6  # s; rounding of clocks


class Ticks:
    """Times ``start + k * period``. After a delay the ones that are past count as one, and the grid stays.

    Example:
        >>> ticks = Ticks()
        >>> ticks.start(1.0, 0.5)
        >>> [ticks.take(now) for now in (1.0, 1.2, 1.5, 3.7, 3.9, 4.0)], ticks.due
        ([True, False, True, True, False, True], 4.5)
    """

    def __init__(self) -> None:
        self.due = math.inf
        self._start, self._period, self._count = 0.0, 0.0, 0

    def start(self, now: float, period: float, *, at_once: bool = True) -> None:
        """Begin; a period of 0 stops it [s]."""
        self._start, self._period, self._count = now, period, 0 if at_once else 1
        self.due = math.inf if period <= 0.0 else now + self._count * period

    def take(self, now: float) -> bool:
        """Whether it was due; if so it is due next at the first time of the grid after now."""
        if now < self.due - _EARLY:
            return False
        passed = math.floor((now - self._start) / self._period + _EARLY)
        self._count = max(self._count, passed) + 1
        self.due = self._start + self._count * self._period
        return True
