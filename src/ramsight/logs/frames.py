"""CAN frames as logs of every kind hold them."""

from __future__ import annotations

from typing import NamedTuple

EXTENDED = 1 << 31
"""Set in the key of an extended identifier."""


class Frame(NamedTuple):
    """A frame of a log.

    Args:
        time: as in the file [s].
        key: identifier, with `EXTENDED` set for one of 29 bits.
        bus: number of the bus, from 0.
        data: its bytes; None for an error frame or a remote frame.
    """

    time: float
    key: int
    bus: int
    data: bytes | None
