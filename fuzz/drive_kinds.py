"""How a faulty drive misbehaves on the bus: 39 kinds, ten draws each, through a whole encoder while the piston moves.

Once with a drive that tells nothing of itself, and once with one whose map names its noise and a sequence number, and
whose heartbeat is watched. The position may never be valid and wrong, but for the kinds of `LIMITS`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from bus import DRIVE, NODE
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS, WORK_DAY, Judge
from stale import played

DRAWS = 10
_PATIENCE = 300.0  # s, of a draw of all kinds
BEFORE, _LASTS, _AFTER = 8.0, 3.0, 3.0  # s
AROUND = 5.0 + _AFTER
"""For which frames are sent from the moment on at which they are wrong for the first time, at least [s]."""
_MOVES = 300  # 1/min
_PERIOD, _BEAT = 0.02, 0.1  # s, of reports and heartbeats
_MODULUS, _WATCHED = 256, 300  # numbers of a sequence; ms
_OPERATIONAL, _STOPPED, _BOOTS = 5, 4, 0
_HIGH, _TORQUES = 1 << 31, 1 << 15


@dataclass(frozen=True)
class Sent:
    """A frame of the drive: when [s], and what is in it; whole data in the place of that, and another identifier."""

    at: float
    speed: int = 0
    torque: int = 0
    number: int = 0
    data: bytes | None = None
    cob_id: int = 0x180 + DRIVE

    @property
    def packed(self) -> bytes:
        """Its data: speed [1/min], torque [per mille], number."""
        if self.data is not None:
            return self.data
        speed = (self.speed + _HIGH) % (2 * _HIGH) - _HIGH
        torque = (self.torque + _TORQUES) % (2 * _TORQUES) - _TORQUES
        parts = ((speed, 4), (torque, 2), (self.number % _MODULUS, 2))
        return b"".join(one.to_bytes(size, "little", signed=one < 0) for one, size in parts)


Frames = list[Sent]
Kind = Callable[[Frames, float, Rng], Iterable[Sent]]


def _changed(during: Callable[[Sent], Sent | None], lasts: float = _LASTS) -> Kind:
    """Each frame of so many seconds becomes another, or none."""

    def kind(frames: Frames, begin: float, _: Rng) -> Iterable[Sent]:
        for one in frames:
            found = during(one) if begin <= one.at < begin + lasts else one
            if found is not None:
                yield found

    return kind


def _held(lasts: float, *names: str) -> Kind:
    """Values stay what they were; all of a frame where none is named."""

    def kind(frames: Frames, begin: float, rng: Rng) -> Iterable[Sent]:
        last = [one for one in frames if one.at < begin][-1]
        old = {name: getattr(last, name) for name in names or ("speed", "torque", "number")}
        return _changed(lambda one: replace(one, **old), lasts)(frames, begin, rng)

    return kind


def _late(delay: float, *, repeats: bool = False, lasts: float = _LASTS) -> Kind:
    """Frames of some time ago; first a gap, or the last one once more."""

    def kind(frames: Frames, begin: float, _: Rng) -> Iterable[Sent]:
        last = [one for one in frames if one.at < begin][-1]
        for one in frames:
            if not begin <= one.at < begin + lasts:
                yield one
            elif one.at < begin + delay:
                if repeats:
                    yield replace(last, at=one.at)
            else:
                yield replace(
                    max((old for old in frames if old.at <= one.at - delay), key=lambda old: old.at), at=one.at
                )

    return kind


def _falling_behind(frames: Frames, begin: float, _: Rng) -> Iterable[Sent]:
    """Every frame a tenth of a period later than the one before it."""
    for one in frames:
        slow = begin + 1.1 * (one.at - begin) if begin <= one.at < begin + _LASTS else one.at
        if one.at < begin + _LASTS or one.at >= begin + 1.1 * _LASTS:
            yield replace(one, at=slow)


def _lost(share: float, lasts: float = _LASTS) -> Kind:
    def kind(frames: Frames, begin: float, rng: Rng) -> Iterable[Sent]:
        return _changed(lambda one: None if rng.random() < share else one, lasts)(frames, begin, rng)

    return kind


def _repeated(times: int) -> Kind:
    def kind(frames: Frames, begin: float, _: Rng) -> Iterable[Sent]:
        for one in frames:
            for k in range(times if begin <= one.at < begin + _LASTS else 1):
                yield replace(one, at=one.at + 1e-3 * k)

    return kind


def _burst(frames: Frames, begin: float, _: Rng) -> Iterable[Sent]:
    """Frames that wait for half a second and then come all at once."""
    end = begin + 0.5
    for k, one in enumerate(frames):
        yield replace(one, at=end + 1e-4 * (k % 100) * 0.1) if begin <= one.at < end else one


def _swapped(frames: Frames, begin: float, _: Rng) -> Iterable[Sent]:
    """Each pair in the other order."""
    found = list(frames)
    inside = [k for k, one in enumerate(found) if begin <= one.at < begin + _LASTS]
    for k in inside[:-1:2]:
        one, other = found[k], found[k + 1]
        found[k], found[k + 1] = replace(other, at=one.at), replace(one, at=other.at)
    return found


def _jittering(frames: Frames, begin: float, rng: Rng) -> Iterable[Sent]:
    return _changed(lambda one: replace(one, at=one.at + float(rng.uniform(0.0, 0.9 * _PERIOD))))(frames, begin, rng)


def _now_and_then(make: Callable[[Sent, Rng], Sent], share: float = 0.05) -> Kind:
    def kind(frames: Frames, begin: float, rng: Rng) -> Iterable[Sent]:
        return _changed(lambda one: make(one, rng) if rng.random() < share else one)(frames, begin, rng)

    return kind


def _reset(silent: float, zeros: float) -> Kind:
    """The drive is silent, boots, reports zeros, and counts from 0 again."""

    def kind(frames: Frames, begin: float, _: Rng) -> Iterable[Sent]:
        back = begin + silent
        yield Sent(back, data=bytes([_BOOTS]), cob_id=0x700 + DRIVE)
        k = 0
        for one in frames:
            if one.at < begin:
                yield one
            elif one.at >= back:
                k += 1
                yield replace(one, speed=0, torque=0, number=k) if one.at < back + zeros else replace(one, number=k)

    return kind


def _beats(frames: Frames, state: Callable[[float], int | None]) -> Iterable[Sent]:
    for at in np.arange(frames[0].at, frames[-1].at, _BEAT).tolist():
        said = state(at)
        if said is not None:
            yield Sent(at, data=bytes([said]), cob_id=0x700 + DRIVE)


def _more(make: Callable[[float, Rng], Sent], every: float) -> Kind:
    """Frames beside those of before."""

    def kind(frames: Frames, begin: float, rng: Rng) -> Iterable[Sent]:
        yield from frames
        for at in np.arange(begin, begin + _LASTS, every).tolist():
            yield make(at + 1e-3, rng)

    return kind


def _turned(value: int, size: int) -> int:
    """The bytes of a number the other way round."""
    return int.from_bytes((value % (1 << 8 * size)).to_bytes(size, "little"), "big")


KINDS: dict[str, Kind] = {
    "frozen for 1 s": _held(1.0),
    "frozen for 2 s": _held(2.0),
    "frozen for 5 s": _held(5.0),
    "frozen, its number goes on": _held(_LASTS, "speed", "torque"),
    "speed frozen": _held(_LASTS, "speed"),
    "torque frozen": _held(_LASTS, "torque"),
    "number stuck": _held(_LASTS, "number"),
    "zeros for 1 s": _changed(lambda one: replace(one, speed=0, torque=0, number=0), 1.0),
    "zeros for 3 s": _changed(lambda one: replace(one, speed=0, torque=0, number=0)),
    "zeros, its number goes on": _changed(lambda one: replace(one, speed=0, torque=0)),
    "speed of 0": _changed(lambda one: replace(one, speed=0)),
    "torque of 0": _changed(lambda one: replace(one, torque=0)),
    "late by 0.1 s after a gap": _late(0.1),
    "late by 0.1 s after repeats": _late(0.1, repeats=True),
    "late by 0.5 s after a gap": _late(0.5),
    "late by 0.5 s after repeats": _late(0.5, repeats=True),
    "falls behind": _falling_behind,
    "half of the frames lost": _lost(0.5),
    "nine of ten frames lost": _lost(0.9),
    "silent for 0.08 s": _lost(1.0, 0.08),
    "silent for 0.5 s": _lost(1.0, 0.5),
    "silent for 3 s": _lost(1.0),
    "frames of 0.5 s at once": _burst,
    "every frame twice": _repeated(2),
    "every frame three times": _repeated(3),
    "pairs swapped": _swapped,
    "jitter": _jittering,
    "bytes of the speed swapped": _changed(lambda one: replace(one, speed=_turned(one.speed, 4))),
    "bytes of the torque swapped": _changed(lambda one: replace(one, torque=_turned(one.torque, 2))),
    "sign of the speed": _changed(lambda one: replace(one, speed=-one.speed)),
    "bit of the speed stuck": _changed(lambda one: replace(one, speed=one.speed | 0x200)),
    "bit of the torque stuck": _changed(lambda one: replace(one, torque=one.torque | 0x100)),
    "spikes of the speed": _now_and_then(lambda one, rng: replace(one, speed=int(rng.integers(-3000, 3000)))),
    "frames by chance": _now_and_then(lambda one, rng: replace(one, data=rng.bytes(8))),
    "short frames": _now_and_then(lambda one, _: replace(one, data=one.packed[:4]), 0.5),
    "emergencies by the hundred": _more(lambda at, rng: Sent(at, data=rng.bytes(8), cob_id=0x080 + DRIVE), 0.01),
    "reset in operation": _reset(1.0, 0.5),
    "heartbeat missing": lambda frames, *_: frames,
    "heartbeat says stopped": lambda frames, *_: frames,
}
"""What a drive does wrong, by name, from some moment on; it is well again afterwards."""

LIMITS = {"speed of 0", "speed frozen", "bit of the speed stuck", "bit of the torque stuck"}
"""Kinds that can be valid and wrong, because the rest of the report is as it should be: SECURITY.md lists them."""


@dataclass
class Prepared:
    """What the draws share."""

    judge: Judge  # with the sensor
    # times, speeds [1/min] and torques [per mille] that the drive reports in a work day
    frames: list[tuple[float, int, int]]
    channel_map: Path  # of the drive
    tells: bool  # whether it tells something of itself
    wrong: Counter[str] = field(default_factory=Counter)  # how often each kind was valid and wrong
    farthest: dict[str, float] = field(default_factory=dict)  # the worst error of each then [m]
    tried: int = 0  # cases so far


def prepare(folder: Path, *, tells: bool) -> Prepared:
    """The work day of a boom, as its drive sends it."""
    judge = Judge(WORK_DAY)
    (folder / "drive.toml").write_text(map_of(tells=tells))
    return Prepared(judge, played(judge), folder / "drive.toml", tells)


def map_of(*, tells: bool) -> str:
    """The map of a drive that names what tells of it, or nothing."""
    noise, sequence = "", ""
    if tells:
        noise, sequence = ', noise = "0.5 N m"', f'sequence = {{channel = "2001h", modulus = {_MODULUS}}}'
    return f"""
