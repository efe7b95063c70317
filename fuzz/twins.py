"""Two encoders of two cylinders with the same numbers, killed at any moment: none comes back with a wrong position.

Each has a file of its own, reaches for the other's while that runs, and finds the two exchanged after the kill.
"""

from __future__ import annotations

import mmap
import os
import signal
import struct
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness import READ, REFUSED, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS, START, WORK_DAY, Judge

CASES = 200
_NAMES = ("left", "right")
_LONGEST = 1.5  # s until the kill; an encoder goes through a work day of 380 s in about as long
_COUNT = struct.Struct("<q")


@dataclass
class Prepared:
    """What the cases share."""

    judge: Judge  # with the sensor
    rows: list[tuple[float, float, float, float]]  # time, motor speed, motor torque and oil temperature of each sample


def prepare(_: Path) -> Prepared:
    """The work day of a boom."""
    judge = Judge(WORK_DAY)
    columns = (judge.log[name].values.tolist() for name in ("time", "motor_speed", "motor_torque", "oil_temperature"))
    return Prepared(judge, list(zip(*columns, strict=True)))


def _follow(prepared: Prepared, path: Path, name: str, seen: mmap.mmap) -> None:
    """Follow the machine as the encoder does, and note each sample before the sensor has it."""
    from ramsight.deploy.encoder.saving import Persistence, Saving

    sensor = prepared.judge.sensor
    saving = Saving(sensor, Persistence(path, sensor, instance=name))
    sensor.start(START, 1e-3)
    for k, (at, speed, torque, warmth) in enumerate(prepared.rows):
        seen[:8] = _COUNT.pack(k + 1)
        if saving.rests(at):
            saving.save(at)
        saving.begin()
        if saving.watch(at, speed, sensor.step(at, speed, torque, warmth)):
            saving.save(at)
    time.sleep(10.0)


def _start(prepared: Prepared, path: Path, name: str) -> tuple[int, mmap.mmap]:
    seen = mmap.mmap(-1, 8)
    process = os.fork()
    if process == 0:
        try:
            _follow(prepared, path, name, seen)
        finally:
            os._exit(0)
    return process, seen


def _check(prepared: Prepared, rng: Rng, folder: Path) -> tuple[str | Counter[str], str]:
    paths = [folder / f"{name}.state" for name in _NAMES]
    for path in paths:
        path.unlink(missing_ok=True)
    running = [_start(prepared, path, name) for path, name in zip(paths, _NAMES, strict=True)]
    try:
        while any(_COUNT.unpack(seen[:8])[0] == 0 for _, seen in running):
            time.sleep(1e-3)
        time.sleep(float(rng.uniform(0.0, _LONGEST)))
        wrong = next(filter(None, (_taken(prepared, path) for path in paths)), "")
    finally:
        for process, _ in running:
            os.kill(process, signal.SIGKILL)
        for process, _ in running:
            os.waitpid(process, 0)
    samples = [_COUNT.unpack(seen[:8])[0] - 1 for _, seen in running]
    outcomes = Counter[str]()
    for path, name, sample in zip(paths, _NAMES, samples, strict=True):
        outcome, found = _resumed(prepared, path, name, sample)
        outcomes[outcome] += 1
        wrong = wrong or found
    for path, name in zip(paths, reversed(_NAMES), strict=True):
        wrong = wrong or _exchanged(prepared, path, name)
    return (WRONG, wrong) if wrong else (outcomes, "")


def _taken(prepared: Prepared, path: Path) -> str:
    """What is wrong if another program gets a file that is followed; "" if it does not."""
    from ramsight.output import HeldError
    from ramsight.sensor.persistence import StateFile

    late: Any = StateFile(path, prepared.judge.sensor, "late")
    for use in (late.hold, late.save, late.resume):
        try:
            use()
        except HeldError:
            continue
        return f"{path.name}: {use.__name__} of another program"
    return ""


def _resumed(prepared: Prepared, path: Path, name: str, sample: int) -> tuple[str, str]:
    """What the file says after the kill, and what is wrong with that."""
    from ramsight.sensor.persistence import StateFile

    judge = prepared.judge
    StateFile(path, judge.sensor, name).resume()
    state = judge.sensor.state
    if state["position_known"] < 0.5:
        return REFUSED, ""
    error = abs(state["position"] - float(judge.true(prepared.rows[sample][0])))
    allowed = max(FARTHEST, SIGMAS * state["position_variance"] ** 0.5)
    return READ, "" if error <= allowed else f"{name} is {1e3 * error:.1f} mm off after sample {sample}"


def _exchanged(prepared: Prepared, path: Path, name: str) -> str:
    """What is wrong if the other cylinder takes the file; "" if it refuses."""
    from ramsight.sensor.persistence import StateError, StateFile

    try:
        resumed = StateFile(path, prepared.judge.sensor, name).resume()
    except StateError:
        return ""
    return f"{name} takes {path.name}" if resumed.found else ""


SECTIONS = [Section("twin state files", CASES, prepare, _check)]
