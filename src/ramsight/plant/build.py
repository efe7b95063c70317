"""Any described unit becomes parts."""

from __future__ import annotations

from dataclasses import replace

from ramsight.machine.description import Composed, DirectDriven, Unit
from ramsight.machine.linkage import Linkage
from ramsight.plant.composed import ComposedUnit, build_composed
from ramsight.plant.ddh import DdhUnit, build_ddh
from ramsight.plant.linkage.lever import lever


def build_unit(name: str, unit: Unit, linkage: Linkage | None = None) -> DdhUnit | ComposedUnit:
    """The parts of a described unit, whatever its circuit.

    Args:
        name: of the unit.
        unit: its description.
        linkage: what the machine's cylinders move, if that is described.

    Raises:
        DescriptionError: the circuit cannot move its load.

    Example:
        >>> from ramsight import machine
        >>> bench = build_unit("axis", machine.load("eha-test-bench").unit("axis"))
        >>> bench.held, [part.name for part in bench.others][:2]
        ('a', ['pump', 'manifold_a'])
    """
    if isinstance(unit, DirectDriven):
        return replace(build_ddh(name, unit), lever=lever(linkage, name), requirement=unit.requirement)
    if isinstance(unit, Composed):
        return replace(build_composed(name, unit), lever=lever(linkage, name), requirement=unit.requirement)
    raise TypeError(f"{type(unit).__name__} is no unit that can be built")
