"""The hypotheses of the sensor by what they take for true, and the names of their states."""

from __future__ import annotations

from enum import IntEnum

from ramsight.sensor.quantity import Quantity


class Kind(IntEnum):
    """What a hypothesis takes for true; its place among all of them.

    `DESCRIBED`: both ends are where the description has them. `LEAKS`: so they are, and the pumps leak much more or
    less than described, or by another law of pressure. `LOW`, `TOP`: the end of the stroke is met somewhere else at the
    retracted, at the extended end. `UNKNOWN_POSITION`: the position is unknown, for a reason of no stated kind.
    """

    DESCRIBED = 0
    LEAKS = 1
    LOW = 2
    TOP = 3
    UNKNOWN_POSITION = 4

    @property
    def text(self) -> str:
        """Its name in outputs, for example ``described``."""
        return self.name.lower()

    @property
    def words(self) -> str:
        """What it takes for true, in words."""
        return _WORDS[self]


_WORDS = {
    Kind.DESCRIBED: "both ends of the stroke are where the description has them",
    Kind.LEAKS: "the pumps leak otherwise than described",
    Kind.LOW: "the retracted end is met elsewhere",
    Kind.TOP: "the extended end is met elsewhere",
    Kind.UNKNOWN_POSITION: "the position is unknown",
}
ANOTHER_MACHINE = (Kind.LEAKS, Kind.UNKNOWN_POSITION)
"""Those under which the ends are where they are described, and the machine is another one."""
KINDS = tuple(Kind)
"""All of them; a smaller sensor has the first, the last, and some between."""


def state_of(place: int, quantity: Quantity) -> str:
    """Name of the state that the hypothesis at a place has for a quantity; where there are all, a `Kind` is its place.

    Example:
        >>> state_of(Kind.LOW, Quantity.LEAKAGE)
        'hypotheses[2].leakage'
    """
    return f"hypotheses[{int(place)}].{quantity}"


def covariance_of(place: int, one: Quantity, other: Quantity) -> str:
    """Name of the state that the hypothesis at a place has for a covariance; `one` comes before `other` in `Quantity`.

    Example:
        >>> covariance_of(Kind.DESCRIBED, Quantity.LEAKAGE, Quantity.LEAKAGE)
        'hypotheses[0].covariance[leakage,leakage]'
    """
    return f"hypotheses[{int(place)}].covariance[{one},{other}]"
