"""A computer that sleeps, is restored, or whose clock is set, while the machine works on: never valid and wrong.

`runner.serve` runs on a played bus. For a while it does nothing, and the frames of that time are lost, but for a few
that wait in a queue. What goes on meanwhile is one thing or more: the program's clock, the bus's time stamps, the
number in the drive's frames. Where none does, nobody can know that time has passed: what comes of that is counted.
The position is judged from the first frame on that was sent afterwards.
"""

from __future__ import annotations

import math
import threading
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bus import DRIVE, NODE
from drive_kinds import Sent, map_of
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS, WORK_DAY, Judge
from stale import played

CASES, UNTOLD = 400, 100
_BEFORE, _AFTER = 8.0, 8.0  # s
_PERIOD, _TICK = 0.02, 1e-4  # s
_SAME = 1e-5  # m
_MOVES = 300  # 1/min
_LAPSES = {"asleep": (0.08, 10.0), "restored": (1.0, 3600.0), "clock set": (1e-3, 3600.0)}  # s
_SET_WITHIN = 5.0  # s, after which a wall clock that stood is set
_QUEUED = 50  # frames that wait at most
_WALL = 1.7e9  # s, since 1970
CLOCK, STAMPS, NUMBER = "clock", "stamps", "number"
GOING = ((CLOCK,), (STAMPS,), (NUMBER,), (CLOCK, STAMPS), (CLOCK, NUMBER), (STAMPS, NUMBER), (CLOCK, STAMPS, NUMBER))
"""What goes on while the computer does not."""


@dataclass(frozen=True)
class Lapse:
    """What happens to the computer."""

    what: str  # one of the names above
    begin: float  # when, by the machine's time [s]
    lasts: float  # for how long, or by how much the clock is set [s]
    going: tuple[str, ...]  # what goes on meanwhile
    set_after: float  # the wall clock, which stood, is set so late after it [s]; infinite if it is not
    queued: int  # frames that wait meanwhile

    @property
    def end(self) -> float:
        """When the program goes on [s]."""
        return self.begin if self.what == "clock set" else self.begin + self.lasts

    def clock(self, at: float) -> float:
        """The program's clock [s]."""
        return at - self.end + self.begin if at >= self.end and CLOCK not in self.going else at

    def stamp(self, at: float) -> float:
        """The clock of the bus's time stamps, of which they are as far ahead as ever [s]."""
        if self.what == "clock set":
            return at + (self.lasts if at >= self.begin else 0.0)
        stands = STAMPS not in self.going and self.end <= at < self.end + self.set_after
        return at - (self.lasts if stands else 0.0)

    def __str__(self) -> str:
        lasts = f"{self.what} at {self.begin:.2f} s for {self.lasts:.3f} s"
        return f"{lasts}, {'/'.join(self.going) or 'nothing'} goes on, {self.queued} frames wait"


@dataclass
class Prepared:
    """What the cases share."""

    judge: Judge  # with the sensor
    # times, speeds [1/min] and torques [per mille] of a work day that ends where it begins
    frames: list[tuple[float, int, int]]
    since: float  # when it begins in the judge's log [s]
    length: float  # of it [s]
    maps: dict[bool, Path]  # of a drive that counts its frames, and of one that does not
    wrong: int = 0  # cases so far that were valid and wrong
    farthest: float = 0.0  # the worst error of them [m]
    tried: int = 0  # cases so far

    def report(self, number: int) -> tuple[float, int, int]:
        """When the drive sends its frame of a number [s], and what is in it: the day goes on for ever."""
        turn, k = divmod(number, len(self.frames))
        at, speed, torque = self.frames[k]
        return turn * self.length + at, speed, torque

    def true(self, at: float) -> float:
        """Where the piston is at some time [m]."""
        return float(self.judge.true(self.since + at % self.length))

    def numbers(self, first: float, last: float) -> range:
        """The drive's frames from one time to another [s]."""
        return range(self._number(first), self._number(last))

    def _number(self, at: float) -> int:
        turn, rest = divmod(at, self.length)
        return int(turn) * len(self.frames) + bisect_left(self.frames, (rest,))


def prepare(folder: Path) -> Prepared:
    """The work day of a boom between two rests at its upper end, as its drive sends it."""
    judge = Judge(WORK_DAY)
    frames, true = played(judge), judge.true(judge.log["time"].values)
    at_end = [one for one in frames if one[1] == 0 and abs(float(judge.true(one[0])) - true[-1]) < _SAME]
    since, until = at_end[0][0], frames[-1][0]
    day = [(at - since, speed, torque) for at, speed, torque in frames if since <= at < until]
    maps = {tells: folder / f"{tells}.toml" for tells in (True, False)}
    for tells, path in maps.items():
        path.write_text(map_of(tells=tells))
    return Prepared(judge, day, since, until - since, maps)


