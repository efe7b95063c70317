"""Any described unit becomes parts."""

from __future__ import annotations

from ramsight.machine.description import Composed, DirectDriven, Unit
from ramsight.plant import composed, ddh
from ramsight.plant.composed import ComposedUnit
from ramsight.plant.ddh import DdhUnit


def build(name: str, unit: Unit) -> DdhUnit | ComposedUnit:
    """The parts of a described unit, whatever its circuit.

    Args:
        name: of the unit.
        unit: its description.

    Raises:
        DescriptionError: the circuit cannot move its load.

    Example:
        >>> from ramsight import machine
        >>> bench = build("axis", machine.load("eha-test-bench").unit("axis"))
        >>> bench.held, [part.name for part in bench.others][:2]
        ('a', ['pump', 'manifold_a'])
    """
    if isinstance(unit, DirectDriven):
        return ddh.build(name, unit)
    if isinstance(unit, Composed):
        return composed.build(name, unit)
    raise TypeError(f"{type(unit).__name__} is no unit that can be built")
