"""Laws that are written once for numbers and for graphs: choices that Python makes of floats and CasADi of SX."""

from __future__ import annotations

import math
from typing import cast, overload

import casadi as ca

from ramsight.expression import Condition, Real

_NUMBER = 1e30  # what no quantity here reaches; NaN is not below it either


def _graph(*values: object) -> bool:
    return any(isinstance(value, ca.SX) for value in values)


def least(a: Real, b: Real) -> Real:
    """The smaller of two."""
    return ca.fmin(a, b) if _graph(a, b) else min(a, b)


def most(a: Real, b: Real) -> Real:
    """The greater of two."""
    return ca.fmax(a, b) if _graph(a, b) else max(a, b)


def within(value: Real, low: Real, high: Real) -> Real:
    """A value, kept between two others."""
    return least(most(value, low), high)


@overload
def choose(condition: bool, then: float, otherwise: float) -> float: ...
@overload
def choose(condition: Condition, then: Real, otherwise: Real) -> Real: ...
def choose(condition: Condition, then: Real, otherwise: Real) -> Real:
    """One of two values; both are worked out."""
    if _graph(condition):
        return ca.if_else(condition, then, otherwise)
    return then if condition else otherwise


def both(first: Condition, second: Condition) -> Condition:
    """Whether both hold."""
    return ca.logic_and(first, second) if _graph(first, second) else bool(first) and bool(second)


def root(value: Real) -> Real:
    """The square root."""
    return ca.sqrt(value) if _graph(value) else math.sqrt(value)


def towards(value: Real) -> Real:
    """+1 where a value is not negative, else -1."""
    return choose(value >= 0.0, 1.0, -1.0)


def known(value: Real) -> Condition:
    """Whether a value is a finite number.

    Example:
        >>> known(0.1), known(float("nan"))
        (True, False)
    """
    return cast("Real", abs(value)) <= _NUMBER
