"""What a sensor says of each of its positions. A status names its reason; the text is what files and buses show."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """Status of one sample; the larger, the worse. Below 10 ok, below 20 uncertain, below 30 not referenced."""

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
    NOT_REFERENCED = 20
    TOO_UNCERTAIN = 30
    OUTSIDE_STROKE = 31
    IMPLAUSIBLE_TORQUE = 32
    IMPLAUSIBLE_SPEED = 33
    INPUT_STUCK = 34
    TIME_FROZEN = 35
    INPUT_LOST = 36
    STATE_INVALID = 37

    @property
    def validity(self) -> str:
        """``ok``, ``uncertain``, ``not referenced`` or ``invalid``."""
        return ("ok", "uncertain", "not referenced", "invalid")[int(self) // 10]

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
    Status.REFERENCE_REFUSED: "a reference that cannot be true was refused; another is needed",
    Status.POSITION_LOST: "oil has passed the relief valve, or was drawn from the tank; a reference is needed",
    Status.TOO_UNCERTAIN: "the uncertainty is above its limit; a reference is needed",
    Status.OUTSIDE_STROKE: "the position would be outside the stroke; a reference is needed",
    Status.IMPLAUSIBLE_TORQUE: "implausible motor torque",
    Status.IMPLAUSIBLE_SPEED: "implausible motor speed",
    Status.INPUT_STUCK: "motor torque stuck",
    Status.TIME_FROZEN: "time does not advance",
    Status.INPUT_LOST: "motor speed, motor torque or time missing",
    Status.STATE_INVALID: "the sensor was never started, or a value is no finite number; start it anew",
}
