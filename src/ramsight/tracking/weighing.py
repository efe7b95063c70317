"""Explanations compared by likelihood: each has a prior, and a likelihood averaged over what it leaves open.

All scores are natural logarithms, known but for a constant. The log, or the description, as it is stands first; another
explanation is named only where that one has become improbable.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import fmean

from ramsight.constant import Constant

SURE = Constant(0.1, "1", "probability of what is described, below which a mistake is named: it is nine times likelier")
WORTH = math.log(0.05)
"""A second explanation is named if it is no less likely than that share of the first."""


def log_mean(scores: Sequence[float]) -> float:
    """Logarithm of the mean of what has these logarithms.

    Args:
        scores: natural logarithms.

    Example:
        >>> round(math.exp(log_mean([math.log(1.0), math.log(3.0)])), 12)
        2.0
    """
    highest = max(scores)
    return highest + math.log(fmean(math.exp(score - highest) for score in scores))


def probabilities(scores: Sequence[float]) -> list[float]:
    """Probability of each explanation among all of them.

    Args:
        scores: natural logarithms of prior times likelihood, up to a common constant.

    Example:
        >>> [round(one, 3) for one in probabilities([0.0, math.log(3.0)])]
        [0.25, 0.75]
    """
    highest = max(scores)
    weights = [math.exp(score - highest) for score in scores]
    total = sum(weights)
    return [weight / total for weight in weights]
