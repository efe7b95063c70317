"""A reference visit: to an end stop, and press on it until the sensor has surely taken it for one."""

from __future__ import annotations

import math

from ramsight.control.activity import Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish
from ramsight.control.judging import Trust, may_home
from ramsight.control.resting import OnStop, Resting
from ramsight.plant.limits import limits_of

_FEELING = 0.5  # s, over which a load's noise is averaged
_PRESSURE = 0.2  # s, in which a chamber comes to the load's pressure and the rod begins to move
_STANDS = 0.3  # of the velocity that it should have: below, the rod is held by something
# Standard deviations of the position before a stop that is to be near: it is nearer by chance 3 times in 100 000.
_SURELY_FAR = 4.0
# Times as long as the whole stroke takes at the slow velocity: a stop that is not found by then is not there.
_SPARE = 1.5


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
        self._never_fast = slow
        self._end, self._direction = end, 1.0 if end > 0.0 else -1.0
        self._slow = by.tuning.homing_share * by.limits.speed
        self._velocity, self._felt = 0.0, math.nan
        self._for, self._stood = 0.0, 0.0

    def step(self, now: Now) -> Wish:
        """Fast as long as the stop is known to be far, then slowly, then press."""
        by, tuning, estimate = self.by, self.by.tuning, now.estimate
        self._for += by.period
        self._approach(now)
        stands = self._for > self._sets_out and abs(estimate.velocity) < _STANDS * self._slow
        self._stood = self._stood + by.period if stands else 0.0
        if not stands:
            self._feel(estimate.load)
        if self._stood > tuning.pressing:
            near = abs(self._end - estimate.position) < by.limits.landing_zone
            if may_home(estimate.status) and near:
                return Wish(0.0, Event.PRESSED)
            return Wish(0.0, Event.FAILED, f"no reference at the end stop: {estimate.status.text}")
        if self._for > _SPARE * by.unit.cylinder.stroke / self._slow + 2.0 * tuning.pressing:
            return Wish(0.0, Event.FAILED, f"no end stop found in time: {estimate.status.text}")
        if self._stood > tuning.surely and not by.holding.stands:
            return Wish(by.turning(0.0, self._pressing()))
        return Wish(by.moving(self._velocity, self._direction, estimate.load))

    def leave(self, event: Event) -> Doing:
        """Rest on the stop that was reached."""
        if event is Event.PRESSED:
            return Resting(self.by, on_stop=OnStop(self._end, self._felt))
        return super().leave(event)

    @property
    def _sets_out(self) -> float:
        """Time until the rod surely moves, and reports show it [s]."""
        limits = self.by.limits
        return limits.speed / limits.acceleration + _PRESSURE + self.by.lag

    def _approach(self, now: Now) -> None:
        """The velocity towards the stop [m/s], with the limits' acceleration."""
        limits, estimate = self.by.limits, now.estimate
        far = abs(self._end - estimate.position) - limits.landing_zone - _SURELY_FAR * estimate.std
        braking = 0.5 * limits.speed**2 / limits.acceleration
        fast = now.trust is not Trust.NONE and far > braking and not self._never_fast
        wanted = limits.speed if fast else self._slow
        change = limits.acceleration * self.by.period
        self._velocity = min(max(wanted, self._velocity - change), self._velocity + change)

    def _feel(self, load: float) -> None:
        """The load on the way [N], its noise averaged."""
        before = self._felt if math.isfinite(self._felt) else load
        self._felt = before + self.by.period / (_FEELING + self.by.period) * (load - before)

    def _pressing(self) -> float:
        """The load [N] as which the stop is pressed.

        Where a pump holds the load its pressure goes with its speed: a stop that is run into gives way by a millimetre.
        """
        way = self._direction * self.by.unit.lift_sign  # +1 at the end of lifting, -1 at that of lowering
        full = limits_of(self.by.unit)
        most = full.load if way > 0.0 else full.pull
        return way * (max(way * self._felt, 0.0) + self.by.tuning.pressing_share * most)
