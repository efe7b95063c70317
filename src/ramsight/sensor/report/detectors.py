"""What is examined to find that an input or a position cannot be trusted: one row a status, and nothing beside them.

The rows are the order in which `status_rules` decides (of several that hold, the last is reported), the table of
docs/reference/detectors.md, and the list of what the tests provoke. Numbers come from `thresholds`.
"""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.inputs.sample import READINGS
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import (
    ALARM_EVIDENCE,
    END_GIVES,
    FALSE_ALARM_RATE,
    FRICTION_TORQUE_SHARE,
    GAP_PERIOD,
    IMPOSSIBLE_LOAD,
    LAG_MOST,
    LIMIT_SHARE,
    NUMBER_LIMIT,
    OIL_TIME_CONSTANT,
    OVERSPEED_SHARE,
    RELIEF_RANGE,
    REST_TIME,
    SURE_STDS,
    TEMPERATURE_HIGHEST,
    TEMPERATURE_LOWEST,
    TEMPERATURE_STEP,
    UNCERTAIN_SHARE,
    VALVE_SETTLED,
    WALTHER_HIGHEST,
    WALTHER_LOWEST,
)
from ramsight.units.conversion import FREEZING

SPEED, TORQUE, TEMPERATURE, TIME = "speed", "torque", "temperature", "time"
COUNTER, POWER, PRESSURES, REFERENCE = "counter", "DC power", "pressures", "reference"
ALWAYS = (SPEED, TORQUE, TEMPERATURE, TIME)
"""Signals that every drive reports."""


@dataclass(frozen=True)
class Detector:
    """A row."""

    status: Status  # that it reports
    signals: tuple[str, ...]  # that it examines
    hypothesis: str  # that it rejects, with its equation
    threshold: str  # from which on, and where that comes from
    after: str = "at once"  # how long it has to last
    then: str = "–"  # what follows beside the status

    @property
    def needs(self) -> tuple[str, ...]:
        """The signals that not every drive reports."""
        return () if REFERENCE in self.signals else tuple(one for one in self.signals if one not in ALWAYS)


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _celsius(lowest: float, highest: float) -> str:
    return f"{lowest - FREEZING:.0f}…{highest - FREEZING:.0f} °C".replace("-", "−")


_ASSUMED = Assumptions()
_ALARM = f"one false alarm in {1.0 / (3600.0 * FALSE_ALARM_RATE):.0f} h"
_DECLARED_ALARM = f"{_ALARM}, from declared noise, delay and steps"
_EXPONENT = f"{NUMBER_LIMIT:.0e}".partition("e+")[2]
_NO_NUMBER = f"NaN, or beyond 10{_EXPONENT.translate(str.maketrans('0123456789', '⁰¹²³⁴⁵⁶⁷⁸⁹'))}"
_NEAR_RELIEF = 1.0 - RELIEF_RANGE * _ASSUMED.machine.relief

