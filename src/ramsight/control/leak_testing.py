"""A leak test: a steady speed against the closed valve, at which the pump's pressure stays below the load's."""

from __future__ import annotations

from ramsight.control.activity import Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish
from ramsight.control.resting import Resting


class LeakTesting(Doing):
    """A leak test.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
    """

    activity = Activity.LEAK_TEST

    def __init__(self, by: Actuation) -> None:
        super().__init__(by)
        self._speed = self._for = 0.0

    def enter(self, now: Now) -> None:
        """Choose the speed by the load that is felt."""
        self._speed = self.by.tuning.leak_test_share(self.by.unit) * self.by.leakage(now.estimate.load)

    def step(self, now: Now) -> Wish:
        """Turn, until the time is over."""
        self._for += self.by.period
        if self._for > self.by.tuning.leak_test_time:
            return Wish(0.0, Event.OVER)
        return Wish(self.by.unit.lift_sign * self._speed)

    def leave(self, event: Event) -> Doing:
        """When the test is over, rest."""
        return Resting(self.by) if event is Event.OVER else super().leave(event)
