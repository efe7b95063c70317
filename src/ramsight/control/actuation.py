"""What a motor speed does with a cylinder: velocity, leakage, valves that have to open, and pending travel."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import casadi as ca

from ramsight.control import thresholds
from ramsight.control.thresholds import FORCE_TAPER, REACHABLE_SHARE
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import DescriptionError
from ramsight.expression import Condition, Flag, Real, Scalar, all_of, scalar, within
from ramsight.plant.holding import Holding
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit


@dataclass(frozen=True)
class Tuning:
    """How a cylinder is driven; reasons of the defaults stand in `ramsight.control.thresholds`.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> f"{1e3 * Tuning.following_error_limit(Limits.of(boom)):.0f} mm, {Tuning.leak_test_share(boom):.3f}"
        '42 mm, 0.584'
    """

    gain: float = thresholds.POSITION_GAIN  # velocity per error of the position [1/s]
    creeping: float = thresholds.CREEPING_SPEED  # least velocity of a lift behind a valve [m/s]
    # opening: least motor speed of lowering, over the one at which the valve begins to open [1]
    opening: float = thresholds.OPENING_RATIO
    settling: float = thresholds.SETTLE_TIME  # time at rest after which the target is looked at again [s]
    tolerance: float = thresholds.TARGET_TOLERANCE  # error there from which the move is repeated [m]
    tries: int = int(thresholds.LANDING_TRIES)  # largest number of such repeats
    dead_band: float = thresholds.DEAD_BAND  # error at rest that a pump which holds the load does not correct [m]
    motor_acceleration: float = thresholds.MOTOR_ACCELERATION  # largest that is asked for [rad/s2]
    slowed: float = thresholds.UNCERTAIN_SPEED_SHARE  # share of the speed while sensor or drive are uncertain [1]
    # homing_share: velocity near and on the way to an unknown end stop, over the largest [1]
    homing_share: float = thresholds.HOMING_SPEED_SHARE
    contact_time: float = thresholds.CONTACT_TIME  # standstill after which a rod counts as on the stop [s]
    pressing: float = thresholds.PRESSING_TIME  # time for which the cylinder then presses on the stop [s]
    # pressing_share: load with which it presses where the pump holds the load, over that at relief pressure [1]
    pressing_share: float = thresholds.PRESSING_SHARE
    leak_test_time: float = thresholds.LEAK_TEST_TIME  # of a leak test [s]

    @staticmethod
    def following_error_limit(limits: Limits) -> float:
        """Largest distance between trajectory and estimate [m]: a sensor's first error, and `FOLLOWING_TIME` of way."""
        return limits.landing_zone + thresholds.FOLLOWING_TIME * limits.speed

    @staticmethod
    def leak_test_share(unit: HydraulicUnit) -> float:
        """Motor speed of a leak test over the one at which the rod would begin to lift [1]."""
        return max(1.0 - thresholds.LEAK_TEST_SIGMAS * unit.assumptions.machine.leak, thresholds.LEAK_TEST_LEAST)


