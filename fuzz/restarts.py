"""The process of an encoder that is killed on a busy bus and begun again: it never comes back with a wrong position.

The drive plays a work day in real time, 500 frames of others a second go between. The machine stands while nobody says
where it is, as one whose controller misses the encoder.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from frames import DRIVE, NODE, OPERATE, WARM, has_bus
from harness import READ, REFUSED, WRONG, Rng, Section
from judge import FARTHEST, WORK_DAY, Judge

CASES = 10
_GROUP, _RATED, _FAULT, _STEP = "239.74.163.3", 80.0, 0x7FFFFFFF, 1e-5
_OTHERS = 10  # frames of others between two samples of the drive
_BOOTS, _LASTS = 150.0, (1.0, 8.0)  # s; until a process serves, and how long it runs until it is killed
_BEHIND = 0.03  # s, from a sample to the frame that says it, and the piston's way in that time is no error
_FASTEST = 0.3  # m/s


@dataclass
class Prepared:
    """What the cases share."""

    judge: Judge  # with the log and the truth
    frames: list[tuple[float, Any]]  # times and frames of drive and thermometer
    bus: Any  # to talk with the encoder
    map: Path  # the channel map's file


def prepare(folder: Path) -> Prepared:
    """A bus of datagrams, and the work day of a boom."""
    import can
    from ramsight.deploy.encoder.played_drive import PlayedDrive, played_map

    judge = Judge(WORK_DAY)
    (folder / "map.toml").write_text(played_map(DRIVE, WARM, _RATED))
    frames = [(float(at), frame) for at, frame in PlayedDrive(judge.log, DRIVE, _RATED, warm_node=WARM).frames()]
    return Prepared(judge, frames, can.Bus(interface="udp_multicast", channel=_GROUP), folder / "map.toml")


class _Machine:
    """Drive, thermometer, a controller that starts the node, and others; what the encoder says meanwhile."""

    def __init__(self, prepared: Prepared, rng: Rng, begin: float) -> None:
        self._prepared, self._rng, self.at = prepared, rng, begin
        self._next = next(k for k, (at, _) in enumerate(prepared.frames) if at >= begin)
        self.said: float | None = None
        self.heard = -1.0

    def go(self, seconds: float, *, moves: bool) -> float:
        """Let time pass; the worst that was said [m] of where the piston is not."""
        worst, until, tick = 0.0, time.monotonic() + seconds, time.monotonic()
        while (now := time.monotonic()) < until:
            self._send(moves=moves)
            tick += 0.02
            while (left := tick - time.monotonic()) > 0.0:
                worst = max(worst, self._hear(left))
            tick = max(tick, now)
        return worst

    def _send(self, *, moves: bool) -> None:
        from ramsight.deploy.encoder.runner import message_of

        if moves:
            self.at += 0.02
        sent = [frame for at, frame in self._prepared.frames[self._next : self._next + 5] if at <= self.at + 1e-9]
        self._next += len(sent) if moves else 0
        if not moves:  # it stands where it is, under its load
            sent = [frame for frame in sent if frame.cob_id != 0x180 + DRIVE] + [self._standing()]
        for frame in [*sent, *self._others()]:
            self._put(message_of(frame))

    def _standing(self) -> Any:
        from ramsight.deploy.encoder import Frame

        (last,) = [f for at, f in self._prepared.frames[: self._next] if f.cob_id == 0x180 + DRIVE][-1:]
        return Frame(last.cob_id, bytes(4) + last.data[4:])

    def _others(self) -> list[Any]:
        from ramsight.deploy.encoder import Frame

        rng = self._rng
        identifiers = rng.choice([0x80, 0x1FF, 0x300, 0x581, 0x605, 0x701, 0x7E5], _OTHERS)
        frames = [Frame(int(one), rng.bytes(int(rng.integers(9)))) for one in identifiers]
        return [*frames, Frame(0, OPERATE)] if rng.random() < 0.05 else frames

    def _put(self, message: Any) -> None:
        import can

        with contextlib.suppress(can.CanError):
            self._prepared.bus.send(message)

    def _hear(self, seconds: float) -> float:
        message = self._prepared.bus.recv(seconds)
        if message is None or message.arbitration_id not in (0x180 + NODE, 0x700 + NODE):
            return 0.0
        self.heard = time.monotonic()
        if message.arbitration_id != 0x180 + NODE:
            return 0.0
        steps = int.from_bytes(message.data, "little", signed=True)
        self.said = None if steps == _FAULT else _STEP * steps
        return 0.0 if self.said is None else abs(self.said - float(self._prepared.judge.true(self.at)))

    def preset(self) -> None:
        """Tell the encoder where the piston is."""
        import can

        steps = round(float(self._prepared.judge.true(self.at)) / _STEP)
        data = bytes.fromhex("23036000") + steps.to_bytes(4, "little")
        self._put(can.Message(arbitration_id=0x600 + NODE, data=data, is_extended_id=False))


def _begin(prepared: Prepared, state: Path) -> subprocess.Popen[bytes]:
    words = ["encoder", "mining-loader", "--unit", "boom", "--interface", "udp_multicast", "--channel", _GROUP]
    words += ["--node-id", str(NODE), "--drive-node", str(DRIVE), "--map", str(prepared.map), "--state", str(state)]
    return subprocess.Popen([sys.executable, "-m", "ramsight", *words], stdout=subprocess.DEVNULL)


def _check(prepared: Prepared, rng: Rng, folder: Path) -> tuple[str | Counter[str], str]:
    for old in folder.glob("boom.state*"):
        old.unlink()
    machine, found = _Machine(prepared, rng, float(rng.uniform(20.0, 250.0))), Counter[str]()
    for life in range(3):
        process = _begin(prepared, folder / "boom.state")
        try:
            worst = _lives(machine, rng, first=life == 0)
            found[READ if machine.said is not None else REFUSED] += 1
        finally:
            process.kill()
            process.wait()
        if worst > FARTHEST + _FASTEST * _BEHIND:
            return WRONG, f"life {life}, at {machine.at:.2f} s: {1e3 * worst:.1f} mm off and valid"
        machine.said = None
    return found, ""


def _lives(machine: _Machine, rng: Rng, *, first: bool) -> float:
    """A life of the process, until it is killed; the worst error while valid [m]."""
    begun, machine.heard = time.monotonic(), -1.0
    worst = 0.0
    while machine.heard < begun:
        worst = max(worst, machine.go(0.2, moves=False))
        if time.monotonic() - begun > _BOOTS:
            raise TimeoutError("the encoder does not boot")
    worst = max(worst, machine.go(0.5, moves=False))
    if first:
        machine.preset()
    return max(worst, machine.go(0.5, moves=False), machine.go(float(rng.uniform(*_LASTS)), moves=True))


SECTIONS = [Section("restart on a busy bus", CASES, prepare, _check, 600.0)] if has_bus(_GROUP) else []
