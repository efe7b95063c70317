"""What a sensor assumes of drive, thermometer, machine and stops; a part of the description, and declared there."""

from ramsight.machine.assumption_description import (
    AssumedDrive,
    AssumedLinkAngle,
    AssumedMachine,
    AssumedPressure,
    AssumedStops,
    AssumedThermometer,
    Assumptions,
)

__all__ = [
    "AssumedDrive",
    "AssumedLinkAngle",
    "AssumedMachine",
    "AssumedPressure",
    "AssumedStops",
    "AssumedThermometer",
    "Assumptions",
]
