"""A stop: the motor is brought to rest at once, and stays there until the cylinder is sent somewhere."""

from __future__ import annotations

from typing import Any

from ramsight.control.activity import Activity, Event
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now, Wish

STOPPING_TIME = 0.16  # s from a stop to the command's standstill: with the 0.14 s of the watch at most, 0.3 s


def stopping_slope(speed: Any, period: float) -> Any:
    """Change of the motor's speed [rad/s2] that stops it in time from a speed [rad/s]; a number or a graph."""
    # A trifle steeper, so that rounding asks for no sample more.
    return (1.0 + 1e-9) * abs(speed) / max(STOPPING_TIME - period, period)


class Stopping(Doing):
    """Bring the motor to rest.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
        speed: commanded at the beginning [rad/s].
    """

    activity = Activity.STOPPING

    def __init__(self, by: Actuation, speed: float) -> None:
        super().__init__(by)
        self._slope = stopping_slope(speed, by.period)

    def step(self, now: Now) -> Wish:
        """Down, until the motor is told to stand."""
        stands = abs(now.speed) <= self._slope * self.by.period + 1e-9
        return Wish(0.0, Event.STANDS if stands else None)

    def leave(self, event: Event) -> Doing:
        """When the motor stands, stay stopped."""
        return Stopped(self.by) if event is Event.STANDS else super().leave(event)

    def slope(self) -> float:
        """So steep that the time for it suffices [rad/s2]."""
        return float(self._slope)


class Stopped(Doing):
    """Stand.

    Args:
        by: the cylinder's motor speeds, limits and tuning.
    """

    activity = Activity.STOPPED

    def step(self, now: Now) -> Wish:
        """Let the motor stand."""
        return Wish(0.0)