DETECTORS = (
    Detector(
        Status.REFERENCE_DUE,
        ALWAYS,
        "the position is known well enough",
        f"standard deviation above {_percent(_ASSUMED.integrity.due)} of the stroke, or an error above "
        f"{_percent(_ASSUMED.integrity.limit)} of it likelier than {_percent(_ASSUMED.integrity.risk)}",
    ),
    Detector(
        Status.OUTSIDE_TEMPERATURE,
        (TEMPERATURE,),
        "the oil's law holds",
        f"outside {_celsius(WALTHER_LOWEST, WALTHER_HIGHEST)} (Walther)",
    ),
    Detector(
        Status.OUTSIDE_SPEED, (SPEED,), "the motor turns as it may", f"above {OVERSPEED_SHARE:g} × its highest speed"
    ),
    Detector(
        Status.TEMPERATURE_LOST,
        (TEMPERATURE,),
        "the thermometer is well",
        f"no number, outside {_celsius(TEMPERATURE_LOWEST, TEMPERATURE_HIGHEST)}, "
        f"or {TEMPERATURE_STEP:g} K from what it was",
        f"a step is accepted after {2.0 * OIL_TIME_CONSTANT:g} s … {LAG_MOST / 60.0:g} min",
        "the last good temperature is used",
    ),
    Detector(
        Status.NEAR_RELIEF,
        (TORQUE,),
        "relief valves are shut",
        f"pressure above {_percent(_NEAR_RELIEF)} of a setting (tolerance {_percent(_ASSUMED.machine.relief)}, std)",
        then="standard deviation grows with what may have passed",
    ),
    Detector(
        Status.INPUT_GAP, (TIME,), "no sample is missing", f"{GAP_PERIOD:g} s without one", then="deviation grows"
    ),
    Detector(
        Status.REFERENCE_REFUSED,
        (REFERENCE, *READINGS),
        "references are true",
        f"less likely than a switch that is wrong ({_percent(_ASSUMED.stops.lies)}), or a reading (its `wrong`)",
        then="a second one that agrees is accepted",
    ),
    Detector(
        Status.SPEED_WRONG,
        (SPEED, TORQUE, COUNTER, POWER),
        "there is a number, and Σ(ω − dφ/dt)h = 0; power shows which is wrong",
        f"{_NO_NUMBER}; {_DECLARED_ALARM}",
        then="the counter is used",
    ),
    Detector(
        Status.COUNTER_WRONG,
        (SPEED, TORQUE, COUNTER, POWER),
        "the same",
        "the same",
        then="the speed is used; deviation grows by what they were apart",
    ),
    Detector(
        Status.POSITION_LOST,
        (TORQUE,),
        "little oil has passed a relief valve",
        f"its share of the deviation above {_percent(_ASSUMED.integrity.due)} of the stroke",
        "until a reference",
    ),
    Detector(
        Status.FAULT_PASSED,
        (SPEED, TORQUE, COUNTER, POWER),
        "inputs have agreed since the last reference",
        "one of the contradictions below",
        "until a reference",
    ),
    Detector(Status.NOT_REFERENCED, (REFERENCE,), "a position has ever been known", "–", "until a reference"),
    Detector(
        Status.TOO_UNCERTAIN,
        ALWAYS,
        "the position is known",
        f"standard deviation over all hypotheses above {_percent(UNCERTAIN_SHARE)} of the stroke",
    ),
    Detector(
        Status.OUTSIDE_STROKE,
        ALWAYS,
        "the piston is in the cylinder",
        f"{SURE_STDS:g} standard deviations and {_percent(END_GIVES)} of the stroke outside",
    ),
    Detector(
        Status.IMPLAUSIBLE_TORQUE,
        (TORQUE, SPEED),
        "the machine explains the torque",
        f"{2.0 * SURE_STDS:g} standard deviations; {IMPOSSIBLE_LOAD:g} × the load at relief pressure; "
        f"at rest {_percent(FRICTION_TORQUE_SHARE)} of the torque there",
        f"{VALVE_SETTLED:g} s; {GAP_PERIOD:g} s; {2.0 * REST_TIME:g} s of rest",
        "without a usable torque the last one is used",
    ),
    Detector(
        Status.IMPLAUSIBLE_SPEED,
        (SPEED,),
        "a motor can turn so fast",
        f"above {LIMIT_SHARE:g} × its highest speed",
    ),
    Detector(
        Status.SPEED_CONTRADICTED,
        (SPEED, COUNTER),
        "Σ(ω − dφ/dt)h = 0",
        _DECLARED_ALARM,
        then="the counter is used; deviation grows by what they are apart; no contact is accepted",
    ),
    Detector(
        Status.TORQUE_CONTRADICTED,
        (SPEED, TORQUE, POWER, PRESSURES),
        "Σ(P − τω − losses)h = 0; Σ(τ − τ(p_a, p_b))h = 0",
        f"{_ALARM} each; gain and losses of the drive are learned",
        then="deviation grows by what leaks otherwise; no contact is accepted",
    ),
    Detector(
        Status.SIGN_CONTRADICTED,
        (SPEED, TORQUE),
        "where the shaft speeds up or slows down, Fτ = FJ dω/dt (F a band-pass filter), and not −FJ dω/dt",
        f"a cumulative sum of log-likelihood ratios above {ALARM_EVIDENCE:g}: {_ALARM}, from undisturbed days",
        "some ramps",
        "no contact is accepted",
    ),
    Detector(
        Status.INPUT_STUCK,
        (TORQUE,),
        "a torque has noise",
        f"{ALARM_EVIDENCE:g} changes that did not come while the motor turned",
    ),
    Detector(Status.TIME_FROZEN, (TIME,), "time goes on", "the same time twice, or an earlier one"),
    Detector(
        Status.INPUT_LOST,
        (SPEED, TORQUE, TIME),
        "there is a number",
        _NO_NUMBER,
        then="the sample is passed over",
    ),
)
"""The later, the worse: of several that hold the last is reported."""
CONTRADICTIONS = tuple(one.status for one in DETECTORS if one.needs)
"""Statuses of a drive whose report contradicts itself: they take signals that not every drive reports."""


def detector_table() -> str:
    """The rows for the documentation, in Markdown, without the alarms of the encoder (encoder.md)."""
    rows = [
        (f"`{one.status.name.lower()}`", ", ".join(one.signals), one.hypothesis, one.threshold, one.after, one.then)
        for one in DETECTORS
    ]
    head = ["| status | signals | hypothesis | threshold | after | then |", "|" + "---|" * 6]
    return "\n".join([*head, *(f"| {' | '.join(row)} |" for row in rows)])
