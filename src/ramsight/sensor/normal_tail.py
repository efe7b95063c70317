"""The upper tail of the normal distribution as an expression."""

from __future__ import annotations

import casadi as ca

from ramsight.expression import Real, Scalar

# Tsay, Huang and Wang (2013), A simple approximation for the normal distribution:
# erfc(x) ~ exp(-1.0950 x - 0.7565 x^2); 3 % too much at two standard deviations, 20 % at three, 90 % at 4.3.
_LINEAR, _SQUARE = 1.0950 / 2.0**0.5, 0.7565 / 2.0


def upper_tail(x: Scalar) -> Scalar:
    """Probability that a standard normal variable is larger than `x`.

    Example:
        >>> [round(float(upper_tail(ca.DM(x))), 3) for x in (0.0, 1.0, 1.96, -1.96)]
        [0.5, 0.158, 0.026, 0.974]
    """
    size = ca.fmin(ca.fabs(x), 30.0)
    tail: Real = 0.5 * ca.exp(-(_LINEAR + _SQUARE * size) * size)
    return ca.if_else(x >= 0.0, tail, 1.0 - tail)
