"""Hostile frames and SDO writes against the encoder while the machine runs: a run of some seconds is a case.

Frames of others must not move the position at all, so it is compared with that of an encoder alone
with the drive; where a preset was taken, with the truth.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

from bus import Bus, Prepared, prepare
from frames import NODE, OPERATE, drive_or_any, others_frame, request
from harness import READ, REFUSED, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS

_RUN = 250  # samples of the drive, 5 s, and as many hostile frames
_STEP = 1e-5  # m
_MOVED = 1e-6  # m; less is the rounding of clocks
_FAULT = 0x7FFF_FFFF
_TIMEOUT = 0.1  # s
_TAKEN, _DISPUTED = bytes.fromhex("60036000"), bytes.fromhex("8003600022000008")
"""Answers to a preset that the sensor has seen; one that it refuses is known to it, too, and its position invalid."""
Found = tuple["str | Counter[str]", str]


def _run(prepared: Prepared, rng: Rng, frame_of: Callable[[Rng, float], Any]) -> Iterator[tuple[Bus, int, Any, Any]]:
    """The drive's and hostile frames in turn: the bus, the sample, the hostile frame, and what was answered to it."""
    first = int(rng.integers(len(prepared.frames) - _RUN))
    bus = Bus(prepared, first)
    for k in range(first, first + _RUN):
        bus.sample(k)
        at = bus.now + float(rng.choice([0.0, 1e-4, 1e-3, 1e-2]))
        frame = frame_of(rng, at)
        yield bus, k, frame, bus.put(at, frame)
        if rng.random() < 0.1:
            bus.send(0, OPERATE)


def _others(prepared: Prepared, rng: Rng, _: Path) -> Found:
    """Frames of others: nothing moves but by a preset, no parameter changes while the machine runs."""
    seen, known, preset = Counter[str](), None, False
    for bus, k, frame, answers in _run(prepared, rng, others_frame):
        preset |= any(one.data[:4] == _TAKEN or one.data == _DISPUTED for one in answers)
        moved = abs(bus.sensor.state["position"] - prepared.states[k]["position"])
        if not preset and moved > _MOVED:
            return Counter([WRONG]), f"sample {k}: the position is {1e3 * moved:.6f} mm off after {frame}"
        if wrong := _wrong(bus, k):
            return Counter([WRONG]), f"sample {k}, after {frame}: {wrong}"
        now = bus.parameters() if bus.is_running else None
        if known is not None and now is not None and now != known:
            return Counter([WRONG]), f"sample {k}: a parameter is another one after {frame}"
        known = now
        seen[REFUSED if not answers or any(one.data[:1] == b"\x80" for one in answers) else READ] += 1
    return seen, ""


def _wrong(bus: Bus, sample: int) -> str:
    """What is wrong with a position that is said to be valid; "" if nothing is."""
    encoder = bus.encoder
    if not encoder.valid:
        return ""
    error = abs(encoder.position - bus.prepared.true[sample])
    if math.isfinite(error) and (error <= FARTHEST or error <= SIGMAS * encoder.std):
        return ""
    return f"{1e3 * error:.1f} mm off and valid, standard deviation {1e3 * encoder.std:.2f} mm"


def _drive(prepared: Prepared, rng: Rng, _: Path) -> Found:
    """Frames with the drive's identifier too: whatever they say, the position goes no faster than a piston."""
    unit = prepared.judge.unit
    fastest = 1.1 * unit.max_speed * unit.travel_per_radian
    *_rest, (bus, _k, _frame, _answers) = _run(prepared, rng, drive_or_any)
    sent = [(at, int.from_bytes(one.data, "little", signed=True)) for at, one in bus.sent if one.cob_id == 0x180 + NODE]
    for (t0, p0), (t1, p1) in pairwise(sent):
        moved = _STEP * abs(p1 - p0)
        if _FAULT not in (p0, p1) and moved > fastest * (t1 - t0 + _TIMEOUT) + 2 * _STEP:
            return Counter([WRONG]), f"at {t1:.3f} s it jumps by {1e3 * moved:.1f} mm"
    return Counter({READ: _RUN}), ""


def _writes(prepared: Prepared, rng: Rng, folder: Path) -> Found:
    """SDO requests: each is answered once, what was taken can be read back, nothing changes while the machine runs."""
    state = folder / "boom.state"
    for left in folder.glob("boom.state*"):
        left.unlink()
    first = int(rng.integers(len(prepared.frames) - _RUN))
    bus, seen = Bus(prepared, first, state), Counter[str]()
    for k in range(first, first + _RUN):
        bus.sample(k)
        if rng.random() < 0.2:
            bus.send(0, bytes([int(rng.choice([1, 1, 128, 2, 129, 130])), NODE]))
        data = request(rng)
        outcome, wrong = _written(bus, data)
        if wrong := wrong or _wrong(bus, k):
            return Counter([WRONG]), f"sample {k}, after {data.hex()}: {wrong}"
        seen[outcome] += 1
    bus.send(0, bytes([129, NODE]))
    if not any(one.data[:4] == bytes.fromhex("43001000") for one in bus.ask(bytes.fromhex("4000100000000000"))):
        return Counter([WRONG]), "it does not say what it is after a reset"
    return seen, ""


def _written(bus: Bus, data: bytes) -> tuple[str, str]:
    """What became of a request, and what is wrong with that."""
    before = bus.parameters()
    answers = bus.ask(data)
    taken = data[0] >> 5 == 1 and any(one.data[:1] == b"\x60" for one in answers)
    if len(answers) != int(bus.serves and data[0] >> 5 != 4) or any(len(one.data) != 8 for one in answers):
        return WRONG, f"{len(answers)} answers"
    if bus.is_running and bus.parameters() != before:
        return WRONG, "a parameter is another one while the machine runs"
    if taken and data[0] & 0x02 and (wrong := _kept(bus, data)):
        return WRONG, wrong
    return (REFUSED if not answers or answers[0].data[0] == 0x80 else READ), ""


def _kept(bus: Bus, data: bytes) -> str:
    """Whether a parameter that was taken is what was written."""
    from ramsight.deploy.encoder.objects import BITS, ENTRIES, STORED

    key = (int.from_bytes(data[1:3], "little"), data[3])
    if key not in STORED:
        return ""
    size = BITS[ENTRIES[key].type] // 8
    (answer,) = bus.ask(b"\x40" + data[1:4] + bytes(4))
    return "" if answer.data[4 : 4 + size] == data[4 : 4 + size] else f"it reads {answer.data.hex()}"


SECTIONS = [
    Section("frames of others", 400, prepare, _others),
    Section("frames of the drive", 160, prepare, _drive),
    Section("SDO writes", 300, prepare, _writes),
]
