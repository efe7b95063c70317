"""What a unit's position is required for: as its description states, or as it is passed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ramsight.machine.requirement_description import Requirement
from ramsight.plant.unit import HydraulicUnit
from ramsight.tracking.compared_track import judged
from ramsight.tracking.pieces import Pieces
from ramsight.tracking.requirement_check import RequirementCheck, require
from ramsight.units import argument, format_si

if TYPE_CHECKING:
    import xarray

Quantity = float | str


def requirement_of(
    unit: HydraulicUnit, require: Quantity | Requirement | None, named: Callable[[str], str] = str
) -> Requirement | None:
    """The requirement that a unit is judged by.

    Args:
        unit: whose description may have one.
        require: error that 95 % have to be within [m], or ``"5 mm"``, in the place of the described one; or a
            requirement; None for the described one.
        named: what errors call an argument.

    Raises:
        DescriptionError: the error cannot be read or is out of range.
    """
    if require is None or isinstance(require, Requirement):
        return unit.requirement if require is None else require
    stroke = format_si(unit.cylinder.stroke, "mm")
    error = argument(require, "m", named("require"), least="0.1 mm", most=stroke)
    return Requirement(error=error) if unit.requirement is None else unit.requirement.replace({"error": error})


def achieved(
    done: Pieces, truth: xarray.Dataset | None, asked: Requirement, unit: HydraulicUnit
) -> RequirementCheck | None:
    """What a track achieves of a requirement; None where nothing was kept of it.

    Args:
        done: with the track and the log kept.
        truth: `position` [m] over `time` [s], if it is known.
        asked: the requirement.
        unit: that was tracked.

    Raises:
        ComparisonError: track and truth have no time in common.
    """
    if done.track is None or done.log is None:
        return None
    kept = ("motor_speed", "reference")
    track = done.track.assign({name: done.log[name] for name in kept if name in done.log})
    return require(track if truth is None else judged(track, truth), asked, unit.cylinder.stroke)
