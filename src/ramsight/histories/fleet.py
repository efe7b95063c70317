"""Sister machines side by side: a population and each of them, and the one that leaves the others.

What is known of machine i is theta_i ~ N(y_i, s_i^2), and the machines are theta_i ~ N(mu, tau^2). mu has a flat prior,
tau a half-Cauchy one, over which it is summed (Gelman et al. (2013), Bayesian Data Analysis, section 5.4). A machine is
nearer to the population the less is known of it: by the share s_i^2 / (s_i^2 + tau^2), its shrinkage. It leaves the
others where it would be rare beside a population that is made of these alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.normal import upper_tail

FEWEST = 4
"""Machines from which on one can leave the others: three, of which none is the rule, say nothing of a fourth."""
RARE = 0.05
"""Chance that any of a population that is one leaves the others [1]."""
_SPREADS = np.geomspace(0.003, 1.5, 60)
_USUAL = 0.1  # scale of the prior of the spread


@dataclass(frozen=True)
class Member:
    """A machine among its sisters."""

    # value, std: as measured [1]
    value: float
    std: float
    # shrunk, shrunk_std: with what the others say [1]
    shrunk: float
    shrunk_std: float
    shrinkage: float  # share by which it is moved to their mean [1]
    chance: float  # that a machine of the population of the others is as far away or farther [1]
    leaves: bool  # whether it leaves the others


@dataclass(frozen=True)
class Population:
    """Sister machines."""

    mean: float  # of the population [1]
    spread: float  # standard deviation between machines [1]
    members: tuple[Member, ...]  # in the order that was passed


def population(values: Sequence[float], stds: Sequence[float]) -> Population:
    """A population and its members.

    Args:
        values: of the machines, two at least [1].
        stds: their standard deviations [1].

    Example:
        >>> found = population([0.0, 0.02, -0.01, 0.03, 0.5], [0.02] * 5)
        >>> [one.leaves for one in found.members]
        [False, False, False, False, True]
    """
    value, std = np.asarray(values, dtype=np.float64), np.asarray(stds, dtype=np.float64)
    weight, mean, variance = _posterior(value, std)
    share = std[:, None] ** 2 / (std[:, None] ** 2 + _SPREADS**2)
    pulled = (1.0 - share) * value[:, None] + share * mean
    spread_of = (1.0 - share) * std[:, None] ** 2 + share**2 * variance
    shrunk = pulled @ weight
    shrunk_std = np.sqrt((spread_of + (pulled - shrunk[:, None]) ** 2) @ weight)
    members = []
    for k in range(len(value)):
        chance = _chance(np.delete(value, k), np.delete(std, k), float(value[k]), float(std[k]))
        leaves = len(value) >= FEWEST and chance < RARE / len(value)
        members.append(
            Member(
                float(value[k]), float(std[k]), float(shrunk[k]), float(shrunk_std[k]), float(share[k] @ weight),
                chance, leaves,
            )
        )  # fmt: skip
    return Population(float(mean @ weight), float(_SPREADS @ weight), tuple(members))


def _posterior(value: Array, std: Array) -> tuple[Array, Array, Array]:
    """Of each spread: its probability, and mean and variance of the population's mean."""
    precision = 1.0 / (std[:, None] ** 2 + _SPREADS**2)
    variance = 1.0 / precision.sum(axis=0)
    mean = variance * (precision * value[:, None]).sum(axis=0)
    power = 0.5 * np.log(variance) + 0.5 * np.log(precision).sum(axis=0)
    power -= 0.5 * (precision * (value[:, None] - mean) ** 2).sum(axis=0)
    power += np.log(_SPREADS / (1.0 + (_SPREADS / _USUAL) ** 2))  # the grid is one of logarithms
    weight = np.exp(power - power.max())
    return weight / weight.sum(), mean, variance


def _chance(others: Array, stds: Array, value: float, std: float) -> float:
    """Chance of a machine that is as far from the others as this one, either way [1]."""
    if len(others) == 0:
        return 1.0
    weight, mean, variance = _posterior(others, stds)
    above = float(upper_tail((value - mean) / np.sqrt(std**2 + _SPREADS**2 + variance)) @ weight)
    return min(2.0 * min(above, 1.0 - above), 1.0)
