"""A bus that misbehaves around an encoder: storms of NMT commands, LSS, a bus that goes off, clocks that are set.

The drive goes on as it was, so the position must never be valid and wrong. Commands and LSS must not move it at all.
A J1939 message goes beside it and must say the same.
"""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bus import Bus, Prepared, prepare
from frames import DRIVE, NODE, OPERATE, WARM
from harness import READ, WRONG, Rng, Section
from judge import FARTHEST, SIGMAS

_RUN = 500  # samples of the drive, 10 s
_STORMY = 100  # of them in a storm
_MOVED = 1e-6  # m
_STORM = 40  # frames between two samples of the drive: 2000 a second, what 250 kbit/s carry
_COMMANDS = (1, 2, 128, 129, 130)
_LSS = 0x7E5, 0x7E4
_LSS_COMMANDS = (4, 17, 19, 21, 23, 64, 65, 66, 67, 70, 71, 72, 73, 74, 75, 76, 81, 90, 91, 92, 93, 94)
_WRAPS = 2**32 * 1e-6  # s, after which a counter of microseconds begins again
_FORWARD = 0.02  # s; by less than that a clock that is set forward costs nothing
_TIMEOUT, _PERIOD = 0.1, 0.02  # s, of the drive's silence and of the J1939 message
_NO_POSITION = 0xFAFF
Found = tuple["str | Counter[str]", str]


def _begun(prepared: Prepared, rng: Rng) -> tuple[Bus, int]:
    first = int(rng.integers(len(prepared.frames) - _RUN))
    return Bus(prepared, first), first


def _wrong(bus: Bus, sample: int, before: float = 0.0) -> str:
    """What is wrong with a position that is said to be valid; "" if nothing is."""
    encoder = bus.encoder
    if not encoder.valid:
        return ""
    error = abs(encoder.position - bus.prepared.true[sample])
    if math.isfinite(error) and (error - before <= FARTHEST or error <= SIGMAS * encoder.std):
        return ""
    return f"{1e3 * error:.1f} mm off and valid, standard deviation {1e3 * encoder.std:.2f} mm"


def _unmoved(bus: Bus, sample: int) -> str:
    moved = abs(bus.sensor.state["position"] - bus.prepared.states[sample]["position"])
    return f"moved by {1e3 * moved:.4f} mm" if moved > _MOVED else ""


def _storm(prepared: Prepared, rng: Rng, _: Path) -> Found:
    """NMT commands by the thousand: each reset boots once, nothing moves, and it runs when it is told to."""
    bus, first = _begun(prepared, rng)
    for k in range(first, first + _STORMY):
        bus.sample(k)
        resets, before = 0, len(bus.sent)
        for command in rng.choice(_COMMANDS, _STORM):
            bus.send(0, bytes([int(command), int(rng.choice([0, NODE]))]))
            resets += int(command) in (129, 130)
        booted = sum(frame.cob_id == 0x700 + NODE and frame.data == b"\0" for _, frame in bus.sent[before:])
        if booted != resets:
            return WRONG, f"sample {k}: {booted} boot-up messages after {resets} resets"
        if wrong := _unmoved(bus, k) or _wrong(bus, k):
            return WRONG, f"sample {k}: {wrong}"
    bus.send(0, OPERATE)
    return (Counter({READ: _STORMY * _STORM}), "") if bus.is_running else (WRONG, "it does not run")


