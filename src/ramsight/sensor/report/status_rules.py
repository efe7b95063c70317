"""The condition behind each status: when a position is to be relied on, and why not."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, negated, never, replaced_where, scalar
from ramsight.machine.assumption_description import AssumedIntegrity
from ramsight.sensor.belief.update import Prediction, Updated
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.inputs.sample import Sample, lasted
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.report.detectors import DETECTORS
from ramsight.sensor.report.stated import Stated
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import (
    END_GIVES,
    FRICTION_TORQUE_SHARE,
    GAP_PERIOD,
    IMPOSSIBLE_LOAD,
    MOTOR_TURNS,
    OVERSPEED_SHARE,
    REST_TIME,
    SURE_STDS,
    UNCERTAIN_SHARE,
    VALVE_SETTLED,
    WALTHER_HIGHEST,
    WALTHER_LOWEST,
)


@dataclass(frozen=True, kw_only=True)
class PlausibilityState:
    """A torque that may be impossible."""

    unexplained_for: Scalar = leaf("s")  # how long its innovation has been too large [s]
    impossible_for: Scalar = leaf("s")  # how long it has asked for an impossible load [s]
    resting_for: Scalar = leaf("s")  # how long the motor has stood [s]
    at_rest: Scalar = leaf("N m")  # smoothed innovation at rest [N m]


@dataclass(frozen=True)
class PositionEstimate:
    """The position as the status judges it."""

    value: Scalar  # [m], perhaps outside the stroke
    said: Stated  # of it
    known: Flag  # whether a position has ever been known


def reference_due(said: Stated, integrity: AssumedIntegrity, stroke: Real) -> Flag:
    """Whether a position is not certain enough to be ok."""
    return any_of(said.settled > integrity.due * stroke, said.beyond > integrity.risk)


def too_uncertain(said: Stated, stroke: Real) -> Flag:
    """Whether it is too uncertain to be used."""
    return said.overall > UNCERTAIN_SHARE * stroke


def outside_temperature(sample: Sample) -> Flag:
    """Whether the oil is colder or warmer than its law holds."""
    return any_of(sample.oil_temperature < WALTHER_LOWEST, sample.oil_temperature > WALTHER_HIGHEST)


OF_POSITION = frozenset(
    {
        Status.REFERENCE_DUE,
        Status.REFERENCE_REFUSED,
        Status.POSITION_LOST,
        Status.NOT_REFERENCED,
        Status.TOO_UNCERTAIN,
        Status.OUTSIDE_STROKE,
    }
)
"""What is said of the position's certainty, and nothing of the sample."""


def first_of(conditions: Mapping[Status, Flag], *, without: Collection[Status] = ()) -> Scalar:
    """The status of a sample as a number: of what holds, what weighs most."""
    code = scalar(float(Status.OK))
    for one in DETECTORS:
        if one.status not in without and not never(conditions[one.status]):
            code = replaced_where(conditions[one.status], code, float(one.status))
    return code


def conditions_of(
    at: Prediction,
    updated: Updated,
    disputed: Flag,
    position: PositionEstimate,
    implausible: Flag,
    model: MachineModel,
) -> Mapping[Status, Flag]:
    """Of each status that a detector has.

    Args:
        implausible: whether the torque is, by `implausible_torque`.
    """
    sample, intake, checks, stroke = at.sample, at.intake, at.checks, model.stroke
    beyond = ca.fmax(-position.value, position.value - stroke)
    outside = beyond > SURE_STDS * position.said.std + END_GIVES * stroke
    return {
        Status.REFERENCE_DUE: reference_due(position.said, model.assumed.integrity, stroke),
        Status.OUTSIDE_TEMPERATURE: outside_temperature(sample),
        Status.OUTSIDE_SPEED: ca.fabs(sample.motor_speed) > OVERSPEED_SHARE * model.max_speed,
        Status.TEMPERATURE_LOST: intake.temperature_bad,
        Status.NEAR_RELIEF: updated.relief.probability > 0.0,
        Status.INPUT_GAP: intake.gap,
        Status.REFERENCE_REFUSED: disputed,
        Status.SPEED_WRONG: any_of(checks.speed_wrong, intake.replaced),
        Status.COUNTER_WRONG: checks.counter_wrong,
        Status.POSITION_LOST: updated.relief.passed_std > model.assumed.integrity.due * stroke,
        Status.FAULT_PASSED: updated.fault_passed,
        Status.NOT_REFERENCED: negated(position.known),
        Status.TOO_UNCERTAIN: all_of(position.known, too_uncertain(position.said, stroke)),
        Status.OUTSIDE_STROKE: all_of(position.known, outside),
        Status.IMPLAUSIBLE_TORQUE: any_of(implausible, intake.overtorque),
        Status.IMPLAUSIBLE_SPEED: intake.overspeed,
        Status.SPEED_CONTRADICTED: checks.undecided,
        Status.TORQUE_CONTRADICTED: checks.torque_wrong,
        Status.SIGN_CONTRADICTED: checks.sign_wrong,
        Status.INPUT_STUCK: intake.stuck,
        Status.TIME_FROZEN: intake.frozen,
        Status.INPUT_LOST: intake.missing,
    }


def implausible_torque(
    state: PlausibilityState, sample: Sample, step: LoadStep, free: Flag, model: MachineModel
) -> tuple[PlausibilityState, Flag]:
    """Whether the torque is impossible for the machine: unexplained, beyond relief, or there at rest."""
    torque, dt = step.torque, sample.elapsed
    turning = ca.fabs(sample.motor_speed) > MOTOR_TURNS
    wrong = all_of(free, ca.fabs(torque.innovation) > 2.0 * SURE_STDS * torque.noise)
    beyond = all_of(turning, ca.fabs(step.load.asked) > IMPOSSIBLE_LOAD * model.relief_load)
    unexplained_for = _while(all_of(turning, wrong), state.unexplained_for, dt)
    impossible_for = _while(all_of(free, beyond), state.impossible_for, dt)
    resting_for = _while(negated(turning), state.resting_for, dt)
    smoothed = state.at_rest + dt / (VALVE_SETTLED + dt) * (torque.innovation - state.at_rest)
    at_rest = ca.if_else(lasted(resting_for, 2.0 * REST_TIME), smoothed, 0.0)
    implausible = any_of(lasted(unexplained_for, VALVE_SETTLED), lasted(impossible_for, GAP_PERIOD))
    offset = ca.fabs(at_rest) > FRICTION_TORQUE_SHARE * model.relief_torque + torque.hidden
    after = PlausibilityState(
        unexplained_for=unexplained_for, impossible_for=impossible_for, resting_for=resting_for, at_rest=at_rest
    )
    return after, any_of(implausible, offset)


def _while(condition: Flag, since: Scalar, elapsed: Scalar) -> Scalar:
    """How long a condition has held [s]."""
    return ca.if_else(condition, since + elapsed, 0.0)
