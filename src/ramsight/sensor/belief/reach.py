"""Where the piston can be: the whole of its way lies within the cylinder.

A piston that has been so far below and so far above its place is at least that far from either end. An unknown position
is the less likely the shorter that leaves the stroke, and what is said of any position is clipped there.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Scalar
from ramsight.sensor.belief.hypothesis import Hypothesis
from ramsight.sensor.quantity import Quantity


@dataclass(frozen=True)
class Reach:
    """Where the piston can be, over the nominal position.

    Attributes:
        lowest, highest: places over the nominal position [m].
        softness: by which ends give way [m].
    """

    lowest: Scalar
    highest: Scalar
    softness: Scalar

    def clipped(self, below: Scalar, above: Scalar) -> tuple[Scalar, Scalar]:
        """How far below and above the nominal position it is at most [m]."""
        return ca.fmin(below, self.softness - self.lowest), ca.fmin(above, self.softness + self.highest)

    def second_moment(self, h: Hypothesis) -> Scalar:
        """Mean square of the distance from the nominal position under a hypothesis [m2].

        No more than if any place within the reach were as likely as any other.
        """
        low, high = self.lowest, self.highest
        anywhere = (low**2 + low * high + high**2) / 3.0 + self.softness**2
        return ca.fmin(h.position_variance + h.mean[Quantity.POSITION] ** 2, anywhere)
