"""Options of an export: what a sensor weighs, and how a control behind it drives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import DescriptionError
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.reckoned import reckoned
from ramsight.sensor.virtual_sensor import VirtualSensor

if TYPE_CHECKING:
    from ramsight.control.block import Block

SURE_ENDS = 1e-5
"""Chance of a stop that is elsewhere than described, up to which a machine's ends are sure."""


class Profile(Enum):
    """What a sensor weighs.

    `KALMAN`: all hypotheses, as in Python. `KALMAN_SMALL`: not those of ends that are elsewhere than described. It is
    for machines whose ends are declared as sure; on another one it would be wrong without a warning. `BALANCE`:
    none; it counts from one reference to the next.
    """

    KALMAN = "kalman"
    KALMAN_SMALL = "kalman-small"
    BALANCE = "balance"

    @property
    def words(self) -> str:
        """The profile and what it weighs, in a line.

        Example:
            >>> Profile.BALANCE.words
            'balance: no hypotheses, counts from one reference to the next'
        """
        weighs = {
            Profile.KALMAN: "all hypotheses, as in Python",
            Profile.KALMAN_SMALL: "no hypotheses of ends that are elsewhere than described",
            Profile.BALANCE: "no hypotheses, counts from one reference to the next",
        }
        return f"{self.value}: {weighs[self]}"

    def sensor(self, unit: HydraulicUnit) -> VirtualSensor:
        """A unit's sensor.

        Raises:
            DescriptionError: the profile is for machines whose ends are sure, and the unit's are not.
        """
        return reckoned(unit) if self is Profile.BALANCE else kalman(unit, None, self.kinds(unit))

    def kinds(self, unit: HydraulicUnit) -> tuple[Kind, ...]:
        """The hypotheses that a unit's sensor weighs.

        Raises:
            DescriptionError: the profile is for machines whose ends are sure, and the unit's are not.
        """
        if self is Profile.BALANCE:
            return ()
        if self is Profile.KALMAN:
            return KINDS
        undeclared = unit.assumptions.stops.undeclared
        if undeclared > SURE_ENDS:
            raise DescriptionError(
                f"profile {self.value} weighs no end that is elsewhere than described; declare that the ends are sure",
                key=f"units.{unit.name}.assumptions.stops.undeclared",
                value=f"{100 * undeclared:g} %",
                allowed=f"up to {100 * SURE_ENDS:g} %",
            )
        return (Kind.DESCRIBED, Kind.LEAKS, Kind.UNKNOWN_POSITION)


def profile_of(name: str) -> Profile:
    """A profile by its name.

    Raises:
        DescriptionError: there is none of that name.

    Example:
        >>> profile_of("kalman-small")
        <Profile.KALMAN_SMALL: 'kalman-small'>
    """
    if name not in {one.value for one in Profile}:
        allowed = ", ".join(one.value for one in Profile)
        raise DescriptionError("there is no such profile", key="profile", value=name, allowed=allowed)
    return Profile(name)


@dataclass(frozen=True)
class ControlOptions:
    """How a control that is exported drives its cylinder."""

    speed: float | None = None  # largest velocity [m/s]; by default half of what the motor could do
    force: float = math.inf  # largest load against a motion that is pushed on [N]
    period: float = SAMPLE_PERIOD  # of its samples [s]
    drive: DriveResponse = IDEAL  # how the drive is declared to follow and to report; what does otherwise is stopped

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
