"""Contacts, references and torques as measurements, and what they make of a hypothesis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Flag, Real, Scalar, count
from ramsight.sensor.hypothesis import Hypothesis
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.mixture import largest_weight
from ramsight.sensor.quantity import Quantity, Row
from ramsight.sensor.thresholds import (
    LOG_WEIGHT_LEAST,
)


@dataclass(frozen=True)
class TorqueEvidence:
    """A torque that does not depend on the load: it tells leakage or compliance.

    Attributes:
        row: derivatives of the torque with respect to what the step was made with.
        around: the values that it was expected with.
        innovation: torque less the expected one [N m].
        variance: of the torque [N2 m2].
        inflation: of that variance, because errors of samples that follow each other are the same ones [1].
        leakage: whether it tells the leakage.
        compliance: whether it tells the compliance.
    """

    row: Row
    around: Mapping[Quantity, Scalar]
    innovation: Scalar
    variance: Scalar
    inflation: Scalar
    leakage: Flag
    compliance: Flag


@dataclass(frozen=True)
class Measurement:
    """A contact, a reference or an angle.

    Attributes:
        use: whether there is one.
        place: where it is by the description [m].
        nominal: where the nominal position is at it [m].
        low: whether it is a contact at the retracted end.
        top: whether it is a contact at the extended end.
        variance: of its own [m2].
        arrived: variance of the nominal position just there [m2]; the piston is at the place all the same.
        obstacle: probability that it is neither an end nor a reference.
        by_offset: how the place follows the error of the link's angle [m/rad].
        seemed: derivatives of the way that the piston only seemed to move since it came to that nominal position, with
            respect to what the steps were made with.
        around: the values that they were made with.
        went_on: whether it moved that way all the same, after it had been there.
    """

    use: Flag
    place: Scalar
    nominal: Scalar
    low: Flag
    top: Flag
    variance: Scalar
    arrived: Scalar
    obstacle: Scalar
    by_offset: Real
    seemed: Row
    around: Mapping[Quantity, Scalar]
    went_on: Flag

    def row(self, *, with_link: bool) -> dict[Quantity, Real]:
        """Its derivatives."""
        found: dict[Quantity, Real] = {
            Quantity.POSITION: 1.0,
            Quantity.LOW: -count(self.low),
            Quantity.TOP: -count(self.top),
        }
        return {**found, Quantity.ANGLE_OFFSET: self.by_offset} if with_link else found


@dataclass(frozen=True)
class Measured:
    """What a measurement did.

    Attributes:
        accepted: whether the likeliest hypothesis used it.
        rejected: whether it did not.
        moved: by how much that moved the nominal position [m].
        stages: the hypotheses before it, and as it corrected each.
    """

    accepted: Flag
    rejected: Flag
    moved: Scalar
    stages: tuple[Sequence[Hypothesis], ...]


@dataclass(frozen=True)
class Weighed:
    """A hypothesis after a measurement.

    Attributes:
        hypothesis: corrected, with its new weight.
        fits: whether the measurement is an end or a reference under it.
        normal: its normalised innovation, squared.
        likelihood: logarithm of it, were it that.
        variance: of the innovation, as it expected it [m2].
        otherwise: logarithm of the likelihood, were it neither.
    """

    hypothesis: Hypothesis
    fits: Flag
    normal: Scalar
    likelihood: Scalar
    variance: Scalar
    otherwise: Scalar


def log_likelihood(innovation2: Scalar, variance: Real) -> Scalar:
    """Logarithm of a normal density, by the square of the innovation."""
    return -0.5 * (innovation2 / variance + ca.log(2.0 * math.pi * variance))


def normalised(hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """With the weight 0 for the likeliest, and none out of reach."""
    largest = largest_weight(hypotheses)
    return [h.with_weight(ca.fmax(h.weight - largest, LOG_WEIGHT_LEAST)) for h in hypotheses]


def weighed(h: Hypothesis, m: Measurement, row: Row, chance: Scalar, model: MachineModel) -> Weighed:
    """A hypothesis weighed and corrected by a measurement.

    Args:
        h: before it.
        m: the measurement.
        row: its derivatives.
        chance: logarithm of the density of an obstacle.
        model: of the machine.
    """
    h = _taken_back(h, m.seemed, m)
    mean = h.mean
    place = m.place + count(m.low) * mean[Quantity.LOW] + count(m.top) * mean[Quantity.TOP]
    innovation = place - (m.nominal + mean[Quantity.POSITION])
    if Quantity.ANGLE_OFFSET in mean:
        innovation = innovation - m.by_offset * mean[Quantity.ANGLE_OFFSET]
    own = m.variance + m.arrived
    # Beyond the cylinder's ends there is neither an obstacle nor an end that is elsewhere.
    beyond = _beyond(h, m.nominal, own, model.stroke)
    elsewhere = chance - 0.5 * beyond
    total = h.covariance.variance(row) + own
    likelihood = log_likelihood(ca.fmax(innovation**2, beyond * total), total)
    fits = likelihood > elsewhere
    covariance = h.covariance.added(Quantity.POSITION, ca.if_else(fits, m.arrived, 0.0))
    corrected = [one for one in mean if one != Quantity.COMPLIANCE]
    after = h.corrected(*covariance.updated(row, innovation, m.variance, fits, only=corrected))
    went_on = {one: ca.if_else(m.went_on, -by, 0.0) for one, by in m.seemed.items()}
    after = _taken_back(after, went_on, m)
    return Weighed(after, fits, innovation**2 / total, likelihood, total, elsewhere)


def reweighed(each: Sequence[Weighed], counts: Scalar) -> list[Hypothesis]:
    """The hypotheses with the logarithms of their weights, each plus that of its likelihood of the measurement.

    The errors of contacts with one end are correlated: by the place of the end, by the law of leakage, by the way from
    the other end. A hypothesis that predicts each contact slightly better must not become certain by repetition. Of the
    logarithm of the likelihood, -0.5 (v^2/s^2 + ln(s^2/s_min^2) + ln(2 pi s_min^2)) for an innovation v of variance
    s^2, the first and the second term therefore count by the share `counts` up to 1 each, and in full beyond.

    Args:
        each: the hypotheses with their likelihoods of this measurement.
        counts: how much this contact counts as evidence, over an independent one [1].
    """
    least = each[0].variance
    for one in each[1:]:
        least = ca.fmin(least, one.variance)

    def shared(value: Scalar) -> Scalar:
        return counts * ca.fmin(value, 1.0) + ca.fmax(value - 1.0, 0.0)

    found = []
    for one in each:
        wider = ca.log(one.variance / least)
        misfit = -2.0 * one.likelihood - ca.log(2.0 * math.pi * one.variance)
        likelihood = -0.5 * (shared(misfit) + shared(wider) + ca.log(2.0 * math.pi * least))
        found.append(one.hypothesis.with_weight(one.hypothesis.weight + ca.fmax(likelihood, one.otherwise)))
    return found


def _taken_back(h: Hypothesis, by: Row, m: Measurement) -> Hypothesis:
    """Without a way that the piston only seemed to move: what it made unsure, and what it made known."""
    if not by:
        return h
    covariance = h.covariance.predicted({one: -value for one, value in by.items()}, {})
    return h.shifted(-h.along(by, m.around)).with_covariance(covariance)


def _beyond(h: Hypothesis, nominal: Scalar, own: Scalar, stroke: Scalar) -> Scalar:
    """How far a hypothesis is beyond the cylinder's ends, where no piston can be, squared and normalised [1]."""
    position = nominal + h.mean[Quantity.POSITION]
    outside = ca.fmax(ca.fmax(-position, position - stroke), 0.0)
    return outside**2 / (h.position_variance + own)
