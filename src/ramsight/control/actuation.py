"""What a motor speed does with a cylinder: velocity, leakage, valves that have to open, and what is on its way."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ramsight.control.trajectory import Limits
from ramsight.control.tuning import Tuning
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import DescriptionError
from ramsight.plant.either import both, choose, least, most, within
from ramsight.plant.holding import Holding
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.thresholds import OIL_TIME_CONSTANT as WARMING

_COLDEST, _HOTTEST = 243.15, 383.15  # K; a thermometer that says anything else is not believed
_REACHABLE = 0.9  # share of the highest motor speed for the trajectory; the rest is for corrections
_BEFORE_FORCE = 0.1  # share of the largest force, over which a motion against it gets slower


class Actuation:
    """A unit's motor speeds, by its data sheet and what its sensor has learned.

    All that it works out may be asked with numbers, as a control does, or with graphs, of which C is made.

    Args:
        unit: the unit's parts, as its data sheet has them.
        limits: what the cylinder may do.
        tuning: how it is driven.
        period: of the samples [s].
        response: how the drive is declared to follow.

    Raises:
        DescriptionError: the motor cannot turn as fast as a valve of the unit asks for before it opens.

    Attributes:
        holding: what holds the load at rest.
        leak: factor of the leakage that the sensor has learned [1].
        displacement: the same of the displacement [1].
        lag: by which reports are behind commands [s].
        slope: largest change of the motor's speed that is asked for [rad/s2].
        temperature: of the oil, its noise averaged [K].
    """

    def __init__(
        self,
        unit: HydraulicUnit,
        limits: Limits,
        tuning: Tuning,
        period: float = SAMPLE_PERIOD,
        response: DriveResponse = IDEAL,
    ) -> None:
        self.unit, self.limits, self.tuning, self.period = unit, limits, tuning, period
        self.lag, self.slope = response.lag, min(tuning.motor_acceleration, response.acceleration)
        self.holding = Holding(unit)
        self.leak: Any = 1.0
        self.displacement: Any = 1.0
        self.temperature: Any = T40
        self._least_lowering = self._opens()

    def _opens(self) -> float:
        """Motor speed with which lowering begins [rad/s]."""
        least = self.tuning.opening * self.holding.opening_speed
        if least > self.unit.max_speed:
            names = ", ".join(valve.name for valve in self.holding.valves)
            raise DescriptionError(
                f"{names} would have to be opened by a motor that turns {least:g} rad/s, to lower a load",
                key=f"units.{self.unit.name}.drive.max_speed",
                value=f"{self.unit.max_speed:g} rad/s",
            )
        return least

    def warm(self, reported: Any) -> None:
        """Take a thermometer's next value [K]."""
        share = self.period / (WARMING + self.period)
        believed = both(reported > _COLDEST, reported < _HOTTEST)
        self.temperature = choose(believed, self.temperature + share * (reported - self.temperature), self.temperature)

    def leakage(self, load: Any) -> Any:
        """Motor speed that leakage takes under a load [N], positive where it turns the way that lifts [rad/s]."""
        return self.leak * self.holding.leakage(load, self.temperature)

    def turning(self, velocity: Any, load: Any) -> Any:
        """The motor's speed [rad/s] for a velocity [m/s] under a load [N], what leaks included."""
        per_radian = self.holding.travel_per_radian(load) * self.displacement
        return velocity / per_radian + self.unit.lift_sign * self.leakage(load)

    def moving(self, pace: Any, direction: Any, load: Any) -> Any:
        """The same for a velocity `pace` [m/s], 0 or more, in a direction, as fast as valves have to open."""
        lift = self.unit.lift_sign
        if not self.holding.valves:
            return self.turning(direction * pace, load)
        lifts = direction * lift > 0.0
        used = choose(lifts, most(pace, self.tuning.creeping * self.displacement), pace)
        speed = self.turning(direction * used, load)
        return choose(lifts, speed, -lift * most(-lift * speed, self._least_lowering))

    def at_rest(self, velocity: Any, load: Any) -> Any:
        """The motor's speed [rad/s] of a rod that is held: 0 behind a valve, else for a velocity [m/s]."""
        return 0.0 if self.holding.stands else self.turning(velocity, load)

    def back(self, away: Any) -> Any:
        """Velocity [m/s] that brings back a rod at rest that is away from its place [m] by more than the dead band."""
        beyond = away - within(away, -self.tuning.dead_band, self.tuning.dead_band)
        return within(self.tuning.gain * beyond, -self.limits.landing_speed, self.limits.landing_speed)

    def pursuing(self, velocity: Any, off: Any, direction: Any, load: Any) -> Any:
        """The motor's speed [rad/s] that follows a trajectory to a target.

        Args:
            velocity: of the trajectory [m/s].
            off: its position less the rod's [m].
            direction: of the target, +1 or -1; a rod that still goes the other way is braked by the trajectory.
            load: [N].
        """
        wanted = velocity + self.tuning.gain * off
        returns = both(direction * velocity < 0.0, direction * wanted < 0.0)
        way = choose(returns, -direction, direction)
        return self.moving(most(way * wanted, 0.0), way, load)

    def steering(self, velocity: Any, wanted: Any, position: Any, fastest: Any, trusted: Any) -> Any:
        """The next velocity [m/s] of a rod that is steered by hand, slow before an end stop.

        Args:
            velocity: until now [m/s].
            wanted: by the hand [m/s].
            position: [m].
            fastest: largest velocity [m/s].
            trusted: whether the position may be relied on; else nobody knows where the stops are.
        """
        stroke, slope = self.unit.cylinder.stroke, self.limits.acceleration * self.period
        up, down = (
            choose(trusted, least(fastest, self.limits.landing(way, position, stroke, self.period)), fastest)
            for way in (1.0, -1.0)
        )
        return velocity + within(within(wanted, -down, up) - velocity, -slope, slope)

    def may_push(self, direction: Any, load: Any) -> Any:
        """Share of the velocity that the largest force leaves to a motion [1]; 0 where it is reached.

        Args:
            direction: of the motion, +1 or -1.
            load: [N].
        """
        force = self.limits.force
        if force == float("inf"):
            return 1.0
        return within((force - direction * self.unit.lift_sign * load) / (_BEFORE_FORCE * force), 0.0, 1.0)

    def ramped(self, speed: Any, wanted: Any, slope: Any) -> Any:
        """The next motor speed [rad/s] of one that is to change to another with at most a slope [rad/s2]."""
        most_change, fastest = slope * self.period, self.unit.max_speed
        return within(speed + within(wanted - speed, -most_change, most_change), -fastest, fastest)

    def to_stand(self, speed: Any, direction: Any, load: Any) -> Any:
        """Way that the rod goes on [m] while the motor ramps down from a speed, and half a sample before that.

        The rod goes by what the motor turns beyond the leakage. It stands when nothing is left of that, or, lowered
        behind a valve, when the valve shuts: a motor that stands already.

        Args:
            speed: commanded now [rad/s].
            direction: of the rod, +1 or -1.
            load: [N].
        """
        leaks = -direction * self.unit.lift_sign * self.leakage(load)
        rate = most(direction * speed + leaks, 0.0)
        last = choose(direction * self.unit.lift_sign < 0.0, most(leaks, 0.0), 0.0) if self.holding.valves else 0.0
        ramp = most(rate**2 - last**2, 0.0) / (2.0 * self.slope)
        return (ramp + 0.5 * rate * self.period) * self.holding.travel_per_radian(load) * self.displacement

    def reachable(self, load: Any) -> Any:
        """The velocity that the motor can give to a trajectory, with some left for corrections [m/s]."""
        left = _REACHABLE * self.unit.max_speed - abs(self.leakage(load))
        return most(left * self.holding.travel_per_radian(load), self.tuning.creeping)

    def on_its_way(self, angle: Any, commanded: Iterable[tuple[Any, float]], load: Any) -> Any:
        """Way that the rod will go by what was commanded and is in no report yet [m].

        Args:
            angle: of all that [rad].
            commanded: the speeds in it [rad/s], and for how long each [s].
            load: [N].
        """
        if self.lag == 0.0:
            return 0.0
        lost = sum(self._moves_nothing(speed, load) * time for speed, time in commanded)
        return (angle - lost) * self.holding.travel_per_radian(load) * self.displacement

    def _moves_nothing(self, speed: Any, load: Any) -> Any:
        """What of a motor's speed does not move the rod [rad/s]: what leaks, or all of it where a valve holds the rod.

        It does while the motor lifts less than leaks, or lowers too slowly to open it.
        """
        lift, leaks = self.unit.lift_sign, self.leakage(load)
        if not self.holding.stands:
            return lift * leaks
        held = both(lift * speed >= -self.holding.opening_speed, lift * speed <= leaks)
        return choose(held, speed, lift * leaks)