class Bus:
    """A bus of python-can on which the drive plays its day; time passes while somebody waits for its frames.

    Args:
        prepared: what is played.
        lapse: of the computer.
        since: by what the program's clock is ahead of the machine's time [s].
        ahead: by what the time stamps are ahead of the program's clock [s].

    Attributes:
        now: the machine's time [s].
        heard: when the newest frame that came was sent [s].
        stop: set when all have come.
    """

    def __init__(self, prepared: Prepared, lapse: Lapse, since: float = 0.0, ahead: float = _WALL) -> None:
        self.lapse, self.now, self.heard, self.stop = lapse, lapse.begin - _BEFORE, -math.inf, threading.Event()
        self._since, self._ahead = since, ahead
        before = prepared.numbers(self.now, lapse.begin)
        waiting = prepared.numbers(lapse.begin, min(lapse.end, lapse.begin + _PERIOD * lapse.queued))
        after = prepared.numbers(lapse.end, lapse.end + _AFTER)
        self._coming = deque(self._message(prepared, number) for one in (before, waiting, after) for number in one)

    def _message(self, prepared: Prepared, number: int) -> tuple[float, float, Any]:
        import can

        at, speed, torque = prepared.report(number)
        data = Sent(at, speed, torque, number).packed
        message = can.Message(self.stamp(at), 0x180 + DRIVE, is_extended_id=False, data=data)
        return (self.lapse.end if self.lapse.begin <= at < self.lapse.end else at), at, message

    def clock(self) -> float:
        """The program's clock [s]."""
        return self.lapse.clock(self.now) + self._since

    def stamp(self, at: float) -> float:
        """The time stamp of a frame that is sent at some time of the machine [s]."""
        return self.lapse.stamp(at) + self._since + self._ahead

    def send(self, message: Any) -> None:
        """Nobody listens."""

    def recv(self, timeout: float) -> Any:
        """The next frame, if it comes in time."""
        at, sent, message = self._coming[0] if self._coming else (math.inf, math.inf, None)
        if at > self.now + timeout:
            self.now += max(timeout, _TICK)
            if self.lapse.begin <= self.now < self.lapse.end:
                self.now = self.lapse.end
            return None
        self._coming.popleft()
        self.now, self.heard = max(at, self.now), sent
        if not self._coming:
            self.stop.set()
        return message


def encoder_of(prepared: Prepared, *, tells: bool) -> Any:
    """An encoder beside a drive that counts its frames, or does not."""
    from ramsight.deploy.encoder import Encoder, Listener, Settings
    from ramsight.logs.channel_map import load_map

    listener = Listener(load_map(prepared.maps[tells]))
    return Encoder(prepared.judge.sensor, prepared.judge.unit, listener, Settings(NODE, DRIVE, 0))


def follow(prepared: Prepared, lapse: Lapse) -> tuple[float, float, float]:
    """The worst error while valid and wrong after a lapse [m], its deviation [m] and when it was [s]; or zeros."""
    encoder, bus = encoder_of(prepared, tells=NUMBER in lapse.going), Bus(prepared, lapse)
    prepared.judge.sensor.start(prepared.true(bus.now), 1e-3)
    return worst_of(prepared, encoder, bus)


def worst_of(prepared: Prepared, encoder: Any, bus: Bus) -> tuple[float, float, float]:
    """The same of an encoder on some bus; it goes on from where it is."""
    from ramsight.deploy.encoder.runner import serve

    before, worst, lapse = 0.0, (0.0, 0.0, 0.0), bus.lapse

    def look() -> None:
        nonlocal before, worst
        error = abs(encoder.position - prepared.true(bus.now)) if encoder.valid else 0.0
        if bus.now < lapse.begin:
            before = error
        elif bus.heard >= lapse.end and error - before > FARTHEST and error > SIGMAS * encoder.std:
            worst = max(worst, (error, encoder.std, bus.now - lapse.end))

    serve(encoder, bus, bus.stop, clock=bus.clock, each=look)
    return worst


def moving(prepared: Prepared, rng: Rng, after: float = 0.0) -> float:
    """A moment of the day in motion, not too near its beginning and its end [s]."""
    inside = (_BEFORE, prepared.length - after)
    chosen = [at for at, speed, _ in prepared.frames if abs(speed) > _MOVES and inside[0] < at < inside[1]]
    return chosen[int(rng.integers(len(chosen)))] - 0.5 * _PERIOD


def drawn(prepared: Prepared, rng: Rng, *, told: bool, counts: bool | None = None) -> Lapse:
    """A lapse in motion, of a drive that counts its frames or does not; None: of either."""
    begin = prepared.length + moving(prepared, rng)
    what = str(rng.choice(list(_LAPSES) if told else ["asleep", "restored"]))
    least, most = _LAPSES[what]
    lasts = float(np.exp(rng.uniform(math.log(least), math.log(most))))
    if what == "clock set":
        return Lapse(what, begin, lasts * float(rng.choice([-1.0, 1.0])), (CLOCK, STAMPS), math.inf, 0)
    possible = [one for one in GOING if counts in (None, NUMBER in one)]
    going = possible[int(rng.integers(len(possible)))] if told else ()
    set_after = float(rng.uniform(0.0, _SET_WITHIN)) if rng.random() < 0.5 else math.inf
    return Lapse(what, begin, lasts, going, set_after, int(rng.integers(_QUEUED)) * int(rng.random() < 0.3))


def _check(prepared: Prepared, rng: Rng, _: Path, *, told: bool) -> tuple[str, str]:
    lapse = drawn(prepared, rng, told=told)
    error, std, at = follow(prepared, lapse)
    prepared.tried, prepared.wrong = prepared.tried + 1, prepared.wrong + (error > 0.0)
    prepared.farthest = max(prepared.farthest, error)
    if error and told:
        return WRONG, f"{lapse}: {1e3 * error:.1f} mm off, std {1e3 * std:.1f} mm, {at:.2f} s later"
    return READ, f"{prepared.wrong} of {prepared.tried} valid and wrong, {1e3 * prepared.farthest:.0f} mm at most"


SECTIONS = [
    Section("computer asleep", CASES, prepare, partial(_check, told=True), tells=True),
    Section("computer asleep, nothing tells", UNTOLD, prepare, partial(_check, told=False), tells=True),
]
