"""Calibrated tables kept on disk by their content: the machine's equation and values, the settings, the method."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from ramsight.arrays import Array
from ramsight.calibration.movement import LOADS, METHOD, TEMPERATURES, calibrate
from ramsight.calibration.sensor_file import FORMAT, SUFFIX, SensorFileError, load, save
from ramsight.duty.lift_lower import SPEED
from ramsight.engine.private_folder import cache_directory, content_hash
from ramsight.engine.run import DEFAULT_RTOL
from ramsight.errors import OutputError
from ramsight.plant.unit import HydraulicUnit, circuit
from ramsight.sensor.table import MovementTable


def cache_file(
    unit: HydraulicUnit, *, motor_speed: float = SPEED, temperatures: Array = TEMPERATURES, loads: int = LOADS
) -> Path:
    """Where a unit's table is kept; its name changes with the unit's laws and values, the settings and the method.

    Args:
        unit: the unit.
        motor_speed: magnitude [rad/s].
        temperatures: [K].
        loads: how many.
    """
    model = circuit(unit)
    settings = [motor_speed, np.asarray(temperatures).tolist(), loads, DEFAULT_RTOL, METHOD, FORMAT]
    laws = (model.ode.function.serialize(), model.ode.output_function.serialize())
    key = content_hash(unit.name, repr(unit), repr((model.values.tolist(), settings)), *laws)
    return cache_directory() / f"table_{key}{SUFFIX}"


def calibrated(
    unit: HydraulicUnit,
    *,
    motor_speed: float = SPEED,
    temperatures: Array = TEMPERATURES,
    loads: int = LOADS,
    advance: Callable[[int], object] | None = None,
) -> MovementTable:
    """The unit's table: from the cache if it was made before, else calibrated and kept.

    A damaged cache file is replaced; where nothing can be kept, the table is calibrated each time.

    Args:
        unit: the unit, taken to be its data sheet.
        motor_speed: magnitude [rad/s].
        temperatures: [K], increasing.
        loads: how many.
        advance: called with 1 after every simulated run.

    Raises:
        SimulationError: if a run does not reach its end.
    """
    file = cache_file(unit, motor_speed=motor_speed, temperatures=temperatures, loads=loads)
    if file.exists():
        with suppress(SensorFileError):
            return load(file)
    movement = calibrate(unit, motor_speed=motor_speed, temperatures=temperatures, loads=loads, advance=advance)
    with suppress(OSError, OutputError):
        save(movement, file)
    return movement
