"""The paper's table from simulated runs: constant speed, many loads and oil temperatures, both directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ramsight.duty.lift_lower import SPEED
from ramsight.duty.profile import Duty, constant, trapezoid_moves
from ramsight.engine.outcome import Outcome
from ramsight.engine.run import integrate, outputs
from ramsight.errors import SimulationError
from ramsight.plant.ddh import DdhUnit, circuit, initial_state
from ramsight.sensor.table import MovementTable

Array = NDArray[np.float64]

TEMPERATURES = np.array([20.0, 30.0, 40.0, 50.0, 60.0, 70.0]) + 273.15  # K
LOADS = 40
_LIGHTEST = 1e3  # N, [P]
_STEEP = 0.95  # share of the relief load above which the points lie closer
_RAMP, _LONGEST, _SHARE_OF_STROKE = 0.2, 8.0, 0.6  # s, s, 1
_SAMPLES = 41


def relief_load(unit: DdhUnit) -> float:
    """Load at which the held side's pressure reaches the relief setting, friction left out [N]."""
    area = unit.cylinder.area_a if unit.held == "a" else unit.cylinder.area_b
    side = unit.a if unit.held == "a" else unit.b
    return side.relief.setting * area


def calibrate(
    unit: DdhUnit,
    *,
    motor_speed: float = SPEED,
    temperatures: Array = TEMPERATURES,
    loads: int = LOADS,
    advance: Callable[[int], object] | None = None,
) -> MovementTable:
    """Simulate the unit at one constant speed and tabulate its movement.

    Args:
        unit: the unit, taken to be its data sheet.
        motor_speed: magnitude [rad/s].
        temperatures: [K], increasing.
        loads: how many, from 1 kN to the relief valve's opening.
        advance: called with 1 after every run; there are 2 * loads * len(temperatures).

    Raises:
        SimulationError: if a run does not reach its end.
    """
    model = circuit(unit)
    ode = model.ode
    top = relief_load(unit)
    steep = max(2, loads // 4)
    force = np.concatenate(
        [np.linspace(_LIGHTEST, _STEEP * top, loads - steep), np.linspace(_STEEP * top, top, steep + 1)[1:]]
    )
    stroke = unit.cylinder.stroke
    span = min(_LONGEST, max(1.0, _SHARE_OF_STROKE * stroke / (motor_speed * unit.travel_per_radian)))
    time = np.linspace(_RAMP + 0.5 * span, _RAMP + span, _SAMPLES)
    position = ode.state_index("position")
    movement = np.empty((2, len(temperatures), loads))
    needed = np.empty_like(movement)
    for d, direction in enumerate((1.0, -1.0)):
        low_end = 0.0 if unit.lift_sign * direction > 0.0 else stroke
        start = low_end + 0.2 * stroke * unit.lift_sign * direction
        speed = trapezoid_moves(
            [(direction * unit.lift_sign * motor_speed, span)], ramp=_RAMP, before=0.0, rest=0.0
        )
        for t, temperature in enumerate(temperatures):
            for k, load in enumerate(force):
                duty = Duty(speed, constant(load), constant(temperature), start, end=_RAMP + span)
                segments = duty.segments(model.values, ode.parameters.index("oil_temperature"))
                run = integrate(ode, initial_state(unit, model, start, load), segments, time)
                if run.outcome is not Outcome.DONE:
                    raise SimulationError(
                        f"{unit.name} at {load:.0f} N and {temperature - 273.15:.0f} degC: {run.message}"
                    )
                x = run.state[:, position]
                angle = direction * unit.lift_sign * motor_speed * (time[-1] - time[0])
                movement[d, t, k] = (x[-1] - x[0]) / angle
                needed[d, t, k] = float(np.mean(outputs(ode, segments, time, run.state)["motor_torque"]))
                if advance is not None:
                    advance(1)
    (lift_torque, lift), (lower_torque, lower) = (_on_common_grid(needed[d], movement[d]) for d in (0, 1))
    return MovementTable(
        unit.name,
        motor_speed,
        np.asarray(temperatures),
        lift_torque,
        lift,
        lower_torque,
        lower,
        unit.lift_sign,
    )


def _on_common_grid(torque: Array, movement: Array) -> tuple[Array, Array]:
    """Bring the rows, each over its own torques, onto the torques of the middle row."""
    order = np.argsort(torque, axis=1)
    torque, movement = np.take_along_axis(torque, order, 1), np.take_along_axis(movement, order, 1)
    grid = np.unique(torque[len(torque) // 2])
    return grid, np.array([np.interp(grid, t, m) for t, m in zip(torque, movement, strict=True)])
