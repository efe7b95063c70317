"""The normal distribution: quantiles in standard deviations, and its tails."""

from __future__ import annotations

import math

import numpy as np

from ramsight.arrays import Array

TWO_SIDED_95 = 1.959964
"""Half the width of the interval that holds 95 % of the distribution."""
ONE_SIDED_95 = 1.644854
"""Below it lie 95 % of the distribution."""

_ERFC = np.frompyfunc(math.erfc, 1, 1)


def upper_tail(size: Array) -> Array:
    """Probability of more than so many standard deviations to one side.

    Example:
        >>> upper_tail(np.array([0.0, ONE_SIDED_95, 6.0])).round(6).tolist()
        [0.5, 0.05, 0.0]
    """
    return 0.5 * np.asarray(_ERFC(size / math.sqrt(2.0)), dtype=np.float64)
