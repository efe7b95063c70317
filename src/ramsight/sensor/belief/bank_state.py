"""What the hypotheses are before the first sample and at it, with their priors, and what is kept of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, scalar
from ramsight.machine.assumption_description import AssumedStops
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.hypothesis import Hypothesis
from ramsight.sensor.covariance import Covariance
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.quantity import Quantity

STEP_QUANTITIES = (Quantity.LEAKAGE, Quantity.DISPLACEMENT, Quantity.COMPLIANCE, Quantity.LAG, Quantity.EXPONENT)
"""What a step of the balance is made with on every machine."""

ENDS = (Quantity.LOW, Quantity.TOP)
"""Where the stroke ends. Under a hypothesis whose end is elsewhere the position is as uncertain as that place."""


@dataclass(frozen=True)
class StartOfPosition:
    """What is known of the position at the first sample."""

    first: Flag  # whether this is it
    known: Flag  # whether a position is known at all
    entered: Flag  # whether somebody entered it
    variance: Scalar  # of it [m2]


@dataclass(frozen=True, kw_only=True)
class BankState:
    """The hypotheses and what references show of all of them."""

    hypotheses: tuple[Hypothesis, ...]  # in the order of `Kind`, as many as the sensor weighs
    innovations: Scalar = leaf("1")  # mean square of normalised innovations, less 1
    band_width: Scalar = leaf("1", 1.0)  # of the band over what the filters say, by references
    entered: Flag = leaf("1")  # whether *unknown position* is that an entered start was wrong
    confirmed: Flag = leaf("1")  # whether a place has been measured since the start
    # by_obstacle: whether *unknown position* is that the last contact, taken for an end, was with an obstacle
    by_obstacle: Flag = leaf("1")
    # below, above: how far below and above where it is now the piston has been [m]
    below: Scalar = leaf("m")
    above: Scalar = leaf("m")
    extent: Scalar = leaf("m")  # way between its lowest and its highest place that the hypotheses are weighed by [m]
    extent_std: Scalar = leaf("m")  # standard deviation of the position when it was last that far [m]
    # lost_below, lost_above: the same since *unknown position* lost its place [m]
    lost_below: Scalar = leaf("m")
    lost_above: Scalar = leaf("m")
    # room: share of the stroke that this leaves it; 0 where nobody knows how its position became wrong
    room: Scalar = leaf("1")
    # met_low, met_top: contacts with the retracted and with the extended end
    met_low: Scalar = leaf("1")
    met_top: Scalar = leaf("1")
    # by_low, by_top: whether *unknown position* has its position from a contact with that end
    by_low: Flag = leaf("1")
    by_top: Flag = leaf("1")

    @classmethod
    def initial(
        cls, assumptions: Assumptions, stroke: float, *, with_link: bool = False, kinds: Sequence[Kind] = KINDS
    ) -> BankState:
        """Before the first sample.

        Args:
            stroke: of the cylinder [m].
            with_link: whether the angle of the body that the cylinder turns is measured.
        """
        machine, stops = assumptions.machine, assumptions.stops
        usual = (machine.leak, machine.leak_exponent)
        other = (max(machine.leak, machine.other_leak), max(machine.leak_exponent, machine.other_exponent))
        described, odds = 1.0 - 2.0 * stops.undeclared, machine.leaks_otherwise / (1.0 - machine.leaks_otherwise)
        priors = {
            Kind.DESCRIBED: (described, stops.std, stops.std, usual),
            Kind.LEAKS: (described * odds, stops.std, stops.std, other),
            Kind.LOW: (stops.undeclared, stops.elsewhere, stops.std, usual),
            Kind.TOP: (stops.undeclared, stops.std, stops.elsewhere, usual),
            Kind.UNKNOWN_POSITION: (stops.wrong, stops.std, stops.std, usual),
        }
        found = []
        for kind in kinds:
            probability, low, top, (leak, exponent) = priors[kind]
            std = _prior_std(assumptions, leak, exponent, low * stroke, top * stroke, with_link=with_link)
            mean = {one: scalar(value) for one, value in _prior_mean(assumptions).items() if one in std}
            weight = scalar(math.log(probability))
            found.append(Hypothesis(mean=mean, covariance=Covariance.diagonal(std), log_weight=weight))
        return cls(hypotheses=tuple(found))

    def begun(self, start: StartOfPosition, stops: AssumedStops, stroke: Real, kinds: Sequence[Kind]) -> BankState:
        """At the beginning of a sample; at the first one the position is as uncertain as the start.

        Args:
            stroke: of the cylinder [m].
        """
        unknown2 = (0.5 * stroke) ** 2
        entered = all_of(start.first, start.known, start.entered)
        wrong2 = ca.if_else(entered, start.variance + (stops.elsewhere * stroke) ** 2, unknown2)
        found = []
        for kind, h in zip(kinds, self.hypotheses, strict=True):
            least = wrong2 if kind == Kind.UNKNOWN_POSITION else ca.if_else(start.known, start.variance, unknown2)
            at_first = ca.if_else(start.first, least, 0.0)
            if kind == Kind.UNKNOWN_POSITION:
                h = h.with_log_weight(ca.if_else(entered, math.log(stops.entered), h.log_weight))
            found.append(h.with_covariance(h.covariance.at_least(Quantity.POSITION, at_first)))
        return replace(self, hypotheses=tuple(found), entered=any_of(entered, self.entered))


def stepping(assumptions: Assumptions) -> tuple[Quantity, ...]:
    """The quantities that a step of the balance is made with."""
    return (*STEP_QUANTITIES, *((Quantity.WARMER,) if assumptions.thermometer.offset > 0.0 else ()))


def _prior_mean(assumptions: Assumptions) -> dict[Quantity, float]:
    """Of each quantity."""
    zero = dict.fromkeys(Quantity, 0.0)
    factors = dict.fromkeys((Quantity.LEAKAGE, Quantity.DISPLACEMENT, Quantity.COMPLIANCE), 1.0)
    ends = {Quantity.LOW: assumptions.stops.retracted, Quantity.TOP: -assumptions.stops.extended}
    return {**zero, **factors, Quantity.LAG: assumptions.thermometer.lag, **ends}


def _prior_std(
    assumptions: Assumptions, leak: float, exponent: float, low: float, top: float, *, with_link: bool
) -> dict[Quantity, float]:
    """Of each quantity that there is."""
    machine, thermometer = assumptions.machine, assumptions.thermometer
    std = {
        Quantity.POSITION: 0.0,
        Quantity.LEAKAGE: leak,
        Quantity.DISPLACEMENT: machine.displacement,
        Quantity.COMPLIANCE: machine.compliance,
        Quantity.LAG: thermometer.lag_std,
        Quantity.EXPONENT: exponent,
        Quantity.RELEASE: assumptions.drive.release,
        Quantity.LOW: low,
        Quantity.TOP: top,
    }
    if with_link:
        std[Quantity.ANGLE_OFFSET] = assumptions.link_angle.offset
    if thermometer.offset > 0.0:
        std[Quantity.WARMER] = thermometer.offset
    return std
