"""A drive whose frames freeze, are zero or come half a second late: an alarm in 0.2 s, nothing valid and wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bus import DRIVE, NODE
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS, WORK_DAY, Judge

CASES = 240
_RATED, _BEFORE, _LASTS, _AFTER, _TOLD, _LATE, _MOVES = 80.0, 8.0, 3.0, 3.0, 0.2, 0.5, 30.0  # N m, s, rad/s
_LEARNED = 0.4  # s; of repeats that are learned
_ENABLED, _MODULUS = 0x0637, 256

TELLING = {
    "nothing": ("frozen", "zero", "late after frozen"),
    "noise": ("frozen", "zero", "late after frozen"),
    "sequence": ("frozen", "zero", "late after frozen", "late"),
    "SYNC": ("frozen", "zero", "late after frozen", "late"),
    "toggle": ("frozen", "zero", "late after frozen"),
    "state": ("zero",),
}
"""What tells, and the faults that it tells; where nothing is declared, how often whole reports repeat is learned."""


@dataclass
class Prepared:
    """What the cases share."""

    judge: Judge  # with the sensor
    # times, speeds [1/min] and torques [per mille] that the drive reports in a work day
    frames: list[tuple[float, int, int]]
    maps: dict[str, Path]  # of what tells


def prepare(folder: Path) -> Prepared:
    """The work day of a boom, as its drive sends it, and a map for each thing that tells."""
    judge = Judge(WORK_DAY)
    maps = {name: folder / f"{name}.toml" for name in TELLING}
    for name, path in maps.items():
        path.write_text(map_of(name))
    return Prepared(judge, played(judge), maps)


def played(judge: Judge) -> list[tuple[float, int, int]]:
    """Times [s], speeds [1/min] and torques [per mille] of what the drive reports in the judge's log."""
    from ramsight.deploy.encoder.played_drive import PlayedDrive

    frames = []
    for at, frame in PlayedDrive(judge.log, DRIVE, _RATED, 7).frames():
        if frame.cob_id == 0x180 + DRIVE:
            speed, torque = (int.from_bytes(one, "little", signed=True) for one in (frame.data[:4], frame.data[4:6]))
            frames.append((float(at), speed, torque))
    return frames


def map_of(telling: str) -> str:
    """The map of a drive with one thing that tells."""
    counted = 'sequence = {{channel = "2001h", modulus = {}{}}}'
    further = {
        "sequence": counted.format(_MODULUS, ""),
        "SYNC": counted.format(240, ', counts = "sync"'),
        "toggle": counted.format(2, ""),
        "state": 'state = {channel = "6041h"}',
    }
    return f"""
speed = {{channel = "606Ch", unit = "1/min"}}
torque = {{channel = "6077h", rated = "80 N m"{', noise = "0.5 N m"' if telling == "noise" else ""}}}
temperature = {{constant = "40 degC"}}
{further.get(telling, "")}
[[can.pdo]]
cob_id = 0x{0x180 + DRIVE:X}
objects = ["606Ch", "6077h", "{"6041h" if telling == "state" else "2001h UINT16"}"]
"""


def _number(telling: str, k: int) -> int:
    return {"sequence": k % _MODULUS, "SYNC": k % 240, "toggle": k % 2, "state": _ENABLED}.get(telling, 0)


def sent(prepared: Prepared, telling: str, fault: str, begin: float, first: float, last: float) -> list[Any]:
    """Frames of the drive [s, bytes] from one time to another, with a fault that begins at some time."""
    times = np.array([at for at, _, _ in prepared.frames])
    frames = []
    for k in range(int(np.searchsorted(times, first)), int(np.searchsorted(times, last))):
        at, (_, speed, torque), number = float(times[k]), prepared.frames[k], _number(telling, k)
        wrong = begin <= at < begin + _LASTS
        held = wrong and (fault == "frozen" or (fault == "late after frozen" and at < begin + _LATE))
        if wrong and fault == "late" and at < begin + _LATE:
            continue
        if held or (wrong and "late" in fault):
            old = int(np.searchsorted(times, begin if held else at - _LATE)) - 1
            (_, speed, torque), number = prepared.frames[old], _number(telling, old)
        if wrong and fault == "zero":
            speed = torque = number = 0
        frames.append((at, _packed(speed, torque, number), k))
    return frames


def _packed(speed: int, torque: int, number: int) -> bytes:
    parts = ((speed, 4), (torque, 2), (number, 2))
    return b"".join(one.to_bytes(size, "little", signed=one < 0) for one, size in parts)


def follow(prepared: Prepared, telling: str, fault: str, begin: float) -> tuple[float, float, float, float]:
    """When the fault is told [s], and the worst error while valid [m], its deviation [m] and time [s]."""
    from ramsight.deploy.encoder import Encoder, Frame, Listener, Settings
    from ramsight.deploy.encoder.alarms import alarms
    from ramsight.logs.channel_map import load_map

    judge, first, last = prepared.judge, begin - _BEFORE, begin + _LASTS + _AFTER
    frames = sent(prepared, telling, fault, begin, first, last)
    encoder = Encoder(judge.sensor, judge.unit, Listener(load_map(prepared.maps[telling])), Settings(NODE, DRIVE, 0))
    encoder.start(frames[0][0])
    judge.sensor.start(float(judge.true(frames[0][0])), 1e-3)
    told, before, worst = math.inf, 0.0, (0.0, 0.0, 0.0)
    for at, data, k in frames:
        while encoder.due <= at:  # a silence is told when it is due, not with the next frame
            due = encoder.due
            encoder.advance(due)
            if alarms(encoder.faults) and due >= begin:
                told = min(told, due - begin)
        if telling == "SYNC":
            encoder.receive(at, Frame(0x080, bytes([k % 240]), at))
        encoder.receive(at, Frame(0x180 + DRIVE, data, at))
        if alarms(encoder.faults) and at >= begin:
            told = min(told, at - begin)
        error = abs(encoder.position - float(judge.true(at))) if encoder.valid else 0.0
        if at < begin:
            before = error
        elif error - before > FARTHEST and error > SIGMAS * encoder.std and error > worst[0]:
            worst = error, encoder.std, at - begin
    return told, *worst


def _check(prepared: Prepared, rng: Rng, _: Path) -> tuple[str, str]:
    pairs = [(telling, fault) for telling, faults in TELLING.items() for fault in faults]
    telling, fault = pairs[int(rng.integers(len(pairs)))]
    moving = [
        at for at, speed, _ in prepared.frames if telling not in ("state", "nothing") or abs(speed) > 10.0 * _MOVES
    ]
    inside = [at for at in moving if prepared.frames[0][0] + _BEFORE < at < prepared.frames[-1][0] - _LASTS - _AFTER]
    begin = inside[int(rng.integers(len(inside)))] - 0.01
    told, error, std, at = follow(prepared, telling, fault, begin)
    case = f"{telling}, {fault} at {begin:.2f} s"
    if error:
        return WRONG, f"{case}: {1e3 * error:.1f} mm off, std {1e3 * std:.1f} mm, and valid {at:.3f} s later"
    most = _LEARNED if telling == "nothing" and fault != "zero" else _TOLD
    return (READ, f"{told:.3f} s") if told <= most else (WRONG, f"{case}: told after {told:.3f} s")


SECTIONS = [Section("frozen, zero or late drive", CASES, prepare, _check)]
