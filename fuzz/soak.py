"""Weeks of simulated work with everything at random: `python fuzz/soak.py --hours 240 --seed 1`.

A work day of minutes is played over and over. In each of its turns something happens: the clock runs at another rate,
is set, stands or loses samples; values are no numbers, or far out of range; the program ends and resumes from its file,
whose bytes may be damaged meanwhile; the sensor is copied or goes through a pickle. It may never be ok and wrong, its
memory stays what it is, and its file can always be resumed or is refused.
"""

from __future__ import annotations

import argparse
import copy
import pickle
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from judge import FARTHEST, LASTING, SIGMAS
from long_day import Prepared, prepare

_HOUR = 3600.0  # s
_PERIOD = 0.02  # s
_GROWN = 20.0  # MiB
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


def _again(sensor: Any, file: Any, rng: np.random.Generator, seen: Counter[str]) -> Any:
    """The sensor after its program ended: as it was, from its file, from a damaged one, copied or pickled."""
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
    return sensor


def _resume(file: Any, seen: Counter[str]) -> None:
    from ramsight.errors import RamsightError

    try:
        seen["found" if file.resume().found else "not found"] += 1
    except RamsightError:
        seen["refused"] += 1
        file.path.unlink()


def _turn(prepared: Prepared, since: float, rng: np.random.Generator) -> tuple[str, Rows, Any]:
    """A turn of the work day with an event: its name, the samples, and where the piston was at each."""
    name = str(rng.choice(list(EVENTS)))
    rows = np.column_stack([np.array(prepared.rows), np.zeros((len(prepared.rows), 3))])
    # The place of each sample goes with it through what is lost or swapped.
    rows[:, 0] += since
    rows[:, 6] = prepared.true
    first = int(rng.integers(len(rows) // 2))
    last = first + max(2, int(rng.choice([0.08, 0.5, 1.0, 2.0, 5.0, 10.0]) / _PERIOD))
    rows = EVENTS[name](rows, first, last, rng)
    return name, np.ascontiguousarray(rows[:, :6]), rows[:, 6]


def silent(said: Any, true: Any) -> float:
    """The longest time for which outputs (position, deviation, status) were ok and wrong [s]."""
    error = np.abs(said[:, 0] - true)
    bad = (said[:, 2] == 0) & ~(error <= FARTHEST) & ~(error <= SIGMAS * said[:, 1])
    edges = np.flatnonzero(np.diff(bad.astype(np.int8), prepend=0, append=0))
    return _PERIOD * float(np.max(edges[1::2] - edges[::2], initial=0))


def soak(hours: float, seed: int, folder: Path) -> tuple[int, str]:
    """How many turns were wrong, and what to tell of them."""
    from ramsight.engine.recursion import replay
    from ramsight.sensor.persistence import StateFile

    prepared, rng = prepare(folder), np.random.default_rng(seed)
    sensor = prepared.judge.sensor
    sensor.start(prepared.true[0], 1e-3)
    file, seen, wrong = StateFile(folder / "soak.state", sensor), Counter[str](), []
    place = [sensor.recursion.outputs.index(name) for name in ("position", "position_std", "status")]
    process, memory, since, ok, samples = psutil.Process(), 0.0, 0.0, 0, 0
    for turn in range(int(hours * _HOUR / prepared.length) + 1):
        name, rows, true = _turn(prepared, since, rng)
        said = replay(sensor.recursion, rows, sensor.parameters, sensor._state)[:, place]
        seen[name] += 1
        ok, samples = ok + int(np.sum(said[:, 2] == 0)), samples + len(said)
        if (lasting := silent(said, true)) > LASTING:
            wrong.append(f"turn {turn}, {name}: ok and wrong for {lasting:.2f} s")
        since = float(rows[-1, 0]) + _PERIOD
        sensor = _again(sensor, file, rng, seen)
        memory = memory or process.memory_info().rss / 2**20
    grown = process.memory_info().rss / 2**20 - memory
    told = f"{samples} samples, ok in {ok / samples:.0%}, {grown:+.1f} MiB, {dict(sorted(seen.items()))}"
    if grown > _GROWN:
        wrong.append(f"memory has grown by {grown:.0f} MiB")
    return len(wrong), "\n".join([told, *wrong[:20]])


def main() -> None:
    """Print what comes of so many hours."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=240.0)
    parser.add_argument("--seed", type=int, default=1)
    asked, begun = parser.parse_args(), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        count, told = soak(asked.hours, asked.seed, Path(folder))
    print(f"{count} wrong in {asked.hours:g} h, {time.perf_counter() - begun:.0f} s\n{told}")
    raise SystemExit(min(count, 1))


if __name__ == "__main__":
    main()
