"""Ten days of simulated work with everything at random: `python fuzz/soak.py --hours 240 --seed 1`.

A work day of minutes is played over and over to one sensor. In each of its turns something happens: the clock runs at
another rate, is set, stands or loses samples; values are no numbers, or far out of range; the drive's node misbehaves
in one of 39 kinds, or the computer sleeps, is restored or set, while an encoder on a bus follows; the program ends and
resumes from its file, whose bytes may be damaged meanwhile; the sensor is copied or goes through a pickle. It may never
be ok and wrong, nor an encoder valid and wrong, the memory stays what it is, and the file can always be resumed or is
refused. Encoders follow around what happens on their bus: 16 s of such a turn.
"""

from __future__ import annotations

import argparse
import copy
import math
import pickle
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import drive_kinds
import long_day
import numpy as np
import psutil
import sleeping
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST, LASTING, SIGMAS

from ramsight.engine.recursion import replay
from ramsight.errors import RamsightError
from ramsight.sensor.persistence import StateFile

HOURS, PIECES = 240.0, 24
_PATIENCE = 3600.0  # s
_HOUR = 3600.0  # s
_PERIOD = 0.02  # s
_GROWN, _SETTLED = 20.0, 100  # MiB; turns until all that is loaded late is there
_RATES = (0.1, 0.2, 0.5, 0.7, 0.9, 1.1, 1.5, 2.0, 5.0)
_SET = 3600.0  # s, by which a clock is set at most
_ODD = (np.nan, np.inf, -np.inf, 1e300, -1e9, 0.0)

Rows = Any  # columns time, speed, torque, temperature, reference, whether there is one
Event = Callable[[Rows, int, int, np.random.Generator], Rows]


def _rate(rows: Rows, first: int, last: int, rng: np.random.Generator) -> Rows:
    ticks = np.diff(rows[:, 0], prepend=rows[0, 0])
    ticks[first:last] *= rng.choice(_RATES)
    rows[:, 0] = rows[0, 0] + np.cumsum(ticks)
    return rows


def _set_clock(rows: Rows, first: int, _: int, rng: np.random.Generator) -> Rows:
    rows[first:, 0] += rng.uniform(-_SET, _SET)
    return rows


def _stands(rows: Rows, first: int, last: int, _: np.random.Generator) -> Rows:
    rows[first:last, 0] = rows[first, 0]
    return rows


def _lost(rows: Rows, first: int, last: int, _: np.random.Generator) -> Rows:
    return np.delete(rows, slice(first, last), axis=0)


def _odd_values(rows: Rows, first: int, last: int, rng: np.random.Generator) -> Rows:
    column = int(rng.integers(1, 4))
    chosen = first + np.flatnonzero(rng.random(last - first) < rng.choice([0.02, 1.0]))
    rows[chosen, column] = rng.choice(_ODD[:-1])
    return rows


def _swapped(rows: Rows, first: int, last: int, rng: np.random.Generator) -> Rows:
    for k in range(first, last - 1):
        if rng.random() < 0.1:
            rows[[k, k + 1]] = rows[[k + 1, k]]
    return rows


def _nothing(rows: Rows, *_: Any) -> Rows:
    return rows


EVENTS: dict[str, Event] = {
    "another rate": _rate, "clock set": _set_clock, "clock stands": _stands, "samples lost": _lost,
    "odd values": _odd_values, "order swapped": _swapped, "nothing": _nothing,
}  # fmt: skip
"""What happens to the samples of a day."""

ON_BUS = ["drive's node", "computer asleep"]
"""What happens to those of an encoder on its bus."""


def _again(sensor: Any, file: Any, rng: np.random.Generator, seen: Counter[str]) -> None:
    """The program ends, and the sensor goes on: as it was, from its file, from a damaged one, copied or pickled."""
    what = str(rng.choice(["on", "on", "resumed", "damaged", "copied", "pickled"]))
    seen[what] += 1
    if what in ("resumed", "damaged"):
        file.save()
        if what == "damaged":
            data = bytearray(file.path.read_bytes())
            data[int(rng.integers(len(data)))] ^= int(rng.integers(1, 256))
            file.path.write_bytes(data)
        sensor.start(None)
        _resume(file, seen)
    elif what == "copied":
        sensor._state = copy.copy(sensor)._state
    elif what == "pickled":
        sensor._state = pickle.loads(pickle.dumps(sensor))._state


