"""Stretches of samples at which something holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def stretches(holds: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First sample of each stretch at which it holds, and the one after its last.

    Args:
        holds: shape (samples,).

    Example:
        >>> stretches(np.array([True, False, True, True]))
        [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
