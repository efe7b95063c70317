"""Units under control: their drives' reports, sensors and controls, a sample at a time, whatever the units move.

The truth goes to the drives' reports and into the record, and nowhere else; the sensors see the reports.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ramsight.closed_loop.planning import Knowledge, Visit, due, learned_factors
from ramsight.closed_loop.referencing import ASKS, Feedback, LoopSettings, Referencing, felt, place
from ramsight.closed_loop.thresholds import LONGEST_MOVE, LOOP_SETTLE_TIME, POSITION_SENSOR_STD
from ramsight.control.activity import STOPS, Activity
from ramsight.control.position import Command, PositionControl
from ramsight.control.sensing import Trust, trust
from ramsight.control.thresholds import ROUNDING
from ramsight.control.trajectory import Limits
from ramsight.duty.live import Instant, Reported
from ramsight.duty.live_drive import LiveDrive
from ramsight.optional import needing
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate, VirtualSensor
from ramsight.signals import Dataset

Fault = Callable[[str, Reported], Reported | None]
"""What becomes of a unit's report on its way: unit and sample in, sample out; nothing if it does not arrive."""
MotorFault = Callable[[str, float], float]
"""What a unit's motor does in the place of what its drive lets it: unit and speed in, speed out [rad/s]."""


@dataclass
class Record:
    """What happened to one unit, sample by sample.

    `command` is the speed passed to the plant, after what the drive made of the control's; `asked` is what the
    control asked for. Where a report is missing, `reported` has the last one that arrived, with its own time. `learned`
    has the factors of leakage and displacement that the control used.
    """

    position: list[float] = field(default_factory=list)
    motor_torque: list[float] = field(default_factory=list)
    command: list[float] = field(default_factory=list)
    estimate: list[Estimate] = field(default_factory=list)
    target: list[float] = field(default_factory=list)
    activity: list[Activity] = field(default_factory=list)
    reported: list[Reported] = field(default_factory=list)
    asked: list[float] = field(default_factory=list)
    learned: list[tuple[float, float]] = field(default_factory=list)


