"""A move to a target: along a trajectory until the target is near, then the landing."""

from __future__ import annotations

import math
from typing import Any

from ramsight.control.activity import Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish
from ramsight.control.judging import Trust
from ramsight.control.resting import Resting
from ramsight.control.trajectory import Limits, Trajectory
from ramsight.control.watch import Verdict
from ramsight.plant.either import both, choose, most, towards

FORCE_REACHED = "the load has reached the largest force"
_LEAVING = 5e-3  # m of the trajectory until a rod has surely left a stop
PUSHING = 1.0  # s, for which a rod waits there until it is taken to be blocked


def leaving(by: Actuation, gone: Any, direction: Any, felt: Any, load: Any) -> Any:
    """The load [N] to reckon with: on a stop, which carries it, the one that was felt on the way there.

    With what leaks under the load that the stop still carries the rod would stay there, and the motor turn for
    nothing: neither a move nor a rest, of which a sensor makes the wrong one.

    Args:
        by: the cylinder's motor speeds.
        gone: way of the trajectory from the stop that it leaves [m]; NaN, or much, where it leaves none.
        direction: of the move, +1 or -1.
        felt: load on the way to the stop [N].
        load: now [N].
    """
    leaves = both(abs(gone) < _LEAVING, direction * by.unit.lift_sign > 0.0)
    return choose(leaves, most(load, felt), load)


class Moving(Doing):
    """Go to a target.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        target: [m].
        tries: how often it may be sought anew.
        limits: of this move.
        felt: load on the way to the end stop that it leaves [N]; NaN if it leaves none.
    """

    activity = Activity.MOVING

    def __init__(self, by: Actuation, target: float, tries: int, limits: Limits, felt: float = math.nan) -> None:
        super().__init__(by)
        self._felt, self._left = felt, math.nan
        self.target, self._tries, self._limits = target, tries, limits
        self.trajectory = Trajectory(limits, by.unit.cylinder.stroke, by.period)
        self._direction, self._pushed = 1.0, 0.0

    def enter(self, now: Now) -> None:
        """Begin the trajectory where the rod is, and as fast as it goes."""
        self._direction = towards(self.target - now.estimate.position)
        self._left = now.estimate.position if math.isfinite(self._felt) else math.nan
        self.trajectory.begin(now.estimate.position, now.estimate.velocity if now.speed != 0.0 else 0.0)

    def step(self, now: Now) -> Wish:
        """The trajectory's velocity and a share of the error, until the target is near."""
        by, way, estimate = self.by, self.trajectory, now.estimate
        slow = now.trust is Trust.SLOW or now.verdict is Verdict.SLOW
        share = by.tuning.slowed if slow else 1.0
        push = by.may_push(self._direction, estimate.load)
        way.step(self.target, push * min(share * self._limits.speed, by.reachable(estimate.load)))
        if now.verdict is Verdict.AT_LIMIT:  # what the drive cannot do is not asked for
            way.begin(estimate.position, estimate.velocity)
        if push == 0.0:
            return self._waits(now)
        self._pushed = 0.0
        off = way.position - estimate.position
        if abs(off) > by.tuning.following(by.limits):
            return Wish(0.0, Event.FAILED, f"the rod is {1e3 * abs(off):.0f} mm from where it should be by now")
        remaining = self._direction * (self.target - estimate.position)
        if remaining <= by.to_stand(now.speed, self._direction, estimate.load):
            return Wish(0.0, Event.NEAR)
        load = leaving(by, way.position - self._left, self._direction, self._felt, estimate.load)
        return Wish(by.pursuing(way.velocity, off, self._direction, load))

    def _waits(self, now: Now) -> Wish:
        """At the largest force: hold the load, for a while."""
        self.trajectory.begin(now.estimate.position)
        self._pushed += self.by.period
        if self._pushed > PUSHING:
            return Wish(0.0, Event.FAILED, FORCE_REACHED)
        return Wish(self.by.at_rest(0.0, now.estimate.load))

    def leave(self, event: Event) -> Doing:
        """Near the target, land."""
        if event is Event.NEAR:
            return Landing(self.by, self.target, self._tries, self._limits)
        return super().leave(event)


class Landing(Resting):
    """The end of a move: bring the motor to rest, and look at the target once more when reports have settled.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        target: [m].
        tries: how often it may still be sought anew.
        limits: of the move then.
    """

    activity = Activity.LANDING

    def __init__(self, by: Actuation, target: float, tries: int, limits: Limits) -> None:
        super().__init__(by, target)
        self.without_position = False
        self._tries, self._limits, self._stood = tries, limits, 0.0

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
        """Go to the target again, or rest."""
        if event is Event.MISSED:
            return Moving(self.by, self.target, self._tries - 1, self._limits)
        return Resting(self.by, self.target) if event is Event.SETTLED else super().leave(event)
