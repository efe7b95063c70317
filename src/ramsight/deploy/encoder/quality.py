"""What a position is worth, in the words of OPC UA: Good, Uncertain or Bad, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ramsight.deploy.encoder.alarms import Fault
from ramsight.deploy.encoder.encoder import Encoder

GOOD = "Good"
WAITING = "BadWaitingForInitialData"
STALE = "BadNoCommunication"
_BAD = "Bad"

QUALITY = {
    Fault.NOT_REFERENCED: WAITING,
    Fault.REFERENCE_DUE: "UncertainSensorNotAccurate",
    Fault.LIMITS: "UncertainEngineeringUnitsExceeded",
    Fault.OVERSPEED: "UncertainEngineeringUnitsExceeded",
    Fault.GAP: "UncertainSensorNotAccurate",
    Fault.TEMPERATURE: "UncertainSubNormal",
    Fault.TOO_UNCERTAIN: "BadSensorFailure",
    Fault.REFUSED: "BadSensorFailure",
    Fault.IMPLAUSIBLE: "BadSensorFailure",
    Fault.ONE_OF_TWO: "UncertainSubNormal",
    Fault.APART: "BadSensorFailure",
    Fault.OTHER_WRONG: "UncertainSubNormal",
    Fault.VIRTUAL_WRONG: "BadSensorFailure",
    Fault.SECOND_NODE: "BadConfigurationError",
    Fault.DRIVE_SILENT: STALE,
    Fault.DRIVE_GONE: STALE,
    Fault.STALE: STALE,
    Fault.DISABLED: "BadDeviceFailure",
    Fault.SHORT: "UncertainSubNormal",
    Fault.STATE_DAMAGED: "BadConfigurationError",
    Fault.PARAMETERS_DAMAGED: "BadConfigurationError",
    Fault.NOT_SAVED: "BadDeviceFailure",
    Fault.INTERNAL: "BadDeviceFailure",
}
"""OPC UA's status code for each fault: Bad where the fault makes the position invalid, Uncertain elsewhere."""


@dataclass(frozen=True)
class Said:
    """What an encoder reports at one time."""

    quality: str  # name of OPC UA's status code for the numbers
    # position, velocity, std, bound: [m], [m/s], [m], [m]; NaN while the quality is bad
    position: float
    velocity: float
    std: float
    bound: float
    status: int  # number of the sensor's status; 255 before the first sample
    text: str  # what is wrong in words, or the position
    referenced: bool  # whether a reference has come since power-up


def said_by(encoder: Encoder) -> Said:
    """What an encoder reports now."""
    found = quality_of(encoder.faults, valid=encoder.valid)
    numbers = encoder.position, encoder.velocity, encoder.std, encoder.bound
    if found.startswith(_BAD):
        numbers = (math.nan,) * 4
    return Said(found, *numbers, encoder.status, encoder.said, encoder.referenced)


def quality_of(faults: frozenset[Fault], *, valid: bool) -> str:
    """The worst quality of some faults.

    Args:
        valid: whether the position is; where it is not, the quality is bad whatever the faults.

    Example:
        >>> quality_of(frozenset(), valid=True), quality_of(frozenset({Fault.GAP}), valid=True)
        ('Good', 'UncertainSensorNotAccurate')
        >>> quality_of(frozenset({Fault.GAP, Fault.REFUSED}), valid=False), quality_of(frozenset(), valid=False)
        ('BadSensorFailure', 'BadWaitingForInitialData')
    """
    found = [QUALITY[fault] for fault in Fault if fault in faults]
    bad = [one for one in found if one.startswith(_BAD)]
    if bad or not valid:
        return bad[0] if bad else WAITING
    return found[0] if found else GOOD
