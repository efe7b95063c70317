"""How a loop is set up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from ramsight.closed_loop.referencing import Referencing
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_report import DriveReport
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.machine.assumption_description import SURE_START
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions

USUAL = DriveReport()
"""What a usual CANopen drive reports: whole rpm, a torque with a noise of 0.5 N m."""


class Feedback(Enum):
    """Where a control takes the position from."""

    SENSOR = "virtual sensor"
    TRUTH = "true position"
    REAL = "position sensor with a noise of 0.5 mm"


@dataclass(frozen=True)
class LoopSettings:
    """How a loop is set up; what all its units share.

    Example:
        >>> LoopSettings(known=True, period=0.01).oil_temperature
        313.15
    """

    # known: whether the sensors start with a known position, which is right; otherwise they have to be homed
    known: bool = False
    oil_temperature: float = T40  # [K]
    temperature_offset: float = 0.0  # by which the thermometers read too much [K]
    feedback: Feedback = Feedback.SENSOR  # where the controls take the position from
    seed: int = 0  # of the drives' and the position sensors' noise
    # assumptions: what the sensors assume of the machine; by default what each unit declares, and that a known
    # position is not wrong
    assumptions: Assumptions | None = None
    limits: Mapping[str, Limits] | None = None  # by unit; by default `Limits.of`
    period: float = SAMPLE_PERIOD  # of the samples [s]
    drive: DriveResponse = IDEAL  # how the drives follow their commands and report
    declared: DriveResponse | None = None  # how the controls take them to do that; by default as they do
    # report: rounding and noise of what the drives report; seed and the thermometers' offset are those above. What
    # the controls take them for is in `DriveResponse`
    report: DriveReport = USUAL
    # referencing: references that `go` takes before a move by which they are due; by default none
    referencing: Referencing | None = None

    def assumed_of(self, unit: HydraulicUnit) -> Assumptions:
        """What the sensor of a unit assumes."""
        if self.assumptions is not None:
            return self.assumptions
        return unit.assumptions.replace(SURE_START) if self.known else unit.assumptions
