"""A cylinder's position control: a target in, a motor speed out, a virtual sensor's estimate as the only feedback.

The piston's velocity is the trajectory's plus a share of the position's error; the motor turns as fast as that velocity
takes, and faster by what leaks at the load that the sensor feels. Where a valve holds the load, the motor stands at a
target: there is no control at rest that could drift. Where the pump holds it, the motor goes on turning as slowly as
leakage takes, and brings back a rod that has left a dead band.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from ramsight.control.judging import Trust, may_home, trust
from ramsight.control.trajectory import Limits, Trajectory
from ramsight.duty.live import Reported
from ramsight.errors import DescriptionError
from ramsight.plant.holding import Holding
from ramsight.plant.limits import limits_of
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.virtual_sensor import Estimate

STOPPING_TIME = 0.2  # s from the first sample that is not usable to the motor's standstill; it has to be below 0.3 s
_COLDEST, _HOTTEST = 243.15, 383.15  # K; a thermometer that says anything else is not believed
_FEELING = 0.5  # s, over which a load's noise is averaged
_WARMING = 5.0  # s, over which its noise is averaged


@dataclass(frozen=True)
class Tuning:
    """How a cylinder is driven.

    Args:
        gain: velocity per error of the position [1/s].
        creeping: least velocity of a lift behind a valve [m/s]; slower, it would not surely be open.
        opening: least motor speed of lowering, over the one at which the valve begins to open [1].
        lead: time between a command and its effect, by which a landing looks ahead [s].
        settling: time at rest after which the target is looked at again [s].
        renewing: error there from which it is sought anew [m] ...
        tries: ... so many times.
        dead_band: error at rest that a pump which holds the load leaves alone [m].
        motor_acceleration: largest [rad/s2].
        slowed: share of the speed while the sensor is not sure [1].
        following: largest distance between trajectory and estimate [m].
        disobedience: difference between commanded and reported motor speed that stops the cylinder [rad/s] ...
        disobedience_share: ... or as a share of the command ...
        disobedience_time: ... if it lasts [s].
        stuck: change of the command that a reported speed cannot sleep through [rad/s] ...
        stuck_time: ... for so long [s].
        homing_share: velocity near and on the way to an unknown end stop, over the largest [1].
        surely: how long a rod stands until it is taken to be on the stop [s].
        pressing: how long the cylinder then presses on the stop [s] ...
        pressing_share: ... and how hard where the pump holds the load, over the load at relief pressure [1].
        leak_test_share: motor speed of a leak test over the one at which the rod would begin to lift [1].
        leak_test_time: how long a leak test takes [s].
    """

    gain: float = 1.5
    creeping: float = 1e-3
    opening: float = 2.5
    lead: float = 0.03
    settling: float = 0.4
    renewing: float = 0.5e-3
    tries: int = 5
    dead_band: float = 0.2e-3
    motor_acceleration: float = 600.0
    slowed: float = 0.5
    following: float = 0.05
    disobedience: float = 5.0
    disobedience_share: float = 0.05
    disobedience_time: float = 0.08
    stuck: float = 0.3
    stuck_time: float = 0.05
    homing_share: float = 0.3
    surely: float = 0.5
    pressing: float = 3.0
    pressing_share: float = 0.25
    leak_test_share: float = 0.58
    leak_test_time: float = 8.0


class Activity(Enum):
    """What a cylinder is doing."""

    RESTING = "resting"
    MOVING = "moving"
    LANDING = "landing"
    HOMING = "homing"
    LEAK_TEST = "leak test"
    STOPPING = "stopping"
    STOPPED = "stopped"


@dataclass(frozen=True)
class Command:
    """What a control asks of its drive.

    Attributes:
        motor_speed: at the next sample, reached evenly [rad/s].
        activity: what it is doing.
        reason: why it stops, has stopped or goes slowly; empty if it does none of that.
    """

    motor_speed: float
    activity: Activity
    reason: str = ""


class PositionControl:
    """Drives one cylinder.

    Args:
        unit: the unit's parts, as its data sheet has them.
        limits: what the cylinder may do; by default `Limits.of(unit)`.
        tuning: how it is driven.
        period: of the samples [s].

    Raises:
        DescriptionError: the motor cannot turn as fast as a valve of the unit asks for before it opens.

    Attributes:
        activity: what the cylinder is doing.
        reason: as in `Command`.
        target: where it goes or is [m]; NaN before the first move and after homing.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> from ramsight.sensor.status import Status
        >>> control = PositionControl(build("boom", machine.load("mining-loader").unit("boom")))
        >>> here = Estimate(position=0.1, std=1e-4, velocity=0.0, load=2e5, status=Status.OK)
        >>> control.move_to(0.3)
        >>> command = control.step(here, Reported(0.0, 0.0, 20.0, 313.15))
        >>> command.activity, command.motor_speed > 0.0
        (<Activity.MOVING: 'moving'>, True)
        >>> lost = Estimate(0.1, 1e-4, 0.0, 2e5, Status.INPUT_LOST)
        >>> control.step(lost, Reported(0.02, command.motor_speed, float("nan"), 313.15)).reason
        'invalid: motor speed, motor torque or time missing'
    """

    def __init__(
        self, unit: HydraulicUnit, limits: Limits | None = None, tuning: Tuning | None = None, period: float = 0.02
    ) -> None:
        self.unit, self.tuning, self.period = unit, tuning or Tuning(), period
        self.limits = limits or Limits.of(unit)
        self.trajectory = Trajectory(self.limits, unit.cylinder.stroke)
        self.activity, self.reason, self.target = Activity.RESTING, "", math.nan
        self.holding = Holding(unit)
        self._least_lowering = self._opens(self.holding)
        self._speed = 0.0  # commanded [rad/s]
        self._most = self.limits.speed
        self._temperature = T40
        self._leak, self._displacement = 1.0, 1.0
        self._stopping_slope = self._disobeys_for = self._rests_for = 0.0
        self._leak_test_for = self._leak_test_speed = 0.0
        self._end, self._homing_for, self._on_stop_for = 0.0, 0.0, 0.0
        self._tries = 0
        self._same, self._same_for, self._same_command = math.nan, 0.0, 0.0
        self._begins, self._direction = False, 1.0
        self._stands_at = math.nan  # where a pump holds the rod if it was sent nowhere [m]
        self._on_stop, self._felt = False, math.nan  # load on the way to an end stop, which hides it [N]

    def _opens(self, holding: Holding) -> float:
        """Motor speed with which lowering begins [rad/s]."""
        least = self.tuning.opening * holding.opening_speed
        if least > self.unit.max_speed:
            names = ", ".join(valve.name for valve in holding.valves)
            raise DescriptionError(
                f"{names} would have to be opened by a motor that turns {least:g} rad/s, to lower a load",
                key=f"units.{self.unit.name}.drive.max_speed",
                value=f"{self.unit.max_speed:g} rad/s",
            )
        return least

    def move_to(self, target: float, speed: float | None = None) -> None:
        """Go to a position; takes a stopped cylinder up again.

        Args:
            target: [m].
            speed: largest velocity [m/s]; by default that of the limits.

        Raises:
            ValueError: the target is beyond an end stop.
        """
        stroke = self.unit.cylinder.stroke
        if not 0.0 <= target <= stroke:
            raise ValueError(f"target {1e3 * target:g} mm is not within the stroke, 0 to {1e3 * stroke:g} mm")
        self._most = self.limits.speed if speed is None else min(speed, self.limits.speed)
        self.target, self._tries = target, self.tuning.tries
        self._take_up(Activity.MOVING)

    def home(self, *, lifted: bool = False) -> None:
        """Visit an end stop and press on it, so that the sensor finds where it is; takes a stopped cylinder up again.

        Args:
            lifted: the stop at the end of lifting; by default that of lowering.
        """
        self._end = self.unit.cylinder.stroke if lifted == (self.unit.lift_sign > 0.0) else 0.0
        self.target, self._homing_for, self._on_stop_for, self._felt = math.nan, 0.0, 0.0, math.nan
        self._take_up(Activity.HOMING)

    def leak_test(self) -> None:
        """Turn slowly against the closed valve: the rod stays, and the sensor learns how much the pump leaks.

        Raises:
            DescriptionError: no valve keeps the load from the pump, and the rod would move.
        """
        if not self.holding.stands:
            raise DescriptionError(
                f"{self.unit.name}: its pump holds the load, and no valve; turning slowly would move the rod. "
                "Let it visit both end stops instead"
            )
        self.target, self._leak_test_for = math.nan, 0.0
        self._take_up(Activity.LEAK_TEST)

    def stop(self, reason: str) -> None:
        """Bring the motor to rest at once, within `STOPPING_TIME`, and stay there.

        A load that the pump holds sinks from then on, as slowly as oil leaks.
        """
        if self.activity not in {Activity.STOPPING, Activity.STOPPED}:
            self.activity, self.reason = Activity.STOPPING, reason
            self._stopping_slope = abs(self._speed) / max(STOPPING_TIME - self.period, self.period)

    @property
    def done(self) -> bool:
        """Whether it rests where it was sent, or has stopped."""
        if self.activity is Activity.RESTING and not self.holding.stands:
            return True
        return self.activity in {Activity.RESTING, Activity.STOPPED} and self._speed == 0.0

    def step(self, estimate: Estimate, reported: Reported, *, leak: float = 1.0, displacement: float = 1.0) -> Command:
        """Decide the next command.

        Args:
            estimate: what the sensor made of the newest sample.
            reported: that sample.
            leak: factor of the leakage that the sensor has learned, if it learns any [1].
            displacement: the same of the displacement [1].
        """
        self._leak, self._displacement = leak, displacement
        self._warm(reported.oil_temperature)
        self._watch(estimate, reported)
        if self.activity is Activity.MOVING:
            wanted = self._moving(estimate)
        elif self.activity is Activity.HOMING:
            wanted = self._homing(estimate)
        elif self.activity is Activity.LEAK_TEST:
            wanted = self._leak_testing(estimate)
        elif self.activity in {Activity.STOPPING, Activity.STOPPED}:
            wanted = 0.0
        else:
            wanted = self._resting(estimate)
        slope = self.tuning.motor_acceleration if self.activity is not Activity.STOPPING else self._stopping_slope
        change = min(max(wanted - self._speed, -slope * self.period), slope * self.period)
        fastest = self.unit.max_speed
        self._speed = min(max(self._speed + change, -fastest), fastest)
        if self.activity is Activity.STOPPING and abs(self._speed) < 1e-9:
            self._speed, self.activity = 0.0, Activity.STOPPED
        return Command(self._speed, self.activity, self.reason)

    def _take_up(self, activity: Activity) -> None:
        self.activity, self.reason, self._begins, self._disobeys_for = activity, "", True, 0.0
        self._stands_at, self._on_stop = math.nan, False

    def _warm(self, reported: float) -> None:
        if _COLDEST < reported < _HOTTEST:
            self._temperature += self.period / (_WARMING + self.period) * (reported - self._temperature)

    def _watch(self, estimate: Estimate, reported: Reported) -> None:
        """Stop if the estimate, or the drive, is not to be relied on; say what slows the cylinder down."""
        if self.activity in {Activity.STOPPING, Activity.STOPPED}:
            return
        allowance = max(self.tuning.disobedience, self.tuning.disobedience_share * abs(self._speed))
        differs = abs(reported.motor_speed - self._speed) > allowance
        self._disobeys_for = self._disobeys_for + self.period if differs else 0.0
        stuck = self._stuck(reported.motor_speed)
        how = trust(estimate.status)
        homes = self._without_position and may_home(estimate.status)
        if (how is Trust.NONE and not homes) or not math.isfinite(estimate.position):
            if self.activity is not Activity.RESTING or self._speed != 0.0:
                self.stop(estimate.status.text)
        elif self._disobeys_for > self.tuning.disobedience_time:
            self.stop("the motor does not turn as commanded")
        elif stuck:
            self.stop("the reported motor speed is stuck")
        else:
            self.reason = estimate.status.text if how is Trust.SLOW and not homes else ""

    @property
    def _without_position(self) -> bool:
        """Whether what it does asks for no position: it looks for one, was sent to none, or only keeps a load up."""
        nowhere = math.isnan(self.target) or not self.holding.stands
        return self.activity is Activity.HOMING or (self.activity is Activity.RESTING and nowhere)

    def _stuck(self, speed: float) -> bool:
        """Whether the reported speed has not changed at all while the command has."""
        if speed != self._same:
            self._same, self._same_for, self._same_command = speed, 0.0, self._speed
            return False
        self._same_for += self.period
        return self._same_for > self.tuning.stuck_time and abs(self._speed - self._same_command) > self.tuning.stuck

    def _moving(self, estimate: Estimate) -> float:
        x, way = estimate.position, self.trajectory
        if self._begins:
            self._begins = False
            self._direction = math.copysign(1.0, self.target - x)
            way.begin(x)
        share = self.tuning.slowed if trust(estimate.status) is Trust.SLOW else 1.0
        way.step(self.target, min(share * self._most, self._reachable(estimate)), self.period)
        if abs(way.position - x) > self.tuning.following:
            self.stop(f"the rod is {1e3 * abs(way.position - x):.0f} mm from where it should be by now")
            return 0.0
        remaining = self._direction * (self.target - x)
        if remaining <= max(self._direction * estimate.velocity, 0.0) * self.tuning.lead:
            self.activity, self._rests_for = Activity.LANDING, 0.0
            return 0.0
        velocity = way.velocity + self.tuning.gain * (way.position - x)
        return self._motor_speed(max(self._direction * velocity, 0.0), self._direction, estimate.load)

    def _resting(self, estimate: Estimate) -> float:
        """Stand; look once more at a target that was landed on."""
        stands = self._speed == 0.0 or not self.holding.stands
        self._rests_for = self._rests_for + self.period if stands else 0.0
        if self.activity is Activity.LANDING and self._rests_for >= self.tuning.settling:
            self.activity = Activity.RESTING
            missed = abs(self.target - estimate.position) > self.tuning.renewing
            if missed and self._tries > 0 and trust(estimate.status) is not Trust.NONE:
                self._tries -= 1
                self._take_up(Activity.MOVING)
        return 0.0 if self.holding.stands else self._held(estimate)

    def _held(self, estimate: Estimate) -> float:
        """As slowly as leakage takes, and back to where it is held once the rod has left the dead band.

        On an end stop the sensor feels what presses on the stop: the load there is the one that was felt on the way.
        What presses the rod to the stop, the stop carries.
        """
        velocity = 0.0
        if self._on_stop:
            towards_lowered = (self._end > 0.0) != (self.unit.lift_sign > 0.0)
            return 0.0 if towards_lowered == (self._felt > 0.0) else self._turning(0.0, self._felt)
        if trust(estimate.status) is not Trust.NONE:
            if math.isnan(self._stands_at):
                self._stands_at = estimate.position
            place = self._stands_at if math.isnan(self.target) else self.target
            away, band = place - estimate.position, self.tuning.dead_band
            beyond = math.copysign(max(abs(away) - band, 0.0), away)
            velocity = min(max(self.tuning.gain * beyond, -self.limits.landing_speed), self.limits.landing_speed)
        return self._turning(velocity, estimate.load)

    def _homing(self, estimate: Estimate) -> float:
        """Go to an end stop, fast as long as it is known to be far, and press until the time for that is over."""
        tuning, limits = self.tuning, self.limits
        stroke, slow = self.unit.cylinder.stroke, tuning.homing_share * limits.speed
        direction = 1.0 if self._end > 0.0 else -1.0
        if self._begins:
            self._begins = False
            self.trajectory.begin(estimate.position)
        self._homing_for += self.period
        far = abs(self._end - estimate.position) - limits.landing_zone - 4.0 * estimate.std
        fast = trust(estimate.status) is not Trust.NONE and far > 0.5 * limits.speed**2 / limits.acceleration
        change = limits.acceleration * self.period
        now = direction * self.trajectory.velocity
        wanted = limits.speed if fast else slow
        self.trajectory.velocity = direction * min(max(wanted, now - change), now + change)
        stands = self._homing_for > 1.0 and abs(estimate.velocity) < 0.3 * slow
        self._on_stop_for = self._on_stop_for + self.period if stands else 0.0
        found = may_home(estimate.status) and abs(self._end - estimate.position) < limits.landing_zone
        if not stands:
            before = self._felt if math.isfinite(self._felt) else estimate.load
            self._felt = before + self.period / (_FEELING + self.period) * (estimate.load - before)
        if self._on_stop_for > tuning.pressing:
            self.activity, self.target, self._on_stop = Activity.RESTING, math.nan, True
            if not found:
                self.stop(f"no reference at the end stop: {estimate.status.text}")
            return 0.0
        if self._homing_for > 1.5 * stroke / slow + 2.0 * tuning.pressing:
            self.stop(f"no end stop found in time: {estimate.status.text}")
            return 0.0
        if self._on_stop_for > tuning.surely and not self.holding.stands:
            return self._turning(0.0, self._pressing(direction * self.unit.lift_sign))
        return self._motor_speed(direction * self.trajectory.velocity, direction, estimate.load)

    def _pressing(self, way: float) -> float:
        """The load [N] as which an end stop is pressed; `way` is +1 at the end of lifting, -1 at that of lowering.

        Where a pump holds the load its pressure goes with its speed: a stop that is run into gives way by a millimetre.
        """
        full = limits_of(self.unit)
        most = full.load if way > 0.0 else full.pull
        return way * (max(way * self._felt, 0.0) + self.tuning.pressing_share * most)

    def _leak_testing(self, estimate: Estimate) -> float:
        """A steady speed, at which the pump's pressure stays below the load's."""
        if self._begins:
            self._begins, self._leak_test_speed = False, self.tuning.leak_test_share * self._leakage(estimate.load)
        self._leak_test_for += self.period
        if self._leak_test_for > self.tuning.leak_test_time:
            self.activity = Activity.RESTING
            return 0.0
        return self.unit.lift_sign * self._leak_test_speed

    def _motor_speed(self, pace: float, direction: float, load: float) -> float:
        """The motor's speed [rad/s] for a velocity `pace` [m/s] in a direction, open valves and what leaks included."""
        lift = self.unit.lift_sign
        if not self.holding.valves:
            return self._turning(direction * pace, load)
        if direction * lift > 0.0:
            return self._turning(lift * max(pace, self.tuning.creeping * self._displacement), load)
        return -lift * max(-lift * self._turning(direction * pace, load), self._least_lowering)

    def _turning(self, velocity: float, load: float) -> float:
        """The motor's speed [rad/s] for a velocity [m/s] under a load [N], what leaks included."""
        per_radian = self.holding.travel_per_radian(load) * self._displacement
        return velocity / per_radian + self.unit.lift_sign * self._leakage(load)

    def _leakage(self, load: float) -> float:
        """Motor speed that leakage takes under a load [N], positive where it turns the way that lifts [rad/s]."""
        return self._leak * self.holding.leakage(load, self._temperature)

    def _reachable(self, estimate: Estimate) -> float:
        """The velocity that the motor can give to the trajectory, with some left for corrections [m/s]."""
        most = 0.9 * self.unit.max_speed - abs(self._leakage(estimate.load))
        return max(most * self.holding.travel_per_radian(estimate.load), self.tuning.creeping)
