"""What a sensor reports of each of its positions. A status names its reason; the text is what files and buses show."""

from __future__ import annotations

from bisect import bisect_right
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

VALIDITIES = ("ok", "uncertain", "not referenced", "invalid")
"""What a position may be worth; the later, the worse."""
LEAST = (10, 30, 40)
"""The least number of a status of each validity but the first."""


class Status(IntEnum):
    """Status of one sample. Below 10 ok, below 30 uncertain, below 40 not referenced, else invalid.

    Example:
        >>> import ramsight
        >>> status = ramsight.Status(30)
        >>> status.name, status.validity, status < ramsight.Status.TOO_UNCERTAIN
        ('NOT_REFERENCED', 'not referenced', True)
        >>> ramsight.Status.INPUT_GAP.text
        'uncertain: samples were missing'
        >>> print(status, int(status))
        not referenced 30
    """

    OK = 0
    REFERENCE_DUE = 10
    OUTSIDE_TORQUE = 11
    OUTSIDE_TEMPERATURE = 12
    OUTSIDE_SPEED = 13
    TEMPERATURE_LOST = 14
    NEAR_RELIEF = 15
    CAVITATION = 16
    INPUT_GAP = 17
    REFERENCE_REFUSED = 18
    POSITION_LOST = 19
    SPEED_WRONG = 20
    COUNTER_WRONG = 21
    FAULT_PASSED = 22
    NOT_REFERENCED = 30
    TOO_UNCERTAIN = 40
    OUTSIDE_STROKE = 41
    IMPLAUSIBLE_TORQUE = 42
    IMPLAUSIBLE_SPEED = 43
    INPUT_STUCK = 44
    TIME_FROZEN = 45
    INPUT_LOST = 46
    SPEED_CONTRADICTED = 47
    TORQUE_CONTRADICTED = 48
    STATE_INVALID = 49
    SIGN_CONTRADICTED = 50

    def __str__(self) -> str:
        return self.text

    def __format__(self, spec: str) -> str:
        return format(int(self), spec) if spec else self.text

    @property
    def validity(self) -> str:
        """``ok``, ``uncertain``, ``not referenced`` or ``invalid``."""
        return VALIDITIES[bisect_right(LEAST, int(self))]

    @property
    def text(self) -> str:
        """The words for it."""
        reason = _REASON.get(self)
        return self.validity if reason is None else f"{self.validity}: {reason}"


_REASON = {
    Status.REFERENCE_DUE: "reference due",
    Status.OUTSIDE_TORQUE: "torque outside the calibrated range",
    Status.OUTSIDE_TEMPERATURE: "oil temperature outside the calibrated range",
    Status.OUTSIDE_SPEED: "motor faster than it may turn",
    Status.TEMPERATURE_LOST: "oil temperature missing or implausible; the last good one is used",
    Status.NEAR_RELIEF: "near the relief valve's pressure",
    Status.CAVITATION: "cavitation, or the load has left the oil",
    Status.INPUT_GAP: "samples were missing",
    Status.REFERENCE_REFUSED: "a reference that cannot be true was rejected; another is needed",
    Status.POSITION_LOST: "oil has passed the relief valve, or was drawn from the tank; a reference is needed",
    Status.SPEED_WRONG: "the motor speed is missing, or contradicts shaft and power; the shaft's counter is used",
    Status.COUNTER_WRONG: "the shaft's counter contradicts speed and power; the motor speed is used",
    Status.FAULT_PASSED: "the drive's report contradicted itself and does no more; a reference is needed",
    Status.TOO_UNCERTAIN: "the uncertainty is above its limit; a reference is needed",
    Status.OUTSIDE_STROKE: "the position would be outside the stroke; a reference is needed",
    Status.IMPLAUSIBLE_TORQUE: "implausible motor torque",
    Status.IMPLAUSIBLE_SPEED: "implausible motor speed",
    Status.INPUT_STUCK: "motor torque stuck",
    Status.TIME_FROZEN: "time does not advance",
    Status.INPUT_LOST: "motor speed, motor torque or time missing",
    Status.SPEED_CONTRADICTED: "motor speed and the shaft's counter contradict each other",
    Status.TORQUE_CONTRADICTED: "motor torque contradicts the drive's power or the pressures",
    Status.SIGN_CONTRADICTED: "the sign of motor torque or motor speed is wrong by the shaft's inertia",
    Status.STATE_INVALID: "the sensor was never started, or a value is no finite number; start it again",
}


def validity_levels(status: Any) -> NDArray[np.int64]:
    """Place of each status' validity in `VALIDITIES`.

    Args:
        status: numbers of `Status`, any shape.

    Example:
        >>> validity_levels([0, 10, 30, 49]).tolist()
        [0, 1, 2, 3]
    """
    return np.searchsorted(LEAST, np.asarray(status), side="right")


def is_invalid(status: Any) -> NDArray[np.bool_]:
    """Whether the position of each status must not be used.

    Args:
        status: numbers of `Status`, any shape.

    Example:
        >>> is_invalid([0, 10, 30, 49]).tolist()
        [False, False, False, True]
    """
    return np.asarray(status) >= LEAST[-1]
