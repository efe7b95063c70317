"""The quantities that the sensor estimates, in one enumeration: names of states, rows of derivatives, covariances."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from ramsight.expression import Real, Scalar


class Quantity(StrEnum):
    """What is estimated beside the circuit's pressures and the load.

    Example:
        >>> Quantity.LEAKAGE, Quantity.LEAKAGE.unit
        (<Quantity.LEAKAGE: 'leakage'>, '1')
    """

    POSITION = "position"
    LEAKAGE = "leakage"
    DISPLACEMENT = "displacement"
    COMPLIANCE = "compliance"
    LAG = "lag"
    EXPONENT = "exponent"
    RELEASE = "release"
    LOW = "low"
    TOP = "top"
    ANGLE_OFFSET = "angle_offset"
    WARMER = "warmer"

    @property
    def unit(self) -> str:
        """Its unit."""
        return _UNIT[self]


_UNIT = {
    Quantity.POSITION: "m",
    Quantity.LEAKAGE: "1",
    Quantity.DISPLACEMENT: "1",
    Quantity.COMPLIANCE: "1",
    Quantity.LAG: "s",
    Quantity.EXPONENT: "1",
    Quantity.RELEASE: "1",
    Quantity.LOW: "m",
    Quantity.TOP: "m",
    Quantity.ANGLE_OFFSET: "rad",
    Quantity.WARMER: "K",
}
FACTOR_OF = {"leak": Quantity.LEAKAGE, "displacement": Quantity.DISPLACEMENT, "compliance": Quantity.COMPLIANCE}
"""Of each factor of the balance (`ramsight.plant.balance.FACTORS`) the quantity that it is."""

Row = Mapping[Quantity, Real]
"""Derivatives of something with respect to quantities; those that are left out are 0."""
Values = Mapping[Quantity, Scalar]
"""A value for each quantity that there is."""


def along(row: Row, values: Mapping[Quantity, Real], point: Mapping[Quantity, Real]) -> Real:
    """How far something changes when quantities are other than those it was worked out with."""
    return sum(by * (values[one] - point[one]) for one, by in row.items())
