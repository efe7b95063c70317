"""A sensor by name, ready for a unit."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from os.path import isfile
from pathlib import Path

import numpy as np

from ramsight.arrays import Array
from ramsight.calibration.movement import LOADS, METHOD, TEMPERATURES, calibrate
from ramsight.calibration.sensor_file import FORMAT, SUFFIX, SensorFileError, load, save
from ramsight.duty.lift_lower import SPEED
from ramsight.engine.private_folder import cache_directory, content_hash
from ramsight.engine.run import DEFAULT_RTOL
from ramsight.errors import OutputError, UnknownNameError
from ramsight.plant.unit import HydraulicUnit, circuit
from ramsight.sensor.kept_sensor import kept_sensor
from ramsight.sensor.table import MovementTable
from ramsight.sensor.virtual_sensor import VirtualSensor


def cache_file(
    unit: HydraulicUnit, *, motor_speed: float = SPEED, temperatures: Array = TEMPERATURES, loads: int = LOADS
) -> Path:
    """Where a unit's table is kept; its name changes with the unit's laws and values, the settings and the method.

    Args:
        motor_speed: magnitude [rad/s].
        temperatures: [K].
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


KINDS = ("kalman", "balance", "table")


def check_kind_of_sensor(kind: str) -> None:
    """Refuse a kind of sensor that there is not.

    Raises:
        UnknownNameError: it is none, and no sensor file.
    """
    if kind in KINDS:
        return
    from ramsight.calibration.sensor_file import SUFFIX

    if not (kind.endswith(SUFFIX) or isfile(kind)):
        raise UnknownNameError("sensor", kind, KINDS)


def sensor_for(unit: HydraulicUnit, kind: str, *, advance: Callable[[int], object] | None = None) -> VirtualSensor:
    """Make a sensor.

    Args:
        unit: the unit it watches.
        kind: ``kalman``; ``balance``; ``table``, which is calibrated first unless it is in the cache, by `RUNS` of
            `calibration.movement` simulated runs; or a sensor file.
        advance: called with 1 after each of those runs.

    Raises:
        UnknownNameError: there is no such kind.
        SensorFileError: the sensor file cannot be used, or was made for another unit.
    """
    check_kind_of_sensor(kind)
    if kind == "kalman":
        return kept_sensor(kind, unit, _kalman)
    if kind == "balance":
        return kept_sensor(kind, unit, _balance)
    if kind == "table":
        from ramsight.sensor.table import table

        return table(calibrated(unit, advance=advance))
    return _from_file(unit, kind)


def _kalman(unit: HydraulicUnit) -> VirtualSensor:
    from ramsight.sensor.kalman import kalman

    return kalman(unit)


def _balance(unit: HydraulicUnit) -> VirtualSensor:
    from ramsight.sensor.balance import balance

    return balance(unit)


def _from_file(unit: HydraulicUnit, path: str) -> VirtualSensor:
    from ramsight.calibration.sensor_file import SensorFileError, load
    from ramsight.sensor.table import table

    movement = load(path)
    if movement.unit != unit.name or movement.lift_sign != unit.lift_sign:
        raise SensorFileError(f"{path}: was calibrated for unit {movement.unit!r}, not for {unit.name!r}")
    return table(movement)
