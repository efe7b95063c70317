"""Whether to believe a position, and why not: the conditions behind each status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.plant.limits import Limits
from ramsight.sensor.contact import Contact
from ramsight.sensor.detectors import DETECTORS
from ramsight.sensor.drive_check import DriveChecks
from ramsight.sensor.intake import Intake
from ramsight.sensor.load import LoadStep
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import SensorGraph

COLDEST, HOTTEST = 243.15, 383.15  # K; -30 ... 110 degC, where the Walther equation joins two points well
WARNING, LIMIT = 0.01, 0.1  # shares of the stroke: standard deviation at which a reference is due, or overdue
_OVERSPEED = 1.05  # share of the highest speed
_BEYOND = 4.0  # standard deviations outside the stroke
_BEYOND_LEAST = 5e-3  # m
_LASTS, _LONG = 0.15, 0.6  # s, after which it is no noise, or no transient
_UNEXPLAINED = 8.0  # standard deviations of the torque
_IMPOSSIBLE = 1.3  # share of the load at relief pressure that no load reaches while oil still moves the piston
_RESTING = 1.5  # s of rest, after which the pumps have leaked empty
_RESTING_TORQUE = 0.06  # share of the torque at relief pressure
_RESTING_SMOOTHING = 0.5  # s
_STANDING = 0.06  # rad/s; below half a step of 1 rpm the motor counts as standing


@dataclass(frozen=True)
class Relief:
    """Oil over a relief valve.

    Attributes:
        doubt: how likely it is that the pump's oil passes one, 0 to 1.
        grown: standard deviation that the position has gained by it since a reference [m].
    """

    doubt: Any
    grown: Any


def judge(
    graph: SensorGraph,
    intake: Intake,
    step: LoadStep,
    contact: Contact,
    relief: Relief,
    limits: Limits,
    *,
    std: Any,
    overall: Any,
    position: Any,
    stroke: Any,
    disputed: Any,
    known: Any,
    checks: DriveChecks,
    fault_passed: Any,
) -> Any:
    """The status of a sample as a number.

    Args:
        graph: the sensor's graph; gains states.
        intake: conditions of the sample.
        step: of the load observer.
        contact: whether the piston is held.
        relief: oil over a relief valve.
        limits: of the unit.
        std: of the position, whose 1.96-fold is the 95 % band [m].
        overall: of the position, over all hypotheses by their probabilities [m].
        position: [m], perhaps outside the stroke.
        stroke: [m].
        disputed: whether a reference was refused and none has been taken since.
        known: whether a position has ever been known.
        checks: what the drive's report says of itself.
        fault_passed: whether it has contradicted itself since the last reference.
    """
    implausible = _implausible(graph, step, ca.logic_not(contact.held))
    outside = ca.fmax(-position, position - stroke) > _BEYOND * std + _BEYOND_LEAST
    extreme = ca.logic_or(graph.oil_temperature < COLDEST, graph.oil_temperature > HOTTEST)
    conditions = {
        Status.REFERENCE_DUE: std > WARNING * stroke,
        Status.OUTSIDE_TEMPERATURE: extreme,
        Status.OUTSIDE_SPEED: ca.fabs(graph.motor_speed) > _OVERSPEED * limits.max_speed,
        Status.TEMPERATURE_LOST: intake.cold,
        Status.NEAR_RELIEF: relief.doubt > 0.0,
        Status.INPUT_GAP: intake.gap,
        Status.REFERENCE_REFUSED: disputed,
        Status.SPEED_WRONG: ca.logic_or(checks.speed_wrong, intake.replaced),
        Status.COUNTER_WRONG: checks.counter_wrong,
        Status.POSITION_LOST: relief.grown > WARNING * stroke,
        Status.FAULT_PASSED: fault_passed,
        Status.NOT_REFERENCED: ca.logic_not(known),
        Status.TOO_UNCERTAIN: ca.logic_and(known, overall > LIMIT * stroke),
        Status.OUTSIDE_STROKE: ca.logic_and(known, outside),
        Status.IMPLAUSIBLE_TORQUE: ca.logic_or(implausible, intake.overtorque),
        Status.IMPLAUSIBLE_SPEED: intake.overspeed,
        Status.SPEED_CONTRADICTED: checks.undecided,
        Status.TORQUE_CONTRADICTED: checks.torque_wrong,
        Status.SIGN_CONTRADICTED: checks.sign_wrong,
        Status.INPUT_STUCK: intake.stuck,
        Status.TIME_FROZEN: intake.frozen,
        Status.INPUT_LOST: intake.lost,
    }
    code = float(Status.OK)
    for one in DETECTORS:
        condition = conditions[one.status]
        if isinstance(condition, float):
            continue  # never, on this machine
        code = ca.if_else(condition, float(one.status), code)
    return code


def _lasting(graph: SensorGraph, name: str, condition: Any, least: float) -> Any:
    """Whether a condition has held for longer than `least` [s]."""
    since = graph.state(name)
    since_1 = ca.if_else(condition, since + graph.elapsed, 0.0)
    graph.becomes(name, since_1)
    return since_1 > least


def _implausible(graph: SensorGraph, step: LoadStep, free: Any) -> Any:
    """Whether the torque is none that the machine can have: unexplained, beyond relief, or there at rest.

    Args:
        graph: the sensor's graph; gains states.
        step: of the load observer.
        free: whether nothing holds the piston.
    """
    dt, symbol = graph.elapsed, graph.parameters.symbol
    turning = ca.fabs(graph.motor_speed) > _STANDING
    wrong = ca.logic_and(free, ca.fabs(step.surprise) > _UNEXPLAINED * step.noise)
    impossible = ca.logic_and(turning, ca.fabs(step.asked) > _IMPOSSIBLE * symbol("relief_load"))
    implausible = ca.logic_or(
        _lasting(graph, "unexplained_for", ca.logic_and(turning, wrong), _LONG),
        _lasting(graph, "impossible_for", ca.logic_and(free, impossible), _LASTS),
    )
    rests = _lasting(graph, "resting_for", ca.logic_not(turning), _RESTING)
    at_rest = graph.state("resting_torque")
    at_rest_1 = ca.if_else(rests, at_rest + dt / (_RESTING_SMOOTHING + dt) * (step.surprise - at_rest), 0.0)
    graph.becomes("resting_torque", at_rest_1)
    offset = ca.fabs(at_rest_1) > _RESTING_TORQUE * symbol("relief_torque") + step.friction
    return ca.logic_or(implausible, offset)
