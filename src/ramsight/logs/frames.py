"""CAN frames as logs of every kind hold them."""

from __future__ import annotations

from typing import NamedTuple

EXTENDED = 1 << 31
"""Set in the key of an extended identifier."""


class Frame(NamedTuple):
    """A frame of a log."""

    time: float  # as in the file [s]
    key: int  # identifier, with `EXTENDED` set for one of 29 bits
    bus: int  # number of the bus, from 0
    data: bytes | None  # its bytes; None for an error frame or a remote frame


def frame_key(identifier: int, *, is_extended: bool) -> int:
    """The key of an identifier of 29 or 11 bits.

    Raises:
        ValueError: the identifier has more bits.

    Example:
        >>> hex(frame_key(0x18FF0001, is_extended=True)), hex(frame_key(0x181, is_extended=False))
        ('0x98ff0001', '0x181')
    """
    if not 0 <= identifier < (1 << 29 if is_extended else 1 << 11):
        raise ValueError(identifier)
    return identifier | (EXTENDED if is_extended else 0)
