"""What a position sensor reads beside a straight line: its linearity, as a curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class SensorCurve:
    """What a position sensor reads too much, linear between some of its readings, constant beyond them.

    Args:
        at: readings [m], increasing.
        excess: of the reading over the position there [m].

    Example:
        >>> curve = SensorCurve((0.0, 0.1, 0.2), (0.0, 0.001, 0.0))
        >>> curve.position([0.05, 0.1]).round(6).tolist()
        [0.0495, 0.099]
        >>> curve.reading(curve.position(0.17)).round(12).item()
        0.17
    """

    at: tuple[float, ...]
    excess: tuple[float, ...]

    @property
    def is_unique(self) -> bool:
        """Whether each position has one reading, and a larger one reads more."""
        at, excess = np.array(self.at), np.array(self.excess)
        return bool((np.diff(at) > 0.0).all() and (np.diff(at - excess) > 0.0).all())

    def position(self, reading: ArrayLike) -> NDArray[np.float64]:
        """Where the piston is [m], of what is read [m]."""
        read = np.asarray(reading, dtype=np.float64)
        return np.asarray(read - np.interp(read, self.at, self.excess))

    def reading(self, position: ArrayLike) -> NDArray[np.float64]:
        """What is read [m], where the piston is [m]."""
        at, excess = np.array(self.at), np.array(self.excess)
        true = np.asarray(position, dtype=np.float64)
        return np.asarray(true + np.interp(true, at - excess, excess))
