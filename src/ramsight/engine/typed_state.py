"""State as frozen dataclasses: what a recursion carries from sample to sample has a type, a unit and a first value.

A stage declares its states as a frozen dataclass of `leaf`s. Dataclasses nest; a field may also be a tuple, a mapping
by name or a quantity, or None for what a machine does not have. Names follow from that alone:

    load.variance    hypotheses[2].leakage    hypotheses[2].covariance[leakage,lag]

The same dataclass holds the first values, the symbols of the recursion and the expressions after a sample, so a stage
is a function of values: (state, inputs, parameters) -> (state, outputs).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.expression import Flag

S = TypeVar("S")
Learned = bool | Callable[[str], bool]


@dataclass(frozen=True)
class Kind:
    """What is declared of a state."""

    unit: str = "1"
    # whether it describes the machine, and stays when the position is forgotten; of a mapping, by key
    learned: Learned = False
    always: bool = False  # whether it follows samples that are passed over as well
    variance: Learned = False  # whether it is the variance of something, and so never negative; of a mapping, by key
    inline: bool = False  # whether names leave out the field's own name
    # what keeps every digit of a state: the name of the input that it repeats, or `sum` for what grows by little at a
    # time; empty for all others
    exact: str = ""


@dataclass(frozen=True)
class Leaf:
    """One state of a recursion."""

    name: str  # by its path, for example `hypotheses[2].leakage`
    value: Any  # first value, symbol or expression
    unit: str
    learned: bool  # whether it describes the machine
    always: bool  # whether it follows samples that are passed over
    variance: bool  # whether it is a variance
    exact: str  # the input that it repeats, or `sum`; empty for all others


_DEFAULT = Kind()


def leaf(
    unit: str,
    initial: float | None = 0.0,
    *,
    learned: Learned = False,
    always: bool = False,
    variance: Learned = False,
    inline: bool = False,
    exact: str = "",
) -> Any:
    """A state of a dataclass.

    Args:
        initial: value before the first sample; None where it depends on the machine.
        exact: the input that it repeats, or ``sum`` for what grows by little at a time.

    Example:
        >>> @dataclass(frozen=True)
        ... class Smoothing:
        ...     value: Any = leaf("K")
        ...     age: Any = leaf("s")
        >>> [one.name for one in leaves(Smoothing())]
        ['value', 'age']
    """
    metadata = {"kind": Kind(unit, learned, always, variance, inline, exact)}
    if initial is None:
        return field(metadata=metadata)
    return field(default_factory=lambda: ca.SX(float(initial)), metadata=metadata)


def inlined() -> Any:
    """A field whose own states are named without it."""
    return field(metadata={"kind": Kind(inline=True)})


def leaves(tree: object) -> list[Leaf]:
    """All states of a tree, in the order of its fields."""
    return list(_walk(tree, "", "", _DEFAULT))


def _walk(node: object, name: str, key: str, kind: Kind) -> Iterator[Leaf]:
    if node is None:
        return
    if is_dataclass(node):
        for one in fields(node):
            declared = one.metadata.get("kind", _DEFAULT)
            below = name if declared.inline else f"{name}.{one.name}" if name else one.name
            yield from _walk(getattr(node, one.name), below, "", declared)
    elif isinstance(node, Mapping):
        for part, value in node.items():
            text = part if isinstance(part, str) else ",".join(part)
            dotted = f"{name}.{text}" if name else text
            below = dotted if isinstance(part, str) else f"{name}[{text}]"
            yield from _walk(value, below, text, kind)
    elif isinstance(node, tuple):
        for k, value in enumerate(node):
            yield from _walk(value, f"{name}[{k}]", key, kind)
    else:
        yield Leaf(name, node, kind.unit, _of(kind.learned, key), kind.always, _of(kind.variance, key), kind.exact)


def _of(declared: Learned, key: str) -> bool:
    return declared if isinstance(declared, bool) else declared(key)


def mapped(tree: S, change: Callable[[Leaf], Any]) -> S:
    """The same tree with each state's value changed."""
    values = iter([change(one) for one in leaves(tree)])
    changed: S = _rebuilt(tree, values)
    return changed


def emptied(tree: S) -> S:
    """The same tree with each state zero."""
    return mapped(tree, lambda _: ca.SX(0.0))


def _rebuilt(node: Any, values: Iterator[Any]) -> Any:
    if node is None:
        return None
    if is_dataclass(node) and not isinstance(node, type):
        return replace(node, **{one.name: _rebuilt(getattr(node, one.name), values) for one in fields(node)})
    if isinstance(node, Mapping):
        return {key: _rebuilt(value, values) for key, value in node.items()}
    if isinstance(node, tuple):
        return tuple(_rebuilt(value, values) for value in node)
    return next(values)


def symbols(initial: S) -> S:
    """The state before a sample: a symbol for each first value.

    Raises:
        ValueError: two states have one name.
    """
    names = [one.name for one in leaves(initial)]
    twice = {name for name in names if names.count(name) > 1} if len(set(names)) < len(names) else ()
    if twice:
        raise ValueError(f"two states are named {min(twice)}")
    return mapped(initial, lambda one: ca.SX.sym(one.name))


def initial_values(initial: object) -> Array:
    """The first values of a tree, shape (states,)."""
    return np.array([float(one.value) for one in leaves(initial)])


def chosen(condition: Flag, then: S, otherwise: S) -> S:
    """One of two states of the same shape."""
    others = iter(leaves(otherwise))
    return mapped(then, lambda one: ca.if_else(condition, one.value, next(others).value))


def passed_over(condition: Flag, before: S, after: S) -> S:
    """The state after a sample that may be passed over: then all is as before, but for what is declared `always`."""
    old = iter(leaves(before))

    def kept(one: Leaf) -> Any:
        was = next(old).value
        return one.value if one.always else ca.if_else(condition, was, one.value)

    return mapped(after, kept)


def column(tree: object) -> Any:
    """The values of a tree as one column."""
    return ca.vertcat(*(one.value for one in leaves(tree)))
