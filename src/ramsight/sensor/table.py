"""The paper's sensor: movement per motor revolution, looked up by torque, oil temperature and direction.

It counts revolutions only, so whatever happens per second (leakage) is right at the speed of calibration alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import SensorGraph, VirtualSensor

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MovementTable:
    """Movement per motor angle in both directions.

    Args:
        unit: name of the unit it was made for.
        motor_speed: magnitude of the speed at which it was made [rad/s].
        temperature: [K], increasing, shape (t,).
        lift_torque, lower_torque: motor torque [N m], increasing, shape (n,).
        lift, lower: piston movement per motor angle [m/rad], shape (t, n), positive where positive speed extends.
        lift_sign: +1 if positive motor speed lifts, else -1.
    """

    unit: str
    motor_speed: float
    temperature: Array
    lift_torque: Array
    lift: Array
    lower_torque: Array
    lower: Array
    lift_sign: float


def _shares(graph: SensorGraph, name: str, grid: Array, x: Any) -> list[Any]:
    """How far `x` has gone through each interval of a grid, 0 ... 1; outside the grid it stays at the end."""
    points = [graph.parameters.add(f"{name}[{i}]", value) for i, value in enumerate(grid)]
    return [
        ca.fmin(ca.fmax((x - low) / (high - low), 0.0), 1.0)
        for low, high in zip(points, points[1:], strict=False)
    ]


def _along(values: list[Any], shares: list[Any]) -> Any:
    """Piecewise-linear value from the values at the grid points and the shares of the intervals."""
    return values[0] + sum(
        (after - before) * share for before, after, share in zip(values, values[1:], shares, strict=False)
    )


def table(movement: MovementTable) -> VirtualSensor:
    """The look-up sensor of a calibrated table.

    Args:
        movement: the table.

    Returns:
        A sensor with position, velocity and status; it knows neither load nor standard deviation (NaN).
    """
    graph = SensorGraph()
    w, torque, temperature = graph.motor_speed, graph.motor_torque, graph.oil_temperature
    warm = _shares(graph, "temperature", movement.temperature, temperature)

    def look_up(name: str, grid: Array, values: Array) -> Any:
        shares = _shares(graph, f"{name}.torque", grid, torque)
        rows = []
        for t, row in enumerate(values):
            cells = [graph.parameters.add(f"{name}[{t},{i}]", value) for i, value in enumerate(row)]
            rows.append(_along(cells, shares))
        return _along(rows, warm)

    lifting = movement.lift_sign * w > 0.0
    per_angle = ca.if_else(
        lifting,
        look_up("lift", movement.lift_torque, movement.lift),
        look_up("lower", movement.lower_torque, movement.lower),
    )
    step = per_angle * graph.angle

    def outside(x: Any, grid: Array) -> Any:
        return ca.logic_or(x < float(grid[0]), x > float(grid[-1]))

    off_torque = ca.if_else(
        lifting, outside(torque, movement.lift_torque), outside(torque, movement.lower_torque)
    )
    turning = ca.fabs(w) > 0.0
    status = ca.if_else(ca.logic_and(turning, off_torque), float(Status.OUTSIDE_TORQUE), float(Status.OK))
    off_temperature = outside(temperature, movement.temperature)
    status = ca.if_else(off_temperature, float(Status.OUTSIDE_TEMPERATURE), status)
    return graph.sensor(
        "table",
        position=graph.position + step,
        velocity=per_angle * w,
        load=math.nan,
        std=math.nan,
        status=status,
    )
