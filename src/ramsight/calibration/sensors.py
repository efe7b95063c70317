"""A sensor by name, ready for a unit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ramsight.errors import UnknownNameError
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kept_sensor import kept_sensor
from ramsight.sensor.virtual_sensor import VirtualSensor

KINDS = ("kalman", "balance", "table")


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
    if kind == "kalman":
        return kept_sensor(kind, unit, _kalman)
    if kind == "balance":
        return kept_sensor(kind, unit, _balance)
    if kind == "table":
        from ramsight.calibration.cached import calibrated
        from ramsight.sensor.table import table

        return table(calibrated(unit, advance=advance))
    from ramsight.calibration.sensor_file import SUFFIX

    if kind.endswith(SUFFIX) or Path(kind).is_file():
        return _from_file(unit, kind)
    raise UnknownNameError("sensor", kind, KINDS)


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