@dataclass(frozen=True, eq=False)
class Actuation:
    """A unit's motor speeds, by its data sheet and what its sensor has learned."""

    unit: HydraulicUnit  # the unit's parts, as its data sheet has them
    limits: Limits  # what the cylinder may do
    tuning: Tuning  # how it is driven
    period: float  # of the samples [s]
    holding: Holding  # what holds the load at rest
    lag: float  # by which reports are behind commands [s]
    slope: float  # largest change of the motor's speed that is asked for [rad/s2]
    leak: Real = 1.0  # factor of the leakage that the sensor has learned [1]
    displacement: Real = 1.0  # the same of the displacement [1]
    temperature: Real = T40  # of the oil, its noise averaged [K]

    @classmethod
    def of(
        cls,
        unit: HydraulicUnit,
        limits: Limits | None = None,
        tuning: Tuning | None = None,
        period: float = SAMPLE_PERIOD,
        response: DriveResponse = IDEAL,
    ) -> Actuation:
        """Of a unit that nothing was learned of.

        Args:
            unit: as the attribute.
            limits: as the attribute; by default `Limits.of(unit)`.
            tuning: as the attribute.
            period: as the attribute [s].
            response: how the drive is declared to follow.

        Raises:
            DescriptionError: the motor cannot turn as fast as a valve of the unit asks for before it opens.
        """
        used, holding = tuning or Tuning(), Holding(unit)
        slope = min(used.motor_acceleration, response.acceleration)
        made = cls(unit, limits or Limits.of(unit), used, period, holding, response.lag, slope)
        if made.lowering_speed > unit.max_speed:
            names = ", ".join(valve.name for valve in holding.valves)
            raise DescriptionError(
                f"{names} would have to be opened by a motor that turns {made.lowering_speed:g} rad/s, to lower a load",
                key=f"units.{unit.name}.drive.max_speed",
                value=f"{unit.max_speed:g} rad/s",
            )
        return made

    @property
    def lowering_speed(self) -> float:
        """Least motor speed of lowering behind a valve [rad/s]."""
        return self.tuning.opening * self.holding.opening_speed

    def leakage(self, load: Real) -> Scalar:
        """Motor speed that leakage takes under a load [N], positive where it turns the way that lifts [rad/s]."""
        return scalar(1.0) * self.leak * self.holding.leakage(load, self.temperature)

    def travel_per_radian(self, load: Real) -> Scalar:
        """Travel of the rod over the motor's angle under a load [N], by what was learned [m/rad]."""
        return scalar(1.0) * self.holding.travel_per_radian(load) * self.displacement

    def speed_of(self, velocity: Real, load: Real) -> Scalar:
        """The motor's speed [rad/s] for a velocity [m/s] under a load [N], leakage included."""
        return velocity / self.travel_per_radian(load) + self.unit.lift_sign * self.leakage(load)

    def driving_speed(self, pace: Real, direction: Real, load: Real) -> Scalar:
        """The same for a velocity `pace` [m/s], 0 or more, in a direction, as fast as valves have to open."""
        lift = self.unit.lift_sign
        if not self.holding.valves:
            return self.speed_of(direction * pace, load)
        lifts = direction * lift > 0.0
        used = ca.if_else(lifts, ca.fmax(pace, self.tuning.creeping * self.displacement), pace)
        speed = self.speed_of(direction * used, load)
        return ca.if_else(lifts, speed, -lift * ca.fmax(-lift * speed, self.lowering_speed))

    def holding_speed(self, velocity: Real, load: Real) -> Scalar:
        """The motor's speed [rad/s] of a rod that is held: 0 behind a valve, else for a velocity [m/s]."""
        return scalar(0.0) if self.holding.stands else self.speed_of(velocity, load)

    def return_velocity(self, away: Real) -> Scalar:
        """Velocity [m/s] that brings back a rod at rest that is away from its place [m] by more than the dead band."""
        beyond = away - within(away, -self.tuning.dead_band, self.tuning.dead_band)
        return within(self.tuning.gain * beyond, -self.limits.landing_speed, self.limits.landing_speed)

    def tracking_speed(self, velocity: Real, error: Real, direction: Real, load: Real) -> Scalar:
        """The motor's speed [rad/s] that follows a trajectory to a target.

        Args:
            velocity: of the trajectory [m/s].
            error: its position less the rod's [m].
            direction: of the target, +1 or -1; a rod that still goes the other way is braked by the trajectory.
            load: [N].
        """
        wanted = velocity + self.tuning.gain * error
        returns = all_of(direction * velocity < 0.0, direction * wanted < 0.0)
        way = ca.if_else(returns, -direction, direction)
        return self.driving_speed(ca.fmax(way * wanted, 0.0), way, load)

    def steered_velocity(
        self, velocity: Real, wanted: Real, position: Real, fastest: Real, trusted: Condition
    ) -> Scalar:
        """The next velocity [m/s] of a rod that is steered by hand, slow before an end stop.

        Args:
            velocity: until now [m/s].
            wanted: by the hand [m/s].
            position: [m].
            fastest: largest velocity [m/s].
            trusted: whether the position may be relied on; else the places of the stops are unknown.
        """
        stroke, slope = self.unit.cylinder.stroke, self.limits.acceleration

        def most(up: Flag) -> Scalar:
            landing = self.limits.landing(up, position, stroke, self.period, slope)
            return ca.if_else(trusted, ca.fmin(fastest, landing), fastest)

        change = slope * self.period
        allowed = within(wanted, -most(scalar(0.0) > 0.0), most(scalar(1.0) > 0.0))
        return velocity + within(allowed - velocity, -change, change)

    def force_margin(self, direction: Real, load: Real) -> Real:
        """Share of the velocity that the largest force leaves to a motion [1]; 0 where it is reached.

        Args:
            direction: of the motion, +1 or -1.
            load: [N].
        """
        force = self.limits.force
        if math.isinf(force):
            return 1.0
        return within((force - direction * self.unit.lift_sign * load) / (FORCE_TAPER * force), 0.0, 1.0)

    def ramped(self, speed: Real, wanted: Real, slope: Real) -> Scalar:
        """The next motor speed [rad/s] of one that is to change to another with at most a slope [rad/s2]."""
        change, fastest = slope * self.period, self.unit.max_speed
        return within(speed + within(wanted - speed, -change, change), -fastest, fastest)

    def stopping_distance(self, speed: Real, direction: Real, load: Real) -> Scalar:
        """Way that the rod goes on [m] while the motor ramps down from a speed, and half a sample before that.

        The rod goes by what the motor turns beyond the leakage. It stands when nothing is left of that, or, lowered
        behind a valve, when the valve shuts: a motor that stands already.

        Args:
            speed: commanded now [rad/s].
            direction: of the rod, +1 or -1.
            load: [N].
        """
        leaks = -direction * self.unit.lift_sign * self.leakage(load)
        rate = ca.fmax(direction * speed + leaks, 0.0)
        lowers = direction * self.unit.lift_sign < 0.0
        last: Real = ca.if_else(lowers, ca.fmax(leaks, 0.0), 0.0) if self.holding.valves else 0.0
        ramp = ca.fmax(rate**2 - last**2, 0.0) / (2.0 * self.slope)
        return (ramp + 0.5 * rate * self.period) * self.travel_per_radian(load)

    def reachable_velocity(self, load: Real) -> Scalar:
        """The velocity that the motor can give to a trajectory, with a reserve for corrections [m/s]."""
        left = REACHABLE_SHARE * self.unit.max_speed - abs(self.leakage(load))
        return ca.fmax(left * self.holding.travel_per_radian(load), self.tuning.creeping)

    def pending_travel(self, angle: Real, commanded: Iterable[tuple[Real, float]], load: Real) -> Real:
        """Way that the rod will go by what was commanded and is in no report yet [m].

        Args:
            angle: of all that [rad].
            commanded: the speeds in it [rad/s], and for how long each [s].
            load: [N].
        """
        if self.lag == 0.0:
            return 0.0
        without_travel = sum(
            (self._speed_without_travel(speed, load) * time for speed, time in commanded), start=scalar(0.0)
        )
        return (angle - without_travel) * self.travel_per_radian(load)

    def _speed_without_travel(self, speed: Real, load: Real) -> Scalar:
        """What of a motor's speed does not move the rod [rad/s]: leakage, or all of it where a valve holds the rod.

        A valve does while the motor lifts less than leaks, or lowers too slowly to open it.
        """
        lift, leaks = self.unit.lift_sign, self.leakage(load)
        if not self.holding.stands:
            return lift * leaks
        held = all_of(lift * speed >= -self.holding.opening_speed, lift * speed <= leaks)
        return ca.if_else(held, speed, lift * leaks)
