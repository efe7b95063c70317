"""A move to a target: along a trajectory until the target is near, then the landing."""

from __future__ import annotations

import math

from ramsight.control.activity import Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish
from ramsight.control.judging import Trust
from ramsight.control.resting import Resting
from ramsight.control.trajectory import Trajectory
from ramsight.control.watch import Verdict


class Moving(Doing):
    """To a target.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        target: [m].
        tries: how often it may be sought anew.
        speed: largest velocity [m/s].
    """

    activity = Activity.MOVING

    def __init__(self, by: Actuation, target: float, tries: int, speed: float) -> None:
        super().__init__(by)
        self.target, self._tries, self._most = target, tries, speed
        self.trajectory = Trajectory(by.limits, by.unit.cylinder.stroke)
        self._direction = 1.0

    def enter(self, now: Now) -> None:
        """Begin the trajectory where the rod is."""
        self._direction = math.copysign(1.0, self.target - now.estimate.position)
        self.trajectory.begin(now.estimate.position)

    def step(self, now: Now) -> Wish:
        """The trajectory's velocity and a share of the error, until the target is near."""
        by, way, estimate = self.by, self.trajectory, now.estimate
        slow = now.trust is Trust.SLOW or now.verdict is Verdict.SLOW
        share = by.tuning.slowed if slow else 1.0
        way.step(self.target, min(share * self._most, by.reachable(estimate.load)), by.period)
        if now.verdict is Verdict.AT_LIMIT:  # what the drive cannot do is not asked for
            way.position, way.velocity = estimate.position, estimate.velocity
        off = way.position - estimate.position
        if abs(off) > by.tuning.following(by.limits):
            return Wish(0.0, Event.FAILED, f"the rod is {1e3 * abs(off):.0f} mm from where it should be by now")
        remaining = self._direction * (self.target - estimate.position)
        if remaining <= by.to_stand(now.speed, self._direction, estimate.load):
            return Wish(0.0, Event.NEAR)
        velocity = way.velocity + by.tuning.gain * off
        return Wish(by.moving(max(self._direction * velocity, 0.0), self._direction, estimate.load))

    def leave(self, event: Event) -> Doing:
        """To the landing."""
        return Landing(self.by, self.target, self._tries, self._most) if event is Event.NEAR else super().leave(event)


class Landing(Resting):
    """The end of a move: bring the motor to rest, and look at the target once more when reports have settled.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        target: [m].
        tries: how often it may still be sought anew.
        speed: largest velocity then [m/s].
    """

    activity = Activity.LANDING

    def __init__(self, by: Actuation, target: float, tries: int, speed: float) -> None:
        super().__init__(by, target)
        self.without_position = False
        self._tries, self._speed, self._stood = tries, speed, 0.0

    def step(self, now: Now) -> Wish:
        """Stand, or hold, and look once more at the target."""
        stands = now.speed == 0.0 or not self.by.holding.stands
        self._stood = self._stood + self.by.period if stands else 0.0
        speed = super().step(now).speed
        if self._stood < self.by.tuning.settling + self.by.lag:
            return Wish(speed)
        missed = abs(self.target - now.estimate.position) > self.by.tuning.renewing
        again = missed and self._tries > 0 and now.trust is not Trust.NONE
        return Wish(speed, Event.MISSED if again else Event.SETTLED)

    def leave(self, event: Event) -> Doing:
        """To the target again, or to rest."""
        if event is Event.MISSED:
            return Moving(self.by, self.target, self._tries - 1, self._speed)
        return Resting(self.by, self.target) if event is Event.SETTLED else super().leave(event)
