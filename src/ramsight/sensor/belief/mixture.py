"""Several hypotheses together: how likely each is, and how large an error of the position may be."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce

import casadi as ca

from ramsight.expression import Condition, Flag, Real, Scalar, all_of, count, holds, scalar, within
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.belief.hypothesis import Hypothesis
from ramsight.sensor.belief.reach import Reach
from ramsight.sensor.normal_tail import two_sided_quantile, upper_quantile
from ramsight.sensor.quantity import Quantity, Row
from ramsight.sensor.thresholds import LOG_WEIGHT_LEAST, OTHERWISE, OUTSIDE, RISK, TINY


def largest_weight(hypotheses: Sequence[Hypothesis]) -> Scalar:
    """Weight of the likeliest."""
    largest = hypotheses[0].log_weight
    for h in hypotheses[1:]:
        largest = ca.fmax(largest, h.log_weight)
    return largest


def bayes(hypotheses: Sequence[Hypothesis], evidence: Sequence[Real]) -> list[Hypothesis]:
    """Bayes' rule in logarithms, with the weight 0 for the likeliest and none out of reach."""
    weights = [h.log_weight + by for h, by in zip(hypotheses, evidence, strict=True)]
    largest = reduce(ca.fmax, weights)
    return [h.with_log_weight(ca.fmax(w - largest, LOG_WEIGHT_LEAST)) for h, w in zip(hypotheses, weights, strict=True)]


