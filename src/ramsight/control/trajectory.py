"""The way to a target: never faster than allowed, never braking harder, slow where an end stop is near.

A point goes ahead with limits of velocity and acceleration. What the rod is to follow is the mean of the point's way
over the smoothing time: with it the acceleration comes and goes evenly, so that the way is of third order, and its jerk
is at most twice the acceleration over that time. It needs no plan: target and velocity may change at any sample.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ramsight.plant.either import both, choose, least, most, root, towards, within
from ramsight.plant.unit import HydraulicUnit

_SPEED_SHARE = 0.5  # of the piston's velocity at the highest motor speed; the rest is for leakage and corrections
_RAMP = 0.8  # s, as the paper's ramps
_SMOOTHING = 0.2  # s: a mean over it has nothing left of what swings at 5 Hz, as a chamber full of oil does
_LANDING_SHARE = 0.15  # of the velocity, near an end stop
_LANDING_ZONE = 0.04  # share of the stroke; several times what a sensor may be wrong by before its first reference


@dataclass(frozen=True)
class Limits:
    """What a cylinder may do.

    Args:
        speed: largest velocity [m/s].
        acceleration: largest, and for braking [m/s2].
        landing_speed: largest velocity towards an end stop that is near [m/s].
        landing_zone: how near that is [m].
        jerk: largest change of the acceleration [m/s3].
        force: largest load against a motion that is pushed on [N]; the sensor's, so with its error.
    """

    speed: float
    acceleration: float
    landing_speed: float
    landing_zone: float
    jerk: float = math.inf
    force: float = math.inf

    @classmethod
    def of(cls, unit: HydraulicUnit, speed: float | None = None, force: float = math.inf) -> Limits:
        """Limits that suit a unit.

        Args:
            unit: the unit's parts.
            speed: largest velocity [m/s]; by default half of what the motor could do.
            force: as the attribute [N].

        Example:
            >>> from ramsight import machine
            >>> from ramsight.plant.ddh import build_ddh
            >>> limits = Limits.of(build_ddh("boom", machine.load("mining-loader").unit("boom")))
            >>> f"{1e3 * limits.speed:.0f} mm/s, {1e3 * limits.landing_speed:.1f} mm/s"
            '28 mm/s, 4.3 mm/s'
            >>> f"{limits.smoothing:.1f} s, {1e3 * limits.jerk:.0f} mm/s3"
            '0.2 s, 355 mm/s3'
        """
        fastest = _SPEED_SHARE * (unit.max_speed * unit.travel_per_radian) if speed is None else speed
        zone, ramp = _LANDING_ZONE * unit.cylinder.stroke, fastest / _RAMP
        return cls(fastest, ramp, _LANDING_SHARE * fastest, zone, 2.0 * ramp / _SMOOTHING, force)

    @property
    def smoothing(self) -> float:
        """Time over which the way is averaged [s]; an acceleration that turns round in it changes by twice itself."""
        return 2.0 * self.acceleration / self.jerk

    def at(self, speed: float | None = None, acceleration: float | None = None) -> Limits:
        """The same with less velocity [m/s] or acceleration [m/s2]; the smoothing time stays."""
        slope = self.acceleration if acceleration is None else min(acceleration, self.acceleration)
        jerk = self.jerk * (slope / self.acceleration)
        fastest = self.speed if speed is None else min(speed, self.speed)
        return replace(self, speed=fastest, acceleration=slope, jerk=jerk)

    def time(self, distance: float) -> float:
        """Time that a way takes from rest to rest [s], an end stop's nearness left aside; `distance` in m."""
        way = abs(distance)
        if way >= self.speed**2 / self.acceleration:
            return way / self.speed + self.speed / self.acceleration + self.smoothing
        return 2.0 * math.sqrt(way / self.acceleration) + self.smoothing

    def landing(self, direction: Any, position: Any, stroke: float, period: float) -> Any:
        """Largest velocity [m/s] from which an end stop is still approached at the landing speed; numbers or graphs.

        Args:
            direction: +1 or -1.
            position: [m].
            stroke: [m].
            period: of the samples [s], for one of which it goes on as fast.
        """
        to_stop = choose(direction > 0.0, stroke - position, position)
        zone = self.landing_zone + 0.5 * self.smoothing * self.landing_speed  # what is smoothed comes later
        slope, least_time = self.acceleration, self.landing_speed / self.acceleration
        braking = root(period**2 + least_time**2 + 2.0 * most(to_stop - zone, 0.0) / slope) - period
        return most(self.landing_speed, slope * braking)