speed = {{channel = "606Ch", unit = "1/min"}}
torque = {{channel = "6077h", rated = "80 N m"{noise}}}
temperature = {{constant = "45 degC"}}
{sequence}
[[can.pdo]]
cob_id = 0x{0x180 + DRIVE:X}
objects = ["606Ch", "6077h", "2001h UINT16"]
"""


def _state(name: str, begin: float, at: float) -> int | None:
    """What the heartbeat says."""
    wrong = begin <= at < begin + _LASTS
    if wrong and name == "heartbeat missing":
        return None
    if wrong and name == "heartbeat says stopped":
        return _STOPPED
    quiet = name in ("silent for 3 s", "reset in operation") and begin <= at < begin + 1.0
    return None if quiet else _OPERATIONAL


def sent(prepared: Prepared, name: str, begin: float, rng: Rng) -> Frames:
    """All that the drive sends around some moment, in the order of its times."""
    return sent_of(prepared.frames, name, begin, rng, tells=prepared.tells)


def sent_of(frames: list[tuple[float, int, int]], name: str, begin: float, rng: Rng, *, tells: bool) -> Frames:
    """The same of times, speeds and torques, with numbers or without."""
    first, last = begin - BEFORE, begin + AROUND
    whole = [
        Sent(at, speed, torque, k if tells else 0) for k, (at, speed, torque) in enumerate(frames) if first <= at < last
    ]
    beats = _beats(whole, partial(_state, name, begin))
    return sorted([*KINDS[name](whole, begin, rng), *beats], key=lambda one: one.at)


def follow(prepared: Prepared, name: str, begin: float, rng: Rng) -> tuple[float, float, float]:
    """The worst error while valid and wrong [m], its deviation [m] and when it was [s]; zeros if it never was."""
    from ramsight.deploy.encoder import Encoder, Listener, Settings
    from ramsight.logs.channel_map import load_map

    judge, frames = prepared.judge, sent(prepared, name, begin, rng)
    watched = {(0x1016, 1): DRIVE << 16 | _WATCHED} if prepared.tells else None
    encoder = Encoder(
        judge.sensor, judge.unit, Listener(load_map(prepared.channel_map)), Settings(NODE, DRIVE, 0, watched)
    )
    encoder.start(frames[0].at)
    judge.sensor.start(float(judge.true(frames[0].at)), 1e-3)
    return worst_of(encoder, frames, begin, judge.true)


def worst_of(
    encoder: Any, frames: Frames, begin: float, true: Callable[[float], Any], since: float = 0.0, ahead: float = 0.0
) -> tuple[float, float, float]:
    """The same of an encoder that goes on from where it is.

    Args:
        encoder: it.
        frames: that come.
        begin: when they are wrong for the first time [s].
        true: where the piston is at a time of the machine [m].
        since: by what the encoder's clock is ahead of that time [s].
        ahead: by what the time stamps are ahead of the encoder's clock [s].
    """
    from ramsight.deploy.encoder import Frame

    worst, before = (0.0, 0.0, 0.0), 0.0
    encoder.advance(since + frames[0].at)
    for one in frames:
        now = since + one.at
        while encoder.due <= now:
            due = encoder.due
            encoder.advance(due)
            worst = max(worst, _wrong(encoder, true, due - since, begin, before))
        encoder.receive(now, Frame(one.cob_id, one.packed, now + ahead))
        if one.at < begin:
            before = abs(encoder.position - float(true(one.at))) if encoder.valid else 0.0
        worst = max(worst, _wrong(encoder, true, one.at, begin, before))
    return worst


def _wrong(
    encoder: Any, true: Callable[[float], Any], at: float, begin: float, before: float
) -> tuple[float, float, float]:
    """How wrong a valid position is now, beyond what the sensor was off by before."""
    error = abs(encoder.position - float(true(at))) if encoder.valid and at >= begin else 0.0
    if error - before > FARTHEST and error > SIGMAS * encoder.std:
        return error, encoder.std, at - begin
    return 0.0, 0.0, 0.0


def begins(prepared: Prepared, rng: Rng) -> float:
    """A moment in motion."""
    first, last = prepared.frames[0][0] + BEFORE, prepared.frames[-1][0] - AROUND
    moving = [at for at, speed, _ in prepared.frames if abs(speed) > _MOVES and first < at < last]
    return moving[int(rng.integers(len(moving)))] - 0.5 * _PERIOD


def _check(prepared: Prepared, rng: Rng, _: Path) -> tuple[Counter[str], str]:
    outcomes, strange = Counter[str](), ""
    for name in KINDS:
        begin = begins(prepared, rng)
        error, std, at = follow(prepared, name, begin, rng)
        prepared.tried += 1
        prepared.wrong[name] += error > 0.0
        prepared.farthest[name] = max(error, prepared.farthest.get(name, 0.0))
        is_known = error == 0.0 or name in LIMITS
        outcomes[READ if is_known else WRONG] += 1
        if not is_known:
            strange += f"{name} at {begin:.2f} s: {1e3 * error:.1f} mm off, std {1e3 * std:.1f} mm, {at:.2f} s later; "
    counted = sorted((+prepared.wrong).items())
    found = ", ".join(f"{name} {count} ({1e3 * prepared.farthest[name]:.0f} mm off)" for name, count in counted)
    return outcomes, strange or f"{prepared.wrong.total()} of {prepared.tried} valid and wrong: {found or 'none'}"


SECTIONS = [
    Section(f"drive's node, {words}", DRAWS, partial(prepare, tells=tells), _check, patience=_PATIENCE, tells=True)
    for words, tells in (("plain", False), ("telling", True))
]