class DrivenUnits(ABC):
    """Units, their sensors and their controls; who derives from it adds the plant that they move.

    Args:
        sheet: the units as their data sheets have them, which is all that sensors and controls know.
        start_position: of each unit's piston [m].
        setting: of the loop.

    Attributes:
        visited: planned visits that were made: when each began [s], by which unit, and which.
    """

    def __init__(
        self, sheet: Sequence[HydraulicUnit], start_position: Mapping[str, float], setting: LoopSettings
    ) -> None:
        self.period, self.feedback = setting.period, setting.feedback
        self.fault: Fault | None = None
        self.motor_fault: MotorFault | None = None
        self._oil_temperature, self._start = setting.oil_temperature, dict(start_position)
        self.units = tuple(unit.name for unit in sheet)
        how = replace(setting.report, temperature_offset=setting.temperature_offset, seed=setting.seed)
        self._drives = {
            name: LiveDrive(setting.drive, self.period, how, stream=k) for k, name in enumerate(self.units)
        }  # fmt: skip
        self._followed_speed = dict.fromkeys(self.units, 0.0)
        self._noise = np.random.default_rng([setting.seed, len(self.units)])
        self.sensors: dict[str, VirtualSensor] = {unit.name: kalman(unit, setting.assumed_of(unit)) for unit in sheet}
        limits, declared = setting.limits or {}, setting.declared or setting.drive
        self.controls = {
            unit.name: PositionControl(unit, limits.get(unit.name), period=self.period, response=declared)
            for unit in sheet
        }
        for name, sensor in self.sensors.items():
            sensor.start(start_position[name] if setting.known else None)
        # What a late drive reports until then is older than the start; the known position is that of the start.
        self._begins = setting.drive.report_delay - ROUNDING
        self._unstarted = set(self.units) if setting.known and setting.drive.report_delay > 0.0 else set()
        self.records = {name: Record() for name in self.units}
        self.time: list[float] = []
        self._commands: dict[str, Command] = {}
        self._references: dict[str, float] = {}
        self._waiting: dict[str, tuple[float, float]] = {}
        self._referencing = setting.referencing or Referencing({})
        self.visited: list[tuple[float, str, Visit]] = []

    @property
    @abstractmethod
    def now(self) -> Instant:
        """The truth at the newest sample."""

    @abstractmethod
    def step(self) -> None:
        """Go on to the next sample."""

    @property
    def reasons(self) -> dict[str, str]:
        """Why units stop or go slowly, by unit; those that do neither are left out."""
        return {name: command.reason for name, command in self._commands.items() if command.reason}

    @property
    def done(self) -> bool:
        """Whether all controls rest."""
        return not self._waiting and all(control.done for control in self.controls.values())

    @property
    def stopped(self) -> bool:
        """Whether the machine has been stopped."""
        return any(control.activity in STOPS for control in self.controls.values())

    def rest(self, time: float) -> None:
        """Let a time pass [s]."""
        for _ in range(round(time / self.period)):
            self.step()

    def send(self, targets: Mapping[str, float], *, scaled: bool = False) -> float:
        """Send cylinders to targets [m] so that all arrive together; returns how long that should take [s].

        What arrives together feels the loads of the place where it stays: a cylinder that has arrived and closed its
        valve while another moves the machine gives way to the load unseen. One that needs less time begins later: what
        leaks in a move goes by its time, and so does the sensor's error.

        Args:
            targets: [m], by unit.
            scaled: all begin at once, and each has done the same share of its way at any time: velocity and
                acceleration over the way are those of the cylinder that needs longest for either.
        """
        ways = {name: target - self._estimated(name) for name, target in targets.items()}
        paces = {name: self._pace(name) for name in ways}
        self._waiting = {}
        if scaled:
            shared = together({name: (paces[name], way) for name, way in ways.items()})
            for name, (speed, acceleration) in shared.items():
                self.controls[name].move_to(targets[name], speed, acceleration)
            return max(paces[name].at(*shared[name]).time(way) for name, way in ways.items())
        times = {name: paces[name].time(way) for name, way in ways.items()}
        longest = max(times.values())
        self._waiting = {name: (self.now.time + longest - times[name], targets[name]) for name in ways}
        self._send_who_waits()
        return longest

    def _pace(self, name: str) -> Limits:
        """A unit's limits, at the speed that its sensor allows now."""
        control, status = self.controls[name], self.records[name].estimate[-1].status
        slowed = trust(status) is Trust.SLOW
        return control.limits.at(control.tuning.slowed * control.limits.speed) if slowed else control.limits

    def _send_who_waits(self) -> None:
        """Let those begin whose time has come."""
        for name, (begins, target) in tuple(self._waiting.items()):
            if self.now.time >= begins - ROUNDING:
                del self._waiting[name]
                self.controls[name].move_to(target)

    def go(self, targets: Mapping[str, float], settle: float = LOOP_SETTLE_TIME) -> None:
        """Send cylinders to targets [m] and wait until they are there, or have stopped; then for a while [s].

        References that are due by then are taken before, where the setting has visits that may be made.
        """
        self.take_references(targets)
        self._go(targets, settle)

    def _go(self, targets: Mapping[str, float], settle: float = LOOP_SETTLE_TIME) -> None:
        self.send(targets)
        self.wait()
        self.rest(settle)

    def reference_due(self, unit: str, targets: Sequence[float]) -> float:
        """Time of work that is left until a unit's next reference is due [s]; 0 if its sensor asks for one.

        Args:
            unit: its name.
            targets: of the work [m], gone to again and again under the load that the unit feels.
        """
        sensor, control, estimates = self.sensors[unit], self.controls[unit], self.records[unit].estimate
        if estimates[-1].status in ASKS:
            return 0.0
        limit = self._referencing.largest(control)
        work = [(target, felt(estimates)) for target in targets]
        return due(Knowledge.of(sensor, control), control, place(estimates, control), work, limit)

    def take_references(self, targets: Mapping[str, float]) -> int:
        """Take the references that are due before moves to targets [m], as the setting allows; how many that were."""
        before = len(self.visited)
        for unit, target in targets.items():
            self._take_references(unit, target)
        return len(self.visited) - before

    def _take_references(self, unit: str, target: float) -> None:
        """The visit that is due, and others of those that are allowed as long as the sensor asks after it."""
        plans, left = self._referencing, list(self._referencing.visits.get(unit, ()))
        sensor, control, estimates = self.sensors[unit], self.controls[unit], self.records[unit].estimate
        chosen = plans.before(sensor, control, estimates, target, left)
        while chosen is not None:
            self.calibrate(unit, chosen)
            left.remove(chosen)
            asks = estimates[-1].status in ASKS
            chosen = plans.before(sensor, control, estimates, target, left) if asks else None

    def calibrate(self, unit: str, visit: Visit) -> None:
        """Make a planned visit with one unit."""
        self.visited.append((self.now.time, unit, visit))
        if not math.isnan(visit.turns):
            self._go({unit: visit.turns})
        self.home(unit, lifted=visit.lifted, slow=visit.slow)

    def home(self, unit: str, *, lifted: bool = False, slow: bool = False, settle: float = LOOP_SETTLE_TIME) -> None:
        """Let one unit visit an end stop and wait until it has, or has stopped; then for a while [s].

        Homing asserts that nothing is in the way: where the rod then stands is a reference. What the
        sensor finds by itself could be an obstacle.
        """
        control = self.controls[unit]
        control.home(lifted=lifted, slow=slow)
        self.wait()
        if control.activity is Activity.RESTING:
            self._references[unit] = control.end(lifted=lifted)
        self.rest(settle)

    def leak_test(self, settle: float = LOOP_SETTLE_TIME) -> None:
        """Let all units do a leak test, in which no rod moves; then wait for a while [s]."""
        for control in self.controls.values():
            control.leak_test()
        self.wait()
        self.rest(settle)

    def wait(self) -> None:
        """Go on until all controls rest."""
        begun = self.now.time
        self.step()
        while not self.done:
            self.step()
            if self.now.time - begun > LONGEST_MOVE:
                for name, control in self.controls.items():
                    if not control.done:
                        control.stop(f"{name} has not arrived in {LONGEST_MOVE:g} s")

    def _estimated(self, name: str) -> float:
        return place(self.records[name].estimate, self.controls[name])

    def _followed(self) -> dict[str, float]:
        """Motor speeds at the next sample, which the drives make of the newest commands [rad/s], by unit."""
        for name, command in self._commands.items():
            speed = self._drives[name].follow(command.motor_speed)
            self._followed_speed[name] = speed if self.motor_fault is None else self.motor_fault(name, speed)
        return self._followed_speed

    def _decide(self) -> None:
        """Reports of this sample, what the sensors make of them, and the next commands."""
        now = self.now
        self._send_who_waits()
        for name in self.units:
            self._decide_for(name, now)
        self._stop_together()
        if self.stopped:
            self._waiting = {}
        self.time.append(now.time)

    def _decide_for(self, name: str, now: Instant) -> None:
        sensor, control, record = self.sensors[name], self.controls[name], self.records[name]
        reported = self._reported(name, now)
        if reported is None:
            estimate, reported, command = record.estimate[-1], record.reported[-1], control.step_unreported()
            record.learned.append(record.learned[-1])
        else:
            if name in self._unstarted and now.time >= self._begins:
                self._unstarted.remove(name)
                sensor.start(self._start[name])
            reference = self._references.pop(name, math.nan)
            values = reported.motor_speed, reported.motor_torque, reported.oil_temperature
            estimate = sensor.step(reported.time, *values, reference)
            leak, displacement = learned_factors(sensor)
            used = self._fed_back(estimate, now.position[name])
            command = control.step(used, reported, leak=leak, displacement=displacement)
            record.learned.append((leak, displacement))
        self._commands[name] = command
        record.position.append(now.position[name])
        record.motor_torque.append(now.motor_torque[name])
        record.command.append(self._followed_speed[name])
        record.asked.append(command.motor_speed)
        record.estimate.append(estimate)
        record.target.append(control.target)
        record.activity.append(command.activity)
        record.reported.append(reported)

    def _reported(self, name: str, now: Instant) -> Reported | None:
        """What arrives of a drive's report."""
        truth = now.motor_speed[name], now.motor_torque[name]
        reported = self._drives[name].report(now.time, *truth, self._oil_temperature)
        return reported if reported is None or self.fault is None else self.fault(name, reported)

    def _fed_back(self, estimate: Estimate, position: float) -> Estimate:
        if self.feedback is Feedback.SENSOR:
            return estimate
        noise = POSITION_SENSOR_STD * float(self._noise.standard_normal()) if self.feedback is Feedback.REAL else 0.0
        return replace(estimate, position=position + noise, position_std=POSITION_SENSOR_STD, status=Status.OK)

    def _stop_together(self) -> None:
        """What stops one unit stops the machine: the other moves the same mechanism, or is about to."""
        for name, control in self.controls.items():
            if control.activity is Activity.STOPPING:
                for one, other in self.controls.items():
                    if other is not control and (one in self._waiting or not other.done):
                        other.stop(f"{name}: {control.reason}")

    def track(self, unit: str) -> Dataset:
        """A unit's estimates, as its sensor's `track` gives them; with `target` [m] and the reports."""
        with needing("datasets"):
            import xarray

        record = self.records[unit]
        estimates, reported = record.estimate, record.reported
        columns = {
            "position": ("m", [e.position for e in estimates]),
            "position_std": ("m", [e.position_std for e in estimates]),
            "velocity": ("m/s", [e.velocity for e in estimates]),
            "load": ("N", [e.load for e in estimates]),
            "target": ("m", record.target),
            "motor_speed": ("rad/s", [r.motor_speed for r in reported]),
            "motor_torque": ("N m", [r.motor_torque for r in reported]),
            "oil_temperature": ("K", [r.oil_temperature for r in reported]),
        }
        data = {name: ("time", np.array(values), {"units": units}) for name, (units, values) in columns.items()}
        found = xarray.Dataset(data, coords={"time": ("time", np.array(self.time), {"units": "s"})})
        found["status"] = ("time", np.array([int(e.status) for e in estimates], dtype=np.int16))
        found["status"].attrs = {"meaning": "; ".join(f"{int(status)}: {status.text}" for status in Status)}
        found.attrs = {"format": 1, "sensor": self.sensors[unit].kind}
        return found


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
