"""A torque that the drive makes of its current, corrected by the motor's temperature.

Magnets lose remanence as they warm up, and the torque of a current with it: a drive that takes its torque constant for
one temperature reports too much above it. Where the temperature is declared,

    torque = reported torque (1 - c (theta - theta_0))

What is left of the gain's error, of that loss and of magnets that are not as warm as the sensor, is declared too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Scalar, all_of
from ramsight.machine.assumption_description import AssumedMotorTemperature
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.inputs.sample import MOTOR_TEMPERATURE, Raw
from ramsight.sensor.thresholds import KELVIN, MAGNETS_HOTTEST, TEMPERATURE_LOWEST


@dataclass(frozen=True, kw_only=True)
class MagnetState:
    """The magnets."""

    warmer: Scalar = leaf("K")  # than the temperature that the torque constant is for [K]


def gain_with_magnets(assumptions: Assumptions) -> Assumptions:
    """What is assumed with what a corrected torque may still be wrong by in its gain."""
    gain = math.hypot(assumptions.drive.torque_gain, assumptions.motor_temperature.std)
    drive = assumptions.drive.model_copy(update={"torque_gain": gain})
    return assumptions.model_copy(update={"drive": drive})


def correct_torque(state: MagnetState, raw: Raw, assumed: AssumedMotorTemperature) -> tuple[MagnetState, Raw]:
    """The sample with the corrected torque.

    A temperature that is missing or impossible is the last one; before the first one the torque is as reported.
    """
    reported = raw.measured[MOTOR_TEMPERATURE]
    possible = all_of(reported > TEMPERATURE_LOWEST, reported < MAGNETS_HOTTEST)
    warmer = ca.if_else(possible, reported - assumed.reference, state.warmer)
    used = ca.if_else(ca.fabs(warmer - state.warmer) >= KELVIN, warmer, state.warmer)
    torque = raw.motor_torque * (1.0 - assumed.loss * used)
    return MagnetState(warmer=used), replace(raw, motor_torque=torque)
