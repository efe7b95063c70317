"""What a reference visit goes by: how fast to an end stop, whether it was reached, how hard it is pressed on.

Laws for numbers, as `ramsight.control.homing` asks, and for graphs, of which C is made.
"""

from __future__ import annotations

from typing import Any

from ramsight.control.actuation import Actuation
from ramsight.plant.either import both, choose, most, within
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

NO_REFERENCE = "no reference at the end stop"
NOT_FOUND = "no end stop found in time"
_FEELING = 0.5  # s, over which a load's noise is averaged
_PRESSURE = 0.2  # s, in which a chamber comes to the load's pressure and the rod begins to move
_STANDS = 0.3  # of the velocity that it should have: below, the rod is held by something
# Standard deviations of the position before a stop that is to be near: it is nearer by chance 3 times in 100 000.
_SURELY_FAR = 4.0
# Times as long as the whole stroke takes at the slow velocity: a stop that is not found by then is not there.
_SPARE = 1.5


def end_stop(unit: HydraulicUnit, lifted: Any) -> Any:
    """Where the end stop of lifting, or that of lowering, is [m].

    Args:
        unit: the unit's parts.
        lifted: whether it is that of lifting.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build_unit
        >>> ram = build_unit("ram", machine.load("press").unit("ram"))
        >>> end_stop(ram, True) - end_stop(ram, False) == ram.lift_sign * ram.cylinder.stroke
        True
    """
    stroke = unit.cylinder.stroke
    return choose(lifted, *((stroke, 0.0) if unit.lift_sign > 0.0 else (0.0, stroke)))


class Visiting:
    """The laws of a cylinder's visits.

    Args:
        by: the cylinder's motor speeds, limits and tuning.

    Attributes:
        slowly: velocity near a stop, and on the way to one that may be anywhere [m/s].
        longest: time after which a stop is given up [s].
    """

    def __init__(self, by: Actuation) -> None:
        limits, tuning, full = by.limits, by.tuning, limits_of(by.unit)
        self.by, self.slowly = by, tuning.homing_share * by.limits.speed
        self.longest = _SPARE * by.unit.cylinder.stroke / self.slowly + 2.0 * tuning.pressing
        # Until the rod surely moves, and reports show it.
        self._sets_out = limits.speed / limits.acceleration + _PRESSURE + by.lag
        self._lifted, self._lowered = tuning.pressing_share * full.load, tuning.pressing_share * full.pull

    def nearing(self, velocity: Any, away: Any, std: Any, fast: Any, trusted: Any) -> Any:
        """The next velocity [m/s]: fast as long as the stop is known to be far, then slowly.

        Args:
            velocity: until now [m/s].
            away: distance of the stop [m].
            std: the position's standard deviation [m].
            fast: velocity where it is far [m/s].
            trusted: whether the position may be relied on.
        """
        limits = self.by.limits
        far = away - limits.landing_zone - _SURELY_FAR * std > 0.5 * limits.speed**2 / limits.acceleration
        change = limits.acceleration * self.by.period
        return within(choose(both(trusted, far), fast, self.slowly), velocity - change, velocity + change)

    def stands(self, time: Any, velocity: Any) -> Any:
        """Whether something holds the rod: a velocity [m/s] at a time since the beginning [s]."""
        return both(time > self._sets_out, abs(velocity) < _STANDS * self.slowly)

    def feeling(self, felt: Any, load: Any) -> Any:
        """The load on the way [N], its noise averaged, from what it was before and is now."""
        return felt + self.by.period / (_FEELING + self.by.period) * (load - felt)

    def on_the_stop(self, away: Any) -> Any:
        """Whether what holds a rod may be the stop, which is taken to be so far away [m]."""
        return away < self.by.limits.landing_zone

    def speed(self, velocity: Any, stood: Any, direction: Any, felt: Any, load: Any) -> Any:
        """The motor's speed [rad/s] on the way to a stop, and on it.

        Where a pump holds the load its pressure goes with its speed: a stop that is run into gives way by a millimetre.

        Args:
            velocity: towards the stop [m/s].
            stood: for how long the rod has been held [s].
            direction: of the stop, +1 or -1.
            felt: load on the way [N].
            load: now [N].
        """
        goes = self.by.moving(velocity, direction, load)
        if self.by.holding.stands:
            return goes
        pressed = self.by.turning(0.0, self.pressing(direction, felt))
        return choose(stood > self.by.tuning.surely, pressed, goes)

    def pressing(self, direction: Any, felt: Any) -> Any:
        """The load [N] as which a stop in a direction is pressed, where one of `felt` [N] was felt on the way there."""
        way = direction * self.by.unit.lift_sign  # +1 at the end of lifting, -1 at that of lowering
        return way * (most(way * felt, 0.0) + choose(way > 0.0, self._lifted, self._lowered))


def kept_on(by: Actuation, direction: Any, felt: Any) -> Any:
    """The motor's speed [rad/s] of a rod that a pump holds, on a stop that hides its load.

    What presses the rod to the stop, the stop carries; else the pump carries what was felt on the way.

    Args:
        by: the cylinder's motor speeds.
        direction: of the stop, +1 or -1.
        felt: load on the way there [N].
    """
    pulls = direction * by.unit.lift_sign * felt > 0.0
    return choose(pulls, by.turning(0.0, felt), 0.0)
