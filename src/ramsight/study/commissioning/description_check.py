"""Whether ends, leak test, torque at relief and position agree with the description, and which value is wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ramsight.calibration.leakage import LeakTest
from ramsight.machine.description import Unit
from ramsight.plant.directional import DirectionalValve
from ramsight.plant.unit import HydraulicUnit
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.study.commissioning.observed import observed
from ramsight.study.commissioning.wrong_values import WrongValue, judge

if TYPE_CHECKING:
    import xarray

CHECK = "description"
_STROKE = "cylinder.stroke"
_WEAR = "volumetric_efficiency"  # what a worn pump has less of


def description(
    described: Unit | None,
    unit: HydraulicUnit,
    log: xarray.Dataset,
    track: xarray.Dataset,
    leak_test: LeakTest | None,
    truth: xarray.Dataset | None,
) -> tuple[Finding, WrongValue | None]:
    """A finding on the description, and the value that is likely wrong, if one is.

    Args:
        described: the description of the unit; None where it was built of something else.
        unit: built of it.
        log: without gaps.
        track: of the kalman sensor.
        leak_test: of the log, if there is one.
        truth: measured position [m] over time [s], if there is one.
    """
    if described is None:
        return Finding(CHECK, Verdict.OPEN, "the unit was built without one"), None
    if any(isinstance(part, DirectionalValve) for part in unit.parts()):
        return Finding(CHECK, Verdict.OPEN, "a valve meters the rod: the motor's angle is not the rod's travel"), None
    found = judge(unit.name, described, unit, observed(unit, log, track, leak_test, truth))
    if not found.off:
        return Finding(CHECK, Verdict.OPEN, "the log shows nothing to compare it with: ends, torque at relief"), None
    shown = ", ".join(f"{name} {100 * off:+.1f} %" for name, off in found.off.items())
    if found.wrong is None:
        return Finding(CHECK, Verdict.PASSED, f"beside what is described: {shown}"), None
    stopped = ", or something stopped the rod before its end" if found.wrong.path == _STROKE and truth is None else ""
    remedy = f"likeliest wrong value: {found.wrong.text}{stopped}; check and correct it, then commission again"
    worn = found.wrong.path.endswith(_WEAR)
    return Finding(CHECK, Verdict.LOOK_TWICE if worn else Verdict.FAILED, f"contradicted: {shown}", remedy), found.wrong
