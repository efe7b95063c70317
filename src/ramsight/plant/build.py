"""Any described unit becomes parts."""

from __future__ import annotations

from dataclasses import replace

from ramsight.machine.description import Composed, DirectDriven, Unit
from ramsight.machine.linkage import Linkage
from ramsight.plant import composed, ddh
from ramsight.plant.composed import ComposedUnit
from ramsight.plant.ddh import DdhUnit
from ramsight.plant.linkage.lever import lever


def build(name: str, unit: Unit, linkage: Linkage | None = None) -> DdhUnit | ComposedUnit:
    """The parts of a described unit, whatever its circuit.

    Args:
        name: of the unit.
        unit: its description.
        linkage: what the machine's cylinders move, if that is described.

    Raises:
        DescriptionError: the circuit cannot move its load.

    Example:
        >>> from ramsight import machine
        >>> bench = build("axis", machine.load("eha-test-bench").unit("axis"))
        >>> bench.held, [part.name for part in bench.others][:2]
        ('a', ['pump', 'manifold_a'])
    """
    if isinstance(unit, DirectDriven):
        return replace(ddh.build(name, unit), lever=lever(linkage, name))
    if isinstance(unit, Composed):
        return replace(composed.build(name, unit), lever=lever(linkage, name))
    raise TypeError(f"{type(unit).__name__} is no unit that can be built")
