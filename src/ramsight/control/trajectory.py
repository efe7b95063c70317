"""The way to a target: never faster than allowed, never braking harder, slow where an end stop is near."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ramsight.plant.unit import HydraulicUnit

_SPEED_SHARE = 0.5  # of the piston's velocity at the highest motor speed; the rest is for leakage and corrections
_RAMP = 0.8  # s, as the paper's ramps
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
    """

    speed: float
    acceleration: float
    landing_speed: float
    landing_zone: float

    @classmethod
    def of(cls, unit: HydraulicUnit, speed: float | None = None) -> Limits:
        """Limits that suit a unit.

        Args:
            unit: the unit's parts.
            speed: largest velocity [m/s]; by default half of what the motor could do.

        Example:
            >>> from ramsight import machine
            >>> from ramsight.plant.ddh import build
            >>> limits = Limits.of(build("boom", machine.load("mining-loader").unit("boom")))
            >>> f"{1e3 * limits.speed:.0f} mm/s, {1e3 * limits.landing_speed:.1f} mm/s"
            '28 mm/s, 4.3 mm/s'
        """
        most = _SPEED_SHARE * (unit.max_speed * unit.travel_per_radian) if speed is None else speed
        return cls(most, most / _RAMP, _LANDING_SHARE * most, _LANDING_ZONE * unit.cylinder.stroke)

    def time(self, distance: float) -> float:
        """Time that a way takes from rest to rest [s], an end stop's nearness left aside; `distance` in m."""
        way = abs(distance)
        if way >= self.speed**2 / self.acceleration:
            return way / self.speed + self.speed / self.acceleration
        return 2.0 * math.sqrt(way / self.acceleration)

    def speed_for(self, distance: float, time: float) -> float:
        """The velocity with which a way takes a time [m/s], at most `speed`; `distance` in m, `time` in s."""
        way = abs(distance)
        free = (self.acceleration * time) ** 2 - 4.0 * self.acceleration * way
        if free <= 0.0:
            return self.speed
        return min(0.5 * (self.acceleration * time - math.sqrt(free)), self.speed)


@dataclass
class Trajectory:
    """A point that runs ahead to a target, sample by sample.

    Args:
        limits: of the cylinder.
        stroke: its travel from end to end [m].
        position: where the point is [m].
        velocity: how fast it goes [m/s].
    """

    limits: Limits
    stroke: float
    position: float = 0.0
    velocity: float = 0.0

    def begin(self, position: float) -> None:
        """Stand at a position [m]."""
        self.position, self.velocity = position, 0.0

    def step(self, target: float, speed: float, period: float) -> None:
        """Go on for one sample.

        Args:
            target: where to [m].
            speed: largest velocity now [m/s].
            period: of the samples [s].
        """
        way = target - self.position
        direction = math.copysign(1.0, way)
        slope = self.limits.acceleration
        to_stop = self.stroke - self.position if direction > 0.0 else self.position
        before_zone = max(to_stop - self.limits.landing_zone, 0.0)
        landing = math.sqrt(self.limits.landing_speed**2 + 2.0 * slope * before_zone)
        braking = slope * (math.sqrt(period**2 + 2.0 * abs(way) / slope) - period)
        wanted = direction * min(speed, braking, landing)
        change = min(max(wanted - self.velocity, -slope * period), slope * period)
        velocity = self.velocity + change
        moved = 0.5 * (self.velocity + velocity) * period
        if abs(way) <= abs(moved) and direction * moved >= 0.0 and abs(velocity) <= 1.5 * slope * period:
            self.begin(target)
        else:
            self.position, self.velocity = self.position + moved, velocity

    @property
    def stands(self) -> bool:
        """Whether the point is at rest."""
        return self.velocity == 0.0
