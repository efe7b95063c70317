"""What a sensor that lags makes of a quantity."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def lagging(time: Array, value: Array, lag: float) -> Array:
    """What a first-order lag [s] makes of a quantity that was settled at first; samples at equal distances.

    Example:
        >>> lagging(np.arange(3.0), np.array([0.0, 1.0, 1.0]), 1.0).round(3).tolist()
        [0.0, 0.632, 0.865]
    """
    if not lag > 0.0 or len(time) < 2:
        return value
    kept = float(np.exp(-(time[1] - time[0]) / lag))
    steps = ((1.0 - kept) * np.asarray(value, dtype=np.float64)).tolist()
    lagged = accumulate(steps, lambda before, step: step + kept * before, initial=float(value[0]))
    return np.array(list(lagged)[1:])
