"""Which part of a machine has changed, from what its quantities did: probabilities, in words that a fitter uses.

A cause moves some quantities together: levels change by a u, with u what it does to each, and an amount a >= 0 that is
half-normal. With the deviations of the changes and a small change that no cause explains, that gives the likelihood of
each cause (Bayes' theorem). Two causes that do the same stay as likely to each other as they were before: then nothing
in the records tells them apart, and the fitter has to look.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Cause:
    """Something that changes a machine."""

    words: str  # what it is
    look: str  # where to look
    prior: float  # how often it is, beside the others [1]
    does: Mapping[str, float] = field(default_factory=dict)  # change of each level for a usual amount [1]
    by_oil_change: float = 1.0  # how much likelier it is where the change came with a declared oil change


CAUSES = (
    Cause("nothing has changed", "nothing to do", 0.5),
    Cause("the pumps wear", "measure the case drain, hot and at rated speed", 0.15, {"leak": 0.3}, 0.05),
    Cause("the oil is thinner", "look at the oil's grade, its age and fuel in it", 0.07, {"leak": 0.3}, 10.0),
    Cause("the oil is thicker", "look at the oil's grade and age", 0.04, {"leak": -0.3}, 10.0),
    Cause("the thermometer reads too low", "compare it with another one", 0.03, {"leak": 0.2}, 0.2),
    Cause("the thermometer reads too high", "compare it with another one", 0.03, {"leak": -0.2}, 0.2),
    Cause("a groove in a pump, or a valve that leaks", "look at port plates and valve seats", 0.04,
          {"leak": 0.4, "exponent": 0.1}, 0.2),
    Cause("the pumps are other ones, or tighter", "look whether they were replaced", 0.02, {"leak": -0.4}, 0.5),
    Cause("air in the oil, or a soft hose", "bleed it, and feel the hoses under pressure", 0.06, {"compliance": 0.4}),
    Cause("a stiffer hose, or less air", "look whether a hose or the oil was replaced", 0.03, {"compliance": -0.4}),
    Cause("the pump takes in air", "look at oil level, strainer and suction line", 0.02,
          {"displacement": -0.02, "compliance": 0.4}),
    Cause("another displacement or belt", "look whether a pump or a belt was replaced", 0.01, {"displacement": 0.01}),
    Cause("the relief valve opens earlier", "measure its pressure", 0.02, {"relief": -0.1}, 0.5),
    Cause("the relief valve opens later", "measure its pressure", 0.01, {"relief": 0.1}, 0.5),
    Cause("the drive reports too much torque", "compare the motor's current with its data sheet", 0.005,
          {"relief": 0.05, "leak": -0.05}, 0.2),
    Cause("the drive reports too little torque", "compare the motor's current with its data sheet", 0.005,
          {"relief": -0.05, "leak": 0.05}, 0.2),
)  # fmt: skip
"""What is known to happen; how often is a guess."""
UNEXPLAINED = {"leak": 0.03, "displacement": 0.002, "compliance": 0.06, "exponent": 0.01, "relief": 0.01}
"""Deviations of a change that needs no cause [1]."""
_AMOUNTS = np.linspace(0.025, 3.975, 80)  # of a usual amount
_WEIGHTS = np.exp(-0.5 * _AMOUNTS**2) / np.exp(-0.5 * _AMOUNTS**2).sum()


@dataclass(frozen=True)
class Suspected:
    """A cause and its probability [1]."""

    cause: Cause
    probability: float

    @property
    def text(self) -> str:
        """In a line."""
        return f"{100 * self.probability:.0f} %: {self.cause.words} ({self.cause.look})"


def suspected(changes: Mapping[str, tuple[float, float]], *, at_oil_change: bool = False) -> list[Suspected]:
    """The causes of some changes, the likeliest first.

    Args:
        changes: of levels, and their standard deviations, by name [1].

    Example:
        >>> [one.cause.words for one in suspected({"compliance": (0.5, 0.05), "leak": (0.0, 0.03)})][0]
        'air in the oil, or a soft hose'
    """
    names = [name for name in UNEXPLAINED if name in changes and all(map(math.isfinite, changes[name]))]
    seen = np.array([changes[name][0] for name in names])
    std = np.array([math.hypot(changes[name][1], UNEXPLAINED[name]) for name in names])
    odds = []
    for one in CAUSES:
        does = np.array([one.does.get(name, 0.0) for name in names])
        amounts, weights = (_AMOUNTS, _WEIGHTS) if does.any() else (np.zeros(1), np.ones(1))
        if one.does and not does.any():  # nothing of what it does was measured
            odds.append(0.0)
            continue
        off = ((seen - amounts[:, None] * does) / std) ** 2
        odds.append(
            one.prior * (one.by_oil_change if at_oil_change else 1.0) * float(weights @ np.exp(-0.5 * off.sum(axis=1)))
        )
    whole = sum(odds)
    if whole <= 0.0:  # no cause does that: all of them are as likely as before
        odds, whole = [one.prior for one in CAUSES], sum(one.prior for one in CAUSES)
    found = [Suspected(one, chance / whole) for one, chance in zip(CAUSES, odds, strict=True)]
    return sorted(found, key=lambda one: -one.probability)
