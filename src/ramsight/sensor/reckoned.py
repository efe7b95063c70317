"""A sensor that counts from one reference to the next: the volume balance, checked inputs, and how far it may be off.

It learns nothing, weighs nothing and knows no end stop; who has a switch or another reference, and a small processor,
needs no more. How far it is off grows by what is unknown of leakage and displacement. Both have one value for the
machine, so that what they do to the position adds up with its sign: a way and the way back cancel.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.engine.typed_state import leaf, passed_over, symbols
from ramsight.expression import Flag, Scalar, all_of, any_of, count, negated, scalar, within
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.balance import FACTORS
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.circuit.load import LoadState, Piston, observe_load
from ramsight.sensor.circuit.relief import relief_probability
from ramsight.sensor.dead_reckoning import ReliefLossState, relief_loss
from ramsight.sensor.inputs.intake import Intake, IntakeState, check_inputs
from ramsight.sensor.inputs.oil_heat import WarmingState, warming_rate
from ramsight.sensor.inputs.sample import Raw, Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.report.status_rules import outside_temperature
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import (
    HALF,
    NEAR_END_SHARE,
    NOISE_AVERAGED,
    OUTSIDE,
    OVERSPEED_SHARE,
    SURE_STDS,
    TINY,
    UNCERTAIN_SHARE,
)
from ramsight.sensor.virtual_sensor import REFERENCED_NOW, Outputs, Report, Section, VirtualSensor, close

STOPPED = 1e-9
"""Way that an end has taken away, from which it counts [m]."""
_LEAK, _DISPLACEMENT = FACTORS.index("leak"), FACTORS.index("displacement")


@dataclass(frozen=True, kw_only=True)
class CountedReport:
    """What is reported."""

    velocity: Scalar = leaf("m/s")  # smoothed [m/s]


@dataclass(frozen=True, kw_only=True)
class CountedState:
    """What a sensor that counts keeps."""

    position: Scalar = leaf("m", None, exact="sum")  # [m]
    position_known: Flag = leaf("1")  # whether one has ever been known
    # position_variance: at the last reference, and by what adds up without a sign since [m2]
    position_variance: Scalar = leaf("m2", variance=True)
    referenced_since_power_up: Flag = leaf("1")  # whether a reference has come since power-up
    by_leak: Scalar = leaf("m")  # what the position has changed by since the reference for the leakage's factor [m]
    by_displacement: Scalar = leaf("m")  # the same for the displacement's [m]
    intake: IntakeState  # the last sample
    warming: WarmingState | None  # the smoothed thermometer, where the oil expands
    load: LoadState  # the simulated circuit
    relief: ReliefLossState = field(default_factory=ReliefLossState)  # a valve that may have let oil pass
    report: CountedReport = field(default_factory=CountedReport)  # what is reported


def reckoned(unit: HydraulicUnit, assumptions: Assumptions | None = None) -> VirtualSensor:
    """The sensor of a unit that counts from one reference to the next.

    Args:
        assumptions: of drive and machine; by default what the unit declares.
    """
    model = MachineModel.of(unit, assumptions)
    raw = Raw.symbols(model.balance.model.commands, ())
    initial = CountedState(
        position=scalar(0.5 * float(unit.cylinder.stroke)),
        intake=IntakeState.initial(model.balance.model.commands, ()),
        warming=WarmingState() if model.balance.expands else None,
        load=LoadState.initial(model),
    )
    state = symbols(initial)
    after, report, sections, intake = _step(state, raw, model)
    kept = passed_over(intake.passed_over, state, after)
    return close("reckoned", model.table, raw, initial, state, kept, report, sections)


def _step(state: CountedState, raw: Raw, model: MachineModel) -> tuple[CountedState, Report, list[Section], Intake]:
    intake_state, sample, intake = check_inputs(state.intake, raw, model)
    refused, sample = _checked_reference(sample, model)
    title = "Input check: what of the sample is possible, and what stands in for the rest"
    sections = [Section(title, (intake, sample.motor_speed, sample.motor_torque, sample.oil_temperature))]
    warming_state, warming = (None, 0.0) if state.warming is None else warming_rate(state.warming, sample)
    piston = Piston.free(state.position)
    load, step = observe_load(state.load, sample, piston, [1.0] * len(FACTORS), warming, model)
    title = "Balance: a step of the circuit's equations under the load that the torque corrects, and its derivatives"
    sections.append(Section(title, (step, load)))
    position = within(state.position + step.motion.travel, 0.0, model.stroke)
    probability = relief_probability(step.z, sample.extending_speed, model)
    away = ca.fmin(position, model.stroke - position) > NEAR_END_SHARE * model.stroke
    passes = all_of(probability > HALF, sample.motor_speed != 0.0, away)
    relief = relief_loss(state.relief, sample, passes)
    new, machine = sample.referenced, model.assumed.machine
    by_leak, by_displacement = (
        state.by_leak + step.travel_by[_LEAK],
        state.by_displacement + step.travel_by[_DISPLACEMENT],
    )
    # A band of 95 % has to hold what is likelier than one in twenty.
    leak = machine.other_leak if machine.leaks_otherwise > OUTSIDE else machine.leak
    learned2 = (leak * by_leak) ** 2 + (machine.displacement * by_displacement) ** 2
    grown = state.position_variance + step.motion.noise**2 + intake.drift**2 + intake.unseen**2
    # At an end the position stops, if the piston is there or not: what was off stays, and no way back cancels it.
    stops = ca.fabs(position - state.position - step.motion.travel) > STOPPED
    variance = ca.if_else(new, model.assumed.stops.reference**2, grown + ca.if_else(stops, learned2, 0.0))
    begins = any_of(new, stops)
    by_leak, by_displacement = (ca.if_else(begins, 0.0, by) for by in (by_leak, by_displacement))
    std2 = variance + ca.if_else(begins, 0.0, learned2)
    known = any_of(state.position_known, new)
    shown = ca.if_else(new, sample.reference, position)
    std = ca.sqrt(std2 + (step.motion.give * step.load.std) ** 2)
    velocity = _velocity(state, sample, step.motion.travel)
    status = _status(sample, intake, relief, known, refused, std, probability, model)
    more: Outputs = {
        **model.balance.chambers(step.z),
        "position_low": (within(shown - TWO_SIDED_95 * std, 0.0, model.stroke), "m"),
        "position_high": (within(shown + TWO_SIDED_95 * std, 0.0, model.stroke), "m"),
        REFERENCED_NOW: (count(any_of(state.referenced_since_power_up, new)), "1"),
    }
    after = CountedState(
        position=shown,
        position_known=known,
        position_variance=variance,
        referenced_since_power_up=any_of(state.referenced_since_power_up, new),
        by_leak=by_leak,
        by_displacement=by_displacement,
        intake=intake_state,
        warming=warming_state,
        load=load,
        relief=relief,
        report=CountedReport(velocity=velocity),
    )
    return after, Report(shown, std, velocity, step.load.value, status, more, known), sections, intake


def _checked_reference(sample: Sample, model: MachineModel) -> tuple[Flag, Sample]:
    """Whether a reference lies where no piston can be, and the sample without it."""
    far = SURE_STDS * model.assumed.stops.reference
    inside = all_of(sample.reference >= -far, sample.reference <= model.stroke + far)
    refused = all_of(sample.referenced, negated(inside))
    return refused, replace(sample, referenced=all_of(sample.referenced, inside))


def _velocity(state: CountedState, sample: Sample, travel: Scalar) -> Scalar:
    """Smoothed [m/s]."""
    dt = sample.elapsed
    moving = ca.if_else(dt > 0.0, travel / ca.fmax(dt, TINY), 0.0)
    return state.report.velocity + dt / (NOISE_AVERAGED + dt) * (moving - state.report.velocity)


def _status(
    sample: Sample,
    intake: Intake,
    relief: ReliefLossState,
    known: Flag,
    refused: Flag,
    std: Scalar,
    probability: Scalar,
    model: MachineModel,
) -> Scalar:
    """The last of those that hold, in the order of the detectors."""
    stroke = model.stroke
    rows: Mapping[Status, Flag] = {
        Status.REFERENCE_DUE: std > model.assumed.integrity.due * stroke,
        Status.OUTSIDE_TEMPERATURE: outside_temperature(sample),
        Status.OUTSIDE_SPEED: ca.fabs(sample.motor_speed) > OVERSPEED_SHARE * model.max_speed,
        Status.TEMPERATURE_LOST: intake.temperature_bad,
        Status.NEAR_RELIEF: probability > 0.0,
        Status.INPUT_GAP: intake.gap,
        Status.REFERENCE_REFUSED: refused,
        Status.POSITION_LOST: relief.unobservable,
        Status.NOT_REFERENCED: negated(known),
        Status.TOO_UNCERTAIN: all_of(known, std > UNCERTAIN_SHARE * stroke),
        Status.IMPLAUSIBLE_TORQUE: intake.overtorque,
        Status.IMPLAUSIBLE_SPEED: intake.overspeed,
        Status.INPUT_STUCK: intake.stuck,
        Status.TIME_FROZEN: intake.frozen,
        Status.INPUT_LOST: intake.missing,
    }
    code = scalar(float(Status.OK))
    for status, holds in rows.items():
        code = ca.if_else(holds, float(status), code)
    return code
