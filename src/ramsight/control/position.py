"""A cylinder's position control: a target in, a motor speed out, a virtual sensor's estimate as the only feedback.

The piston's velocity is the trajectory's plus a share of the position's error; the motor turns as fast as that velocity
takes, and faster by what leaks at the load that the sensor feels. Where a valve holds the load, the motor stands at a
target: there is no control at rest that could drift. Where the pump holds it, the motor goes on turning as slowly as
leakage takes, and brings back a rod that has left a dead band. All that decides is the graph of
`ramsight.control.block`; this object hands it orders and puts its reasons into words.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ramsight.control.activity import ACTIVITIES, STOPS, Activity, Event, after
from ramsight.control.actuation import Actuation, Tuning
from ramsight.control.block import VERDICTS, Notice, position_block
from ramsight.control.homing import end_stop
from ramsight.control.orders import Ask, Reason
from ramsight.control.thresholds import NO_ORDER
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live import Reported
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.engine.recursion import Live
from ramsight.errors import DescriptionError
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate


@dataclass(frozen=True)
class Command:
    """What a control asks of its drive."""

    motor_speed: float  # at the next sample, reached evenly [rad/s]
    activity: Activity  # what it is doing
    reason: str = ""  # why it stops, has stopped or goes slowly; empty if it does none of that


@dataclass(frozen=True)
class _Order:
    """What is asked for at every sample until the next order: `Ask`, target [m], velocity by hand, largest [m/s]."""

    ask: Ask = Ask.POSITION
    target: float = math.nan
    steering: float = 0.0
    speed: float = math.inf


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
        >>> from ramsight.plant.build import build
        >>> from ramsight.sensor.status import Status
        >>> control = PositionControl(build(machine.load_machine("mining-loader").unit("boom"), "boom"))
        >>> here = Estimate(position=0.1, position_std=1e-4, velocity=0.0, load=2e5, status=Status.OK)
        >>> control.move_to(0.3)
        >>> command = control.step(here, Reported(0.0, 0.0, 20.0, 313.15))
        >>> command.activity, command.motor_speed > 0.0
        (<Activity.MOVING: 'moving'>, True)
        >>> missing = Estimate(0.1, 1e-4, 0.0, 2e5, Status.INPUT_LOST)
        >>> control.step(missing, Reported(0.02, command.motor_speed, float("nan"), 313.15)).reason
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
        block = position_block(unit, limits, tuning, period, response)
        self.unit, self.limits, self.tuning, self.period = unit, block.by.limits, block.by.tuning, period
        self.actuation, self.holding = block.by, block.by.holding
        self.reason, self.target = "", math.nan
        self._live = Live(block.recursion, block.initial, (self.limits.acceleration,))
        self._order = _Order()
        self._event: Event | None = None
        self._activity, self._speed = Activity.RESTING, 0.0
        self._stop_reason = ""
        self._last = Estimate(math.nan, math.inf, 0.0, 0.0, Status.NOT_REFERENCED)

    @property
    def activity(self) -> Activity:
        """What the cylinder is doing; after an order, what it begins at the next sample."""
        return self._activity if self._event is None else after(self._activity, self._event)

    def move_to(self, target: float, speed: float | None = None, acceleration: float | None = None) -> None:
        """Go to a position, from whatever it is doing; a stopped cylinder, too.

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
        limits = self.limits.at(speed, acceleration)
        self._live.set_parameter(0, limits.acceleration)
        self._take_up(Event.SENT, _Order(Ask.POSITION, target, speed=limits.speed))

    def steer(self, velocity: float) -> None:
        """Go at a velocity that a hand gives, from whatever it is doing; a stopped cylinder, too.

        Args:
            velocity: [m/s], positive extends, within the limits; 0 holds the rod where it is.
        """
        order = _Order(Ask.STEER, steering=velocity)
        if self.activity is Activity.MANUAL:
            self._order = order
        else:
            self._take_up(Event.STEERED, order)

    def end(self, *, lifted: bool) -> float:
        """Where the end stop of lifting, or that of lowering, is [m]."""
        return end_stop(self.unit, lifted=lifted)

    def home(self, *, lifted: bool = False, slow: bool = False) -> None:
        """Go to an end stop and press on it, so that the sensor finds its position; a stopped cylinder, too.

        Args:
            lifted: the stop at the end of lifting; by default that of lowering.
            slow: go slowly all the way: the leakage meanwhile shows the sensor how much leaks.
        """
        ask = Ask.HOME_LIFTED if lifted else Ask.HOME_LOWERED
        self._take_up(Event.HOMED, _Order(ask, speed=0.0 if slow else math.inf))

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
        self._take_up(Event.TESTED, _Order(Ask.LEAK_TEST))

    def stop(self, reason: str) -> None:
        """Bring the motor to rest at once, within `STOPPING_TIME`, and stay there.

        A load that the pump holds sinks from then on, as slowly as oil leaks.
        """
        if self.activity not in STOPS:
            self.reason = self._stop_reason = reason
            self._order, self._event = _Order(Ask.STOP), Event.FAILED

    @property
    def done(self) -> bool:
        """Whether it rests where it was sent, or has stopped; never while it is steered by hand."""
        if self.activity is Activity.RESTING and not self.holding.stands:
            return True
        return self.activity in {Activity.RESTING, Activity.STOPPED} and self._speed == 0.0

    def step(self, estimate: Estimate, reported: Reported, *, leak: float = 1.0, displacement: float = 1.0) -> Command:
        """Decide the next command.

        Args:
            estimate: the sensor's, of the newest sample.
            reported: that sample.
            leak: factor of the leakage that the sensor has learned, if it learns any [1].
            displacement: the same of the displacement [1].
        """
        e, r, self._last = estimate, reported, estimate
        sensed = e.position, e.position_std, e.velocity, e.load, float(e.status), r.oil_temperature, leak, displacement
        return self._stepped((*sensed, 1.0, r.motor_speed, r.motor_torque))

    def step_unreported(self) -> Command:
        """Decide the next command at a sample whose report has not arrived: by the last one, and its velocity."""
        return self._stepped(_UNREPORTED)

    @property
    def learned(self) -> Actuation:
        """The cylinder's motor speeds by what was learned until the last sample."""
        state = self._live.state
        return replace(
            self.actuation,
            leak=state["sensed.leak"],
            displacement=state["sensed.displacement"],
            temperature=state["oil_temperature"],
        )

    @property
    def state(self) -> dict[str, float]:
        """All that the control knows, by name."""
        return self._live.state

    @state.setter
    def state(self, values: Mapping[str, float]) -> None:
        self._live.state = dict(values)

    def _take_up(self, event: Event, order: _Order) -> None:
        """Give an order, to a stopped cylinder too."""
        self.reason, self.target = "", order.target
        self._order, self._event = order, event
        self._live.set("order.ask", NO_ORDER)

    def _stepped(self, values: tuple[float, ...]) -> Command:
        order, before = self._order, self._activity
        inputs = (*values, float(order.ask), order.target, order.steering, order.speed)
        self._speed, activity, reason, _, error, notice = self._live.step(inputs)
        new, self._event = self._event is not None and order.ask is not Ask.STOP, None
        self._activity = ACTIVITIES[int(activity)]
        if self._activity not in STOPS:
            self.reason = self._notice(int(notice))
        elif new or before not in STOPS:
            self.reason = self._why(Reason(int(reason)), error)
        return Command(self._speed, self._activity, self.reason)

    def _notice(self, notice: int) -> str:
        """What slows the cylinder, in words."""
        if notice == Notice.AS_BEFORE:
            return self.reason
        return self._last.status.text if notice == Notice.SENSOR else VERDICTS[notice - Notice.DRIVE].value

    def _why(self, reason: Reason, error: float) -> str:
        """Why it stops, in words, with the following error [m]."""
        status = self._last.status.text
        if reason is Reason.ASKED:
            return self._stop_reason
        if reason is Reason.SENSOR:
            return status
        if reason is Reason.ROD:
            return f"the rod is {1e3 * abs(error):.0f} mm from where it should be by now"
        return f"{reason.text}: {status}" if reason in {Reason.NO_REFERENCE, Reason.NOT_FOUND} else reason.text


_UNREPORTED = (*(math.nan for _ in range(8)), 0.0, math.nan, math.nan)
