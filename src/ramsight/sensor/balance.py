"""The volume balance by the data sheet: what the pumps deliver, less what leaks and is compressed, moves the piston."""

from __future__ import annotations

import math

import casadi as ca

from ramsight.plant.balance import FACTORS
from ramsight.plant.balance import balance as balance_of
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.judgement import COLDEST, HOTTEST
from ramsight.sensor.load import LoadObserver
from ramsight.sensor.pressures import measured_pressures
from ramsight.sensor.relief import passing
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import SensorGraph, VirtualSensor

_STOP_ZONE = 0.02  # share of the stroke from its ends, where a relief valve opens because of the stop
_PASSES = 0.5  # share between first opening and setting of a relief valve from which the position counts as lost


def balance(unit: HydraulicUnit, assumptions: Assumptions | None = None) -> VirtualSensor:
    """The volume balance of a unit, whatever its circuit.

    Args:
        unit: the unit's parts; it is taken to be its data sheet.
        assumptions: of the drive, for how far a torque is believed; by default what the unit declares.

    Returns:
        A sensor with position, velocity, load and status; it does not know its standard deviation (NaN).
    """
    assumed = assumptions or unit.assumptions
    limits, circuit = limits_of(unit), balance_of(unit)
    graph = SensorGraph(circuit.model.commands, measured_pressures(assumed))
    stroke = float(unit.cylinder.stroke)
    graph.initially("position", 0.5 * stroke)
    graph.parameters.add("travel_per_radian", float(unit.travel_per_radian))
    observer = LoadObserver(graph, circuit, limits, assumed)
    step = observer.step([1.0] * len(FACTORS), 0.0)
    position = ca.fmin(ca.fmax(graph.position + step.travel, 0.0), stroke)
    velocity = ca.if_else(graph.elapsed > 0.0, step.travel / ca.fmax(graph.elapsed, 1e-6), 0.0)
    symbol, setting = graph.parameters.symbol, assumed.machine.relief
    doubt = passing(circuit, step.z, lambda name: symbol(f"circuit.{name}"), graph.extending_speed, setting)
    away = ca.fmin(position, stroke - position) > _STOP_ZONE * stroke
    turning = graph.motor_speed != 0.0
    lost = graph.lost(ca.logic_and(doubt > _PASSES, ca.logic_and(turning, away)), graph.referenced)
    extreme = ca.logic_or(graph.oil_temperature < COLDEST, graph.oil_temperature > HOTTEST)
    status = ca.if_else(extreme, float(Status.OUTSIDE_TEMPERATURE), float(Status.OK))
    status = ca.if_else(doubt > 0.0, float(Status.NEAR_RELIEF), status)
    status = ca.if_else(lost, float(Status.POSITION_LOST), status)
    return graph.counting(
        "balance",
        position=position,
        velocity=velocity,
        load=step.load,
        std=math.nan,
        status=status,
        more=circuit.chambers(step.z),
    )
