"""What is looked at to find that an input or a position cannot be believed: one row a status, and nothing beside them.

The rows are the order in which `judgement` decides (the last that holds is said), the table of docs/integrity.md, and
the list of what the tests provoke.
"""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.sensor.status import Status

SPEED, TORQUE, TEMPERATURE, TIME = "speed", "torque", "temperature", "time"
COUNTER, POWER, PRESSURES, REFERENCE = "counter", "DC power", "pressures", "reference"
ALWAYS = (SPEED, TORQUE, TEMPERATURE, TIME)
"""Signals that every drive reports."""


@dataclass(frozen=True)
class Detector:
    """A row.

    Attributes:
        status: what it says.
        signals: that it looks at.
        looks: the hypothesis that is given up, with its equation.
        threshold: from where on, and where that comes from.
        after: how long it has to last.
        then: what it does beside saying so.
    """

    status: Status
    signals: tuple[str, ...]
    looks: str
    threshold: str
    after: str = "at once"
    then: str = "–"

    @property
    def needs(self) -> tuple[str, ...]:
        """The signals that not every drive reports."""
        return tuple(one for one in self.signals if one not in (*ALWAYS, REFERENCE))


DETECTORS = (
    Detector(
        Status.REFERENCE_DUE, ALWAYS, "the position is known well enough", "standard deviation above 1 % of the stroke"
    ),
    Detector(Status.OUTSIDE_TEMPERATURE, (TEMPERATURE,), "the oil's law holds", "outside −30…110 °C (Walther)"),
    Detector(Status.OUTSIDE_SPEED, (SPEED,), "the motor turns as it may", "above 1.05 × its highest speed"),
    Detector(
        Status.TEMPERATURE_LOST,
        (TEMPERATURE,),
        "the thermometer is well",
        "no number, outside −70…150 °C, or 10 K from what it was",
        "a leap is believed after 10 s … 10 min",
        "the last good temperature is used",
    ),
    Detector(
        Status.NEAR_RELIEF,
        (TORQUE,),
        "relief valves are shut",
        "pressure above 90 % of a setting (tolerance 3 %, std)",
        then="standard deviation grows with what may have passed",
    ),
    Detector(Status.INPUT_GAP, (TIME,), "no sample is missing", "0.15 s without one", then="deviation grows"),
    Detector(
        Status.REFERENCE_REFUSED,
        (REFERENCE,),
        "references are true",
        "less likely than a switch that lies (5 %)",
        then="a second one that agrees is taken",
    ),
    Detector(
        Status.SPEED_WRONG,
        (SPEED, TORQUE, COUNTER, POWER),
        "there is a number, and Σ(ω − dφ/dt)h = 0; power tells which is wrong",
        "NaN, or beyond 10¹²; one false alarm in 1000 h, from declared noise, delay and steps",
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
        "its share of the deviation above 1 % of the stroke",
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
        "standard deviation over all hypotheses above 10 % of the stroke",
    ),
    Detector(Status.OUTSIDE_STROKE, ALWAYS, "the piston is in the cylinder", "4 standard deviations and 5 mm outside"),
    Detector(
        Status.IMPLAUSIBLE_TORQUE,
        (TORQUE, SPEED),
        "the machine explains the torque",
        "8 standard deviations; 1.3 × the load at relief pressure; at rest 6 % of the torque there",
        "0.6 s; 0.15 s; 1.5 s of rest",
        "without a usable torque the last one is used",
    ),
    Detector(Status.IMPLAUSIBLE_SPEED, (SPEED,), "a motor can turn so fast", "above 1.5 × its highest speed"),
    Detector(
        Status.SPEED_CONTRADICTED,
        (SPEED, COUNTER),
        "Σ(ω − dφ/dt)h = 0",
        "one false alarm in 1000 h, from declared noise, delay and steps",
        then="the counter is used; deviation grows by what they are apart; no contact is believed",
    ),
    Detector(
        Status.TORQUE_CONTRADICTED,
        (SPEED, TORQUE, POWER, PRESSURES),
        "Σ(P − τω − losses)h = 0; Σ(τ − τ(p_a, p_b))h = 0",
        "one false alarm in 1000 h each; gain and losses of the drive are learned",
        then="deviation grows by what leaks otherwise; no contact is believed",
    ),
    Detector(
        Status.SIGN_CONTRADICTED,
        (SPEED, TORQUE),
        "where the shaft speeds up or slows down, Fτ = FJ dω/dt (F a band-pass filter), and not −FJ dω/dt",
        "a cumulative sum of log-likelihood ratios above 18: one false alarm in 1000 h, from undisturbed days",
        "some ramps",
        "no contact is believed",
    ),
    Detector(
        Status.INPUT_STUCK, (TORQUE,), "a torque has noise", "20 changes that did not come while the motor turned"
    ),
    Detector(Status.TIME_FROZEN, (TIME,), "time goes on", "the same time twice, or an earlier one"),
    Detector(
        Status.INPUT_LOST,
        (SPEED, TORQUE, TIME),
        "there is a number",
        "NaN, or beyond 10¹²",
        then="the sample is passed over",
    ),
)
"""The later, the worse: of several that hold the last is said."""
CONTRADICTIONS = tuple(one.status for one in DETECTORS if one.needs)
"""What is said of a drive whose report contradicts itself: it takes signals that not every drive reports."""


def detector_table() -> str:
    """The rows for the documentation, in Markdown, with the alarm that each is on a CANopen bus left to encoder.md."""
    rows = [
        (f"`{one.status.name.lower()}`", ", ".join(one.signals), one.looks, one.threshold, one.after, one.then)
        for one in DETECTORS
    ]
    head = ["| status | signals | hypothesis | threshold | after | then |", "|" + "---|" * 6]
    return "\n".join([*head, *(f"| {' | '.join(row)} |" for row in rows)])
