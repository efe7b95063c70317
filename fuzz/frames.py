"""Frames of chance: of any service of CiA 301, in and out of form."""

from __future__ import annotations

import math
import struct
from typing import Any

from harness import Rng

NODE, DRIVE, WARM = 6, 5, 7
OPERATE = bytes([1, NODE])
_EXTENDED = 1 << 31
_SERVICES = (
    0x000, 0x080, 0x080 + NODE, 0x080 + DRIVE, 0x100, 0x180 + NODE, 0x280 + NODE, 0x200 + NODE, 0x280 + DRIVE,
    0x580 + NODE, 0x600 + DRIVE, 0x700 + NODE, 0x700 + DRIVE, 0x7E4, 0x7FF,
    _EXTENDED | 0x180 + DRIVE, _EXTENDED | 0x600 + NODE, _EXTENDED | 0x1FFFFFFF,
)  # fmt: skip
_COMMANDS = (1, 1, 1, 1, 2, 128, 129, 130, 0, 255)
_SPECIFIERS = (
    0x22,
    0x23,
    0x23,
    0x27,
    0x2B,
    0x2B,
    0x2F,
    0x2F,
    0x20,
    0x21,
    0x40,
    0x40,
    0x60,
    0x70,
    0xA0,
    0xC0,
    0xC2,
    0xE0,
)
_VALUES = (
    0, 1, 4, 5, 8, 10, 12, 100, 10_000, 20_000, 35_000, 70_000, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000,
    0xFFFFFFFF, 0x80, 0x185, 0x40000186, 0xC0000186, 0x40000080, 0x40000185, 0x60040020, 0x65030010, 0x65050010,
    0x20100020, 0x6576_6173, 0x6461_6F6C, (DRIVE << 16) | 100,
)  # fmt: skip
_FORGET = b"forg"


def has_bus(group: str) -> bool:
    """Whether this machine lets processes talk over a multicast group as over a bus."""
    import can

    try:
        can.Bus(interface="udp_multicast", channel=group).shutdown()
    except (can.CanError, OSError, ImportError):
        return False
    return True


def request(rng: Rng) -> bytes:
    """An SDO request: an object that there is, or is not; any command; a value at a border, or of chance.

    'forg' is left out: after it whatever preset comes is the position, and a wrong one is the client's.
    """
    from ramsight.deploy.encoder.objects import ENTRIES

    keys = list(ENTRIES)
    index, subindex = keys[int(rng.integers(len(keys)))]
    if rng.random() < 0.1:
        index = int(rng.integers(0x10000))
    if rng.random() < 0.1:
        subindex = int(rng.integers(256))
    specifier = int(rng.choice(_SPECIFIERS)) if rng.random() < 0.9 else int(rng.integers(256))
    value = int(rng.choice(_VALUES)) if rng.random() < 0.7 else int(rng.integers(1 << 32))
    data = struct.pack("<BHBI", specifier, index, subindex, value)
    return data if data[4:] != _FORGET else data[:4] + bytes(4)


def others_frame(rng: Rng, now: float) -> Any:
    """A frame of anybody but drive and thermometer [s]."""
    from ramsight.deploy.encoder import Frame

    stamp = _stamp(rng, now)
    kind = rng.random()
    if kind < 0.4:
        return Frame(0x600 + NODE, request(rng), stamp)
    if kind < 0.5:
        return Frame(0x000, bytes([int(rng.choice(_COMMANDS)), int(rng.choice([0, NODE, NODE, DRIVE]))]), stamp)
    identifier = int(rng.choice(_SERVICES))
    if kind > 0.9:
        identifier = int(rng.integers(0x800))
        identifier += identifier in (0x180 + DRIVE, 0x180 + WARM)
    data = rng.bytes(int(rng.integers(9)))
    return Frame(identifier, data if _FORGET not in data else b"", stamp)


def drive_or_any(rng: Rng, now: float) -> Any:
    """A frame with the identifier of the drive or its thermometer, or of others; but no preset, which may jump."""
    from ramsight.deploy.encoder import Frame

    if rng.random() < 0.6:
        identifier = 0x180 + (WARM if rng.random() < 0.1 else DRIVE)
        data = rng.bytes(int(rng.choice([6, 6, 6, 8, 8, 2, 5, 0])))
        if rng.random() < 0.5:
            data = struct.pack("<ih", int(rng.integers(-3000, 3000)), int(rng.integers(-1000, 1000)))
        return Frame(identifier, data, _stamp(rng, now))
    frame = others_frame(rng, now)
    is_network = frame.cob_id in (0x000, 0x600 + NODE)
    return Frame(0x000, OPERATE, now) if is_network else frame


def _stamp(rng: Rng, now: float) -> float:
    """When a frame says that it was sent: mostly then, sometimes by a clock that was set, or by none."""
    if rng.random() < 0.9:
        return now
    return float(rng.choice([now + 3600.0, now - 3600.0, math.nan, math.inf, -1e300, 0.0, now - 0.05]))
