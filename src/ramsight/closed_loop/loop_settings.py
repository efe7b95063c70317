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

    Args:
        known: whether the sensors start with a known position, which is right; otherwise they have to be homed.
        oil_temperature: [K].
        temperature_offset: by which the thermometers read too much [K].
        feedback: where the controls take the position from.
        seed: of the drives' and the position sensors' noise.
        assumptions: what the sensors assume of the machine; by default what each unit declares, and that a known
            position is not wrong.
        limits: by unit; by default `Limits.of`.
        period: of the samples [s].
        drive: how the drives follow their commands and report.
        declared: how the controls take them to do that; by default as they do.
        report: rounding and noise of what the drives report; seed and the thermometers' offset are those above. What
            the controls take them for is in `DriveResponse`.
        referencing: references that `go` takes before a move by which they are due; by default none.

    Example:
        >>> LoopSettings(known=True, period=0.01).oil_temperature
        313.15
    """

    known: bool = False
    oil_temperature: float = T40
    temperature_offset: float = 0.0
    feedback: Feedback = Feedback.SENSOR
    seed: int = 0
    assumptions: Assumptions | None = None
    limits: Mapping[str, Limits] | None = None
    period: float = SAMPLE_PERIOD
    drive: DriveResponse = IDEAL
    declared: DriveResponse | None = None
    report: DriveReport = USUAL
    referencing: Referencing | None = None

    def assumed_of(self, unit: HydraulicUnit) -> Assumptions:
        """What the sensor of a unit assumes."""
        if self.assumptions is not None:
            return self.assumptions
        return unit.assumptions.replace(SURE_START) if self.known else unit.assumptions
