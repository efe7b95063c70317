"""One hypothesis of what is unknown of the machine: estimates, their covariance, and its probability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, within
from ramsight.sensor.covariance import Covariance, where
from ramsight.sensor.quantity import Quantity, Row, along
from ramsight.sensor.thresholds import (
    COMPLIANCE_FACTOR_MOST,
    DISPLACEMENT_TOLERANCE,
    LAG_MOST,
    LEAK_FACTOR_LEAST,
    LEAK_FACTOR_MOST,
    LEAKAGE_EXPONENT_MOST,
)

BOUNDS = {
    Quantity.LEAKAGE: (LEAK_FACTOR_LEAST, LEAK_FACTOR_MOST),
    Quantity.DISPLACEMENT: (1.0 - DISPLACEMENT_TOLERANCE, 1.0 + DISPLACEMENT_TOLERANCE),
    Quantity.COMPLIANCE: (1.0 / COMPLIANCE_FACTOR_MOST, COMPLIANCE_FACTOR_MOST),
    Quantity.LAG: (-LAG_MOST, LAG_MOST),
    Quantity.EXPONENT: (-LEAKAGE_EXPONENT_MOST, LEAKAGE_EXPONENT_MOST),
}
"""What estimates of the machine are kept within [SI]: inputs that cannot be leave nothing behind that overflows."""


def _describes_machine(key: str) -> bool:
    """Whether an estimate is of the machine, by its name."""
    return key != Quantity.POSITION


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Estimates under one hypothesis."""

    # mean: of each quantity: position over the nominal one [m], factors [1], lag [s], exponent [1], places of the
    # stops over the cylinder's ends [m], and where they are learned the error of the link's angle [rad] and how much
    # warmer the oil in the pumps is [K]
    mean: Mapping[Quantity, Scalar] = leaf("SI", None, learned=_describes_machine, inline=True)
    covariance: Covariance  # of these
    log_weight: Scalar = leaf("1", None, learned=True)  # natural logarithm of its probability, but for a common term

    @property
    def position_std(self) -> Scalar:
        """Standard deviation of the position [m]."""
        return self.covariance.std(Quantity.POSITION)

    @property
    def position_variance(self) -> Scalar:
        """Variance of the position [m2]."""
        return self.covariance[Quantity.POSITION, Quantity.POSITION]

    def along(self, row: Row, point: Mapping[Quantity, Scalar]) -> Real:
        """How far something is off that was worked out with other values, by its derivatives."""
        return along(row, self.mean, point)

    def shifted(self, by: Real) -> Hypothesis:
        """With another position [m]."""
        return replace(self, mean={**self.mean, Quantity.POSITION: self.mean[Quantity.POSITION] + by})

    def corrected(self, covariance: Covariance, changes: Mapping[str, Scalar]) -> Hypothesis:
        """With estimates changed by so much and another covariance; those of the machine stay within `BOUNDS`."""
        mean = {one: value + changes[one] if one in changes else value for one, value in self.mean.items()}
        mean |= {one: within(mean[one], *bounds) for one, bounds in BOUNDS.items()}
        return replace(self, mean=mean, covariance=covariance)

    def with_covariance(self, covariance: Covariance) -> Hypothesis:
        """With another covariance."""
        return replace(self, covariance=covariance)

    def with_log_weight(self, log_weight: Scalar) -> Hypothesis:
        """With another weight."""
        return replace(self, log_weight=log_weight)


def choose(condition: Flag, then: Hypothesis, otherwise: Hypothesis) -> Hypothesis:
    """One of two hypotheses."""
    return Hypothesis(
        mean={one: ca.if_else(condition, value, otherwise.mean[one]) for one, value in then.mean.items()},
        covariance=where(condition, then.covariance, otherwise.covariance),
        log_weight=ca.if_else(condition, then.log_weight, otherwise.log_weight),
    )
