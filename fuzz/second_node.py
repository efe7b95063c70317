"""A second node with the drive's identifier, babbling or lying: an alarm within 0.2 s, and nothing valid and wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bus import DRIVE, NODE
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS, WORK_DAY, Judge

CASES = 120
_RATED, _BEFORE, _LASTS, _AFTER, _TOLD = 80.0, 8.0, 3.0, 3.0, 0.2  # N m, s
_RATES = (10.0, 50.0, 200.0, 1000.0)  # Hz


@dataclass
class Prepared:
    """What the cases share."""

    judge: Judge  # with the sensor
    frames: list[tuple[float, bytes]]  # times and data of the drive's frames in a work day


def prepare(_: Path) -> Prepared:
    """The work day of a boom, as its drive sends it."""
    from ramsight.deploy.encoder.played_drive import PlayedDrive

    judge = Judge(WORK_DAY)
    sent = PlayedDrive(judge.log, DRIVE, _RATED, 7).frames()
    return Prepared(judge, [(float(at), frame.data) for at, frame in sent if frame.cob_id == 0x180 + DRIVE])


def _data(speed: float, torque: float) -> bytes:
    return round(speed).to_bytes(4, "little", signed=True) + round(1e3 * torque / _RATED).to_bytes(
        2, "little", signed=True
    )


def _lies(rng: Rng) -> Any:
    """What the other node makes of the drive's last frame."""
    kind, off = int(rng.integers(5)), float(rng.choice([-300.0, -100.0, 100.0, 300.0, 900.0]))

    def lie(last: bytes) -> bytes:
        speed, torque = int.from_bytes(last[:4], "little", signed=True), last[4:6]
        by_chance = _data(float(rng.uniform(-3000.0, 3000.0)), float(rng.uniform(-60.0, 60.0)))
        faster, heavier = _data(speed + off, 0.0)[:4] + torque, last[:4] + _data(0.0, 40.0)[4:]
        whole = (faster, _data(1000.0 + off, 20.0), _data(0.0, 0.0), heavier, by_chance)
        return whole[kind]

    return lie


def _check(prepared: Prepared, rng: Rng, _: Path) -> tuple[str, str]:
    from ramsight.deploy.encoder import Encoder, Frame, Listener, Settings
    from ramsight.deploy.encoder.alarms import Fault
    from ramsight.deploy.encoder.listening import drive_map

    judge, times = prepared.judge, [at for at, _ in prepared.frames]
    begin = float(rng.uniform(_BEFORE, times[-1] - _LASTS - _AFTER))
    here = [one for one in prepared.frames if begin - _BEFORE <= one[0] <= begin + _LASTS + _AFTER]
    period, lie = 1.0 / float(rng.choice(_RATES)), _lies(rng)
    others = [(begin + period * k + float(rng.uniform(0.0, 1e-3)), b"") for k in range(int(_LASTS / period))]
    declared = {(0x2004, 0): 200} if rng.random() < 0.5 else None
    encoder = Encoder(
        judge.sensor, judge.unit, Listener(drive_map(DRIVE, rated_torque=_RATED)), Settings(NODE, DRIVE, 0, declared)
    )
    encoder.start(here[0][0])
    judge.sensor.start(float(judge.true(here[0][0])), 1e-3)
    encoder._listener.write_temperature(40.0, here[0][0])
    told, last, before = math.inf, here[0][1], 0.0
    for at, data in sorted([*here, *others]):
        last = data or last
        encoder.receive(at, Frame(0x180 + DRIVE, data or lie(last), at))
        if Fault.SECOND_NODE in encoder.faults:
            told = min(told, at - begin)
        error = abs(encoder.position - float(judge.true(at))) if encoder.valid else 0.0
        if at < begin:  # what a sensor that begins in the middle of a day is off by is no lie
            before = error
        elif error - before > FARTHEST and error > SIGMAS * encoder.std:
            return WRONG, f"{1e3 * error:.1f} mm off and valid at {at:.3f} s"
    if not 0.0 <= told <= _TOLD:
        return WRONG, f"told {told:.3f} s after it began at {begin:.3f} s, every {1e3 * period:g} ms"
    return READ, f"{told:.3f} s"


SECTIONS = [Section("second node", CASES, prepare, _check)]
