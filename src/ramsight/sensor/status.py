"""What a sensor says of each of its positions. A status names its reason; the text is what files and buses show."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """Status of one sample; the larger, the worse."""

    OK = 0
    OUTSIDE_TORQUE = 10
    OUTSIDE_TEMPERATURE = 11
    NEAR_RELIEF = 12
    POSITION_LOST = 13

    @property
    def text(self) -> str:
        """The words for it."""
        return _TEXT[self]


_TEXT = {
    Status.OK: "ok",
    Status.OUTSIDE_TORQUE: "uncertain: torque outside the calibrated range",
    Status.OUTSIDE_TEMPERATURE: "uncertain: oil temperature outside the calibrated range",
    Status.NEAR_RELIEF: "uncertain: near the relief valve's pressure",
    Status.POSITION_LOST: "uncertain: the relief valve has let oil pass; a reference is needed",
}
