"""A variable of an FMU, and the enumerations that it may be of."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.sensor.status import Status
from ramsight.tracking.comparing import Verdict

UNKNOWN = 1e10
"""What no pressure in Pa, no angle in rad and no position in m is."""
NOTHING = "1e10 where it is not measured"
PERIOD = SAMPLE_PERIOD  # s; of the steps of a sensor that nothing behind it asks for others
ENUMERATIONS: dict[str, type[Status] | type[Verdict]] = {"status": Status, "verdict": Verdict}
"""Kinds of variables that are whole numbers with words."""


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU."""

    name: str
    kind: str  # `real`, `status`, `verdict` or `truth`
    causality: str  # `input`, `output`, `parameter` or `independent`
    unit: str = ""  # SI unit; empty if it has none
    text: str = ""  # what it is
    start: float | None = None  # value before anything is set; outputs have none
    nominal: float | None = None  # a usual size; None where it is unknown
    # least, most: range, where there is one
    least: float | None = None
    most: float | None = None

    @property
    def enumeration(self) -> type[IntEnum] | None:
        """What its numbers mean, if they have words."""
        return ENUMERATIONS.get(self.kind)
