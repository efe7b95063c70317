"""Machines that differ in some values: as they were built, or in their descriptions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine import load_machine, only_unit, walk
from ramsight.machine.declare import Quantity
from ramsight.machine.description import Machine, Unit
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import AnyUnit, build
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import si_unit

Vary = Mapping[str, Sequence[float | str]]
_FACTORS = tuple(one.name for one in fields(AsBuilt))


@dataclass(frozen=True)
class Varied:
    """Machines, and what is varied of them.

    Attributes:
        units: the machines.
        coordinates: values of what is varied [SI], shape (machines,), by name, each with its unit.
    """

    units: list[HydraulicUnit]
    coordinates: Mapping[str, tuple[Any, str]]


def varied(machine: AnyUnit, unit: str | None, vary: Vary) -> Varied:
    """Machines that differ in some values, in the order of the values.

    Args:
        machine: the machine; as a description, a name or a file where values of the description vary.
        unit: name of the unit, if the machine has several.
        vary: values of each machine by name: a factor of `AsBuilt`, or a key of the unit's description.

    Raises:
        DescriptionError: the values are not equally many, or one cannot be used.
        UnknownNameError: there is neither such a factor nor such a key.
    """
    columns = _columns(vary)
    described, name = _described(machine, unit)
    keys = {} if described is None else {one.path: one.declared for one in walk(described)}
    for one in columns:
        if one not in _FACTORS and keys.get(one) is None:
            known = [*_FACTORS, *(path for path, declared in keys.items() if declared is not None)]
            raise UnknownNameError("value to vary", one, known)
    sheet, units = build(machine, unit), []
    read: dict[str, list[float]] = {one: [] for one in columns}
    for k in range(len(next(iter(columns.values())))):
        values = {one: _value(column[k], one, keys.get(one)) for one, column in columns.items()}
        own = {one: value for one, value in values.items() if one not in _FACTORS}
        made = sheet if described is None or not own else build(described.replace(own), name)
        factors = AsBuilt(**{one: value for one, value in values.items() if one in _FACTORS})
        units.append(factors.apply(made))
        for one, value in values.items():
            read[one].append(value)
    units_of = {one: "1" if one in _FACTORS else _unit_of(keys[one]) for one in columns}
    return Varied(units, {one: (np.array(values), units_of[one]) for one, values in read.items()})


def _columns(vary: Vary) -> dict[str, list[float | str]]:
    """The values of each machine by name, equally many."""
    passed = vary if isinstance(vary, Mapping) else {}
    columns = {
        name: list(values)
        for name, values in passed.items()
        if isinstance(name, str) and isinstance(values, Iterable) and not isinstance(values, str)
    }
    counts = {len(values) for values in columns.values()}
    if len(columns) != len(passed) or len(counts) != 1 or counts == {0}:
        allowed = "{'leak': [1.0, 1.2]}"
        raise DescriptionError("needs a list of each value, all equally long", key="vary", allowed=allowed)
    return columns


def _described(machine: AnyUnit, unit: str | None) -> tuple[Unit | None, str | None]:
    """The unit's description, if the machine is one, and the unit's name."""
    if isinstance(machine, Unit):
        return machine, unit
    if isinstance(machine, str | Path | Machine):
        whole = load_machine(machine)
        name = only_unit(whole) if unit is None else unit
        return whole.unit(name), name
    return None, unit


def _value(value: float | str, name: str, declared: Quantity | None) -> float:
    """A value in SI, held against its range."""
    if declared is None:
        return float(getattr(AsBuilt(**{name: value}), name))  # type: ignore[arg-type]
    try:
        return float(declared.read(value.item() if isinstance(value, np.number) else value))
    except DescriptionError as error:
        raise DescriptionError(error.message, key=f"vary.{name}", value=error.value, allowed=error.allowed) from None


def _unit_of(declared: Quantity | None) -> str:
    return "1" if declared is None else si_unit(declared.unit)
