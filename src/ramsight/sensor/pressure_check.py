"""The torque against measured pressures: what the pump has to give for them.

    sum (torque - torque of the pump under the measured pressures) h ~ 0

within noise, delay, the torque's gain and what pumps and pressure sensors may be off by (`disagreement`). Which of them
is wrong it does not tell.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import casadi as ca

from ramsight.plant.limits import Limits
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.disagreement import apart, lately
from ramsight.sensor.drive_check import DriveChecks, from_onset, wrong_leakage
from ramsight.sensor.load import LoadStep
from ramsight.sensor.virtual_sensor import SensorGraph

_PUMP = 0.03  # of a torque, by the pumps' efficiency: catalogues and makers round it to 0.02 or 0.03 [G]
_LEAST = 0.2  # s of turning lately, below which it says nothing of a torque


def check_pressures(
    graph: SensorGraph, checks: DriveChecks, step: LoadStep, assumptions: Assumptions, limits: Limits, thinner: Any
) -> DriveChecks:
    """What the drive's report says of itself, with what pressures say of its torque; as it is where there are none.

    Args:
        graph: of the sensor; gains states.
        checks: of the drive alone.
        step: of the load observer.
        assumptions: of drive and pressure sensors.
        limits: of the unit.
        thinner: viscosity at 40 degC over that of the oil [1].
    """
    if step.over_pressures is None:
        return checks
    drive, (over, off) = assumptions.drive, step.over_pressures
    shown = off > 0.0
    gain = math.hypot(drive.torque_gain, _PUMP) * ca.fabs(graph.motor_torque)
    noise = drive.torque * limits.torque
    found = apart(
        graph,
        "pressures",
        over,
        level=graph.motor_torque,
        delay=drive.delay + assumptions.pressure.lag,
        lasting=ca.if_else(shown, ca.sqrt(gain**2 + off**2 + noise**2), 0.0),
        noise=ca.sqrt(noise**2 + off**2),
    )
    turned = lately(graph, "pressures_shown", shown)
    by = ca.if_else(turned > _LEAST, found.by / ca.fmax(turned, _LEAST), 0.0)
    alarm = ca.logic_and(found.alarm, ca.logic_not(checks.undecided))
    wrong = ca.fmin(ca.fabs(by), limits.torque)
    grows = from_onset(graph, "pressures_torque", alarm, wrong_leakage(limits, wrong, thinner))
    return replace(
        checks,
        torque_wrong=ca.logic_or(checks.torque_wrong, alarm),
        grows=checks.grows + grows,
        torque_off=ca.fmax(checks.torque_off, ca.if_else(alarm, wrong, 0.0)),
        more={**checks.more, "torque_over_pressures": (by, "N m")},
        declared=True,
    )
