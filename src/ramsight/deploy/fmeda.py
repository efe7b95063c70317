"""An FMEDA table of a unit's virtual sensor: faults, what they do, what detects them, and how surely, as CSV.

The shares are those that the study of faults has measured, as the tables of docs/integrity.md and docs/safety.md have
them: on simulated work days of machines drawn around the data sheets of the mining loader's boom and bucket. A fault
without a measurement stays in the table and has no share. Failure rates are for a safety engineer to fill in;
`ramsight.deploy.diagnostic_coverage` reads them back.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from ramsight.logs.channels import column_of
from ramsight.plant.unit import HydraulicUnit, circuit
from ramsight.sensor.inputs.sample import DC_POWER, SHAFT_ANGLE, declared_inputs
from ramsight.sensor.redundancy import declared
from ramsight.sensor.report.detectors import COUNTER, DETECTORS, POWER, PRESSURES, SPEED, TEMPERATURE, TIME, TORQUE
from ramsight.sensor.status import Status
from ramsight.tracking.comparing import Verdict

MEASURED_ON = "simulated work days of machines drawn around the data sheets of mining-loader's boom and bucket"
"""What the shares were measured on."""
REAL_TOLERANCE, REAL_ALERT = 1e-3, 0.2
"""Tolerance [m] and time to alert [s] with which faults of a real sensor were compared."""
_SETS = (
    (frozenset({COUNTER, POWER}), "+ counter and DC power"),
    (frozenset({POWER}), "+ DC power"),
    (frozenset({COUNTER}), "+ counter"),
    (frozenset({PRESSURES}), "+ pressures"),
    (frozenset[str](), "speed, torque, temperature"),
)
"""Sets of signals that were measured, the strongest first."""
BOTH = _SETS[0][1]
"""The set of signals with which faults of a real sensor were measured."""


@dataclass(frozen=True)
class MeasuredFault:
    """A fault that was put into a signal, many times."""

    signal: str  # name of the input, `time`, `all`, or `other_position` of a real sensor
    fault: str  # what is wrong with it
    trials: int  # how often it was put in
    detected: int  # how often it was detected
    at_least: float  # lower end of the 95 % interval of that share (Clopper and Pearson)
    delay: float | None  # median time to detection [s]; None if it never was
    # the time that 95 % of the detected ones take at most [s]; None where it was not kept
    delay_95: float | None = None
    # median over the trials of the largest error of the position [m]; None where it was not kept
    error: float | None = None

    @property
    def share(self) -> float:
        """Share that was detected."""
        return self.detected / self.trials


def measured_set(further: Collection[str]) -> str:
    """The strongest set of signals that was measured and that a machine has.

    Args:
        further: what the machine declares beside speed, torque and temperature, by the names of the detectors.

    Example:
        >>> measured_set(["counter", "pressures"])
        '+ counter'
    """
    return next(name for needs, name in _SETS if needs <= set(further))


def measured_faults(given: str) -> tuple[MeasuredFault, ...]:
    """Faults of the signals of a virtual sensor.

    Args:
        given: a set of signals, as `measured_set` gives it.

    Example:
        >>> one = measured_faults("+ counter and DC power")[1]
        >>> one.signal, one.fault, one.detected, one.trials, round(one.at_least, 3)
        ('shaft_angle', 'stuck, 5 s', 160, 160, 0.977)
    """
    return tuple(
        MeasuredFault(signal, fault, trials, detected, at_least, delay, None, 1e-3 * error)
        for signal, fault, trials, detected, at_least, delay, error in _kept()["virtual"][given]
    )


def measured_real_faults() -> tuple[MeasuredFault, ...]:
    """Faults of a real position sensor that is compared with a virtual one, which has counter and DC power."""
    return tuple(
        MeasuredFault("other_position", fault, trials, detected, at_least, delay, delay_95)
        for fault, trials, detected, at_least, delay, delay_95 in _kept()["real"]
    )


@cache
def _kept() -> dict[str, Any]:
    text = (resources.files("ramsight.deploy") / "measured_faults.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


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
