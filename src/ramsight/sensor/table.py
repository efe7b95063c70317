"""The paper's sensor: movement per motor revolution, looked up by torque, oil temperature and direction.

It counts revolutions only, so whatever happens per second (leakage) is right at the speed of calibration alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

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
        relief_torque: magnitude of the torque at which the relief valve begins to open while lifting [N m]; infinite
            if no load of the calibration opened it.
    """

    unit: str
    motor_speed: float
    temperature: Array
    lift_torque: Array
    lift: Array
    lower_torque: Array
    lower: Array
    lift_sign: float
    relief_torque: float = math.inf


_SLOW = 0.05  # share of the calibrated speed; slower turns move the piston too little to judge the torque by
_TORQUE_MARGIN = 0.03  # share of the largest torque; the noise of a drive and the rotor's own torque in a ramp
_TEMPERATURE_MARGIN = 1.0  # K; the noise of a temperature reading, worth a few parts in a thousand of the leakage
_NEAR_RELIEF = 0.97  # share of the torque at the relief valve's opening above which flow may be lost, [G]
_AT_RELIEF = 0.99  # share of that torque from which oil is taken to pass, [G]


def _shares(graph: SensorGraph, name: str, grid: Array, x: Any) -> list[Any]:
    """How far `x` has gone through each interval of a grid, 0 ... 1; outside the grid it stays at the end."""
    points = [graph.parameters.add(f"{name}[{i}]", value) for i, value in enumerate(grid)]
    return [ca.fmin(ca.fmax((x - low) / (high - low), 0.0), 1.0) for low, high in pairwise(points)]


def _along(values: list[Any], shares: list[Any]) -> Any:
    """Piecewise-linear value from the values at the grid points and the shares of the intervals."""
    return values[0] + sum(
        (after - before) * share for before, after, share in zip(values, values[1:], shares, strict=False)
    )


def _per_angle(graph: SensorGraph, movement: MovementTable, prefix: str = "") -> Any:
    """Movement per motor angle [m/rad] at this sample's torque, oil temperature and direction."""
    warm = _shares(graph, f"{prefix}temperature", movement.temperature, graph.oil_temperature)

    def look_up(name: str, grid: Array, values: Array) -> Any:
        shares = _shares(graph, f"{name}.torque", grid, graph.motor_torque)
        rows = []
        for t, row in enumerate(values):
            cells = [graph.parameters.add(f"{name}[{t},{i}]", value) for i, value in enumerate(row)]
            rows.append(_along(cells, shares))
        return _along(rows, warm)

    return ca.if_else(
        movement.lift_sign * graph.motor_speed > 0.0,
        look_up(f"{prefix}lift", movement.lift_torque, movement.lift),
        look_up(f"{prefix}lower", movement.lower_torque, movement.lower),
    )


def _status(graph: SensorGraph, movement: MovementTable) -> Any:
    """Inside the calibrated range or not; judged while the motor turns fast enough to matter."""
    w, torque, temperature = graph.motor_speed, graph.motor_torque, graph.oil_temperature
    add = graph.parameters.add
    lifting, turning = (
        movement.lift_sign * w > 0.0,
        ca.fabs(w) > _SLOW * add("motor_speed", movement.motor_speed),
    )
    grids = (movement.lift_torque, movement.lower_torque)
    margin = _TORQUE_MARGIN * max(float(np.abs(grid).max()) for grid in grids)

    def outside(name: str, x: Any, grid: Array, tolerance: float) -> Any:
        low, high = add(f"{name}.lowest", grid[0] - tolerance), add(f"{name}.highest", grid[-1] + tolerance)
        return ca.logic_or(x < low, x > high)

    off_torque = ca.if_else(
        lifting, outside("lift", torque, grids[0], margin), outside("lower", torque, grids[1], margin)
    )
    pushing = ca.logic_and(turning, lifting) * movement.lift_sign * torque
    status = ca.if_else(ca.logic_and(turning, off_torque), float(Status.OUTSIDE_TORQUE), float(Status.OK))
    off_temperature = outside("temperature", temperature, movement.temperature, _TEMPERATURE_MARGIN)
    status = ca.if_else(off_temperature, float(Status.OUTSIDE_TEMPERATURE), status)
    relief = add("relief_torque", movement.relief_torque)
    status = ca.if_else(pushing > _NEAR_RELIEF * relief, float(Status.NEAR_RELIEF), status)
    return ca.if_else(graph.lost(pushing > _AT_RELIEF * relief, graph.referenced), float(Status.POSITION_LOST), status)


def table(movement: MovementTable) -> VirtualSensor:
    """The look-up sensor of a calibrated table.

    Args:
        movement: the table.

    Returns:
        A sensor with position, velocity and status; it knows neither load nor standard deviation (NaN). Outside the
        table it goes on with the table's nearest value, and says so.
    """
    return _sensor("table", SensorGraph(), movement, _per_angle)


def speed_table(movements: Sequence[MovementTable], over: Literal["speed", "reciprocal"] = "speed") -> VirtualSensor:
    """The look-up sensor of tables made at several speeds, with the movement interpolated between them.

    Below the slowest and above the fastest table it uses that one.

    Args:
        movements: tables of one unit, their speeds increasing.
        over: what is interpolated over: the speed, or its reciprocal. What leaks per second is a movement per
            revolution that goes as 1/n, so that over the reciprocal it is a straight line.

    Returns:
        A sensor like that of `table`.
    """

    def per_angle(graph: SensorGraph, first: MovementTable) -> Any:
        values = [_per_angle(graph, m, f"speed[{k}].") for k, m in enumerate(movements)]
        speeds = np.array([movement.motor_speed for movement in movements])
        speed = ca.fabs(graph.motor_speed)
        if over == "speed":
            return _along(values, _shares(graph, "motor_speed", speeds, speed))
        slowest = graph.parameters.add("slowest", speeds[0])
        return _along(values[::-1], _shares(graph, "reciprocal", 1.0 / speeds[::-1], 1.0 / ca.fmax(speed, slowest)))

    return _sensor("speed table", SensorGraph(), movements[-1], per_angle)


def _sensor(
    kind: str,
    graph: SensorGraph,
    movement: MovementTable,
    look_up: Callable[[SensorGraph, MovementTable], Any],
) -> VirtualSensor:
    per_angle = look_up(graph, movement)
    return graph.counting(
        kind,
        position=graph.position + per_angle * graph.angle,
        velocity=per_angle * graph.motor_speed,
        load=math.nan,
        std=math.nan,
        status=_status(graph, movement),
    )
