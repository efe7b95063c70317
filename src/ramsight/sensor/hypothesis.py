"""One hypothesis of what is not known of the machine: what it believes, how surely, and how likely it is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.sensor.uncertainty import Covariance

NAMES = ("described", "leaks", "low", "top", "wrong")
LEAKS, WRONG = NAMES.index("leaks"), NAMES.index("wrong")
POSITION, LEAK, DISPLACEMENT, COMPLIANCE, LAG, EXPONENT, LOW, TOP, OFFSET, WARMER = range(10)
BOUNDS = ((0.3, 4.0), (0.97, 1.03), (0.4, 2.5))
"""What the factors are kept within [1]."""
_LEARNED = frozenset(
    f"{name}_{what}"
    for name in NAMES
    for what in (
        *range(LEAK, WARMER + 1),
        *(f"covariance_{i}{j}" for i in range(LEAK, WARMER + 1) for j in range(i, WARMER + 1)),
        "weight",
    )
)


def learned(states: Iterable[str]) -> tuple[str, ...]:
    """Those of a sensor's states that know the machine; all others say where the piston is, or of which pressures."""
    return tuple(name for name in states if name in _LEARNED)


@dataclass
class Hypothesis:
    """One hypothesis: its means as expressions, its covariance, its weight.

    Attributes:
        mean: position over the nominal one [m], factors [1], lag [s], places of the stops over the cylinder's ends [m],
            error of the link's angle [rad] where there is one, how much warmer the oil in the pumps is [K] where that
            is learned.
        covariance: of these.
        weight: natural logarithm of its probability, but for a common term.
    """

    mean: list[Any]
    covariance: Covariance
    weight: Any

    def copy(self) -> Hypothesis:
        """As it is now."""
        return Hypothesis(list(self.mean), self.covariance.copy(), self.weight)

    def correct(self, changes: list[Any]) -> None:
        """Change the means by so much; the factors stay within `BOUNDS`."""
        self.mean = [value + change for value, change in zip(self.mean, changes, strict=True)]
        for k, (least, most) in enumerate(BOUNDS, LEAK):
            self.mean[k] = ca.fmin(ca.fmax(self.mean[k], least), most)

    @property
    def position_std(self) -> Any:
        """Standard deviation of the position [m]."""
        return ca.sqrt(ca.fmax(self.covariance[POSITION, POSITION], 0.0))
