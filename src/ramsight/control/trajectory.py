"""The way to a target: never faster than allowed, never braking harder, slow where an end stop is near.

A point goes ahead with limits of velocity and acceleration. The rod follows the mean of the point's way over the
smoothing time: with it the acceleration changes evenly, so that the way is of third order, and its jerk is at most
twice the acceleration over that time. Nothing is planned: target and velocity may change at any sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.control import thresholds as limit
from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, all_of, scalar, within
from ramsight.plant.unit import HydraulicUnit


@dataclass(frozen=True)
class Limits:
    """What a cylinder may do."""

    speed: float  # largest velocity [m/s]
    acceleration: float  # largest, and for braking [m/s2]
    landing_speed: float  # largest velocity towards an end stop that is near [m/s]
    landing_zone: float  # how near that is [m]
    jerk: float = math.inf  # largest change of the acceleration [m/s3]
    force: float = math.inf  # largest load against a motion that is pushed on [N]; the sensor's, so with its error

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
            >>> limits = Limits.of(build_ddh("boom", machine.load_machine("mining-loader").unit("boom")))
            >>> f"{1e3 * limits.speed:.0f} mm/s, {1e3 * limits.landing_speed:.1f} mm/s"
            '28 mm/s, 4.3 mm/s'
            >>> f"{limits.smoothing:.1f} s, {1e3 * limits.jerk:.0f} mm/s3"
            '0.2 s, 355 mm/s3'
        """
        fastest = limit.SPEED_SHARE * (unit.max_speed * unit.travel_per_radian) if speed is None else speed
        zone, ramp = limit.LANDING_ZONE_SHARE * unit.cylinder.stroke, fastest / limit.RAMP_TIME
        return cls(fastest, ramp, limit.LANDING_SPEED_SHARE * fastest, zone, 2.0 * ramp / limit.SMOOTHING_TIME, force)

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
        """Time of a way from rest to rest [s], the zone before an end stop neglected; `distance` in m."""
        way = abs(distance)
        if way >= self.speed**2 / self.acceleration:
            return way / self.speed + self.speed / self.acceleration + self.smoothing
        return 2.0 * math.sqrt(way / self.acceleration) + self.smoothing

    def landing(self, up: Flag, position: Real, stroke: float, period: float, acceleration: Real) -> Scalar:
        """Largest velocity [m/s] from which an end stop is still approached at the landing speed.

        Args:
            up: whether the rod extends.
            position: [m].
            stroke: [m].
            period: of the samples [s], for one of which it goes on as fast.
            acceleration: for braking [m/s2].
        """
        to_stop = ca.if_else(up, stroke - position, position)
        zone = self.landing_zone + 0.5 * self.smoothing * self.landing_speed  # what is smoothed comes later
        ramp = self.landing_speed / acceleration
        braking = ca.sqrt(period**2 + ramp**2 + 2.0 * ca.fmax(to_stop - zone, 0.0) / acceleration) - period
        return ca.fmax(self.landing_speed, acceleration * braking)


@dataclass(frozen=True)
class Trajectory:
    """State of a way."""

    points: tuple[Scalar, ...] = leaf("m", None)  # places of the point that goes ahead, newest first
    velocity: Scalar = leaf("m/s")  # of that point


def smoothing_samples(limits: Limits, period: float) -> int:
    """Samples over which the way is averaged; 0 for none."""
    return round(limits.smoothing / period)


def at_rest(limits: Limits, period: float) -> Trajectory:
    """The state at power-up."""
    return Trajectory(tuple(scalar(0.0) for _ in range(smoothing_samples(limits, period) + 1)))


def begun(way: Trajectory, position: Real, velocity: Real, period: float) -> Trajectory:
    """A way whose mean is at a position [m] with a velocity [m/s]."""
    count = len(way.points) - 1
    points = (position + (0.5 * count - k) * velocity * period for k in range(count + 1))
    return Trajectory(tuple(ca.SX(point) for point in points), ca.SX(velocity))


def advanced(
    way: Trajectory, limits: Limits, stroke: float, acceleration: Real, target: Real, speed: Real, period: float
) -> Trajectory:
    """The way after a sample.

    Args:
        stroke: [m].
        acceleration: largest now [m/s2].
        target: where to [m].
        speed: largest velocity now [m/s].
        period: of the samples [s].
    """
    position, velocity, slope = way.points[0], way.velocity, acceleration
    rest = target - position
    up = rest >= 0.0
    direction = ca.if_else(up, 1.0, -1.0)
    braking = slope * (ca.sqrt(period**2 + 2.0 * abs(rest) / slope) - period)
    landing = limits.landing(direction > 0.0, position, stroke, period, acceleration)
    wanted = direction * ca.fmin(ca.fmin(speed, braking), landing)
    new = velocity + within(wanted - velocity, -slope * period, slope * period)
    moved = 0.5 * (velocity + new) * period
    close = all_of(abs(rest) <= abs(moved), direction * moved >= 0.0)
    arrived = all_of(close, abs(new) <= limit.ARRIVAL_STEPS * slope * period)
    place = ca.if_else(arrived, target, position + moved)
    return Trajectory((place, *way.points[:-1]), ca.if_else(arrived, 0.0, new))


def setpoint(way: Trajectory, period: float) -> tuple[Scalar, Scalar]:
    """Position [m] and velocity [m/s] that the rod is to have: means over the smoothing time."""
    points, count = way.points, len(way.points) - 1
    if count == 0:
        return points[0], way.velocity
    inner = sum(points[1:-1], start=scalar(0.0))
    return (inner + 0.5 * (points[0] + points[-1])) / count, (points[0] - points[-1]) / (count * period)