def weighed_where(use: Flag, weighed: Sequence[Hypothesis], otherwise: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Hypotheses with the weights that evidence leads to, where there is some; they differ in nothing else."""
    both = zip(weighed, otherwise, strict=True)
    return [old.with_log_weight(ca.if_else(use, new.log_weight, old.log_weight)) for new, old in both]


def of_likeliest(hypotheses: Sequence[Hypothesis], values: Sequence[Real]) -> Scalar:
    """The value that belongs to the likeliest hypothesis."""
    largest, chosen = largest_weight(hypotheses), values[-1]
    for h, value in reversed(list(zip(hypotheses, values, strict=True))):
        chosen = ca.if_else(h.log_weight >= largest, value, chosen)
    return chosen  # type: ignore[return-value]  # at least one has been chosen


def flag_of_likeliest(hypotheses: Sequence[Hypothesis], values: Sequence[Flag]) -> Flag:
    """The same of conditions."""
    return holds(of_likeliest(hypotheses, [count(one) for one in values]))


def leads(hypotheses: Sequence[Hypothesis], place: int) -> Flag:
    """Whether the hypothesis at a place is the likeliest."""
    return holds(of_likeliest(hypotheses, [float(k == place) for k in range(len(hypotheses))]))


def shares_of(hypotheses: Sequence[Hypothesis]) -> list[Scalar]:
    """Probability of each over that of the likeliest."""
    largest = largest_weight(hypotheses)
    return [ca.exp(h.log_weight - largest) for h in hypotheses]


@dataclass(frozen=True)
class Mixture:
    """Hypotheses weighed against each other."""

    hypotheses: Sequence[Hypothesis]  # all of them
    shares: Sequence[Scalar]  # probability of each over that of the likeliest, when weights last changed
    wrong: Real  # prior probability that the position is wrong for a reason of no stated kind; 0 while there is another

    @classmethod
    def of(cls, hypotheses: Sequence[Hypothesis], wrong: Real) -> Mixture:
        """Of hypotheses as they are."""
        return cls(hypotheses, shares_of(hypotheses), wrong)

    def reweighed(self, hypotheses: Sequence[Hypothesis], where: Flag, weighed: Sequence[Hypothesis]) -> Mixture:
        """After a measurement, where there is one; elsewhere the probabilities stay.

        Nothing else changes a weight, so exponentials are worked out again in samples with a measurement alone.

        Args:
            weighed: with the weights that a measurement leads to, whether there was one or not.
        """
        shares = zip(shares_of(weighed), self.shares, strict=True)
        return Mixture(hypotheses, [ca.if_else(where, new, old) for new, old in shares], self.wrong)

    def moved(self, hypotheses: Sequence[Hypothesis]) -> Mixture:
        """The same with other estimates and the same probabilities."""
        return Mixture(hypotheses, self.shares, self.wrong)

    @property
    def probabilities(self) -> list[Scalar]:
        """Of each."""
        total = sum(self.shares)
        return [share / total for share in self.shares]

    def mean(self, quantity: Quantity) -> Scalar:
        """Of a quantity over all."""
        weighed = (w * h.mean[quantity] for w, h in zip(self.probabilities, self.hypotheses, strict=True))
        return sum(weighed)  # type: ignore[return-value]  # of at least one

    def likeliest(self, value: Callable[[Hypothesis], Real]) -> Scalar:
        """Something of the likeliest hypothesis."""
        return of_likeliest(self.hypotheses, [value(h) for h in self.hypotheses])

    def variance(self, reach: Reach) -> Scalar:
        """Of the position over all, about the nominal one [m2].

        A position that may be anywhere counts from where it is one of twenty cases: the band is that of 95 %.
        """
        weights = self.probabilities
        weights[-1] = weights[-1] * within(weights[-1] / OUTSIDE - 1.0, 0.0, 1.0)
        reaches = reach.under(self.hypotheses)
        weighed = (w * own.second_moment(h) for w, h, own in zip(weights, self.hypotheses, reaches, strict=True))
        return sum(weighed)  # type: ignore[return-value]  # of at least one

    def _deviations(self, width: Scalar, others: Scalar) -> list[Scalar]:
        """Standard deviation of the position under each, with what no hypothesis follows [m]."""
        return [ca.sqrt((width * h.position_std) ** 2 + others) for h in self.hypotheses]

    def _stated(self) -> list[Scalar]:
        """Probabilities, but that of *unknown position* only as far as evidence supports it.

        Until then its weight is an assumption (`stops.wrong`), not a finding.
        """
        stated = self.probabilities
        stated[-1] = ca.fmax(stated[-1] - 2.0 * self.wrong, 0.0)
        return stated

    def band(self, width: Scalar, others: Scalar, reach: Reach) -> tuple[Scalar, Scalar]:
        """How far below and above the position the truth is in 95 of 100 cases [m].

        That of the likeliest hypothesis, and so much more that the truth is outside by any other one with no more than
        `OTHERWISE`: where it has the probability w, its position is outside with

            P(|x_h - x| > band) = q = OTHERWISE / w,

        so it counts the less the less likely it is, and not at all where q is 1. Which hypothesis is true is one draw
        for a whole log: were it 5 %, five logs of a hundred would be wrong from their first sample to the last.

        Args:
            width: factor of the filters' standard deviations [1].
            others: variance of the position by what no hypothesis follows [m2].
        """
        deviations, largest = self._deviations(width, others), largest_weight(self.hypotheses)
        below = above = TWO_SIDED_95 * of_likeliest(self.hypotheses, deviations)
        each = zip(self._stated(), self.hypotheses, deviations, reach.under(self.hypotheses), strict=True)
        for p, h, std, own in each:
            share, off = OTHERWISE / ca.fmax(p, OTHERWISE), h.mean[Quantity.POSITION]
            # Beside the likeliest one side of it counts, about the same position both do.
            beside, about = ca.fabs(off) + upper_quantile(share) * std, two_sided_quantile(share) * std
            far, near = ca.fmax(beside, about), about - ca.fabs(off)
            counts = all_of(h.log_weight < largest, p > OTHERWISE)
            down, up = own.clipped(ca.if_else(off < 0.0, far, near), ca.if_else(off < 0.0, near, far))
            below = ca.fmax(below, ca.if_else(counts, down, 0.0))
            above = ca.fmax(above, ca.if_else(counts, up, 0.0))
        return below, above

    def beyond(self, limit: Scalar, width: Scalar, others: Scalar, reach: Reach, where: Condition = True) -> Scalar:
        """Probability that the error of the position is larger than a limit, whichever hypothesis is true [1].

        Args:
            limit: of the error [m].
            width: factor of the filters' standard deviations [1].
            others: variance of the position by what no hypothesis follows [m2].
            where: whether it is asked for; elsewhere it is 0, and no exponential of it is worked out.
        """
        found, deviations = scalar(0.0), self._deviations(width, others)
        bounds, reaches = self._bounds(deviations), reach.under(self.hypotheses)
        each = zip(self._stated(), self.hypotheses, deviations, bounds, reaches, strict=True)
        for p, h, std, furthest, own in each:  # who has no part in a bound beyond the limit adds less than `RISK`
            beyond = p * own.beyond(h, ca.fmax(std, TINY), limit)
            found = found + ca.if_else(all_of(where, furthest > limit), beyond, 0.0)
        return found

    def bound(self, width: Scalar, others: Scalar) -> Scalar:
        """The error that no more than `RISK` of the samples exceed, whichever hypothesis is true [m].

        By the separation of solutions, as satellite navigation bounds its errors: each hypothesis has its own position
        and deviation, and has a part in the bound as large as its probability asks for,

            b = max_h |x_h - x| + sigma_h sqrt(2 ln(w_h / RISK)).

        Args:
            width: factor of the filters' standard deviations [1].
            others: variance of the position by what no hypothesis follows [m2].
        """
        return reduce(ca.fmax, self._bounds(self._deviations(width, others)), scalar(0.0))

    def _bounds(self, deviations: Sequence[Scalar]) -> Iterator[Scalar]:
        """The part of each hypothesis in a bound, for these standard deviations of the position [m]."""
        for p, h, std in zip(self._stated(), self.hypotheses, deviations, strict=True):
            over = ca.log(ca.fmax(p / RISK, 1.0))
            reach = ca.fabs(h.mean[Quantity.POSITION]) + ca.sqrt(2.0 * over) * std
            yield ca.if_else(over > 0.0, reach, 0.0)

    def std(self, row: Row) -> Scalar:
        """Standard deviation, under the likeliest, of something with these derivatives."""
        return ca.sqrt(ca.fmax(self.likeliest(lambda h: h.covariance.variance(row)), 0.0))
