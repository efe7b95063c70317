"""An FMEDA table of a unit's virtual sensor: faults, what they do, what detects them, and how surely, as CSV.

The shares are those that were measured. A fault without a measurement stays in the table and has no share. Failure
rates are for a safety engineer to fill in; `ramsight.deploy.diagnostic_coverage` reads them back.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

from ramsight.deploy.measured_faults import (
    BOTH,
    MEASURED_ON,
    REAL_ALERT,
    REAL_TOLERANCE,
    MeasuredFault,
    measured_faults,
    measured_real_faults,
    measured_set,
)
from ramsight.logs.channels import column_of
from ramsight.plant.unit import HydraulicUnit, circuit
from ramsight.sensor.inputs.sample import DC_POWER, SHAFT_ANGLE, declared_inputs
from ramsight.sensor.redundancy import declared
from ramsight.sensor.report.detectors import COUNTER, DETECTORS, POWER, PRESSURES, SPEED, TEMPERATURE, TIME, TORQUE
from ramsight.sensor.status import Status
from ramsight.tracking.comparing import Verdict

COLUMNS = (
    "channel", "signal", "fault", "effect", "detected_by", "trials", "detected_percent",
    "detected_at_least_percent", "time_to_detection_s", "time_to_detection_95_s", "failure_rate_fit",
    "diagnostic_coverage_percent", "undetected_fit", "measured_with", "measured_on",
)  # fmt: skip
"""Columns of the table. An engineer fills in `failure_rate_fit`; the two behind it follow from that."""
VIRTUAL, REAL = "virtual sensor", "real sensor"
NOT_MEASURED = "not measured"
_SIGNALS = {
    "motor_speed": SPEED, "motor_torque": TORQUE, "oil_temperature": TEMPERATURE, "shaft_angle": COUNTER,
    "dc_power": POWER, "time": TIME, "all": TIME,
}  # fmt: skip
"""What the detectors call a signal. All reports together stop or come late: that shows in the time."""
_NOT_SAID = (Status.NEAR_RELIEF,)  # the study does not count it as a detection
_UNMEASURED = (
    ("reference", "a switch or a stop at another place than described", "the position is set to a wrong value"),
    ("description", "numbers of another machine", "position, bound and thresholds are those of that machine"),
    ("piston seals", "oil passes the piston", "the piston moves and the pump's revolutions do not show it"),
    ("control unit", "memory, processor or software", "any"),
)
"""Faults that the study has not put in: signal, fault, effect."""
_UNMEASURED_EFFECT = "the position or its bound may be wrong"


def fmeda_table(unit: HydraulicUnit) -> str:
    """The table of a unit, with the faults of a real sensor that is compared with the virtual one.

    Args:
        unit: its parts and assumptions.

    Returns:
        CSV text: a header, and a row a fault. Shares in %, times in s, rates in FIT (failures in 10⁹ h).
    """
    further = declared(unit.assumptions)
    given = measured_set(further)
    rows = [_virtual(one, given) for one in measured_faults(given)]
    rows += [_blank(VIRTUAL, signal, "any", _UNMEASURED_EFFECT) for signal in _others(unit, given)]
    rows += [_blank(VIRTUAL, signal, fault, effect) for signal, fault, effect in _UNMEASURED]
    rows += list(_real(given))
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows(rows)
    return text.getvalue()


def _virtual(one: MeasuredFault, given: str) -> list[str]:
    error = "" if one.error is None else f"position off by {1e3 * one.error:.1f} mm (median of the largest error)"
    return _row(VIRTUAL, one, error, _statuses(one.signal, given), given)


def _real(given: str) -> Iterator[list[str]]:
    """Faults of the real sensor; they were measured beside one set of signals."""
    by = ", ".join(one.name.lower() for one in (Verdict.OTHER_WRONG, Verdict.APART, Verdict.VIRTUAL_WRONG))
    words = f"{given}; tolerance {1e3 * REAL_TOLERANCE:g} mm, time to alert {REAL_ALERT:g} s"
    for one in measured_real_faults():
        effect = "the real sensor's position is wrong"
        yield (
            _row(REAL, one, effect, f"comparison: {by}", words)
            if given == BOTH
            else _blank(REAL, one.signal, one.fault, effect)
        )


def _row(channel: str, one: MeasuredFault, effect: str, by: str, given: str) -> list[str]:
    shares = [f"{100.0 * value:.2f}" for value in (one.share, one.at_least)]
    times = ["" if value is None else f"{value:.2f}" for value in (one.delay, one.delay_95)]
    rates = ["", "", ""]
    return [channel, one.signal, one.fault, effect, by, str(one.trials), *shares, *times, *rates, given, MEASURED_ON]


def _blank(channel: str, signal: str, fault: str, effect: str) -> list[str]:
    """A fault whose share nobody has measured."""
    filled = [channel, signal, fault, effect, NOT_MEASURED, "0"]
    return [*filled, *[""] * (len(COLUMNS) - len(filled) - 2), NOT_MEASURED, NOT_MEASURED]


def _statuses(signal: str, given: str) -> str:
    """Statuses of the detectors that examine a signal with no more signals than were measured."""
    there = [name for name in (COUNTER, POWER, PRESSURES) if name in given]
    found = [
        one.status.name.lower()
        for one in DETECTORS
        if _SIGNALS[signal] in one.signals and set(one.needs) <= set(there) and one.status not in _NOT_SAID
    ]
    return "one of " + ", ".join(found)


def _others(unit: HydraulicUnit, given: str) -> Iterator[str]:
    """Signals of the unit whose faults were not put in with this set of signals."""
    measured = {SHAFT_ANGLE: COUNTER, DC_POWER: POWER}
    for name in declared_inputs(unit.assumptions):
        if name not in measured or measured[name] not in given:
            yield name
    yield from (column_of(name) for name in circuit(unit).commands)
