"""How far samples of a channel usually are apart: the median, which neither a pause nor a wrong clock moves."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ramsight.constant import Constant

STEPS = Constant(250.0, "1", "steps of a decade in which distances are counted: the median is right to half a percent")
_SHORTEST, _LONGEST = 1e-7, 1e9  # s; a clock's step, and more than any log lasts


class Distances:
    """Counts distances in time by their size, in memory that does not grow with the log.

    Attributes:
        longest: of the distances [s].
    """

    def __init__(self) -> None:
        decades = math.log10(_LONGEST / _SHORTEST)
        self._counts = np.zeros(int(STEPS * decades) + 1, dtype=np.int64)
        self._sums = np.zeros(len(self._counts))
        self._last = math.nan
        self.longest = 0.0

    def take(self, times: NDArray[np.float64]) -> None:
        """Take the next times [s], finite, shape (n,); steps back and repeated times are no distances."""
        steps = np.diff(times, prepend=self._last)
        self._last = float(times[-1])
        steps = steps[(steps >= _SHORTEST) & (steps < _LONGEST)]
        self.longest = max(self.longest, float(steps.max(initial=0.0)))
        places = (STEPS * np.log10(steps / _SHORTEST)).astype(np.int64)
        self._counts += np.bincount(places, minlength=len(self._counts))
        self._sums += np.bincount(places, weights=steps, minlength=len(self._sums))

    @property
    def usual(self) -> float:
        """The median [s], NaN if there are none.

        Example:
            >>> found = Distances()
            >>> found.take(np.array([0.0, 0.02, 0.04, 1800.0, 1800.02]))
            >>> round(found.usual, 9)
            0.02
        """
        total = int(self._counts.sum())
        if not total:
            return math.nan
        place = int(np.searchsorted(np.cumsum(self._counts), 0.5 * total))
        return float(self._sums[place] / self._counts[place])
