"""Whether the drive is there, by its samples and its heartbeat, and whether another node sends with its identifier."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable

from ramsight.deploy.encoder.server import INVALID, OPERATIONAL, Node, refuse

_STATE = 0x7F  # bits of a heartbeat; the highest is that of the older node guarding


class Presence:
    """Watches the drive.

    Args:
        drive_node: the drive's node-ID; None has no heartbeat.

    Attributes:
        silent: no whole sample has come within 2002h.
        gone: the heartbeat has stopped, or says that the drive is not operational. One that never came is not missed.
    """

    def __init__(self, node: Node, drive_node: int | None) -> None:
        self._node, self._drive_node = node, drive_node
        self._sampled = self._alive = -math.inf
        self.silent = self.gone = self._idle = False

    @property
    def lost(self) -> bool:
        """Whether the drive is silent or gone."""
        return self.silent or self.gone

    def sampled(self, now: float) -> None:
        """A sample has come, or waiting for one begins [s]."""
        self._sampled, self.silent = now, False

    def alive(self, now: float, state: int) -> None:
        """A heartbeat has come [s], with the drive's NMT state. A drive sends process data in one state alone."""
        self._idle = state & _STATE != OPERATIONAL and self._is_watched
        self._alive, self.gone = now, self._idle

    def check(self, now: float) -> bool:
        """See what is missing by now [s]; whether that has changed."""
        before = self.silent, self.gone
        self.silent, self.gone = now >= self._silent_at, self._idle or now >= self._gone_at
        return before != (self.silent, self.gone)

    @property
    def due(self) -> float:
        """When something will be missing that is not yet [s]."""
        return min(math.inf if self.silent else self._silent_at, math.inf if self.gone else self._gone_at)

    def expect(self, value: int) -> None:
        """1016h is being written: refuse another node than the drive; wait for the first heartbeat."""
        if value & 0xFFFF and value >> 16 != self._drive_node:
            refuse(INVALID)
        self._alive, self.gone, self._idle = -math.inf, False, False

    @property
    def _silent_at(self) -> float:
        return self._sampled + self._node.get(0x2002) * 1e-3

    @property
    def _gone_at(self) -> float:
        watched = self._is_watched and math.isfinite(self._alive)
        return self._alive + (self._node.get(0x1016, 1) & 0xFFFF) * 1e-3 if watched else math.inf

    @property
    def _is_watched(self) -> bool:
        wanted = self._node.get(0x1016, 1)
        return bool(wanted & 0xFFFF) and wanted >> 16 == self._drive_node


PERIOD = (0x2004, 0)
"""The object with the drive's period, in 0.1 ms; 0: it is learned."""

EXTRA = 1.8
"""Frames that have come beyond those of one drive when there are two. Frames of one drive that wait for the bus come up
to one period late, the next in time: one."""
LEARNED = 50  # intervals, of which a period is learned: a second of most drives
_SPREAD = 0.4  # of the period; so near it intervals are that are even: no gap, and no second node between them
_ALIKE, _OTHER = (
    0.9,
    0.1,
)  # share of them in which the motor turns, for a period in motion; of a period, for another one
_FOLLOWS = 0.1  # share of what the mean of some intervals is off by: jitter and waiting at their ends average out
_FASTER = 0.01  # share by which a drive may be faster than its period before its frames add up, by its clock
_LONGEST_BURST = 50.0  # frames that may come at once after a gap in which they waited
_FORGOTTEN = 0.1  # of a gap's frames that did not come after it, with each further one

_TURNS = 0.02  # of the highest speed; slower a drive may send less often, as one does that sends what changes
_START_TIME = 0.02  # s; no motor with pumps at its shaft comes from rest to its highest speed sooner
_NOISE = 0.02  # of the highest speed; so far may two reports of one motor be apart in no time
_JUMPS, _FADES = 2.5, 2.0  # jumps until they are those of two motors, three soon; of them forgotten in a second
_SHORTEST = 1e-3  # s; time stamps are no better
_TURNED, _AMONG = 2, 8  # turns of the speed, up and down by more than noise, among so many reports: of two motors

_LASTS = 2.0  # s after the last sign of a second node until it counts as gone


