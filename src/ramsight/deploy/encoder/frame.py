"""A CAN frame as a plain thing: what comes in, what goes out."""

from __future__ import annotations

import math
from dataclasses import dataclass

EXTENDED = 1 << 31
"""Set in an identifier of 29 bits, as in the logs."""


@dataclass(frozen=True)
class Frame:
    """A data frame.

    Example:
        >>> print(Frame(0x186, bytes.fromhex("10270000")))
        186#10270000
    """

    cob_id: int  # its identifier, with `EXTENDED` for one of 29 bits
    data: bytes = b""  # up to 8 bytes
    time: float = math.nan  # the bus's time stamp [s], on any clock; NaN if there is none

    def __str__(self) -> str:
        """As candump writes it."""
        wide = bool(self.cob_id & EXTENDED)
        return f"{self.cob_id & ~EXTENDED:0{8 if wide else 3}X}#{self.data.hex().upper()}"
