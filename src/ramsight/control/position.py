"""A cylinder's position control: a target in, a motor speed out, a virtual sensor's estimate as the only feedback.

The piston's velocity is the trajectory's plus a share of the position's error; the motor turns as fast as that velocity
takes, and faster by what leaks at the load that the sensor feels. Where a valve holds the load, the motor stands at a
target: there is no control at rest that could drift. Where the pump holds it, the motor goes on turning as slowly as
leakage takes, and brings back a rod that has left a dead band. What the cylinder is doing is an object of its own, with
its own state; which follows which stands in one table (`ramsight.control.activity`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ramsight.control.activity import STOPS, Activity, Event, after
from ramsight.control.actuation import Actuation
from ramsight.control.doing import Doing, Now
from ramsight.control.homing import Homing
from ramsight.control.judging import Trust, may_home, trust
from ramsight.control.leak_testing import LeakTesting
from ramsight.control.moving import Moving
from ramsight.control.resting import Resting
from ramsight.control.steering import Manual
from ramsight.control.stopping import Stopping
from ramsight.control.trajectory import Limits
from ramsight.control.tuning import Tuning
from ramsight.control.visiting import end_stop
from ramsight.control.watch import DriveWatch, Verdict
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live import Reported
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import DescriptionError
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate


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
        response: how the drive is declared to follow its commands.

    Raises:
        DescriptionError: the motor cannot turn as fast as a valve of the unit asks for before it opens.

    Attributes:
        reason: as in `Command`.
        target: where it goes or is [m]; NaN before the first move and after homing.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build_unit
        >>> from ramsight.sensor.status import Status
        >>> control = PositionControl(build_unit("boom", machine.load("mining-loader").unit("boom")))
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
        self,
        unit: HydraulicUnit,
        limits: Limits | None = None,
        tuning: Tuning | None = None,
        period: float = SAMPLE_PERIOD,
        response: DriveResponse = IDEAL,
    ) -> None:
        self.unit, self.tuning, self.period = unit, tuning or Tuning(), period
        self.limits = limits or Limits.of(unit)
        self.watch = DriveWatch(unit, response, period)
        self.actuation = Actuation(unit, self.limits, self.tuning, period, response)
        self.holding = self.actuation.holding
        self.reason, self.target = "", math.nan
        self._doing: Doing = Resting(self.actuation)
        self._entered = True
        self._speed = 0.0  # commanded [rad/s]
        self._verdict = Verdict.OBEYS
        self._last = Estimate(math.nan, math.inf, 0.0, 0.0, Status.NOT_REFERENCED)

    @property
    def activity(self) -> Activity:
        """What the cylinder is doing."""
        return self._doing.activity

    def move_to(self, target: float, speed: float | None = None, acceleration: float | None = None) -> None:
        """Go to a position, from whatever it is doing; takes a stopped cylinder up again.

        Args:
            target: [m].
            speed: largest velocity [m/s]; by default, and at most, that of the limits.
            acceleration: the same of the acceleration [m/s2]; the jerk is less by as much.

        Raises:
            ValueError: the target is beyond an end stop.
        """
        stroke = self.unit.cylinder.stroke
        if not 0.0 <= target <= stroke:
            raise ValueError(f"target {1e3 * target:g} mm is not within the stroke, 0 to {1e3 * stroke:g} mm")
        self.target = target
        stop = self._doing.on_stop if isinstance(self._doing, Resting) else None
        felt = math.nan if stop is None else stop.felt
        limits = self.limits.at(speed, acceleration)
        self._take_up(Event.SENT, Moving(self.actuation, target, self.tuning.tries, limits, felt))

    def steer(self, velocity: float) -> None:
        """Go as fast as a hand says, from whatever it is doing; takes a stopped cylinder up again.

        Args:
            velocity: [m/s], positive extends, within the limits; 0 holds the rod where it is.
        """
        self.target = math.nan
        if isinstance(self._doing, Manual):
            self._doing.wanted = velocity
        else:
            self._take_up(Event.STEERED, Manual(self.actuation, velocity))

    def end(self, *, lifted: bool) -> float:
        """Where the end stop of lifting, or that of lowering, is [m]."""
        return float(end_stop(self.unit, lifted))

    def home(self, *, lifted: bool = False, slow: bool = False) -> None:
        """Visit an end stop and press on it, so that the sensor finds where it is; takes a stopped cylinder up again.

        Args:
            lifted: the stop at the end of lifting; by default that of lowering.
            slow: go slowly all the way: what leaks meanwhile tells the sensor how much leaks.
        """
        self.target = math.nan
        self._take_up(Event.HOMED, Homing(self.actuation, self.end(lifted=lifted), slow=slow))

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
        self.target = math.nan
        self._take_up(Event.TESTED, LeakTesting(self.actuation))

    def stop(self, reason: str) -> None:
        """Bring the motor to rest at once, within `STOPPING_TIME`, and stay there.

        A load that the pump holds sinks from then on, as slowly as oil leaks.
        """
        if self.activity not in STOPS:
            self.reason = reason
            self._become(Event.FAILED, Stopping(self.actuation, self._speed))

    @property
    def done(self) -> bool:
        """Whether it rests where it was sent, or has stopped; never while a hand has it."""
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
        self.actuation.leak, self.actuation.displacement = leak, displacement
        self.actuation.warm(reported.oil_temperature)
        self._verdict = self.watch.look(reported)
        self._last = estimate
        return self._decide(estimate)

    def step_unreported(self) -> Command:
        """Decide the next command at a sample whose report has not arrived: by the last one, and its velocity."""
        last = self._last
        self._last = replace(last, position=last.position + self.period * last.velocity)
        self._verdict = self.watch.missed()
        return self._decide(self._last)

    def _decide(self, estimate: Estimate) -> Command:
        how = trust(estimate.status)
        self._judge(estimate, how)
        coming = self.actuation.on_its_way(self.watch.pending, self.watch.underway, estimate.load)
        there = replace(estimate, position=estimate.position + coming) if coming != 0.0 else estimate
        now = Now(there, how, self._verdict, self._speed)
        if not self._entered:
            self._doing.enter(now)
            self._entered = True
        wish, slope = self._doing.step(now), self._doing.slope()
        if wish.event is Event.FAILED:
            self.stop(wish.reason)
            slope = self._doing.slope()
        elif wish.event is not None:
            self._become(wish.event, self._doing.leave(wish.event))
        self._speed = self.actuation.ramped(self._speed, wish.speed, slope)
        self.watch.command(self._speed)
        return Command(self._speed, self.activity, self.reason)

    def _take_up(self, event: Event, doing: Doing) -> None:
        """Do something else, of a stopped cylinder too."""
        self.reason = ""
        self.watch.begin()
        self._become(event, doing)

    def _become(self, event: Event, doing: Doing) -> None:
        """Go where the table leads."""
        if doing.activity is not after(self.activity, event):
            raise ValueError(f"{self.activity.value}, {event.value}: {doing.activity.value} is not in the table")
        self._doing, self._entered = doing, False

    def _judge(self, estimate: Estimate, how: Trust) -> None:
        """Stop if the estimate, or the drive, is not to be relied on; say what slows the cylinder down."""
        doing = self._doing
        if doing.activity in STOPS:
            return
        homes = doing.without_position and may_home(estimate.status)
        if (how is Trust.NONE and not homes) or not math.isfinite(estimate.position):
            if doing.activity is not Activity.RESTING or self._speed != 0.0:
                self.stop(estimate.status.text)
        elif self._verdict.stops and not (self._verdict is Verdict.STALLED and doing.may_stall):
            self.stop(self._verdict.value)
        else:
            self.reason = estimate.status.text if how is Trust.SLOW and not homes else self._verdict.value
