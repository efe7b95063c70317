"""What a control that is a graph is asked for and given, and what it says: the words that its C and its FMU use too."""

from __future__ import annotations

from enum import IntEnum

from ramsight.control.activity import Activity
from ramsight.control.moving import FORCE_REACHED
from ramsight.control.visiting import NO_REFERENCE, NOT_FOUND
from ramsight.control.watch import Verdict

# Homing comes last: what drives machines by these numbers keeps the ones that it has.
ACTIVITIES = (*(a for a in Activity if a not in {Activity.HOMING, Activity.LEAK_TEST}), Activity.HOMING)
"""What the block does; its `activity` is the place in here."""
INPUTS = {
    "position": "m",
    "position_std": "m",
    "velocity": "m/s",
    "load": "N",
    "status": "1",
    "oil_temperature": "K",
    "leak": "1",
    "displacement": "1",
    "reported": "1",
    "reported_speed": "rad/s",
    "reported_torque": "N*m",
    "ask": "1",
    "target": "m",
    "steering": "m/s",
    "speed": "m/s",
}
"""What it takes, with units: of the sensor, of the thermometer, of the drive, and of whoever commands it.

`reported` is whether a report has arrived; where none has, what the sensor says is that of the last one, gone on with.
"""
OUTPUTS = {"motor_speed": "rad/s", "activity": "1", "reason": "1", "reference": "m"}
"""What it says, with units; `reference` is the end stop that a visit has just pressed on, else `NOTHING`."""
NOTHING = -1e3  # a place that is none: NaN would be lost in choices that a compiler may turn round


class Ask(IntEnum):
    """What is asked of a control, at every sample."""

    STOP = 0
    POSITION = 1
    STEER = 2
    HOME_LOWERED = 3
    HOME_LIFTED = 4


class Reason(IntEnum):
    """Why a control stops or has stopped."""

    NONE = 0
    ASKED = 1
    SENSOR = 2
    ROD = 3
    FORCE = 4
    NO_REFERENCE = 5
    NOT_FOUND = 6
    SILENT = 7
    DISOBEYS = 8
    SPEED_STUCK = 9
    TORQUE_STUCK = 10
    STALLED = 11

    @property
    def text(self) -> str:
        """The reason in words."""
        return {
            Reason.NONE: "",
            Reason.ASKED: "asked to stop",
            Reason.SENSOR: "the sensor is not to be relied on: see its status",
            Reason.ROD: "the rod is not where it should be",
            Reason.FORCE: FORCE_REACHED,
            Reason.NO_REFERENCE: NO_REFERENCE,
            Reason.NOT_FOUND: NOT_FOUND,
            **{reason: verdict.value for verdict, reason in STOPPED_BY.items()},
        }[self]


STOPPED_BY = {
    Verdict.SILENT: Reason.SILENT,
    Verdict.DISOBEYS: Reason.DISOBEYS,
    Verdict.STUCK: Reason.SPEED_STUCK,
    Verdict.TORQUE_STUCK: Reason.TORQUE_STUCK,
    Verdict.STALLED: Reason.STALLED,
}
"""Verdicts over a drive that stop a cylinder, and the reasons that they are."""
