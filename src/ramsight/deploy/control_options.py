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

    @property
    def words(self) -> tuple[str, ...]:
        """The options of `ramsight export` that say the same; what else is declared of a drive has none.

        Example:
            >>> ControlOptions(speed=0.02, period=0.01).words
            ('--speed "0.02 m/s"', '--period "0.01 s"')
        """
        late = self.drive.command_delay if self.drive.command_delay == self.drive.report_delay else 0.0
        said = (
            ("speed", self.speed, "m/s", None),
            ("force", self.force, "N", math.inf),
            ("period", self.period, "s", SAMPLE_PERIOD),
            ("drive-delay", late, "s", 0.0),
        )
        return tuple(f'--{name} "{value!r} {unit}"' for name, value, unit, usual in said if value != usual)

    def block(self, unit: HydraulicUnit) -> Block:
        """The control of a unit, as a graph."""
        from ramsight.control.block import position_block
        from ramsight.control.trajectory import Limits

        return position_block(unit, Limits.of(unit, self.speed, self.force), period=self.period, response=self.drive)
