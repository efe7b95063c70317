"""Damaged state files: power lost anywhere in a work day, slots torn and damaged; resumed, the log goes on."""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness import READ, REFUSED, WARNED, WRONG, Rng, Section
from judge import START, WORK_DAY, Judge
from slots import History, Pair

CASES = 20_000
_HEAD = 80  # bytes of a slot before its values
_TRACKED = 500  # samples, 10 s


@dataclass
class Prepared:
    """What the cases share."""

    judge: Judge  # with the sensor
    history: History  # of the file
    file: Any  # the state file


def prepare(folder: Path) -> Prepared:
    """Track the work day as the encoder does, and keep what its state file held."""
    from ramsight.sensor.persistence import StateFile

    judge = Judge(WORK_DAY)
    path = folder / "boom.state"
    contents, samples = _followed(judge, path)
    size = len(contents[-1]) // 2
    pairs = [(content[:size], content[size:]) for content in contents]
    return Prepared(judge, History(pairs, samples, _sealed), StateFile(path, judge.sensor))


def _followed(judge: Judge, path: Path) -> tuple[list[bytes], list[int]]:
    from ramsight.deploy.encoder.saving import Persistence, Saving

    sensor, log = judge.sensor, judge.log
    saving = Saving(sensor, Persistence(path, sensor))
    sensor.start(START, 1e-3)
    contents, samples = [path.read_bytes()], [-1]
    columns = (log[name].values.tolist() for name in ("time", "motor_speed", "motor_torque", "oil_temperature"))
    for k, (time, speed, torque, warmth) in enumerate(zip(*columns, strict=True)):
        if saving.rests(time):
            saving.save(time)
        saving.begin()
        if saving.watch(time, speed, sensor.step(time, speed, torque, warmth)):
            saving.save(time)
        if (content := path.read_bytes()) != contents[-1]:
            contents.append(content)
            samples.append(k)
    return contents, samples


def _sealed(slot: bytes, value: float, rng: Rng) -> bytes:
    content = bytearray(slot[:-32])
    place = _HEAD + 8 * int(rng.integers((len(content) - _HEAD) // 8))
    content[place : place + 8] = struct.pack("<d", value)
    return bytes(content) + hashlib.sha256(content).digest()


def _check(prepared: Prepared, rng: Rng, folder: Path) -> tuple[str, str]:
    from ramsight.sensor.persistence import StateError

    judge = prepared.judge
    sample, pair = chosen(prepared.history, judge.log.sizes["time"], rng)
    with prepared.file.path.open("r+b") as file:  # in place: a file made anew each time waits for the disk
        file.truncate(file.write(b"".join(pair)))
    try:
        resumed = prepared.file.resume()
    except StateError as error:
        text = str(error)
        if not text.startswith(str(prepared.file.path)) or len(text) > 1000 or len(text.splitlines()) > 1:
            raise
        return REFUSED, text
    if wrong := judge.silent(*judge.followed(sample, _TRACKED)):
        return WRONG, f"power lost at sample {sample}: {wrong}"
    return (WARNED if resumed.older else READ if resumed.found else REFUSED), ""


def chosen(history: History, count: int, rng: Rng) -> tuple[int, Pair]:
    """A sample after which the power goes, and what the slots hold then; four of five times they are damaged, too."""
    sample, write, pair = history.cut(count - 1, rng)
    if rng.random() < 0.8:
        pair = history.damaged(write, pair, rng)
    return sample, pair


SECTIONS = [Section("state file", CASES, prepare, _check)]
