"""Parameters as symbols: a part's numbers become inputs of the graph, so that one graph serves every machine."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, TypeVar

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.expression import Scalar, Vector, scalar_symbol

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

D = TypeVar("D", bound="DataclassInstance")


class Parameters:
    """A growing list of named parameters with their symbols and values."""

    def __init__(self) -> None:
        self._symbols: dict[str, Scalar] = {}
        self._values: list[float] = []

    def add(self, name: str, value: float) -> Scalar:
        """A new parameter's symbol.

        Raises:
            ValueError: if the name is taken.
        """
        if name in self._symbols:
            raise ValueError(f"parameter {name!r} exists already")
        self._symbols[name] = scalar_symbol(name)
        self._values.append(float(value))
        return self._symbols[name]

    def symbol(self, name: str) -> Scalar:
        """The symbol of a parameter that is there already."""
        return self._symbols[name]

    def symbolic(self, name: str, part: D) -> D:
        """A copy of a dataclass with a parameter `name.field` in place of every float field."""
        numbers = [field.name for field in fields(part) if isinstance(getattr(part, field.name), float)]
        symbols = {key: self.add(f"{name}.{key}", getattr(part, key)) for key in numbers}
        changed: D = replace(part, **symbols)
        return changed

    @property
    def names(self) -> tuple[str, ...]:
        """Names in the order of `column` and `values`."""
        return tuple(self._symbols)

    @property
    def column(self) -> Vector:
        """The symbols as one column."""
        return ca.vertcat(*self._symbols.values())

    @property
    def values(self) -> Array:
        """The values."""
        return np.array(self._values)
