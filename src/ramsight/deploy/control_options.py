"""How a control that is exported drives its cylinder; nothing of the control is loaded before one is made."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.plant.unit import HydraulicUnit

if TYPE_CHECKING:
    from ramsight.control.block import Block


@dataclass(frozen=True)
class ControlOptions:
    """How a control that is exported drives its cylinder.

    Args:
        speed: largest velocity [m/s]; by default half of what the motor could do.
        force: largest load against a motion that is pushed on [N].
        period: of its samples [s].
        drive: how the drive is declared to follow and to report; what does otherwise is stopped.
    """

    speed: float | None = None
    force: float = math.inf
    period: float = SAMPLE_PERIOD
    drive: DriveResponse = IDEAL

    def block(self, unit: HydraulicUnit) -> Block:
        """The control of a unit, as a graph."""
        from ramsight.control.block import position_block
        from ramsight.control.trajectory import Limits

        return position_block(unit, Limits.of(unit, self.speed, self.force), period=self.period, response=self.drive)
