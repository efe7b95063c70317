"""A sensor by name, ready for a unit."""

from __future__ import annotations

from collections.abc import Callable

from ramsight.calibration.movement import LOADS, TEMPERATURES, calibrate
from ramsight.errors import UnknownNameError
from ramsight.plant.ddh import DdhUnit
from ramsight.sensor.balance import balance
from ramsight.sensor.table import table
from ramsight.sensor.virtual_sensor import VirtualSensor

KINDS = ("balance", "table")
TABLE_RUNS = 2 * LOADS * len(TEMPERATURES)


def sensor_for(unit: DdhUnit, kind: str, *, advance: Callable[[int], object] | None = None) -> VirtualSensor:
    """Make a sensor.

    Args:
        unit: the unit it watches.
        kind: ``balance`` or ``table``; a table is calibrated first, by `TABLE_RUNS` simulated runs.
        advance: called with 1 after each of those runs.

    Raises:
        UnknownNameError: there is no such kind.
    """
    if kind == "balance":
        return balance(unit)
    if kind == "table":
        return table(calibrate(unit, advance=advance))
    raise UnknownNameError("sensor", kind, KINDS)
