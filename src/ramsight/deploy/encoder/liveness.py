"""Whether the drive's data are alive: new, in time, of a drive that is enabled, by what its frames say of themselves.

A frame that is frozen, zero or late looks like any other. Five things tell it, two of them where the map names them:

- a *sequence*, a number of the frame that goes on with each frame, or the counter of the SYNC that the frame answers;
- *noise* of the torque: a report with noise repeats only so often in a row by chance (`control.repeats`); where none is
  declared, how often whole reports repeat is learned;
- *zeros*: a motor that turns fast does not stand in the next report, with a torque of exactly 0;
- a *step* of the speed: a shaft does not go from one steady speed to another without a torque (`ShaftSteps`);
- the *state word* of the drive (6041h): a drive that is not enabled has no torque.

A shaft of the inertia J that goes from one speed to another within the time h takes the torque J d omega/h for that
time, beside that of its load. If the drive reports one steady speed and then, from the next report on, another one,
while its torque goes on as before, then one of both speeds is false: its sign is wrong, a bit is stuck, or it is 0.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from functools import cache

from ramsight.control.repeats import repeats_in_a_row, runs, upper_share
from ramsight.logs.mapped import ENABLED, ENABLED_MASK, Sequence

FAST = 0.1
"""Of the highest speed; a motor that turns faster is not stopped within a report."""
SHORTEST_STOP = 0.2
"""From the highest speed [s]; a motor that stops sooner may do so between two reports of its torque."""
_STEADY = 0.03  # of a step, by which reports before and after it may differ from another
_QUIET = 0.5  # of the torque that a step takes; oil and moved mass take up to a third of that on themselves


@dataclass(frozen=True)
class _Seen:
    """A report: when it was sent for the first and the last time in a row [s], its speed [rad/s] and torque [N m]."""

    sent: float
    last: float
    speed: float
    torque: float


class ShaftSteps:
    """Compares steps of the speed with the torque around them.

    Args:
        fastest: highest speed of the motor [rad/s].
        inertia: of rotor, belt and pumps at the motor shaft [kg m2].

    Example:
        >>> shaft = ShaftSteps(300.0, 0.01)
        >>> seen = [(100.0, 20.0), (100.0, 20.1), (0.0, 20.2), (0.0, 19.9)]
        >>> [shaft.take(0.02 * k, speed, torque, 0.02) for k, (speed, torque) in enumerate(seen)]
        [False, False, False, True]
    """

    def __init__(self, fastest: float, inertia: float) -> None:
        self._fastest, self._inertia = fastest, inertia
        self._seen: deque[_Seen] = deque(maxlen=4)

    def take(self, sent: float, speed: float, torque: float, period: float) -> bool:
        """A report, and the period of them [s, rad/s, N m, s]; whether the step before it was without a torque."""
        if self._seen and (speed, torque) == (self._seen[-1].speed, self._seen[-1].torque):
            self._seen[-1] = replace(self._seen[-1], last=sent)
            return False
        self._seen.append(_Seen(sent, sent, speed, torque))
        return len(self._seen) == 4 and self._has_stepped(period)

    def _has_stepped(self, period: float) -> bool:
        first, before, after, last = self._seen
        # A drive that sends more often than it measures has measured when it sent a report for the first time.
        passed, step = after.sent - before.sent, abs(after.speed - before.speed)
        steady = max(abs(before.speed - first.speed), abs(last.speed - after.speed)) <= _STEADY * step
        sudden = step > self._fastest * max(FAST, passed / SHORTEST_STOP) and passed > 0.0
        changed = max(abs(one.torque - before.torque) for one in (after, last))
        quiet = passed * changed < _QUIET * self._inertia * step
        return steady and sudden and quiet and after.sent - before.last < 2.0 * period


LATE = 3.0
"""Frames by which the drive may be late: one waits for the bus a period at most, two more are for a busy bus."""
AHEAD = 2.0
"""Frames by which the drive may be ahead of the earliest before: that one waited for the bus a period, and another."""
RESTARTS = 2.0  # s; after such a silence a drive may have been switched off and on, and counts from anywhere
USUAL_PERIOD = 0.02  # s
_SLOWER = 0.01  # share by which a drive's period may be longer than it is known, before its frames add up
_DUPLICATE = 2  # frames with one number; CAN repeats one whose last bit was disturbed, not two
_SURE = 2  # repeats from which on they make the report older: more are rarer than one sample in 100
_SELDOM = 0.1  # share of reports that repeat, up to which a repeat makes the report older
_OFTEN = 0.5  # share of reports that repeat, from which on nothing is learned from repeats
_REMEMBERED = 2000  # reports: 40 s of a usual drive
_TURNS = 0.02  # of the highest speed; slower the motor rests
_ZEROS = 2  # reports of zeros in a row; one may be disturbed
_DECLARED = 1e-3  # of a step; finer a report is not rounded


@dataclass(frozen=True)
class Report:
    """What a whole sample says of itself."""

    sent: float  # when its frame was sent [s]
    speed: float  # [rad/s]
    torque: float  # [N m]
    sequence: float = math.nan  # its number; NaN if it has none
    state: float = math.nan  # the drive's state word; NaN if it has none


class Counted:
    """Compares a number of the frames with time, or with the counter of SYNC.

    Attributes:
        late: frames, or SYNCs, by which the newest frame is late [1].
        repeated: frames in a row with the same number.
        leapt: whether more frames were sent before the newest one than the time lets: time has passed unseen.
    """

    def __init__(self, sequence: Sequence) -> None:
        self._sequence = sequence
        self.late, self.repeated, self.leapt = 0.0, 0, False
        self._at = self._last = self._sync = math.nan

    @property
    def are_late(self) -> bool:
        """Whether frames are too late to be used."""
        return self.late >= LATE or self.repeated >= _DUPLICATE

    def synced(self, counter: int) -> None:
        """A SYNC with its counter."""
        self._sync = float(counter)

    def take(self, at: float, number: float, period: float) -> None:
        """A frame, when it was sent [s], its number, and the period of such frames [s]; NaN if that is not known."""
        passed, step = at - self._at, (number - self._last) % self._sequence.modulus
        begins = not passed <= RESTARTS
        self._at, self._last = at, number
        self.repeated = self.repeated + 1 if step == 0.0 and not begins else 0
        self.leapt = False
        if self._sequence.of_sync:
            late = (self._sync - number) % self._sequence.modulus
            self.late = 0.0 if math.isnan(late) else late
        elif begins:
            self.late = 0.0
        else:
            share = 1.0 if self.are_late else 1.0 - _SLOWER  # a drive that is late stays so
            expected = share * passed / period if period > 0.0 else max(step, 1.0)
            half = 0.5 * self._sequence.modulus
            late = self.late + (expected - step + half) % self._sequence.modulus - half
            self.leapt = late <= -AHEAD and half >= LATE + AHEAD  # else it is as well late
            self.late = max(late, 0.0)


class Habit:
    """How often whole reports repeat, learned from repeats that have ended.

    Example:
        >>> habit = Habit()
        >>> habit.enough(0.02)
        inf
        >>> for _ in range(300): habit.ended(0)
        >>> habit.enough(0.02)
        10.0
    """

    def __init__(self) -> None:
        self._repeated = self._reports = 0.0

    @property
    def share(self) -> float:
        """Upper 95 % bound of the share of reports that repeat the one before."""
        return float(upper_share(self._repeated, self._reports))

    def ended(self, run: int) -> None:
        """So many repeats have ended with another report."""
        self._repeated, self._reports = self._repeated + run, self._reports + run + 1
        if self._reports > _REMEMBERED:
            self._repeated, self._reports = 0.5 * self._repeated, 0.5 * self._reports

    def enough(self, period: float) -> float:
        """Repeats that are too many by chance; infinite if reports repeat often, or few were seen.

        Of values that fall into steps with the probabilities p_k the share that repeats is the sum of p_k^2. So none
        is likelier than its root, and n repeats in a row are rarer than that share to the power of n/2.

        Args:
            period: of the reports [s].
        """
        share = self.share
        return math.inf if share > _OFTEN else 2.0 * runs(share, period)


class Liveness:
    """Watches what the drive's reports say of themselves.

    Args:
        fastest: highest speed of the motor [rad/s].
        sequence: how the number of its frames counts; None where there is none.
        noise: of the torque from frame to frame, standard deviation [N m]; 0 where none is declared.
        step: to which the torque is rounded [N m].
        inertia: at the motor shaft [kg m2]; 0 if it is unknown.

    Attributes:
        is_stale: whether its data repeat, or are late.
        is_disabled: whether its state word says that it is not enabled.

    Example:
        >>> alive = Liveness(300.0, None, noise=0.5, step=0.08)
        >>> def forgets(k, torque): return alive.take(Report(0.02 * k, 100.0, torque), 0.02)
        >>> any(forgets(k, 20.0 + 0.08 * (k % 5)) for k in range(100))
        False
        >>> [forgets(100 + k, 20.0) for k in range(9)].index(True), alive.is_stale
        (7, True)
    """

    def __init__(
        self, fastest: float, sequence: Sequence | None, noise: float, step: float, inertia: float = 0.0
    ) -> None:
        self._turns, self._noise, self._step = _TURNS * fastest, noise, max(step, _DECLARED * noise)
        self._counted = None if sequence is None else Counted(sequence)
        self._torque, self._run, self._since = math.nan, 0, -math.inf
        self._speed, self._habits = math.nan, {True: Habit(), False: Habit()}
        self._turned = False
        self._fastest, self._zeros = fastest, 0
        self._steps = ShaftSteps(fastest, inertia)
        self.is_stale = self.is_disabled = False
        self._age = 0.0

    @property
    def age(self) -> float:
        """For how long the reports that were used may have been old [s]."""
        return self._age

    def synced(self, counter: int) -> None:
        """A SYNC with its counter."""
        if self._counted is not None:
            self._counted.synced(counter)

    def take(self, report: Report, period: float) -> bool:
        """A whole sample, and the period of the drive [s], NaN if unknown; whether false ones may have been used."""
        known = period if period > 0.0 else USUAL_PERIOD
        late = frozen = leapt = False
        self._age = 0.0
        if self._counted is not None and not math.isnan(report.sequence):
            self._counted.take(report.sent, report.sequence, period)
            late, leapt = self._counted.are_late, self._counted.leapt
            self._age = known * self._counted.late
        moved = self._state(report)
        if not self.is_disabled:
            frozen = self._repeats(report, known) if self._noise > 0.0 else self._stands(report, known)
        stepped = self._steps.take(report.sent, report.speed, report.torque, known)
        frozen = self._stops_at_once(report, known) or stepped or frozen
        forgets = frozen and not self.is_stale
        self.is_stale = late or frozen
        self._speed, self._torque = report.speed, report.torque
        return forgets or moved or leapt

    def is_new(self) -> bool:
        """Whether the newest report may be used: it is of an enabled drive that rests or turns, in time and new."""
        again = self._counted is not None and self._counted.repeated > 0
        return not (self.is_stale or again or (self.is_disabled and self._turned))

    def _state(self, report: Report) -> bool:
        """Follow the state word; whether the motor turned while it was said to be disabled."""
        if math.isnan(report.state):
            return False
        before = self.is_disabled
        self.is_disabled = int(report.state) & ENABLED_MASK != ENABLED
        turns = abs(report.speed) > self._turns
        self._turned = turns or (self._turned and self.is_disabled)
        return before and not self.is_disabled and turns

    def _repeats(self, report: Report, period: float) -> bool:
        """Whether the torque repeats for longer than its noise lets it."""
        if report.torque != self._torque:
            self._run, self._since = 0, report.sent
            return False
        self._run += 1
        if self._run >= _SURE:
            self._age = max(self._age, report.sent - self._since)
        # Of a learned period that trembles, worked out once a millisecond.
        return self._run >= _rounded_enough(self._noise, self._step, max(round(period, 3), 1e-3))

    def _stops_at_once(self, report: Report, period: float) -> bool:
        """Whether speed and torque have become 0 from one report to the next, faster than a motor stops."""
        if report.speed != 0.0 or report.torque != 0.0 or self.is_disabled:
            self._zeros = 0
        elif abs(self._speed) > self._fastest * max(FAST, period / SHORTEST_STOP):
            self._zeros = 1
        elif self._zeros > 0:
            self._zeros += 1
        return self._zeros >= _ZEROS

    def _stands(self, report: Report, period: float) -> bool:
        """Whether the whole report repeats for longer than it did before, in motion or at rest."""
        habit = self._habits[abs(report.speed) > self._turns]
        enough = habit.enough(period)
        if (report.speed, report.torque) != (self._speed, self._torque):
            if self._run < enough:
                self._habits[abs(self._speed) > self._turns].ended(self._run)
            self._run, self._since = 0, report.sent
            return False
        self._run += 1
        if self._run >= _SURE and habit.share < _SELDOM:
            self._age = max(self._age, report.sent - self._since)
        return self._run >= enough


@cache
def _rounded_enough(noise: float, step: float, period: float) -> float:
    return repeats_in_a_row(noise, step, period)
