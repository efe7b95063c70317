"""A cylinder that is steered by hand: a velocity in the place of a target, taken over and given back without a jerk."""

from __future__ import annotations

from ramsight.control.activity import Activity
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish
from ramsight.control.judging import Trust
from ramsight.control.resting import Resting
from ramsight.control.watch import Verdict


class Manual(Doing):
    """Go as fast as a hand says.

    Without a position that may be relied on it goes as slowly as a reference visit does, and knows of no end stop.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        wanted: velocity [m/s], positive extends; may be changed at any time.
    """

    activity = Activity.MANUAL
    without_position, may_stall = True, True

    def __init__(self, by: Actuation, wanted: float) -> None:
        super().__init__(by)
        self.wanted, self._velocity = wanted, 0.0
        self._rest = Resting(by)

    def enter(self, now: Now) -> None:
        """Begin as fast as the rod goes."""
        self._velocity = now.estimate.velocity if now.speed != 0.0 else 0.0

    def step(self, now: Now) -> Wish:
        """The hand's velocity within the limits; at none the rod is held where it is."""
        by, estimate, trusted = self.by, now.estimate, now.trust is not Trust.NONE
        slow = now.trust is Trust.SLOW or now.verdict is Verdict.SLOW
        share = by.tuning.homing_share if not trusted else by.tuning.slowed if slow else 1.0
        fastest = min(share * by.limits.speed, by.reachable(estimate.load))
        self._velocity = by.steering(self._velocity, self.wanted, estimate.position, fastest, trusted)
        direction = 1.0 if self._velocity > 0.0 else -1.0
        push = by.may_push(direction, estimate.load)
        if push == 0.0:
            self._velocity = 0.0
        if self._velocity == 0.0:
            return self._rest.step(now)
        self._rest = Resting(by)
        return Wish(by.moving(push * abs(self._velocity), direction, estimate.load))
