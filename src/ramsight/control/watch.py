"""Whether a drive does as it is told: what it reports against what the declared drive would report.

The declared drive follows the same commands in a model. Its speed may come at any time up to the declared delays, so
a report has to lie between the least and the greatest of what commands and model had in that time, give or take the
declared deviation and noise. A servo gives way to a load that changes: by (T - z)/k_p, where z, its integral, is the
torque T behind a low pass of k_p/k_i, so that its own torque says by how much.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from enum import Enum
from statistics import NormalDist

from ramsight.control.repeats import FALSE_ALARMS, Going, Seen, SpeedRepeats, runs
from ramsight.duty.drive_response import Delay, DriveResponse, Follower
from ramsight.duty.live import Reported
from ramsight.plant.drive import ServoDrive
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

NOTICED = 0.08  # s, in which a motor that does not obey is noticed: with the stopping time less than 0.3 s
STALLED = 1.0  # s at the torque limit without a turn: a pump presses a chamber to relief pressure in a tenth of it
STANDS = 1.0  # rad/s, below which a motor at its limit does not turn
# Steps of the reported speed by which the model has to move past a report that stands: one may be rounding.
MOVED = 2.0
# Samples of which a mean is taken, and in which a command has left it, at least: one that follows a sensor trembles by
# some 0.06 rad/s, so that three are two steps of 1 rpm off a mean of three one time in 10^8.
LEAVING = 3
SAME = 0.5  # steps of the reported speed, within which a command stands: rounding alone could hide it
TREMBLE = 6.0  # standard deviations of the reported speed, from end to end, in which what a command does is not seen


class Verdict(Enum):
    """What a drive is doing with its commands; the text is what a control says of it."""

    OBEYS = ""
    SLOW = "the drive follows more slowly than declared"
    AT_LIMIT = "the drive is at its torque limit"
    STALLED = "the drive is stalled at its torque limit"
    DISOBEYS = "the motor does not turn as commanded"
    STUCK = "the reported motor speed is stuck"
    TORQUE_STUCK = "the reported motor torque is stuck"
    SILENT = "no report of the drive arrives"

    @property
    def stops(self) -> bool:
        """Whether a cylinder may not go on with such a drive."""
        return self not in {Verdict.OBEYS, Verdict.SLOW, Verdict.AT_LIMIT}


@dataclass(frozen=True)
class Allowed:
    """What a drive that is as declared may do, in samples and speeds.

    Attributes:
        late: samples by which a report may be behind its command.
        patience: samples beyond which a late drive is no drive that obeys.
        in_a_row: samples in which a motor that does not obey is noticed.
        leaving: samples of a command's mean, and in which it has left it.
        missing: reports that may be missing in a row.
        speed: by which one may be off the declared drive's [rad/s].
        kept: samples of commands that are looked at.
        times: of the samples within the declared lag, the newest first [s].
        servo: the drive, if it is one whose torque says by how much it gives way.
        full: torque at which such a drive is at its limit [N m].
    """

    late: int
    patience: int
    in_a_row: int
    leaving: int
    missing: int
    speed: float
    kept: int
    times: tuple[float, ...]
    servo: ServoDrive | None
    full: float

    @classmethod
    def of(cls, unit: HydraulicUnit, response: DriveResponse, period: float) -> Allowed:
        """Of a unit's drive that is declared to follow so, at samples of a period [s]."""
        lost = runs(response.lost, period) if response.lost > 0.0 else 0
        late = math.ceil((response.command_delay + response.report_delay) / period - 1e-9) + lost
        patience = late + max(late // 3, 2)
        in_a_row = max(math.floor(NOTICED / period + 1e-9), 1)
        chance = (FALSE_ALARMS * period) ** (1.0 / in_a_row)
        whole = math.floor(response.lag / period + 1e-9)
        servo = unit.drive if isinstance(unit.drive, ServoDrive) else None
        noise = unit.assumptions.drive.torque * limits_of(unit).torque
        return cls(
            late=late,
            patience=patience,
            in_a_row=in_a_row,
            leaving=max(in_a_row, LEAVING),
            missing=max(lost, in_a_row),
            speed=response.deviation + NormalDist().inv_cdf(1.0 - chance) * response.speed_noise,
            kept=max(patience, late + in_a_row) + 1,
            times=(*(period for _ in range(whole)), max(response.lag - whole * period, 0.0)),
            servo=servo,
            full=math.inf if servo is None else servo.max_torque - 3.0 * noise,
        )


class DriveWatch:
    """Looks at a drive, a sample at a time.

    Args:
        unit: whose drive it is, as its data sheet has it.
        response: how the drive is declared to follow.
        period: of the samples [s].

    Attributes:
        pending: angle that was commanded and is not to be seen in the reports yet [rad].
        late: samples by which a report may be behind its command.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build_unit
        >>> boom = build_unit("boom", machine.load("mining-loader").unit("boom"))
        >>> watch = DriveWatch(boom, DriveResponse(), 0.02)
        >>> for k in range(8):
        ...     watch.command(50.0)
        ...     said = watch.look(Reported(0.02 * k, 0.0, 20.0 + k, 313.15))
        >>> said
        <Verdict.STUCK: 'the reported motor speed is stuck'>
    """

    def __init__(self, unit: HydraulicUnit, response: DriveResponse, period: float) -> None:
        self.response, self.period, self.pending = response, period, 0.0
        self._may = may = Allowed.of(unit, response, period)
        self.late = may.late
        self._model, self._reporting = Follower(response, period, delayed=False), Follower(response, period)
        self._delay = Delay(response.report_delay, period, 0.0)
        self._speeds = deque([0.0] * may.kept, maxlen=may.kept)
        self._asked = deque(self._speeds, maxlen=may.kept)
        self._underway = deque([0.0] * len(may.times), maxlen=len(may.times))
        self._commanded = self._integral = self._shown = 0.0
        self._speed = self._torque = math.nan
        self._torques = Seen()
        self._same_speed = SpeedRepeats(response.speed_noise, response.speed_step, period)
        self.begin()

    def begin(self) -> None:
        """Look anew, after a stop."""
        self._off = self._slow = self._missing = self._repeats = self._limited = 0
        self._stalled_for = 0.0
        self._same_speed.forget()
        self._forget()

    def _forget(self) -> None:
        """Count anew how long a speed has been reported unchanged, and what the model did meanwhile."""
        self._same = self._gone = 0
        self._began, self._side = (0.0, 0.0), 0.0

    @property
    def underway(self) -> tuple[tuple[float, float], ...]:
        """Mean speeds of the samples within the declared lag, the newest first [rad/s], and how much of each [s]."""
        return tuple(zip(self._underway, self._may.times, strict=True))

    def command(self, speed: float) -> None:
        """What the drive was asked for: the speed at the next sample [rad/s]."""
        self._commanded = speed

    def missed(self) -> Verdict:
        """At a sample whose report has not arrived."""
        self._advance()
        self._missing += 1
        return Verdict.SILENT if self._missing > self._may.missing else Verdict.OBEYS

    def look(self, reported: Reported) -> Verdict:
        """At a report; a value that is no number is the sensor's to judge."""
        self._missing = 0
        self._advance()
        speed, torque = reported.motor_speed, reported.motor_torque
        if not (math.isfinite(speed) and math.isfinite(torque)):
            return Verdict.OBEYS
        gives = self._gives_way(torque)
        low, high = self._range(self.late, gives)
        missing = low - speed if speed < low else high - speed if speed > high else 0.0
        slept = self._slept(speed) | self._speed_sticks(speed)
        stuck = self._torque_sticks(torque, speed)
        self._speed, self._torque = speed, torque
        if self._at_limit(torque, missing):
            return Verdict.STALLED if self._stalls(speed) else Verdict.AT_LIMIT
        self._stalled_for = 0.0
        if missing == 0.0:
            self._off = 0
        elif self._disobeys(speed, gives):
            return Verdict.STUCK if self._same >= self._may.in_a_row else Verdict.DISOBEYS
        if slept:
            return Verdict.STUCK
        if stuck:
            return Verdict.TORQUE_STUCK
        self._slow = self._slow + 1 if missing != 0.0 else 0
        return Verdict.SLOW if self._slow >= self._may.in_a_row else Verdict.OBEYS

    def _advance(self) -> None:
        """The declared drive's next sample."""
        before = self._asked[-1]
        self._asked.append(self._commanded)
        self._underway.appendleft(0.5 * (before + self._commanded))  # a command is reached evenly
        self._speeds.append(self._model.step(self._commanded))
        shown = self._delay.step(self._reporting.step(self._commanded))
        self.pending += 0.5 * (before + self._commanded - self._shown - shown) * self.period
        self._shown = shown

    def _gives_way(self, torque: float) -> float:
        """Speed by which a servo is below its reference, as its torque has it [rad/s]."""
        if self._may.servo is None:
            return 0.0
        off = torque - self._integral
        gain = self._may.servo.integral_gain / self._may.servo.proportional_gain
        self._integral += (1.0 - math.exp(-gain * self.period)) * off
        return off / self._may.servo.proportional_gain

    def _range(self, late: int, gives: float) -> tuple[float, float]:
        """Least and greatest speed that a drive could report that is up to so many samples late [rad/s].

        It may also be quicker than declared, down to one that does at once as it is told.
        """
        least, most = self._spread(late)
        return least - max(gives, 0.0) - self._may.speed, most - min(gives, 0.0) + self._may.speed

    def _spread(self, late: int) -> tuple[float, float]:
        """Least and greatest of what commands and model had in so many samples [rad/s]."""
        speeds = [speeds[-1 - k] for k in range(late + 1) for speeds in (self._speeds, self._asked)]
        return min(speeds), max(speeds)

    def _disobeys(self, speed: float, gives: float) -> bool:
        low, high = self._range(self._may.patience, gives)
        self._off = 0 if low <= speed <= high else self._off + 1
        return self._off >= self._may.in_a_row

    def _slept(self, speed: float) -> bool:
        """Whether the speed has been reported unchanged while all that must have been reported by now went elsewhere.

        Commands tremble with the sensor's noise, and a servo does not follow that: model and command have to leave, to
        one side, what they were on average when the report began to stand.
        """
        if speed != self._speed:
            self._forget()
            return False
        self._same += 1
        model, asked, seen = self._speeds[-1 - self.late], self._asked[-1 - self.late], self._same - self.late
        if 0 < seen <= self._may.leaving:
            self._began = self._began[0] + model / self._may.leaving, self._began[1] + asked / self._may.leaving
        elif seen > 0:
            off, least = (model - self._began[0], asked - self._began[1]), MOVED * self.response.speed_step
            side = 1.0 if min(off) > least else -1.0 if max(off) < -least else 0.0
            self._gone, self._side = (self._gone + 1 if side == self._side else 1), side
        return self._side != 0.0 and self._gone >= self._may.leaving

    def _speed_sticks(self, speed: float) -> bool:
        """Whether the speed of a motor that turns repeats more often than its noise lets it."""
        if abs(speed) < STANDS:
            self._same_speed.forget()
            return False
        return self._same_speed.look(speed, self._going())

    def _going(self) -> Going:
        """What the command did in the time that a report may be late, and as long as it takes to notice."""
        least, most = self._spread(self.late + self._may.in_a_row)
        if most - least < SAME * self.response.speed_step:
            return Going.STANDS
        return Going.TREMBLES if most - least < TREMBLE * self.response.speed_noise else Going.GOES

    def _torque_sticks(self, torque: float, speed: float) -> bool:
        """Whether a torque repeats more often than its noise lets it, while the motor turns.

        How often it does is declared, or learned from repeats that ended: of a coarse torque it is often.
        """
        if abs(speed) < STANDS or math.isnan(self._torque):
            self._repeats = 0
            return False
        if torque == self._torque:
            self._repeats += 1
        else:
            self._torques.add(1 + self._repeats, self._repeats)
            self._repeats = 0
        declared = self.response.torque_repeats
        share = self._torques.share if declared is None else declared
        return share < 1.0 and self._repeats >= runs(share, self.period)

    def _at_limit(self, torque: float, missing: float) -> bool:
        """Whether the drive has no torque for the speed that is missing, or had none just now."""
        if self._may.servo is None:
            return False
        if abs(torque) >= self._may.full:
            self._limited = self._may.patience + self._may.in_a_row
            self._forget()  # a motor at its limit keeps its speed, whatever the command
            self._same_speed.forget()
        else:
            self._limited = max(self._limited - 1, 0)
        return self._limited > 0 and missing != 0.0

    def _stalls(self, speed: float) -> bool:
        self._stalled_for = self._stalled_for + self.period if abs(speed) < STANDS else 0.0
        return self._stalled_for > STALLED
