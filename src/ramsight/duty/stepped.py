"""What a resolution makes of a number."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ramsight.arrays import Array

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
