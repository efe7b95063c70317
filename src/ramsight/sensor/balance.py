"""The volume balance by the data sheet: what the pumps deliver, less what leaks and is compressed, moves the piston."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import inlined, symbols
from ramsight.expression import Real, all_of, scalar, within
from ramsight.plant.balance import FACTORS
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.circuit.load import LoadState, Piston, observe_load
from ramsight.sensor.circuit.pressures import measured_pressures
from ramsight.sensor.circuit.relief import relief_probability
from ramsight.sensor.dead_reckoning import ReckoningState, at_reference, relief_loss
from ramsight.sensor.inputs.oil_heat import WarmingState, warming_rate
from ramsight.sensor.inputs.sample import Raw, SampleState, plain_sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.report.status_rules import outside_temperature
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import HALF, NEAR_END_SHARE, TINY
from ramsight.sensor.virtual_sensor import Report, VirtualSensor, close


@dataclass(frozen=True, kw_only=True)
class BalanceState:
    """What the volume balance keeps."""

    reckoning: ReckoningState = inlined()  # position and the last sample
    warming: WarmingState | None  # the smoothed thermometer, where the oil expands
    load: LoadState  # the simulated circuit


def balance(unit: HydraulicUnit, assumptions: Assumptions | None = None) -> VirtualSensor:
    """The volume balance of a unit, whatever its circuit.

    Args:
        unit: the unit's parts; it is assumed to match its data sheet.
        assumptions: of the drive, for the weight of a torque; by default what the unit declares.

    Returns:
        A sensor with position, velocity, load and status; it has no standard deviation (NaN).
    """
    model = MachineModel.of(unit, assumptions)
    raw = Raw.symbols(model.balance.model.commands, measured_pressures(model.assumed))
    initial = BalanceState(
        reckoning=ReckoningState(
            position=scalar(0.5 * float(unit.cylinder.stroke)),
            intake=SampleState.initial(model.balance.model.commands),
        ),
        warming=WarmingState() if model.balance.expands else None,
        load=LoadState.initial(model),
    )
    state = symbols(initial)
    reckoning = state.reckoning
    intake, sample = plain_sample(reckoning.intake, raw)
    warming: Real = 0.0
    warming_state = None
    if state.warming is not None:
        warming_state, warming = warming_rate(state.warming, sample)
    piston = Piston.free(reckoning.position)
    load, step = observe_load(state.load, sample, piston, [1.0] * len(FACTORS), warming, model)
    position = within(reckoning.position + step.motion.travel, 0.0, model.stroke)
    travel, elapsed = step.motion.travel, sample.elapsed
    velocity = ca.if_else(elapsed > 0.0, travel / ca.fmax(elapsed, TINY), 0.0)
    probability = relief_probability(step.z, sample.extending_speed, model)
    away = ca.fmin(position, model.stroke - position) > NEAR_END_SHARE * model.stroke
    turning = sample.motor_speed != 0.0
    passes = all_of(probability > HALF, turning, away)
    relief = relief_loss(reckoning.relief, sample, passes)
    status = ca.if_else(outside_temperature(sample), float(Status.OUTSIDE_TEMPERATURE), float(Status.OK))
    status = ca.if_else(probability > 0.0, float(Status.NEAR_RELIEF), status)
    status = ca.if_else(relief.unobservable, float(Status.POSITION_LOST), status)
    shown = at_reference(sample, position)
    after = BalanceState(
        reckoning=ReckoningState(position=shown, intake=intake, relief=relief), warming=warming_state, load=load
    )
    report = Report(shown, math.nan, velocity, step.load.value, status, model.balance.chambers(step.z))
    return close("balance", model.table, raw, initial, state, after, report)
