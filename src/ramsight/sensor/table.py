"""The paper's sensor: movement per motor revolution, looked up by torque, oil temperature and direction.

It counts revolutions only, so whatever happens per second (leakage) is right at the speed of calibration alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.engine.typed_state import symbols
from ramsight.expression import Flag, Scalar, all_of, any_of, count, scalar, within
from ramsight.plant.symbols import Parameters
from ramsight.sensor.dead_reckoning import ReckoningState, ReliefLossState, at_reference, relief_loss
from ramsight.sensor.inputs.sample import Raw, Sample, SampleState, plain_sample
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import EFFICIENCY_STD, KELVIN, TABLE_SLOW_SHARE, TORQUE_OFFSET
from ramsight.sensor.virtual_sensor import Report, VirtualSensor, close

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MovementTable:
    """Movement per motor angle in both directions."""

    unit: str  # name of the unit it was made for
    motor_speed: float  # magnitude of the speed at which it was made [rad/s]
    temperature: Array  # [K], increasing, shape (t,)
    # lift_torque, lower_torque: motor torque [N m], increasing, shape (n,)
    lift_torque: Array
    # lift, lower: piston movement per motor angle [m/rad], shape (t, n), positive where positive speed extends
    lift: Array
    lower_torque: Array
    lower: Array
    lift_sign: float  # +1 if positive motor speed lifts, else -1
    # relief_torque: magnitude of the torque at which the relief valve begins to open while lifting [N m]; infinite if
    # no load of the calibration opened it
    relief_torque: float = math.inf


def _shares(table: Parameters, name: str, grid: Array, x: Scalar) -> list[Scalar]:
    """How far `x` has gone through each interval of a grid, 0 ... 1; outside the grid it stays at the end."""
    points = [table.add(f"{name}[{i}]", value) for i, value in enumerate(grid)]
    return [within((x - low) / (high - low), 0.0, 1.0) for low, high in pairwise(points)]


def _along(values: Sequence[Scalar], shares: Sequence[Scalar]) -> Scalar:
    """Piecewise-linear value from the values at the grid points and the shares of the intervals."""
    found = values[0]
    for before, after, share in zip(values, values[1:], shares, strict=False):
        found = found + (after - before) * share
    return found


def _per_angle(table: Parameters, sample: Sample, movement: MovementTable, prefix: str = "") -> Scalar:
    """Movement per motor angle [m/rad] at this sample's torque, oil temperature and direction."""
    warm = _shares(table, f"{prefix}temperature", movement.temperature, sample.oil_temperature)

    def look_up(name: str, grid: Array, values: Array) -> Scalar:
        shares = _shares(table, f"{name}.torque", grid, sample.motor_torque)
        rows = []
        for t, row in enumerate(values):
            cells = [table.add(f"{name}[{t},{i}]", value) for i, value in enumerate(row)]
            rows.append(_along(cells, shares))
        return _along(rows, warm)

    return ca.if_else(
        movement.lift_sign * sample.motor_speed > 0.0,
        look_up(f"{prefix}lift", movement.lift_torque, movement.lift),
        look_up(f"{prefix}lower", movement.lower_torque, movement.lower),
    )


def _status(
    state: ReliefLossState, table: Parameters, sample: Sample, movement: MovementTable
) -> tuple[ReliefLossState, Scalar]:
    """Inside the calibrated range or not; judged while the motor turns fast enough to matter."""
    w, torque, temperature, add = sample.motor_speed, sample.motor_torque, sample.oil_temperature, table.add
    lifting = movement.lift_sign * w > 0.0
    turning = ca.fabs(w) > TABLE_SLOW_SHARE * add("motor_speed", movement.motor_speed)
    grids = (movement.lift_torque, movement.lower_torque)
    margin = EFFICIENCY_STD * max(float(np.abs(grid).max()) for grid in grids)

    def outside(name: str, x: Scalar, grid: Array, tolerance: float) -> Flag:
        low, high = add(f"{name}.lowest", grid[0] - tolerance), add(f"{name}.highest", grid[-1] + tolerance)
        return any_of(x < low, x > high)

    off_torque = ca.if_else(
        lifting, outside("lift", torque, grids[0], margin), outside("lower", torque, grids[1], margin)
    )
    pushing = count(all_of(turning, lifting)) * movement.lift_sign * torque
    status = ca.if_else(all_of(turning, off_torque), float(Status.OUTSIDE_TORQUE), float(Status.OK))
    off_temperature = outside("temperature", temperature, movement.temperature, KELVIN)
    status = ca.if_else(off_temperature, float(Status.OUTSIDE_TEMPERATURE), status)
    relief = add("relief_torque", movement.relief_torque)
    status = ca.if_else(pushing > (1.0 - EFFICIENCY_STD) * relief, float(Status.NEAR_RELIEF), status)
    after = relief_loss(state, sample, pushing > (1.0 - TORQUE_OFFSET) * relief)
    return after, ca.if_else(after.unobservable, float(Status.POSITION_LOST), status)


def table(movement: MovementTable) -> VirtualSensor:
    """The look-up sensor of a calibrated table.

    Args:
        movement: the table.

    Returns:
        A sensor with position, velocity and status; it knows neither load nor standard deviation (NaN). Outside the
        table it goes on with the table's nearest value, and its status shows that.
    """
    return _sensor("table", movement, _per_angle)


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

    def per_angle(table: Parameters, sample: Sample, first: MovementTable) -> Scalar:
        values = [_per_angle(table, sample, m, f"speed[{k}].") for k, m in enumerate(movements)]
        speeds = np.array([movement.motor_speed for movement in movements])
        speed = ca.fabs(sample.motor_speed)
        if over == "speed":
            return _along(values, _shares(table, "motor_speed", speeds, speed))
        slowest = table.add("slowest", speeds[0])
        return _along(values[::-1], _shares(table, "reciprocal", 1.0 / speeds[::-1], 1.0 / ca.fmax(speed, slowest)))

    return _sensor("speed table", movements[-1], per_angle)


def _sensor(
    kind: str, movement: MovementTable, look_up: Callable[[Parameters, Sample, MovementTable], Scalar]
) -> VirtualSensor:
    parameters, raw = Parameters(), Raw.symbols()
    initial = ReckoningState(position=scalar(0.0), intake=SampleState.initial())
    state = symbols(initial)
    intake, sample = plain_sample(state.intake, raw)
    per_angle = look_up(parameters, sample, movement)
    relief, status = _status(state.relief, parameters, sample, movement)
    position = at_reference(sample, state.position + per_angle * sample.angle)
    after = ReckoningState(position=position, intake=intake, relief=relief)
    report = Report(position, math.nan, per_angle * sample.motor_speed, math.nan, status)
    return close(kind, parameters, raw, initial, state, after, report)
