"""Quantiles of the normal distribution as expressions."""

from __future__ import annotations

import math

import casadi as ca

from ramsight.expression import Scalar
from ramsight.sensor.thresholds import TINY

# Tsay, Huang and Wang (2013), A simple approximation for the normal distribution:
# erfc(x) ~ exp(-1.0950 x - 0.7565 x^2), which has an inverse; a quantile is 1 % too large at 1 %, 2 % at 0.1 %.
_LINEAR, _SQUARE = 1.0950 / math.sqrt(2.0), 0.7565 / 2.0


def upper_tail(size: Scalar) -> Scalar:
    """Probability that a standard normal variable exceeds a size.

    Example:
        >>> [round(float(upper_tail(ca.DM(x))), 3) for x in (0.0, 1.96, -1.96)]
        [0.5, 0.026, 0.974]
    """
    way = ca.fabs(size)
    tail = 0.5 * ca.exp(-way * (_LINEAR + _SQUARE * way))
    return ca.if_else(size > 0.0, tail, 1.0 - tail)


def upper_quantile(probability: Scalar) -> Scalar:
    """What a standard normal variable exceeds with a probability between 0 and 1.

    Example:
        >>> [round(float(upper_quantile(ca.DM(p))), 2) for p in (0.5, 0.16, 0.025, 0.975)]
        [0.0, 0.99, 1.97, -1.97]
    """
    tail = ca.fmin(probability, 1.0 - probability)
    size = two_sided_quantile(2.0 * ca.fmax(tail, TINY))
    return ca.if_else(probability < 0.5, size, -size)


def two_sided_quantile(probability: Scalar) -> Scalar:
    """What the size of a standard normal variable exceeds with a probability above 0 and up to 1.

    Example:
        >>> [round(float(two_sided_quantile(ca.DM(p))), 2) for p in (1.0, 0.32, 0.05)]
        [0.0, 0.99, 1.97]
    """
    return (ca.sqrt(_LINEAR**2 - 4.0 * _SQUARE * ca.log(probability)) - _LINEAR) / (2.0 * _SQUARE)
