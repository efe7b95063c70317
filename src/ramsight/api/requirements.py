"""What a unit's position is required for: as its description states, or as it is passed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ramsight.machine.requirement_description import Requirement
from ramsight.plant.build import required
from ramsight.plant.unit import HydraulicUnit
from ramsight.signals import Samples, Signals
from ramsight.tracking.pieces import Pieces
from ramsight.units import argument, format_si

if TYPE_CHECKING:
    from ramsight.tracking.requirement_check import RequirementCheck

Quantity = float | str


def required_unit(unit: HydraulicUnit, require: Quantity | Requirement | None) -> HydraulicUnit:
    """A unit with the requirement that it is judged by, and whose sensor is ok by it.

    Args:
        require: error that 95 % have to be within [m], or ``"5 mm"``, in the place of the described one; or a
            requirement; None for the described one.

    Raises:
        DescriptionError: the error cannot be read or is out of range.
    """
    if require is None or isinstance(require, Requirement):
        return required(unit, require)
    stroke = format_si(unit.cylinder.stroke, "mm")
    error = argument(require, "m", "require", least="0.1 mm", most=stroke)
    before = unit.requirement
    return required(unit, Requirement(error=error) if before is None else before.replace({"error": error}))


def achieved(done: Pieces, truth: Samples | None, asked: Requirement, unit: HydraulicUnit) -> RequirementCheck | None:
    """What a track achieves of a requirement; None where nothing was kept of it.

    Args:
        truth: `position` [m] over `time` [s], if it is known.

    Raises:
        ComparisonError: track and truth have no time in common.
    """
    if done.track is None or done.log is None:
        return None
    from ramsight.tracking.requirement_check import require
    from ramsight.tracking.track_errors import with_error

    kept = {name: done.log[name] for name in ("motor_speed", "reference") if name in done.log}
    track = Signals({**done.track.columns, **kept})
    return require(track if truth is None else with_error(track, truth), asked, unit.cylinder.stroke)
