"""What the catalogue has, and the description of a unit."""

from __future__ import annotations

from pathlib import Path

from ramsight.argument_kinds import by_kind
from ramsight.errors import UnknownNameError
from ramsight.machine import catalogue as _catalogue
from ramsight.machine import load_machine
from ramsight.machine.catalogue import Entry
from ramsight.machine.description import Machine, Unit
from ramsight.plant.build import AnyUnit


@by_kind
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


def description_of(machine: AnyUnit, unit: str) -> Unit | None:
    """The description of a unit; None of one that is built already.

    Args:
        machine: as `build` takes it.
    """
    if isinstance(machine, str | Path | Machine):
        return load_machine(machine).unit(unit)
    return machine if isinstance(machine, Unit) else None
