"""How often a report that is alive repeats by chance, so that one that is stuck can be distinguished from it.

A value that is rounded to steps and has noise is now and then the same as the one before. Of a steady value the noise
falls into the step k with the probability p_k, and n repeats in a row, n + 1 equal reports, with

    P(n) = sum over k of p_k^(n + 1),    p_k = Phi((k + 1/2) s) - Phi((k - 1/2) s),    s = step/noise,

where Phi is the normal distribution; a value in the middle of a step repeats most often. (The square of the
probability of one repeat is less than that of two: what repeated is likely to lie well within its step.) A value that
moves repeats less often.
"""

from __future__ import annotations

import math
from itertools import pairwise
from statistics import NormalDist

import casadi as ca

from ramsight.control.thresholds import FALSE_ALARM_RATE, NEVER_SAMPLES, PRIOR_REPEATS, TAIL_SIGMAS
from ramsight.expression import Real, Scalar


def runs(share: float, period: float) -> int:
    """Samples in a row, of which each occurs by chance with this share, that are rarer than `FALSE_ALARM_RATE`.

    Args:
        share: probability of one sample [1].
        period: of the samples [s].

    Example:
        >>> runs(0.0, 0.02), runs(0.05, 0.02), runs(0.2, 0.02)
        (1, 7, 12)
    """
    if share <= 0.0:
        return 1
    return max(math.ceil(math.log(FALSE_ALARM_RATE * period) / math.log(share)), 1)


def runs_of(share: Real, period: float) -> Scalar:
    """As `runs`, of a share above 0 and below 1 that is an expression."""
    return ca.fmax(ca.ceil(math.log(FALSE_ALARM_RATE * period) / ca.log(share)), 1.0)


def upper_share(met: Real, samples: Real) -> Real:
    """Upper 95 % bound of a rare event's share [1], by how often it was met in so many samples; 1 before any.

    Example:
        >>> upper_share(0.0, 0.0), round(upper_share(27.0, 300.0), 3)
        (1.0, 0.099)
    """
    return (met + PRIOR_REPEATS) / (samples + PRIOR_REPEATS)


def repeats(count: int, noise: float, step: float, off: float = 0.0) -> float:
    """Probability that a steady value is reported as often again as it was just now [1].

    Args:
        off: by which the value is off the middle of a step, in the same unit.

    Example:
        >>> [round(repeats(1, noise, 1.0), 3) for noise in (0.5, 1.0, 2.0)]
        [0.516, 0.271, 0.14]
        >>> round(repeats(2, 1.0, 1.0), 3)
        0.085
    """
    normal, reach = NormalDist(off, noise), math.ceil(TAIL_SIGMAS * noise / step) + 1
    edges = [normal.cdf((k - 0.5) * step) for k in range(-reach, reach + 2)]
    return sum((after - before) ** (count + 1) for before, after in pairwise(edges))


def repeats_in_a_row(noise: float, step: float, period: float) -> float:
    """Repeats of a steady value that are rarer than `FALSE_ALARM_RATE`, wherever it lies in a step.

    Args:
        noise: standard deviation before it is rounded; 0: there is none, and it may repeat for ever.
        step: to which it is rounded, in the same unit; 0: it never repeats.
        period: of the samples [s].

    Returns:
        A whole number, or infinity.

    Example:
        >>> [repeats_in_a_row(noise, 1.0, 0.02) for noise in (0.0, 1.0, 2.0, 10.0)]
        [inf, 19, 11, 6]
    """
    if step <= 0.0:
        return 1
    if noise <= 0.0:
        return math.inf
    likeliest = 2.0 * NormalDist().cdf(0.5 * step / noise) - 1.0
    if likeliest >= 1.0 or math.log(FALSE_ALARM_RATE * period) / math.log(likeliest) > NEVER_SAMPLES:
        return math.inf
    count = max(math.floor(runs(likeliest, period) / 2) - 1, 1)
    while repeats(count, noise, step) > FALSE_ALARM_RATE * period:
        count += 1
    return count
