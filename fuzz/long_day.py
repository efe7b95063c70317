"""A sensor that is not restarted for a day: 24 h sample by sample, and memory and position stay what they are.

A work day of minutes is played over and over from one visit to the upper end to another, so that the piston is where it
was each time.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS, WORK_DAY, Judge

_DAY = 86_400.0  # s
_SAME = 1e-5  # m
_GROWN = 20.0  # MiB


@dataclass
class Prepared:
    """What is played."""

    judge: Judge  # with the sensor
    # time from the visit on, motor speed, motor torque and oil temperature of each sample
    rows: list[tuple[float, float, float, float]]
    true: list[float]  # position at each of them [m]
    length: float  # of all of them [s]


def prepare(_: Path) -> Prepared:
    """The work day between its first and its last rest at the upper end."""
    judge = Judge(WORK_DAY)
    time_, *columns = (judge.log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature"))
    true = judge.true(time_)
    first = int(np.flatnonzero((columns[0] == 0.0) & (np.abs(true - true[-1]) < _SAME))[0])
    chosen = slice(first, len(time_) - 1)
    rows = list(zip(*((one[chosen]).tolist() for one in (time_ - time_[first], *columns)), strict=True))
    return Prepared(judge, rows, true[chosen].tolist(), float(time_[-1] - time_[first]))


def _check(prepared: Prepared, _: Rng, __: Path) -> tuple[str, str]:
    sensor, worst = prepared.judge.sensor, 0.0
    sensor.start(prepared.true[0], 1e-3)
    process, memory, samples, begun = psutil.Process(), 0.0, 0, time.perf_counter()
    for turn in range(int(_DAY / prepared.length) + 1):
        since = turn * prepared.length
        for (at, speed, torque, warmth), true in zip(prepared.rows, prepared.true, strict=True):
            said = sensor.step(since + at, speed, torque, warmth)
            error = abs(said.position - true)
            if said.status == 0 and error > FARTHEST and error > SIGMAS * said.position_std:
                return WRONG, f"{1e3 * error:.1f} mm off and ok after {since + at:.2f} s"
            worst = max(worst, error if said.status == 0 else 0.0)
        samples += len(prepared.rows)
        memory = memory or process.memory_info().rss / 2**20
    grown = process.memory_info().rss / 2**20 - memory
    each = 1e6 * (time.perf_counter() - begun) / samples
    detail = f"{samples} samples, {each:.1f} us each, at most {1e3 * worst:.2f} mm off, {grown:+.1f} MiB"
    return (READ if grown < _GROWN else WRONG), detail


def main() -> None:
    """Print what comes of a day."""
    print(_check(prepare(Path()), np.random.default_rng(1), Path()))


SECTIONS: list[Any] = [Section("24 h without a restart", 1, prepare, _check, 3600.0, tells=True)]

if __name__ == "__main__":
    main()
