"""A cylinder at rest, where a valve or the pump holds it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ramsight.control.activity import Activity
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish
from ramsight.control.judging import Trust
from ramsight.control.visiting import kept_on


@dataclass(frozen=True)
class OnStop:
    """An end stop that the rod stands on.

    Args:
        direction: of the stop, +1 or -1.
        felt: load on the way there, which the stop hides [N].
    """

    direction: float
    felt: float


class Resting(Doing):
    """Stand, or turn as slowly as leakage takes where the pump holds the load.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        target: where it is held [m]; NaN: where it is when it is first trusted.
        on_stop: the end stop that it stands on, if it does.
    """

    activity = Activity.RESTING

    def __init__(self, by: Actuation, target: float = math.nan, on_stop: OnStop | None = None) -> None:
        super().__init__(by)
        self.target, self.on_stop = target, on_stop
        self.without_position = math.isnan(target) or not by.holding.stands
        self._place = target

    def step(self, now: Now) -> Wish:
        """Let the motor stand, or hold the load with it."""
        return Wish(self._held(now))

    def _held(self, now: Now) -> float:
        """As slowly as leakage takes, and back to where it is held once the rod has left the dead band.

        On an end stop the sensor feels what presses on the stop: the load there is the one that was felt on the way.
        """
        if self.by.holding.stands:
            return 0.0
        if self.on_stop is not None:
            return float(kept_on(self.by, self.on_stop.direction, self.on_stop.felt))
        velocity = 0.0
        if now.trust is not Trust.NONE:
            if math.isnan(self._place):
                self._place = now.estimate.position
            velocity = self.by.back(self._place - now.estimate.position)
        return float(self.by.at_rest(velocity, now.estimate.load))
