"""Which of a sensor's statuses let a cylinder move, which slow it down, and which stop it."""

from __future__ import annotations

from enum import Enum

from ramsight.sensor.status import Status


class Trust(Enum):
    """What may be done with an estimate."""

    FULL = "full speed"
    SLOW = "half speed"
    NONE = "stop"


_STOPS = {Status.POSITION_LOST, Status.FAULT_PASSED}
"""Uncertain by name, but the position is gone: nobody knows how much oil a relief valve let pass, or how wrong an input
was."""


def trust(status: Status) -> Trust:
    """What may be done while a sensor says so.

    Nearly every uncertain status only slows the cylinder down: its position is still the best there is, and its own
    standard deviation says how good. Without a reference, with an invalid sample, and once the relief valve has let
    the position go, it stops.

    Args:
        status: what the sensor says of its newest estimate.

    Example:
        >>> trust(Status.REFERENCE_DUE), trust(Status.POSITION_LOST), trust(Status.INPUT_LOST)
        (<Trust.SLOW: 'half speed'>, <Trust.NONE: 'stop'>, <Trust.NONE: 'stop'>)
    """
    if status is Status.OK:
        return Trust.FULL
    if status.validity == "uncertain" and status not in _STOPS:
        return Trust.SLOW
    return Trust.NONE


_NEEDS_A_REFERENCE = {
    Status.POSITION_LOST,
    Status.FAULT_PASSED,
    Status.NOT_REFERENCED,
    Status.TOO_UNCERTAIN,
    Status.OUTSIDE_STROKE,
}


def may_home(status: Status) -> bool:
    """Whether a cylinder may visit an end stop: whatever a reference mends does not forbid to fetch one."""
    return status in _NEEDS_A_REFERENCE or trust(status) is not Trust.NONE
