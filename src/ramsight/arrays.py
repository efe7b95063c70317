"""Arrays of NumPy by what they hold, for annotations; shapes stand in docstrings. And where a condition holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Places = NDArray[np.int64]


def true_intervals(holds: Bools) -> list[tuple[int, int]]:
    """First sample of each interval over which a condition holds, and the sample after its last.

    Args:
        holds: shape (samples,).

    Example:
        >>> true_intervals(np.array([True, False, True, True]))
        [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
