"""How much time passes in a log, whatever its clock does: only finite steps forward count."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

_LONGEST = 1e8  # s, three years; a longer step is a clock that was set, from 1970 or 1601 to now


class PassedTime:
    """Counts the time of a log, piece by piece.

    Attributes:
        seconds: that have passed [s].

    Example:
        >>> passed = PassedTime()
        >>> passed.append(np.array([5.0, 6.0, np.nan, 8.0])).tolist(), passed.append(np.array([2.0, 3.0])).tolist()
        ([0.0, 1.0, 1.0, 3.0], [3.0, 4.0])
    """

    def __init__(self) -> None:
        self.seconds, self._last = 0.0, math.nan

    def append(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take the times of a piece [s]; how much has passed at each of its samples since the first of all [s]."""
        known = np.isfinite(time)
        steps = np.zeros(len(time))
        with np.errstate(over="ignore"):
            steps[known] = np.diff(time[known], prepend=self._last if math.isfinite(self._last) else time[known][:1])
        steps[~((steps > 0.0) & (steps <= _LONGEST))] = 0.0
        passed = self.seconds + np.cumsum(steps)
        if known.any():
            self._last = float(time[known][-1])
        if len(passed):
            self.seconds = float(passed[-1])
        return passed