def together(ways: Mapping[str, tuple[Limits, float]]) -> dict[str, tuple[float, float]]:
    """Velocities [m/s] and accelerations [m/s2] with which cylinders do the same shares of their ways at any time.

    Args:
        ways: limits and way [m] of each.

    Example:
        >>> slow, fast = Limits(0.05, 0.1, 0.01, 0.02), Limits(0.1, 0.1, 0.01, 0.02)
        >>> together({"boom": (slow, 0.2), "bucket": (fast, -0.1)})
        {'boom': (0.05, 0.1), 'bucket': (0.025, 0.05)}
    """
    moving = {name: (limits, abs(way)) for name, (limits, way) in ways.items() if way != 0.0}
    speed = min((limits.speed / way for limits, way in moving.values()), default=0.0)
    slope = min((limits.acceleration / way for limits, way in moving.values()), default=0.0)
    still = {name: (limits.speed, limits.acceleration) for name, (limits, _) in ways.items()}
    return still | {name: (speed * way, slope * way) for name, (_, way) in moving.items()}


def ahead(
    limits: Limits, stroke: float, position: Any, velocity: Any, target: Any, speed: Any, period: float
) -> tuple[Any, Any]:
    """The next position [m] and velocity [m/s] of the point that goes ahead; numbers or graphs.

    Args:
        limits: of the cylinder.
        stroke: [m].
        position: of the point [m].
        velocity: of it [m/s].
        target: where to [m].
        speed: largest velocity now [m/s].
        period: of the samples [s].
    """
    way, slope = target - position, limits.acceleration
    direction = towards(way)
    braking = slope * (root(period**2 + 2.0 * abs(way) / slope) - period)
    wanted = direction * least(least(speed, braking), limits.landing(direction, position, stroke, period))
    new = velocity + within(wanted - velocity, -slope * period, slope * period)
    moved = 0.5 * (velocity + new) * period
    close = both(abs(way) <= abs(moved), direction * moved >= 0.0)
    arrived = both(close, abs(new) <= 1.5 * slope * period)
    return choose(arrived, target, position + moved), choose(arrived, 0.0, new)


def places(limits: Limits, period: float) -> int:
    """Samples over which the way is averaged; 0 for none."""
    return round(limits.smoothing / period)


def begun(position: Any, velocity: Any, count: int, period: float) -> list[Any]:
    """Where the point has been, newest first, so that their mean is at a position [m] with a velocity [m/s]."""
    return [position + (0.5 * count - k) * velocity * period for k in range(count + 1)]


def smoothed(been: Sequence[Any], period: float) -> tuple[Any, Any]:
    """Mean position [m] and velocity [m/s] of where the point has been, newest first; two places at least."""
    count = len(been) - 1
    inner = sum(been[1:-1])
    return (inner + 0.5 * (been[0] + been[-1])) / count, (been[0] - been[-1]) / (count * period)


class Trajectory:
    """The way to a target, sample by sample.

    Args:
        limits: of the cylinder.
        stroke: its travel from end to end [m].
        period: of the samples [s].

    Attributes:
        position: where the rod is to be [m].
        velocity: how fast it is to go [m/s].

    Example:
        >>> way = Trajectory(Limits(0.05, 0.1, 0.01, 0.02, jerk=1.0), 0.5, 0.02)
        >>> way.begin(0.2)
        >>> for _ in range(150):
        ...     way.step(0.25, 0.05)
        >>> way.stands, f"{way.position:.3f}"
        (True, '0.250')
    """

    def __init__(self, limits: Limits, stroke: float, period: float) -> None:
        self.limits, self.stroke, self.period = limits, stroke, period
        self._count = places(limits, period)
        self.begin(0.0)

    def begin(self, position: float, velocity: float = 0.0) -> None:
        """Be at a position [m], with a velocity [m/s]."""
        self.position, self.velocity, self._velocity = position, velocity, velocity
        self._been = deque(begun(position, velocity, self._count, self.period), maxlen=self._count + 1)

    def step(self, target: float, speed: float) -> None:
        """Go on for one sample.

        Args:
            target: where to [m].
            speed: largest velocity now [m/s].
        """
        now = self._been[0], self._velocity
        place, self._velocity = ahead(self.limits, self.stroke, *now, target, speed, self.period)
        self._been.appendleft(place)
        self.position, self.velocity = (
            smoothed(tuple(self._been), self.period) if self._count else (place, self._velocity)
        )

    @property
    def stands(self) -> bool:
        """Whether the rod is to be at rest."""
        return self.velocity == 0.0 and self._velocity == 0.0
