"""What an estimator believes while a sample is worked in: position, factors, and how sure it is of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.sensor.uncertainty import Covariance

BOUNDS = {"leak": (0.3, 4.0), "displacement": (0.97, 1.03), "compliance": (0.4, 2.5)}
"""The factors and what they are kept within."""


@dataclass
class Belief:
    """Position [m], factors in the order of `BOUNDS` [1], and the covariance of all four."""

    position: Any
    factors: list[Any]
    covariance: Covariance

    @property
    def std(self) -> Any:
        """Standard deviation of the position [m]."""
        return ca.sqrt(ca.fmax(self.covariance[0, 0], 0.0))

    @property
    def leak_doubt(self) -> Any:
        """Standard deviation of the leakage over the leakage [1]."""
        return ca.sqrt(ca.fmax(self.covariance[1, 1], 0.0)) / self.factors[0]

    def measure(
        self, row: list[Any], innovation: Any, variance: Any, use: Any, only: Sequence[int] | None = None
    ) -> None:
        """Take a measurement, `row` times the quantities; nothing happens where `use` is false.

        Args:
            row: derivative of the measurement with respect to position and factors.
            innovation: the measurement less what it was expected to be.
            variance: of the measurement.
            use: whether there is one at this sample.
            only: places of the quantities that it may correct; by default all.
        """
        correction = self.covariance.update(row, innovation, variance, use, only)
        self.position = self.position + correction[0]
        corrected = (value + change for value, change in zip(self.factors, correction[1:], strict=True))
        self.factors = [
            ca.fmin(ca.fmax(value, least), most)
            for value, (least, most) in zip(corrected, BOUNDS.values(), strict=True)
        ]
