"""A torque that the drive makes of its current, corrected by what it says of the motor's temperature.

Magnets lose remanence as they warm up, and the torque of a current with it: a drive that takes its torque constant for
one temperature reports too much above it. Where the temperature is declared,

    torque = reported torque (1 - c (theta - theta_0))

What is left of the gain's error, of that loss and of magnets that are not as warm as the sensor, is declared too.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca

from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.virtual_sensor import MOTOR_TEMPERATURE, SensorGraph

_COLDEST, _HOTTEST = 203.15, 523.15  # K; magnets and windings are beyond repair above 250 degC
_STEP = 1.0  # K; smaller changes are not followed, so that a torque that stands still stands still


def declared_temperature(assumptions: Assumptions) -> tuple[str, ...]:
    """The input that a sensor is given for it."""
    return (MOTOR_TEMPERATURE,) if assumptions.motor_temperature.std > 0.0 else ()


def correct_torque(graph: SensorGraph, assumptions: Assumptions) -> Assumptions:
    """Put the corrected torque in the place of the reported one; what is assumed of its gain then.

    A temperature that is missing, or cannot be, is the last one; before the first one the torque is as reported.

    Args:
        graph: the sensor's graph, before its intake; gains a state.
        assumptions: of drive and motor.
    """
    assumed = assumptions.motor_temperature
    if assumed.std == 0.0:
        return assumptions
    given, last = graph.measured[MOTOR_TEMPERATURE], graph.state("magnets_warmer")
    there = ca.logic_and(given > _COLDEST, given < _HOTTEST)
    warmer: Any = ca.if_else(there, given - assumed.reference, last)
    used = ca.if_else(ca.fabs(warmer - last) >= _STEP, warmer, last)
    graph.becomes("magnets_warmer", used)
    graph.motor_torque = graph.motor_torque * (1.0 - assumed.loss * used)
    gain = math.hypot(assumptions.drive.torque_gain, assumed.std)
    drive = assumptions.drive.model_copy(update={"torque_gain": gain})
    return assumptions.model_copy(update={"drive": drive})
