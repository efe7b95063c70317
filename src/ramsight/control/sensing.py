"""What a control has of its sensor: the newest estimate, or the last one moved on; and how far it is relied on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import casadi as ca

from ramsight.control.orders import Inputs
from ramsight.control.thresholds import COLDEST_OIL, HOTTEST_OIL, LARGEST_NUMBER, NO_POSITION
from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, negated, within
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import OIL_TIME_CONSTANT


class Trust(Enum):
    """What an estimate allows."""

    FULL = "full speed"
    SLOW = "half speed"
    NONE = "stop"


_STOPS = {Status.POSITION_LOST, Status.FAULT_PASSED}
"""Uncertain by name, but the position is unobservable: oil through a relief valve, or an input's error, is unknown."""
_NEEDS_A_REFERENCE = {*_STOPS, Status.NOT_REFERENCED, Status.TOO_UNCERTAIN, Status.OUTSIDE_STROKE}


def trust(status: Status) -> Trust:
    """What a status of the sensor allows.

    Nearly every uncertain status only slows the cylinder down: its position is still the best estimate, with a
    standard deviation. Without a reference, with an invalid sample, and with an unobservable position, it stops.

    Example:
        >>> trust(Status.REFERENCE_DUE), trust(Status.POSITION_LOST), trust(Status.INPUT_LOST)
        (<Trust.SLOW: 'half speed'>, <Trust.NONE: 'stop'>, <Trust.NONE: 'stop'>)
    """
    if status is Status.OK:
        return Trust.FULL
    if status.validity == "uncertain" and status not in _STOPS:
        return Trust.SLOW
    return Trust.NONE


def may_home(status: Status) -> bool:
    """Whether a cylinder may be homed: a status that a reference clears does not forbid to fetch one."""
    return status in _NEEDS_A_REFERENCE or trust(status) is not Trust.NONE


@dataclass(frozen=True)
class Sensed:
    """The sensor's estimate and the factors that it has learned; as a state, those of the last sample."""

    position: Scalar = leaf("m", NO_POSITION)  # of the rod
    position_std: Scalar = leaf("m")  # its standard deviation
    velocity: Scalar = leaf("m/s")  # of the rod
    load: Scalar = leaf("N")  # on it
    status: Scalar = leaf("1", float(Status.NOT_REFERENCED))  # a `Status`
    leak: Scalar = leaf("1", 1.0)  # factor of the leakage
    displacement: Scalar = leaf("1", 1.0)  # factor of the displacement


def sensed_at(last: Sensed, inputs: Inputs, period: float, stroke: float) -> Sensed:
    """The estimate of a sample; without a report the last one, moved on by its velocity.

    A sensor that has no position has a velocity. From the middle of the stroke on, and within it, that leads to an end
    once the rod has gone through the whole of the stroke, wherever it was: a visit that began anywhere finds it.

    Args:
        period: between them [s].
        stroke: of the cylinder [m].
    """
    moved = last.position + period * last.velocity
    began = ca.if_else(abs(last.position) <= LARGEST_NUMBER, moved, 0.5 * stroke)
    position = ca.if_else(abs(inputs.position) <= LARGEST_NUMBER, inputs.position, within(began, 0.0, stroke))
    new = Sensed(
        position, inputs.position_std, inputs.velocity, inputs.load, inputs.status, inputs.leak, inputs.displacement
    )
    return chosen(inputs.reported != 0.0, new, replace(last, position=moved))


def smoothed_temperature(before: Scalar, inputs: Inputs, period: float) -> Scalar:
    """The oil's temperature [K] behind a low pass of `OIL_TIME_CONSTANT`; a report that no oil has is rejected."""
    reported, share = inputs.oil_temperature, period / (OIL_TIME_CONSTANT + period)
    accepted = all_of(inputs.reported != 0.0, reported > COLDEST_OIL, reported < HOTTEST_OIL)
    return ca.if_else(accepted, before + share * (reported - before), before)


@dataclass(frozen=True)
class Reliance:
    """What a sample's status allows."""

    full: Flag  # full speed
    slow: Flag  # less
    none: Flag  # nothing that needs a position
    homing: Flag  # to fetch a reference


def reliance_on(status: Scalar) -> Reliance:
    """What a status allows, as conditions; a number that is no status allows nothing."""

    def any_status(test: Callable[[Status], bool]) -> Flag:
        return any_of(*(status == float(one) for one in Status if test(one)))

    full, slow = any_status(lambda one: trust(one) is Trust.FULL), any_status(lambda one: trust(one) is Trust.SLOW)
    none = negated(any_of(full, slow))
    return Reliance(full, slow, none, any_of(negated(none), any_status(lambda one: one in _NEEDS_A_REFERENCE)))
