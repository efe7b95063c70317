"""A reference visit: to an end stop, and press on it until the sensor has surely taken it for one."""

from __future__ import annotations

import math

from ramsight.control.activity import Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish
from ramsight.control.judging import Trust
from ramsight.control.resting import OnStop, Resting
from ramsight.control.visiting import NO_REFERENCE, NOT_FOUND, Visiting


class Homing(Doing):
    """Go to an end stop.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        end: the stop's place [m].
        slow: go slowly however far it is.
    """

    activity = Activity.HOMING
    without_position, may_stall = True, True

    def __init__(self, by: Actuation, end: float, *, slow: bool = False) -> None:
        super().__init__(by)
        self._laws = Visiting(by)
        self._fast = self._laws.slowly if slow else by.limits.speed
        self._end, self._direction = end, 1.0 if end > 0.0 else -1.0
        self._velocity, self._felt = 0.0, math.nan
        self._for, self._stood = 0.0, 0.0

    def enter(self, now: Now) -> None:
        """Feel the load first where the way begins."""
        self._felt = now.estimate.load

    def step(self, now: Now) -> Wish:
        """Fast as long as the stop is known to be far, then slowly, then press."""
        laws, estimate = self._laws, now.estimate
        away = abs(self._end - estimate.position)
        self._for += self.by.period
        self._velocity = laws.nearing(
            self._velocity, away, estimate.std, self._fast, now.trust is not Trust.NONE
        )  # fmt: skip
        if laws.stands(self._for, estimate.velocity):
            self._stood += self.by.period
        else:
            self._stood, self._felt = 0.0, laws.feeling(self._felt, estimate.load)
        if self._stood > self.by.tuning.pressing:
            if laws.on_the_stop(away):
                return Wish(0.0, Event.PRESSED)
            return Wish(0.0, Event.FAILED, f"{NO_REFERENCE}: {estimate.status.text}")
        if self._for > laws.longest:
            return Wish(0.0, Event.FAILED, f"{NOT_FOUND}: {estimate.status.text}")
        return Wish(laws.speed(self._velocity, self._stood, self._direction, self._felt, estimate.load))

    def leave(self, event: Event) -> Doing:
        """Rest on the stop that was reached."""
        if event is Event.PRESSED:
            return Resting(self.by, on_stop=OnStop(self._direction, self._felt))
        return super().leave(event)
