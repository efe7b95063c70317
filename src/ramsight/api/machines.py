"""Machines and their units: from a name or a file to what is simulated and tracked."""

from __future__ import annotations

from pathlib import Path

from ramsight.errors import DescriptionError, UnknownNameError
from ramsight.machine import catalogue as _catalogue
from ramsight.machine import load
from ramsight.machine.catalogue import Entry
from ramsight.machine.description import Machine, Unit
from ramsight.plant.build import build_unit
from ramsight.plant.unit import HydraulicUnit

AnyMachine = str | Path | Machine
AnyUnit = str | Path | Machine | Unit | HydraulicUnit


def load_machine(name_or_path: AnyMachine) -> Machine:
    """A machine, by its name in the catalogue or from a TOML file.

    Args:
        name_or_path: such as ``"mining-loader"`` or ``"my-machine.toml"``; a machine is returned as it is.

    Returns:
        The machine, checked; all values in SI units.

    Raises:
        DescriptionError: the file cannot be read, or holds what cannot be; names file, key, value and range.
        UnknownNameError: there is no such machine.

    Example:
        >>> import ramsight
        >>> sorted(ramsight.load_machine("mining-loader").units)
        ['boom', 'bucket']
    """
    if isinstance(name_or_path, Machine):
        return name_or_path
    if not isinstance(name_or_path, str | Path):
        allowed = "a description, its name or file; a built unit has none"
        raise DescriptionError("is no machine", key="machine", value=type(name_or_path).__name__, allowed=allowed)
    return load(name_or_path)


def catalogue(kind: str | None = None) -> tuple[Entry, ...]:
    """What the catalogue has: machines, circuits, oils, pumps and valves.

    Args:
        kind: of this kind only, for example ``"machine"``; None for everything.

    Returns:
        Entries with `kind`, `name`, `description`, `source` and `path`, by kind and name.

    Raises:
        UnknownNameError: there is no such kind.

    Example:
        >>> import ramsight
        >>> "mining-loader" in [entry.name for entry in ramsight.catalogue("machine")]
        True
    """
    entries = _catalogue.entries()
    kinds = {entry.kind for entry in entries}
    if kind is not None and kind not in kinds:
        raise UnknownNameError("kind", kind, kinds, "catalogue")
    return tuple(entry for entry in entries if kind in (None, entry.kind))


def build(machine: AnyUnit, unit: str | None = None) -> HydraulicUnit:
    """A unit made of its parts, whatever its circuit: what every other function takes.

    Args:
        machine: a machine, its name or file; or one unit's description; a built unit is returned as it is.
        unit: name of the unit; may be left out where there is only one.

    Returns:
        The unit, all values in SI units.

    Raises:
        DescriptionError: several units, and none is named; or what is described cannot be used.
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
        return build_unit(name, description.unit(name), description.linkage)
    if isinstance(machine, Unit):
        return build_unit("unit" if unit is None else unit, machine)
    if not hasattr(machine, "parts"):
        allowed = "a machine, its name or file, or a unit"
        raise DescriptionError("is no machine", key="machine", value=machine, allowed=allowed)
    if unit not in (None, machine.name):
        raise UnknownNameError("unit", str(unit), [machine.name])
    return machine


def description_of(machine: AnyUnit, unit: str) -> Unit | None:
    """The description of a unit; None of one that is built already.

    Args:
        machine: as `build` takes it.
        unit: name of the unit.
    """
    if isinstance(machine, str | Path | Machine):
        return load_machine(machine).unit(unit)
    return machine if isinstance(machine, Unit) else None


def only_unit(machine: Machine, named: str = "unit") -> str:
    """The name of a machine's unit where it has only one.

    Args:
        machine: the machine.
        named: what errors call the argument that names one.

    Raises:
        DescriptionError: it has several.
    """
    if len(machine.units) > 1:
        names = ", ".join(machine.units)
        raise DescriptionError(f"{machine.name} has several units: name one", key=named, allowed=names)
    return next(iter(machine.units))
