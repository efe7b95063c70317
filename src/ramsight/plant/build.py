"""Any described unit becomes parts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from ramsight.argument_kinds import by_kind
from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine import load_machine, only_unit
from ramsight.machine.description import Composed, DirectDriven, Machine, Unit
from ramsight.machine.linkage import Linkage
from ramsight.machine.requirement_description import Requirement
from ramsight.plant.unit import HydraulicUnit

U = TypeVar("U", bound=HydraulicUnit)
AnyUnit = str | Path | Machine | Unit | HydraulicUnit


@by_kind
def build(machine: AnyUnit, unit: str | None = None) -> HydraulicUnit:
    """A unit made of its parts, whatever its circuit: what every other function takes.

    Args:
        machine: a machine, its name or file; or one unit's description, which moves no body of a linkage; a built unit
            is returned as it is.
        unit: name of the unit; may be left out where there is only one.

    Returns:
        The unit, all values in SI units.

    Raises:
        DescriptionError: several units, and none is named; the circuit cannot move its load; or what is described
            cannot be used.
        UnknownNameError: no such machine or unit.

    Example:
        >>> import ramsight
        >>> boom = ramsight.build("mining-loader", "boom")
        >>> boom.name, round(boom.cylinder.stroke, 3)  # m
        ('boom', 0.7)
    """
    if isinstance(machine, str | Path | Machine):
        description = load_machine(machine)
        name = only_unit(description) if unit is None else unit
        return _built(name, description.unit(name), description.linkage)
    if isinstance(machine, Unit):
        return _built("unit" if unit is None else unit, machine, None)
    if not hasattr(machine, "parts"):
        allowed = "a machine, its name or file, or a unit"
        raise DescriptionError("is no machine", key="machine", value=machine, allowed=allowed)
    if unit not in (None, machine.name):
        raise UnknownNameError("unit", str(unit), [machine.name])
    return machine


def _built(name: str, unit: Unit, linkage: Linkage | None) -> HydraulicUnit:
    """A unit, by the code of its circuit alone."""
    if isinstance(unit, DirectDriven):
        from ramsight.plant.ddh import build_ddh

        built: HydraulicUnit = build_ddh(name, unit)
    elif isinstance(unit, Composed):
        from ramsight.plant.composed import build_composed

        built = build_composed(name, unit)
    else:
        raise TypeError(f"{type(unit).__name__} is no unit that can be built")
    if linkage is not None:
        from ramsight.plant.linkage.lever import lever

        built = replace(built, lever=lever(linkage, name))
    return required(built, unit.requirement)


def required(unit: U, asked: Requirement | None) -> U:
    """A unit whose position is required for something: that says when its sensor is ok."""
    if asked is None:
        return unit
    integrity = asked.integrity(unit.assumptions.integrity, float(unit.cylinder.stroke))
    assumptions = unit.assumptions.model_copy(update={"integrity": integrity})
    return replace(unit, requirement=asked, assumptions=assumptions)
