"""A measurement, and what one hypothesis makes of it: the update of the extended Kalman filter.

    z = h(x) + v,  v ~ N(0, R):     nu = z - h(x),   S = H P H' + R,   K = P H' / S
    x <- x + K nu,   P <- (I - K H) P (I - K H)' + K R K'              where  ln N(nu; 0, S) > ln a
    ln w <- ln w + c max(ln N(nu; 0, S), ln a)

The alternative is that the measurement is of something else: an obstacle, a switch that is wrong, a valve that opened.
Its density is a. One rule decides whether a hypothesis is corrected: the measurement is likelier as itself than as
something else. The power c tempers evidence that is not independent (docs/explanation/model.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce

import casadi as ca

from ramsight.expression import Condition, Flag, Real, Scalar, all_of, count, holds, scalar
from ramsight.sensor.belief.hypothesis import Hypothesis, choose
from ramsight.sensor.covariance import Covariance
from ramsight.sensor.quantity import Quantity, Row
from ramsight.sensor.thresholds import TINY

BY_PLACE: Mapping[Quantity, Condition] = {one: True for one in Quantity if one != Quantity.COMPLIANCE}
"""What a measurement of the place teaches: all but the compliance."""


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """One measurement of all hypotheses."""

    use: Flag  # whether there is one at this sample
    innovation: Scalar  # z less what was expected at the linearisation point
    H: Row  # derivatives of the measurement by the quantities
    # at: the linearisation point; quantities that are left out are 0 there
    at: Mapping[Quantity, Scalar] = field(default_factory=dict)
    R: Scalar  # variance of its error
    alternative: Scalar | None = None  # logarithm of the density a of something else; None where `gate` gives it
    gate: float = 0.0  # standard deviations of the innovation at which something else is as likely
    # teaches: the quantities that it corrects, each with its condition; None for all (the others are considered)
    teaches: Mapping[Quantity, Condition] | None = None
    power: Real = 1.0  # c, how much it counts as evidence of a hypothesis over an independent one [1]; 0 for none
    common: Real = 0.0  # standard deviation of the error that all measurements of its kind share
    arrived: Real = 0.0  # variance that the position gains with it [m2]
    # stands: nominal position at it, and the stroke: whatever it is lies within the cylinder [m]; None anywhere
    stands: tuple[Scalar, Scalar] | None = None

    def innovation_of(self, h: Hypothesis) -> Scalar:
        """nu, the innovation under a hypothesis."""
        at = {one: self.at.get(one, scalar(0.0)) for one in self.H}
        return self.innovation - h.along(self.H, at)

    def something_else(self, variance: Scalar) -> Scalar:
        """Ln a, for an innovation of this variance."""
        if self.alternative is None:
            return log_density(self.gate**2 * variance, variance)
        return self.alternative

    def outside(self, h: Hypothesis) -> Scalar:
        """How far a hypothesis is beyond the cylinder's ends, squared and normalised; there is nothing to be met."""
        if self.stands is None:
            return scalar(0.0)
        nominal, stroke = self.stands
        position = nominal + h.mean[Quantity.POSITION]
        beyond = ca.fmax(ca.fmax(-position, position - stroke), 0.0)
        return beyond**2 / (h.position_variance + self.R + self.arrived)


@dataclass(frozen=True)
class Applied:
    """A hypothesis after a measurement."""

    hypothesis: Hypothesis  # corrected where it fits
    fits: Flag  # whether the measurement is likelier as itself than as something else
    normal: Scalar  # the squared innovation over its variance
    likelihood: Scalar  # ln N(nu; 0, S)
    evidence: Scalar  # by how much the logarithm of the weight grows
    variance: Scalar  # S
    otherwise: Scalar  # ln a


_NUMBERS = ("normal", "likelihood", "evidence", "variance", "otherwise")


def log_density(squared: Scalar, variance: Real) -> Scalar:
    """Logarithm of a normal density, by the square of the innovation.

    Example:
        >>> round(float(log_density(ca.DM(0.0), 1.0)), 4)
        -0.9189
    """
    return -0.5 * (squared / variance + ca.log(2.0 * math.pi * variance))


def applied(h: Hypothesis, m: Measurement) -> Applied:
    """What a hypothesis makes of a measurement."""
    known, innovation = h.covariance.variance(m.H), m.innovation_of(h)
    total = known + m.R + m.common**2 + m.arrived
    # Beyond the cylinder's ends there is neither an obstacle nor an end that is elsewhere.
    outside = m.outside(h)
    likelihood = log_density(ca.fmax(innovation**2, outside * total), total)
    other = m.something_else(total) - 0.5 * outside
    # With a gate the same without a logarithm.
    fits = likelihood > other if m.alternative is not None else innovation**2 < m.gate**2 * total
    covariance = h.covariance
    if not isinstance(m.arrived, float):
        covariance = covariance.added(Quantity.POSITION, ca.if_else(fits, m.arrived, 0.0))
    # What all measurements of a kind have in common is not learned, however many there are.
    shared = not isinstance(m.common, float) or m.common > 0.0
    new = ca.fmax(1.0 - m.common**2 / known, TINY) if shared else 1.0
    corrected = h.corrected(*_updated(covariance, m, innovation, m.R / new, fits))
    return Applied(
        hypothesis=corrected,
        fits=fits,
        normal=innovation**2 / total,
        likelihood=likelihood,
        evidence=m.power * ca.fmax(likelihood, other),
        variance=total,
        otherwise=other,
    )


def either(condition: Flag, then: Applied, otherwise: Applied) -> Applied:
    """One of two."""
    return Applied(
        hypothesis=choose(condition, then.hypothesis, otherwise.hypothesis),
        fits=holds(ca.if_else(condition, count(then.fits), count(otherwise.fits))),
        **{name: ca.if_else(condition, getattr(then, name), getattr(otherwise, name)) for name in _NUMBERS},
    )


def _updated(
    covariance: Covariance, m: Measurement, innovation: Scalar, variance: Scalar, fits: Flag
) -> tuple[Covariance, dict[str, Scalar]]:
    if m.teaches is None:
        return covariance.updated(m.H, innovation, variance, fits)
    use = {one: all_of(fits, condition) for one, condition in m.teaches.items()}
    return covariance.considered(m.H, innovation, variance, use)


def tempered(each: Sequence[Applied], counts: Scalar) -> list[Scalar]:
    """Evidence of a measurement like others before it, whose errors are correlated.

    The errors of contacts with one end are those of its place, of the law of leakage, of the way from the other end. A
    hypothesis that predicts each slightly better must not become certain by repetition. Of

        ln N(nu; 0, S) = -1/2 (nu^2/S + ln(S/S_min) + ln(2 pi S_min))

    the first and the second term count by a share up to 1 each, and in full beyond.
    """
    least = reduce(ca.fmin, (one.variance for one in each))

    def shared(value: Scalar) -> Scalar:
        return counts * ca.fmin(value, 1.0) + ca.fmax(value - 1.0, 0.0)

    found = []
    for one in each:
        misfit = shared(-2.0 * one.likelihood - ca.log(2.0 * math.pi * one.variance))
        wider = shared(ca.log(one.variance / least))
        found.append(ca.fmax(-0.5 * (misfit + wider + ca.log(2.0 * math.pi * least)), one.otherwise))
    return found
