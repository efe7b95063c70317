"""The paper's table from simulated runs: constant speed, many loads and oil temperatures, both directions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import Duty, constant, trapezoid_moves
from ramsight.engine.run import Outcome, integrate, outputs
from ramsight.errors import SimulationError
from ramsight.plant.circuit import CircuitModel
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit, circuit, initial_state, pumped_into
from ramsight.plant.valve import ReliefValve
from ramsight.sensor.table import MovementTable
from ramsight.units import FREEZING

METHOD = 3
"""Version of the method; one that gives other tables has another number."""

TEMPERATURES = np.array([20.0, 30.0, 40.0, 50.0, 60.0, 70.0]) + FREEZING  # K
LOADS = 40
RUNS = 2 * LOADS * len(TEMPERATURES)
_LIGHTEST = 1e3  # N, [P]
_STEEP, _TOP = 0.95, 1.03  # shares of the relief load: the points lie closer from here, and end there
_APART = 1e-3  # share of the table's torque range below which two points are one
_RAMP, _LONGEST, _SHARE_OF_STROKE = 0.2, 8.0, 0.6  # s, s, 1
_SAMPLES = 41
_RELIEF_PASSES = 1e-3  # share of the pump's flow from which the relief valve counts as open


@dataclass(frozen=True)
class Sweep:
    """Movement and torque of every simulated run, before they become a table."""

    motor_speed: float  # magnitude [rad/s]
    temperature: Array  # [K], shape (t,)
    load: Array  # [N], shape (n,)
    movement: Array  # piston movement per motor angle [m/rad], shape (2, t, n), lift first
    torque: Array  # motor torque [N m], the same shape
    relieved: Array  # share of the pump's flow that passed the relief valve [1], the same shape


def sweep(
    unit: HydraulicUnit,
    *,
    motor_speed: float = SPEED,
    temperatures: Array = TEMPERATURES,
    loads: int = LOADS,
    advance: Callable[[int], object] | None = None,
) -> Sweep:
    """Simulate the unit at one constant speed, over loads and oil temperatures, in both directions.

    Args:
        motor_speed: magnitude [rad/s].
        temperatures: [K], increasing.
        loads: how many, from 1 kN to a little above the relief valve's opening; a quarter of them close to that.

    Raises:
        SimulationError: if a run does not reach its end.
    """
    model = circuit(unit)
    top = limits_of(unit).load
    steep = max(2, loads // 4)
    force = np.concatenate(
        [np.linspace(_LIGHTEST, _STEEP * top, loads - steep), np.linspace(_STEEP * top, _TOP * top, steep + 1)[1:]]
    )
    result = np.empty((3, 2, len(temperatures), loads))
    for d, direction in enumerate((1.0, -1.0)):
        for t, temperature in enumerate(temperatures):
            for k, load in enumerate(force):
                speed = direction * unit.lift_sign * motor_speed
                result[:, d, t, k] = _run(unit, model, speed, float(temperature), float(load))
                if advance is not None:
                    advance(1)
    return Sweep(motor_speed, np.asarray(temperatures), force, *result)


def calibrate(
    unit: HydraulicUnit,
    *,
    motor_speed: float = SPEED,
    temperatures: Array = TEMPERATURES,
    loads: int = LOADS,
    advance: Callable[[int], object] | None = None,
) -> MovementTable:
    """Simulate the unit at one constant speed and tabulate its movement, as the paper did.

    Args:
        unit: the unit, taken to be its data sheet.
        motor_speed: magnitude [rad/s].
        temperatures: [K], increasing.
        loads: how many, from 1 kN to the relief valve's opening.
        advance: called with 1 after every run; there are 2 * loads * len(temperatures).

    Raises:
        SimulationError: if a run does not reach its end.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> table = calibrate(boom, temperatures=np.array([313.15]), loads=4)
        >>> bool(table.lift[0, 0] > table.lift[0, 1])  # the heavier load moves less
        True
    """
    found = sweep(unit, motor_speed=motor_speed, temperatures=temperatures, loads=loads, advance=advance)
    return tabulate(unit, found)


def tabulate(unit: HydraulicUnit, found: Sweep) -> MovementTable:
    """Make the table of a sweep."""
    lift_torque, lift = _on_common_grid(found.torque[0], found.movement[0])
    # Lowering through an open relief valve has no movement of its own to a torque: such loads are left out.
    clear = (found.relieved[1] <= _RELIEF_PASSES).all(axis=0)
    lower_torque, lower = _on_common_grid(found.torque[1][:, clear], found.movement[1][:, clear])
    opens = found.relieved[0] > _RELIEF_PASSES
    relief_torque = float(np.abs(found.torque[0][opens]).min()) if opens.any() else math.inf
    return MovementTable(
        unit=unit.name,
        motor_speed=found.motor_speed,
        temperature=found.temperature,
        lift_torque=lift_torque,
        lift=lift,
        lower_torque=lower_torque,
        lower=lower,
        lift_sign=unit.lift_sign,
        relief_torque=relief_torque,
    )


def _run(
    unit: HydraulicUnit, model: CircuitModel, motor_speed: float, temperature: float, load: float
) -> tuple[float, float, float]:
    """Movement per angle [m/rad], mean torque [N m] and share of the flow through the relief valve of one run."""
    ode, stroke = model.ode, unit.cylinder.stroke
    span = min(_LONGEST, max(1.0, _SHARE_OF_STROKE * stroke / (abs(motor_speed) * unit.travel_per_radian)))
    time = np.linspace(_RAMP + 0.5 * span, _RAMP + span, _SAMPLES)
    way = math.copysign(1.0, motor_speed)  # +1 extends
    start = 0.5 * (1.0 - way) * stroke + 0.2 * stroke * way
    speed = trapezoid_moves([(motor_speed, span)], ramp=_RAMP, before=0.0, rest=0.0)
    duty = Duty(speed, constant(load), constant(temperature), start, end=_RAMP + span)
    segments = duty.segments(model.values, ode.parameters)
    run = integrate(ode, initial_state(unit, model, start, load), segments, time)
    if run.outcome is not Outcome.DONE:
        raise SimulationError(f"{unit.name} at {load:.0f} N and {temperature - FREEZING:.0f} degC: {run.message}")
    x = run.state[:, ode.state_index("position")]
    computed = outputs(ode, segments, time, run.state)
    parts = unit.parts()
    pumped = abs(pumped_into(unit, unit.held) * motor_speed)
    relieved = sum(np.mean(computed[f"{p.name}.flow"]) for p in parts if isinstance(p, ReliefValve)) / pumped
    movement = (x[-1] - x[0]) / (motor_speed * (time[-1] - time[0]))
    return float(movement), float(np.mean(computed["motor_torque"])), float(relieved)


def _on_common_grid(torque: Array, movement: Array) -> tuple[Array, Array]:
    """Bring the rows, each over its own torques, onto the torques of the middle row."""
    order = np.argsort(torque, axis=1)
    torque, movement = np.take_along_axis(torque, order, 1), np.take_along_axis(movement, order, 1)
    grid = np.unique(torque[len(torque) // 2])
    grid = grid[np.concatenate([[True], np.diff(grid) > _APART * np.ptp(grid)])]
    return grid, np.array([np.interp(grid, t, m) for t, m in zip(torque, movement, strict=True)])
