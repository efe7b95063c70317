"""Where the piston can be: the whole of its way lies within the cylinder.

A piston that has been so far below and so far above its place is at least that far from either end, as far as its way
is known. With s of a hypothesis, edges e and their deviation sigma,

    P(reach | h) = Phi((e_high + sigma - x) / s) - Phi((e_low - sigma - x) / s)

weighs it, and what is said of its position is that of a normal distribution which ends there.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.expression import Flag, Scalar
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.belief.hypothesis import Hypothesis
from ramsight.sensor.normal_tail import upper_tail
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import OUTSIDE, TINY


@dataclass(frozen=True)
class Reach:
    """Where the piston can be, over the nominal position."""

    # lowest, highest: places over the nominal position [m]
    lowest: Scalar
    highest: Scalar
    std: Scalar  # standard deviation of both [m]
    otherwise: Collection[int] = ()  # places of the hypotheses under which the machine goes another way

    def clipped(self, below: Scalar, above: Scalar) -> tuple[Scalar, Scalar]:
        """How far below and above the nominal position it is at most, where these are the limits of a band [m]."""
        slack = TWO_SIDED_95 * self.std
        return ca.fmin(below, ca.fmax(slack - self.lowest, 0.0)), ca.fmin(above, ca.fmax(slack + self.highest, 0.0))

    def second_moment(self, h: Hypothesis) -> Scalar:
        """Mean square of the distance from the nominal position under a hypothesis [m2].

        No more than if any place within the reach were as likely as any other.
        """
        low, high = self.lowest, self.highest
        anywhere = (low**2 + low * high + high**2) / 3.0 + self.std**2
        return ca.fmin(h.position_variance + h.mean[Quantity.POSITION] ** 2, anywhere)

    def under(self, hypotheses: Sequence[Hypothesis]) -> list[Reach]:
        """The same under each hypothesis: the way of another machine is another one, by as much as its place is off."""
        places = [ca.fabs(h.mean[Quantity.POSITION]) for h in hypotheses]
        return [
            replace(self, lowest=self.lowest - off, highest=self.highest + off) if k in self.otherwise else self
            for k, off in enumerate(places)
        ]

    def widened(self, up: Flag, by: Scalar) -> Reach:
        """As it was before the piston went further by so much, up or down [m]."""
        lower, higher = ca.if_else(up, 0.0, by), ca.if_else(up, by, 0.0)
        return replace(self, lowest=self.lowest - lower, highest=self.highest + higher)

    def share(self, h: Hypothesis) -> Scalar:
        """Probability that the piston is within it under a hypothesis, and that the cylinder is as long as the way.

        One in twenty at least, for ways are wrong as well.
        """
        std, mean = ca.sqrt(h.position_variance + TINY**2), h.mean[Quantity.POSITION]
        low, high = self.lowest - self.std - mean, self.highest + self.std - mean
        outside = upper_tail(-low / std) + upper_tail(high / std)
        fits = upper_tail((self.lowest - self.highest) / self.std)
        return ca.fmax(fits * (1.0 - outside), OUTSIDE)

    def beyond(self, h: Hypothesis, std: Scalar, limit: Scalar) -> Scalar:
        """Probability that the piston is further than a limit from the nominal position under a hypothesis.

        Args:
            std: standard deviation of the position under it [m].
            limit: on either side [m].
        """
        mean, share = h.mean[Quantity.POSITION], self.share(h)
        return self._tail(mean, std, self.highest, limit, share) + self._tail(-mean, std, -self.lowest, limit, share)

    def _tail(self, mean: Scalar, std: Scalar, edge: Scalar, limit: Scalar, share: Scalar) -> Scalar:
        """Of a normal distribution that ends at an edge, what is above a limit.

        An edge with the deviation sigma leaves of a density n beyond a distance z sigma from it n sigma psi(z), with
        psi(z) = phi(z) - z Q(z).
        """
        plain = upper_tail((limit - mean) / std)
        off = (limit - edge) / self.std
        further = (ca.fmax(limit, edge) - mean) / std
        soft = self.std / std * _density(further) * (_density(off) - ca.fabs(off) * upper_tail(ca.fabs(off)))
        left = ca.fmax(plain - upper_tail((edge - mean) / std), 0.0) + ca.fmax(soft, 0.0)
        return ca.fmin(left / share, 1.0)


def _density(z: Scalar) -> Scalar:
    """Of the standard normal distribution."""
    density: Scalar = ca.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi)
    return density