def _lss(prepared: Prepared, rng: Rng, _: Path) -> Found:
    """Every LSS command: none is answered, and it stays who it is."""
    bus, first = _begun(prepared, rng)
    for k in range(first, first + _STORMY):
        bus.sample(k)
        for command in rng.choice(_LSS_COMMANDS, _STORM // 4):
            if bus.send(int(rng.choice(_LSS)), bytes([int(command)]) + rng.bytes(int(rng.integers(8)))):
                return WRONG, f"sample {k}: LSS command {command} is answered"
        if wrong := _unmoved(bus, k) or _wrong(bus, k):
            return WRONG, f"sample {k}: {wrong}"
    identity = bus.ask(bytes.fromhex("4018100100000000"))
    return (Counter({READ: _STORMY * _STORM // 4}), "") if identity else (WRONG, "it does not answer at its node-ID")


def _off(prepared: Prepared, rng: Rng, _: Path) -> Found:
    """A bus that goes off for up to some seconds, again and again: silence is told in time, and is no position."""
    bus, first = _begun(prepared, rng)
    ends, last, before = -math.inf, bus.now, 0.0
    for k in range(first, first + _RUN):
        at = prepared.frames[k][-1].time
        if at > ends + 1.0 and rng.random() < 0.02:
            ends = at + float(rng.choice([0.05, 0.2, 1.0, 3.0]))
        if at < ends:
            while bus.encoder.due <= at:
                bus.now = max(bus.now, bus.encoder.due)
                bus.encoder.advance(bus.now)
            if bus.encoder.valid and at - last > _TIMEOUT + 2 * _PERIOD:
                return WRONG, f"sample {k}: valid {at - last:.2f} s after the last frame"
            continue
        bus.sample(k)
        last = at
        if wrong := _wrong(bus, k, before):
            return WRONG, f"sample {k}: {wrong}"
        before = abs(bus.encoder.position - prepared.true[k]) if bus.encoder.valid and at > ends + 1.0 else before
    return Counter({READ: _RUN}), ""


def _stamps(prepared: Prepared, rng: Rng, first: int) -> Iterator[tuple[int, list[Any]]]:
    """The frames of each sample, stamped by a clock that is set, slewed, or begins again at zero."""
    kind, offset, rate, begins = int(rng.integers(4)), 0.0, 0.0, prepared.frames[first][-1].time
    wrap = begins + float(rng.uniform(0.0, 10.0))
    for k in range(first, first + _RUN):
        at = prepared.frames[k][-1].time
        if kind == 0 and rng.random() < 0.01:  # set by a step, as after a start without a network
            offset += float(rng.choice([-1.0, 1.0])) * float(10.0 ** rng.uniform(-3.0, 5.0))
        if kind == 1 and rng.random() < 0.05:  # set to and fro by a bad server
            offset = 0.0 if offset else float(rng.choice([-1.0, 1.0])) * float(rng.uniform(0.01, 2.0))
        if kind == 2 and rng.random() < 0.02:  # slewed, at most as fast as NTP does
            rate = float(rng.choice([-5e-4, 0.0, 5e-4]))
        if kind == 3:
            offset = -_WRAPS if at > wrap else 0.0
        offset += 0.02 * rate
        yield k, [(one, one.time + offset) for one in prepared.frames[k]]


def _set(prepared: Prepared, rng: Rng, _: Path) -> Found:
    """Clocks that are set while the machine moves; one that is set forward may also be a computer that slept."""
    from ramsight.deploy.encoder import Frame

    bus, first = _begun(prepared, rng)
    valid, before, forward = 0, 0.0, 0.0
    for k, frames in _stamps(prepared, rng, first):
        for frame, stamp in frames:
            bus.put(frame.time, Frame(frame.cob_id, frame.data, stamp))
            forward, before = max(forward, stamp - frame.time - before), stamp - frame.time
        if wrong := _wrong(bus, k):
            return WRONG, f"sample {k}: {wrong}"
        valid += bus.encoder.valid
    if valid <= 0.9 * _RUN and forward < _FORWARD:
        return WRONG, f"valid in {valid} of {_RUN} samples only"
    return Counter({READ: _RUN}), ""


def _j1939(prepared: Prepared, rng: Rng, _: Path) -> Found:
    """A J1939 message beside it, while the drive falls silent: on its beat, and never a stale number."""
    from ramsight.deploy.encoder.j1939 import Broadcasting, Message

    bus, first = _begun(prepared, rng)
    said = Message()
    both = Broadcasting(bus.encoder, said)
    both._next = bus.now
    silent, last, heard, kept = -math.inf, bus.now, bus.now, []
    for k in range(first, first + _RUN):
        at = prepared.frames[k][-1].time
        if at > silent + 1.0 and rng.random() < 0.02:
            silent = at + float(rng.choice([0.08, 0.15, 1.0]))
        frames = [one for one in prepared.frames[k] if at >= silent or one.cob_id == 0x180 + WARM]
        while both.due <= at:
            kept += [(both.due, one) for one in both.advance(max(both.due, bus.now))]
        for frame in frames:
            kept += [(at, one) for one in both.receive(at, frame)]
            last = at if frame.cob_id == 0x180 + DRIVE else last
        for sent, one in kept:
            if one.cob_id & 0x1FFFFFFF != said.identifier:
                continue
            if sent - heard > 2.0 * _PERIOD + 1e-6:
                return WRONG, f"sample {k}: {sent - heard:.3f} s without a message"
            heard = sent
            place, _, flags, _, _ = struct.unpack("<HHBBH", one.data)
            if bool(flags & 1) != (place <= _NO_POSITION) or (flags & 1 and sent - last > _TIMEOUT + _PERIOD):
                return WRONG, f"sample {k}: {one.data.hex()} {sent - last:.3f} s after the last frame of the drive"
        kept.clear()
    return Counter({READ: _RUN}), ""


SECTIONS = [
    Section("NMT storm", 20, prepare, _storm, 120.0),
    Section("LSS", 20, prepare, _lss),
    Section("bus off", 60, prepare, _off),
    Section("clock that is set", 100, prepare, _set),
    Section("J1939 beside", 60, prepare, _j1939),
]
