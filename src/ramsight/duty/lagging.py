"""What a sensor's lag and its resolution make of a quantity."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ramsight.arrays import Array

_NOTHING = 1e-20  # of what was there before, far below the rounding of a float64


def lagging(time: Array, value: Array, lag: float) -> Array:
    """What a first-order lag [s] makes of a quantity that was settled at first; samples at equal distances.

    Example:
        >>> lagging(np.arange(3.0), np.array([0.0, 1.0, 1.0]), 1.0).round(3).tolist()
        [0.0, 0.632, 0.865]
    """
    if not lag > 0.0 or len(time) < 2:
        return value
    kept = float(np.exp(-(time[1] - time[0]) / lag))
    lagged = (1.0 - kept) * np.asarray(value, dtype=np.float64)
    lagged[0] += kept * float(value[0])
    # y[k] = x[k] + kept y[k-1], for all k at once: with what is one back, then two, then four, and so on.
    back = 1
    while back < len(lagged) and kept > _NOTHING:
        lagged[back:] += kept * lagged[:-back]
        back, kept = 2 * back, kept * kept
    return lagged


Value = TypeVar("Value", float, Array)


def stepped(value: Value, step: float) -> Value:
    """The nearest multiple of a step; the value itself where the step is 0.

    Example:
        >>> stepped(2.34, 0.5), stepped(2.34, 0.0), stepped(np.array([0.2, 0.9]), 1.0).tolist()
        (2.5, 2.34, [0.0, 1.0])
    """
    if not step > 0.0:
        return value
    nearest = np.round(value / step) * step
    return nearest if isinstance(value, np.ndarray) else float(nearest)
