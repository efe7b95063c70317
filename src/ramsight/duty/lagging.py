"""What a sensor that lags makes of a quantity."""

from __future__ import annotations

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
    from scipy.signal import lfilter

    kept = float(np.exp(-(time[1] - time[0]) / lag))
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], value, zi=[kept * value[0]])[0])