def _resume(file: Any, seen: Counter[str]) -> None:
    try:
        seen["found" if file.resume().found else "not found"] += 1
    except RamsightError:
        seen["refused"] += 1
        file.path.unlink()


def silent(said: Any, true: Any) -> float:
    """The longest time for which outputs (position, deviation, status) were ok and wrong [s]."""
    error = np.abs(said[:, 0] - true)
    bad = (said[:, 2] == 0) & ~(error <= FARTHEST) & ~(error <= SIGMAS * said[:, 1])
    edges = np.flatnonzero(np.diff(bad.astype(np.int8), prepend=0, append=0))
    return _PERIOD * float(np.max(edges[1::2] - edges[::2], initial=0))


@dataclass
class Beside:
    """An encoder whose sensor it is."""

    encoder: Any
    tells: bool  # whether its drive counts its frames
    ahead: float = 1e9  # by what the time stamps are ahead of its clock [s]

    @property
    def stood(self) -> float:
        """By what the sensor's time is ahead of its clock [s]."""
        return float(self.encoder._clock.stood)


class Work:
    """A sensor that works day after day, and two encoders that follow when something happens on their bus.

    Args:
        folder: for its files.
        seed: of all that is drawn.

    Attributes:
        length: of a day [s].
        turns: days so far.
        seen: how often which event was.
        ok, samples: samples that were ok, and all that were played without an encoder.
        wrong: what was ok, or valid, and wrong.
        limits: turns that were wrong by a kind that SECURITY.md lists.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        day, self._bus = long_day.prepare(folder), sleeping.prepare(folder)
        self.length, self._sensor, self._rng = day.length, day.judge.sensor, np.random.default_rng(seed)
        self._bus.judge = day.judge
        # The place of each sample goes with it through what is lost or swapped.
        self._rows = np.column_stack([np.array(day.rows), np.zeros((len(day.rows), 2)), day.true])
        self._since = self._now = 0.0  # s, of the sensor's time over that of the day, and that of the newest sample
        self._beside = [Beside(sleeping.encoder_of(self._bus, tells=tells), tells) for tells in (False, True)]
        for one in self._beside:
            one.encoder.start(0.0)
        outputs = self._sensor.recursion.outputs.index
        self._place = [outputs(name) for name in ("position", "position_std", "status")]
        self.seen, self.wrong, self.limits, self.ok, self.samples = Counter[str](), list[str](), 0, 0, 0
        self._file = StateFile(folder / "soak.state", self._sensor)
        self._sensor.start(day.true[0], 1e-3)
        self.turns, self._process, self._memory = 0, psutil.Process(), math.nan

    @property
    def grown(self) -> float:
        """By how much memory has grown since all that is loaded late was there [MiB]."""
        return self._process.memory_info().rss / 2**20 - self._memory if self.turns > _SETTLED else 0.0

    def turn(self) -> None:
        """A day with an event, and what happens to the program afterwards."""
        name, rng = str(self._rng.choice([*EVENTS, *ON_BUS])), self._rng
        self.seen[name] += 1
        self._since = self._now + _PERIOD
        if name in ON_BUS:
            what, wrong = self._followed(name)
        else:
            rows, first = self._rows.copy(), int(rng.integers(len(self._rows) // 2))
            last = first + max(2, int(rng.choice([0.08, 0.5, 1.0, 2.0, 5.0, 10.0]) / _PERIOD))
            lasting = self._play(EVENTS[name](rows, first, last, rng))
            what, wrong = name, f"ok and wrong for {lasting:.2f} s" if lasting > LASTING else ""
        if wrong and what in drive_kinds.LIMITS:
            self.limits += 1
        elif wrong:
            self.wrong.append(f"turn {self.turns}, {what}: {wrong}")
        _again(self._sensor, self._file, rng, self.seen)
        self.turns += 1
        if self.turns == _SETTLED:
            self._memory = self._process.memory_info().rss / 2**20

    def _play(self, rows: Rows) -> float:
        """Let the sensor follow samples of the day; for how long it was ok and wrong [s]."""
        if not len(rows):
            return 0.0
        given = np.ascontiguousarray(rows[:, :6])
        given[:, 0] += self._since
        said = replay(self._sensor.recursion, given, self._sensor.parameters, self._sensor._state)[:, self._place]
        self.ok, self.samples = self.ok + int(np.sum(said[:, 2] == 0)), self.samples + len(said)
        self._now = float(given[-1, 0])
        return silent(said, rows[:, 6])

    def _followed(self, name: str) -> tuple[str, str]:
        """A day of which an encoder follows a part: what happened, and what was wrong."""
        beside = self._beside[int(self._rng.integers(2))]
        if name == "computer asleep":
            lapse = sleeping.drawn(self._bus, self._rng, told=True, counts=beside.tells)
            what, begin = str(lapse), lapse.begin - self._bus.length
        else:
            what = str(self._rng.choice(list(drive_kinds.KINDS)))
            begin = sleeping.moving(self._bus, self._rng, drive_kinds.AROUND)
        lasting = self._play(self._rows[self._rows[:, 0] < begin - drive_kinds.BEFORE])
        since = self._since - beside.stood  # of the encoder's clock
        if name == "computer asleep":
            end, error = self._asleep(beside, lapse, since)
        else:
            end, error = self._misbehaves(beside, what, begin, since)
        lasting = max(lasting, self._play(self._rows[self._rows[:, 0] > end]))
        wrong = f"{1e3 * error:.1f} mm off and valid" if error else ""
        return what, wrong or (f"ok and wrong for {lasting:.2f} s" if lasting > LASTING else "")

    def _misbehaves(self, beside: Beside, name: str, begin: float, since: float) -> tuple[float, float]:
        """The drive's node misbehaves: the day's time at the end [s], and the worst error while valid and wrong [m]."""
        frames = drive_kinds.sent_of(self._bus.frames, name, begin, self._rng, tells=beside.tells)
        error, *_ = drive_kinds.worst_of(beside.encoder, frames, begin, self._bus.true, since, beside.ahead)
        self._since = since + beside.stood
        return frames[-1].at, error

    def _asleep(self, beside: Beside, lapse: sleeping.Lapse, since: float) -> tuple[float, float]:
        """The same of a computer that sleeps, is restored, or whose clock is set."""
        bus = sleeping.Bus(self._bus, lapse, since - self._bus.length, beside.ahead)
        error, *_ = sleeping.worst_of(self._bus, beside.encoder, bus)
        end = bus.now % self._bus.length
        self._since, beside.ahead = bus.clock() + beside.stood - end, bus.stamp(bus.now) - bus.clock()
        return end, error


def soak(work: Work, hours: float) -> tuple[int, list[str], str]:
    """Go on for so many hours: how many turns there were, what was wrong in them, and what to tell of all so far."""
    wrong, turns = len(work.wrong), math.ceil(hours * _HOUR / work.length)
    for _ in range(turns):
        work.turn()
    if (grown := work.grown) > _GROWN:
        work.wrong.append(f"memory has grown by {grown:.0f} MiB")
    seen = ", ".join(f"{name} {count}" for name, count in sorted(work.seen.items()))
    told = f"{work.turns} turns in {work.turns * work.length / _HOUR:.0f} h, {len(work.wrong)} ok and wrong"
    told += f", {work.limits} more by a known limit; ok in {work.ok / work.samples:.0%} of {work.samples} samples"
    return turns, work.wrong[wrong:], f"{told}; {grown:+.1f} MiB; {seen}"


def _check(work: Work, _: Rng, __: Path) -> tuple[Counter[str], str]:
    turns, wrong, told = soak(work, HOURS / PIECES)
    return Counter({READ: turns - len(wrong), WRONG: len(wrong)}), "; ".join([told, *wrong[:5]])


SECTIONS = [Section("soak", PIECES, partial(Work, seed=1), _check, _PATIENCE, tells=True)]
"""The cases are its pieces, each of which goes on from the one before."""


def main() -> None:
    """Print what comes of so many hours."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=HOURS)
    parser.add_argument("--seed", type=int, default=1)
    asked, begun = parser.parse_args(), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        _turns, wrong, told = soak(Work(Path(folder), asked.seed), asked.hours)
    print(f"{len(wrong)} wrong in {asked.hours:g} h, {time.perf_counter() - begun:.0f} s", told, *wrong[:20], sep="\n")
    raise SystemExit(min(len(wrong), 1))


if __name__ == "__main__":
    main()
