"""Inputs and outputs of a control, and what it is asked for: the same words in Python, in C and in FMUs."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import casadi as ca

from ramsight.control.drive_watch import Verdict
from ramsight.control.thresholds import NO_PLACE
from ramsight.engine.typed_state import leaf, leaves
from ramsight.expression import Flag, Scalar, all_of, any_of


@dataclass(frozen=True)
class Inputs:
    """What a control takes at a sample, with units: of the sensor, the thermometer, the drive, and who commands it.

    `reported` is whether a report has arrived. Where none has, the last estimate goes on with its velocity.
    """

    position: Scalar = leaf("m")
    position_std: Scalar = leaf("m")
    velocity: Scalar = leaf("m/s")
    load: Scalar = leaf("N")
    status: Scalar = leaf("1")
    oil_temperature: Scalar = leaf("K")
    leak: Scalar = leaf("1")
    displacement: Scalar = leaf("1")
    reported: Scalar = leaf("1")
    reported_speed: Scalar = leaf("rad/s")
    reported_torque: Scalar = leaf("N*m")
    ask: Scalar = leaf("1")
    target: Scalar = leaf("m")
    steering: Scalar = leaf("m/s")
    speed: Scalar = leaf("m/s")


INPUTS = {one.name: one.unit for one in leaves(Inputs())}
"""Names of the inputs, with units."""
OUTPUTS = {"motor_speed": "rad/s", "activity": "1", "reason": "1", "reference": "m"}
"""Outputs with units; `reference` is the end stop that homing has just pressed on, else `NO_PLACE`."""


class Ask(IntEnum):
    """What is asked of a control, at every sample."""

    STOP = 0
    POSITION = 1
    STEER = 2
    HOME_LOWERED = 3
    HOME_LIFTED = 4
    LEAK_TEST = 5


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
        return _TEXTS[self]


STOPPED_BY = {
    Verdict.SILENT: Reason.SILENT,
    Verdict.DISOBEYS: Reason.DISOBEYS,
    Verdict.STUCK: Reason.SPEED_STUCK,
    Verdict.TORQUE_STUCK: Reason.TORQUE_STUCK,
    Verdict.STALLED: Reason.STALLED,
}
"""Verdicts over a drive that stop a cylinder, and the reasons that they are."""
_TEXTS = {
    Reason.NONE: "",
    Reason.ASKED: "asked to stop",
    Reason.SENSOR: "the sensor is not to be relied on: see its status",
    Reason.ROD: "the rod is not where it should be",
    Reason.FORCE: "the load has reached the largest force",
    Reason.NO_REFERENCE: "no reference at the end stop",
    Reason.NOT_FOUND: "no end stop found in time",
    **{reason: verdict.value for verdict, reason in STOPPED_BY.items()},
}


@dataclass(frozen=True)
class LastOrder:
    """State: what was asked for at the last sample."""

    ask: Scalar = leaf("1", Ask.POSITION)  # an `Ask`
    target: Scalar = leaf("m", NO_PLACE)  # the last one within the stroke


@dataclass(frozen=True)
class Orders:
    """What is asked for at a sample, and was not before."""

    sent: Flag  # to a target
    steered: Flag  # by hand
    homed: Flag  # to an end stop
    tested: Flag  # whether a leak test is asked for
    stopped: Flag  # whether a stop is asked for, new or not
    lifted: Flag  # whether the end stop is that of lifting

    @property
    def any(self) -> Flag:
        """Whether a new activity is asked for."""
        return any_of(self.sent, self.steered, self.homed, self.tested)


def read_orders(last: LastOrder, inputs: Inputs, stroke: float) -> tuple[LastOrder, Orders]:
    """The orders of a sample: what differs from the sample before is new.

    Args:
        stroke: [m]; a target beyond it is none.
    """
    ask, target = inputs.ask, inputs.target

    def asks(*one: Ask) -> Flag:
        return any_of(*(ask == float(each) for each in one))

    inside = all_of(target >= 0.0, target <= stroke)
    other = ask != last.ask
    orders = Orders(
        sent=all_of(asks(Ask.POSITION), inside, any_of(target != last.target, other)),
        steered=all_of(asks(Ask.STEER), other),
        homed=all_of(asks(Ask.HOME_LOWERED, Ask.HOME_LIFTED), other),
        tested=all_of(asks(Ask.LEAK_TEST), other),
        stopped=asks(Ask.STOP),
        lifted=asks(Ask.HOME_LIFTED),
    )
    kept = ca.if_else(asks(Ask.POSITION), last.target, NO_PLACE)
    return LastOrder(ask, ca.if_else(inside, target, kept)), orders
