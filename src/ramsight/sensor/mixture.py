"""Several hypotheses together: which is how likely, and how large an error of the position may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import casadi as ca

from ramsight.normal import ONE_SIDED_95, TWO_SIDED_95
from ramsight.sensor.hypothesis import POSITION, WRONG, Hypothesis

OUTSIDE = 0.05
"""Share of the truth that the band may miss."""
RISK = 1e-5
"""Share of the samples at which an error may be larger than the position's bound and nothing says so."""
CERTAIN = math.sqrt(-2.0 * math.log(RISK))
"""Standard deviations that a normal error exceeds no more often: P(|e| > k sigma) <= exp(-k^2/2) (Chernoff)."""


class Mixture:
    """Hypotheses weighed against each other.

    Args:
        hypotheses: they, as they are when something is asked.
        wrong: probability from the start on that the position is wrong for a reason of no stated kind.
    """

    def __init__(self, hypotheses: Sequence[Hypothesis], wrong: float) -> None:
        self._all, self._wrong = hypotheses, wrong
        self._shares = self._likelihoods()

    def _likelihoods(self) -> list[Any]:
        """Of each over that of the likeliest."""
        largest = self.largest()
        return [ca.exp(h.weight - largest) for h in self._all]

    def reweighed(self, where: Any) -> None:
        """Take the weights as they are now where a condition holds; elsewhere the probabilities stay.

        Nothing else changes a weight, so exponentials are worked out anew in samples with a measurement alone.

        Args:
            where: whether something was measured. The weights are those that it leads to, whether it was or not.
        """
        shares = zip(self._likelihoods(), self._shares, strict=True)
        self._shares = [ca.if_else(where, new, old) for new, old in shares]

    def largest(self) -> Any:
        """The weight of the likeliest."""
        largest = self._all[0].weight
        for h in self._all[1:]:
            largest = ca.fmax(largest, h.weight)
        return largest

    def best(self, values: list[Any]) -> Any:
        """The value that belongs to the likeliest hypothesis."""
        largest = self.largest()
        chosen = values[-1]
        for h, value in reversed(list(zip(self._all, values, strict=True))):
            chosen = ca.if_else(h.weight >= largest, value, chosen)
        return chosen

    def leads(self, one: Hypothesis) -> Any:
        """Whether a hypothesis is the likeliest."""
        return self.best([float(h is one) for h in self._all])

    def probabilities(self) -> list[Any]:
        """Of each."""
        total = sum(self._shares)
        return [share / total for share in self._shares]

    def _logarithms(self) -> list[Any]:
        """Natural logarithms of the probabilities."""
        largest, total = self.largest(), ca.log(sum(self._shares))
        return [h.weight - largest - total for h in self._all]

    def mean(self, k: int) -> Any:
        """Of a quantity over all."""
        return sum(w * h.mean[k] for w, h in zip(self.probabilities(), self._all, strict=True))

    def variance(self) -> Any:
        """Of the position over all, about the nominal one [m2].

        A position that may be anywhere counts from where it is one of twenty cases: the band is that of 95 %.
        """
        weights = self.probabilities()
        weights[WRONG] = weights[WRONG] * _counts(0.5 * weights[WRONG])
        return sum(
            w * (h.covariance[POSITION, POSITION] + h.mean[POSITION] ** 2)
            for w, h in zip(weights, self._all, strict=True)
        )

    def band(self) -> Any:
        """Standard deviation of the position [m] whose 1.96-fold holds the truth in 95 of 100 cases.

        That of the likeliest hypothesis, or more where another one has about 5 % or more: then that is inside as well,
        and does not wait for a log on which it happens to be true.
        """
        wide = ca.sqrt(ca.fmax(self.best([h.covariance[POSITION, POSITION] for h in self._all]), 0.0))
        for w, h in zip(self.probabilities(), self._all, strict=True):
            # Beside the likeliest one side of it counts, about the same position both do.
            std = h.position_std
            reach = ca.fmax(ca.fabs(h.mean[POSITION]) + ONE_SIDED_95 * std, TWO_SIDED_95 * std)
            wide = ca.fmax(wide, _counts(w) * reach / TWO_SIDED_95)
        return wide

    def bound(self) -> Any:
        """The error that no more than `RISK` of the samples exceed, whichever hypothesis is true [m].

        By the separation of solutions, as satellite navigation bounds its errors: each hypothesis has its own position
        and deviation, and has a part in the bound as large as its probability asks for,

            b = max_h |x_h - x| + sigma_h sqrt(2 ln(w_h / RISK)).

        That the position may be wrong for a reason of no stated kind counts from where evidence speaks for it: until
        then its weight is an assumption (`stops.wrong`), not a finding.
        """
        wide: Any = 0.0
        shares, found = self._logarithms(), self.probabilities()[WRONG] - 2.0 * self._wrong
        shares[WRONG] = ca.log(ca.fmax(found, RISK))
        for share, h in zip(shares, self._all, strict=True):
            over = share - math.log(RISK)
            sure = ca.sqrt(2.0 * ca.fmax(over, 0.0))
            wide = ca.fmax(wide, ca.if_else(over > 0.0, ca.fabs(h.mean[POSITION]) + sure * h.position_std, 0.0))
        return wide

    def std(self, row: Sequence[Any]) -> Any:
        """Standard deviation, under the likeliest, of something with these derivatives with respect to the means."""
        return ca.sqrt(ca.fmax(self.best([h.covariance.variance(row) for h in self._all]), 0.0))


def _counts(probability: Any) -> Any:
    """How far a hypothesis counts in a band of 95 %: wholly from one in twenty on, not at all below half of that."""
    return ca.fmin(ca.fmax(2.0 * probability / OUTSIDE - 1.0, 0.0), 1.0)
