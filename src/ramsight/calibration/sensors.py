"""A sensor by name, ready for a unit."""

from __future__ import annotations

from collections.abc import Callable
from os.path import isfile

from ramsight.errors import UnknownNameError
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kept_sensor import kept_sensor
from ramsight.sensor.virtual_sensor import VirtualSensor

KINDS = ("kalman", "balance", "table")


def check_kind_of_sensor(kind: str) -> None:
    """Refuse a kind of sensor that there is not.

    Args:
        kind: as `sensor_for`'s.

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
        from ramsight.calibration.cached import calibrated
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