class Arrivals:
    """Counts the frames of one identifier against the period of one drive.

    Args:
        declared: the period [s]; 0 learns it, from when intervals are even.

    Attributes:
        period: of the drive [s]; NaN until it is known.
        is_sure: whether it was declared, or learned while the motor turned. A drive may send less often at rest.
        are_many: whether more frames have come than one drive sends in this period.
    """

    def __init__(self, declared: float = 0.0) -> None:
        self.period = declared or math.nan
        self.is_sure, self.are_many = declared > 0.0, False
        self._last, self._extra = math.nan, 0.0
        self._intervals: deque[tuple[float, bool]] = deque(maxlen=LEARNED)
        self._count = 0

    def take(self, at: float, turns: bool) -> None:
        """A frame that was sent at a time [s], and whether the motor turns."""
        passed, self._last = max(at - self._last, 0.0), at
        if math.isnan(passed):
            return
        self._learn(passed, turns)
        if not math.isnan(self.period):
            self._add(passed / self.period)

    def forgive(self) -> None:
        """Begin to count again."""
        self._extra, self.are_many = 0.0, False

    def _add(self, share: float) -> None:
        """Count an interval, over the period; what came late may come at once after it, what came early is extra."""
        self._extra = max(self._extra + 1.0 - (1.0 + _FASTER) * share, -_LONGEST_BURST)
        if self._extra < 0.0 and share < 1.5:
            self._extra *= 1.0 - _FORGOTTEN * min(share, 1.0)
        self.are_many = self._extra >= EXTRA
        self._extra = min(self._extra, EXTRA)

    def _learn(self, passed: float, turns: bool) -> None:
        """Follow the period of intervals that are even. Once it is sure, a shorter one is not another period."""
        self._intervals.append((passed, turns))
        self._count += 1
        if self._count < LEARNED or self._count % (LEARNED // 2):
            return
        inner = sorted(one for one, _ in self._intervals)
        median, mean = inner[LEARNED // 2], sum(inner) / LEARNED
        if not (median > 0.0 and inner[-1] - median <= _SPREAD * median and median - inner[0] <= _SPREAD * median):
            return
        in_motion = sum(turns for _, turns in self._intervals) >= _ALIKE * LEARNED
        shorter = mean < (1.0 - _OTHER) * self.period
        if shorter and (self.is_sure or not in_motion):
            return
        if shorter or math.isnan(self.period) or mean > (1.0 + _OTHER) * self.period:
            self.period = mean
            self.forgive()
        else:
            self.period += _FOLLOWS * (mean - self.period)
        self.is_sure = self.is_sure or in_motion


class Reports:
    """Looks whether reports of the speed can be those of one motor.

    Args:
        fastest: highest speed of the motor [rad/s].
    """

    def __init__(self, fastest: float) -> None:
        self._fastest = fastest
        self._at = self._speed = math.nan
        self._gap = self._jumps = self._way = 0.0
        self._turned: deque[bool] = deque(maxlen=_AMONG)

    @property
    def turn(self) -> bool:
        """Whether the motor turns, by the newest report."""
        return abs(self._speed) > _TURNS * self._fastest

    @property
    def differ(self) -> bool:
        """Whether they go up and down as those of two motors in turn."""
        return sum(self._turned) >= _TURNED

    def take(self, at: float, speed: float) -> bool:
        """A report [s, rad/s]; whether there have been too many jumps that no motor goes through."""
        passed, way = max(at - self._at, _SHORTEST), speed - self._speed
        if math.isnan(way):
            self._at, self._speed = at, speed
            return False
        wide = abs(way) > _NOISE * self._fastest
        self._turned.append(wide and way * self._way < 0.0)
        if wide:
            self._way = way
        # After a gap reports that waited come at once; how long they did is forgotten within about a second.
        self._gap = max(passed, self._gap * max(1.0 - passed, 0.0))
        allowed = self._fastest * (self._gap / _START_TIME + _NOISE)
        self._jumps = max(self._jumps - _FADES * passed, 0.0) + (abs(way) > allowed)
        self._at, self._speed = at, speed
        if self._jumps < _JUMPS:
            return False
        self._jumps = 0.0
        return True


class SecondNode:
    """Watches the frames with the drive's identifiers.

    Args:
        fastest: highest speed of the motor [rad/s].

    Attributes:
        is_there: whether another node sends them, too.

    Example:
        >>> second = SecondNode([0x185], fastest=300.0)
        >>> times = [0.02 * k for k in range(100)]
        >>> any(second.take(0x185, at, 0.0, period=0.02) for at in times)
        False
        >>> twice = [2.0 + at + after for at in times for after in (0.0, 0.005)]
        >>> [round(at, 3) for at in twice if second.take(0x185, at, 0.0, period=0.02)]
        [2.04]
    """

    def __init__(self, identifiers: Iterable[int], fastest: float) -> None:
        self._declared = 0.0
        self._arrivals = {one: Arrivals() for one in identifiers}
        self._reports, self._until = Reports(fastest), -math.inf
        self.is_there = False

    def take(self, identifier: int, sent: float, speed: float, *, period: float) -> bool:
        """A frame of the drive, or of who says to be it; whether a second node begins to be there.

        Args:
            sent: when it was sent [s].
            speed: that it reports [rad/s]; NaN if it reports none.
            period: declared [s]; 0 if it is to be learned.
        """
        if period != self._declared:
            self._declared = period
            self._arrivals = {one: Arrivals(period) for one in self._arrivals}
        found = not math.isnan(speed) and self._reports.take(sent, speed)
        if (arrivals := self._arrivals.get(identifier)) is not None:
            arrivals.take(sent, self._reports.turn)
            if arrivals.are_many and (arrivals.is_sure or self._reports.differ):
                arrivals.forgive()
                found = True
        if not found:
            return False
        begins, self.is_there, self._until = not self.is_there, True, sent + _LASTS
        return begins

    def period_of(self, identifier: int) -> float:
        """Of the frames with an identifier [s]; NaN if it is not known."""
        arrivals = self._arrivals.get(identifier)
        return math.nan if arrivals is None else arrivals.period

    def check(self, now: float) -> bool:
        """See whether it is gone [s]; whether that has changed."""
        gone = self.is_there and now >= self._until
        self.is_there = self.is_there and not gone
        return gone

    @property
    def due(self) -> float:
        """When `check` has something to do next [s]."""
        return self._until if self.is_there else math.inf
