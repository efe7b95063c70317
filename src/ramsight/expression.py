"""Kinds of graph expressions, and what is said of conditions: a condition is no number, and a column no scalar.

At run time each of them is a CasADi expression. A type checker tells them apart, by the stub of CasADi in `typings/`:
a condition that is added to metres, or a length that is used as a condition, does not pass it.

    Scalar   a number that depends on symbols
    Flag     whether something holds; 1 or 0 in a state
    Vector   a column of numbers
    Matrix   rows and columns of numbers, such as a Jacobian
    Real     a Scalar, or a plain number where a law is evaluated without a graph
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, TypeAlias

import casadi as ca

if TYPE_CHECKING:
    from casadi import Flag as Flag
    from casadi import Matrix as Matrix
    from casadi import Scalar as Scalar
    from casadi import Vector as Vector
else:
    Flag = Matrix = Scalar = Vector = ca.SX

Real: TypeAlias = "Scalar | float"
Condition: TypeAlias = "Flag | bool"


def scalar(value: float) -> Scalar:
    """A plain number as an expression."""
    expression: Scalar = ca.SX(float(value))
    return expression


def flag(value: bool) -> Flag:
    """A plain condition as an expression."""
    expression: Flag = ca.SX(float(value))
    return expression


def scalar_symbol(name: str) -> Scalar:
    """A new symbol for a number."""
    symbol: Scalar = ca.SX.sym(name)
    return symbol


def flag_symbol(name: str) -> Flag:
    """A new symbol for a condition, 0 or 1."""
    symbol: Flag = ca.SX.sym(name)
    return symbol


def all_of(first: Condition, *others: Condition) -> Flag:
    """Whether all hold.

    Example:
        >>> x = scalar_symbol("x")
        >>> all_of(x > 0.0, x < 1.0)
        SX(((0<x)&&(x<1)))
    """
    return reduce(ca.logic_and, others, _graph(first))


def any_of(first: Condition, *others: Condition) -> Flag:
    """Whether at least one holds.

    Example:
        >>> x = scalar_symbol("x")
        >>> any_of(x < 0.0, x > 1.0)
        SX(((x<0)||(1<x)))
    """
    return reduce(ca.logic_or, others, _graph(first))


def negated(condition: Condition) -> Flag:
    """Whether a condition does not hold."""
    return ca.logic_not(condition)


def count(condition: Condition) -> Scalar:
    """1 where a condition holds, else 0."""
    number: Scalar = _graph(condition)  # type: ignore[assignment]
    return number


def holds(number: Scalar) -> Flag:
    """Whether a number that is 0 or 1 is 1."""
    condition: Flag = number  # type: ignore[assignment]
    return condition


def never(condition: Flag) -> bool:
    """Whether a condition is false on every sample, by how the machine is described."""
    return bool(condition.is_constant() and condition.is_zero())


def within(value: Real, low: Real, high: Real) -> Scalar:
    """A number kept between two others."""
    return ca.fmin(ca.fmax(value, low), high)


def replaced_where(condition: Condition, value: Real, other: Real) -> Scalar:
    """Another finite number where a condition holds, as a sum: what leads to the value waits for other conditions.

    A choice would make it the body of one branch, and what is in a branch has none of its own.

    Example:
        >>> [float(ca.DM(replaced_where(flag(one), 2.0, 49.0))) for one in (False, True)]
        [2.0, 49.0]
    """
    replaced: Scalar = value + count(condition) * (other - value)
    return replaced


def _graph(condition: Condition) -> Flag:
    return flag(condition) if isinstance(condition, bool) else condition
