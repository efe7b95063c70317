"""What may stand behind a sensor in its FMU: a position control, the comparison with a real sensor, or a weighing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ramsight.deploy.c_compare import comparison_source
from ramsight.deploy.c_function import template
from ramsight.deploy.fmu_units import NOTHING, PERIOD, UNKNOWN, Variable
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.tracking.availability import LONGEST_ALERT, TIME_TO_ALERT
from ramsight.tracking.comparing import TOLERANCE, Verdict


@dataclass(frozen=True)
class Behind:
    """C that takes what a sensor reports, sample by sample."""

    files: Mapping[str, str]  # its C by name; `header` is among them
    header: str  # what the model includes
    member: str  # of the instance's memory
    takes: tuple[Variable, ...]  # inputs and parameters of its own
    says: tuple[Variable, ...]  # real outputs of its own
    words: tuple[Variable, ...]  # outputs of its own that are enumerations
    began: Callable[[int], str]  # its C at the start, from the place of the first of `says`
    step: Callable[[int], str]  # its C after the sensor's step, from the same
    title: str  # what it adds, in the FMU's description
    period: float  # of the steps [s]
    refer: str = ""  # its C before the sensor's step, if it has any
    unknown: int = 0  # its enumeration before the initialization


_COMPARED = (
    Variable("other_position", "real", "input", "m", f"position by the other sensor, {NOTHING}", UNKNOWN),
    Variable(
        "other_tolerance",
        "real",
        "parameter",
        "m",
        "of the other sensor, by data sheet and mounting",
        TOLERANCE,
        None,
        0.0,
    ),
    Variable(
        "time_to_alert",
        "real",
        "parameter",
        "s",
        "for which both have to be apart",
        TIME_TO_ALERT,
        None,
        0.0,
        LONGEST_ALERT,
    ),
)
_VERDICT = Variable("verdict", "verdict", "output", "", "what both sensors say together")


def comparison_behind(unit: HydraulicUnit, prefix: str, machine: str) -> Behind:
    """The comparison with a real sensor."""
    text = {
        "p": f"{prefix}_compare",
        "stroke": f"{unit.cylinder.stroke:g}",
        "longest": f"{LONGEST_ALERT:g}",
        "bound": BOUND,
        "unchecked": str(int(Verdict.UNCHECKED)),
    }
    began, step = template("fmu_compare_began.c", **text), template("fmu_compare_step.c", **text)
    return Behind(
        comparison_source(unit, prefix, machine),
        f"{prefix}_compare.h",
        f"{prefix}_compare compare;",
        _COMPARED,
        (),
        (_VERDICT,),
        lambda place: began,
        lambda place: step,
        ", and the comparison with a real one,",
        PERIOD,
        unknown=int(Verdict.UNCHECKED),
    )
