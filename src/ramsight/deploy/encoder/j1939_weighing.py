"""The last weighing and the total as J1939 messages: two proprietary parameter groups, one after the other.

| bytes | what | a bit is | offset |
|---|---|---|---|
| 1, 2 | mass of the last weighing | 1 kg | -3200 kg |
| 3, 4 | its standard deviation | 0.1 kg | 0 |
| 5, 6 | share of the rated load | 0.1 % | 0 |
| 7 | number of weighings since power-up; after 250 comes 0 | 1 | 0 |
| 8 | bits 1-4 quality, the last four of 2043h; 5-6 status of the rated load, 2048h; 7-8 unused | | |

and in the next group:

| bytes | what | a bit is | offset |
|---|---|---|---|
| 1-4 | total since power-up | 1 kg | 0 |
| 5-8 | its standard deviation | 1 kg | 0 |
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ramsight.deploy.encoder.encoder import Encoder
from ramsight.deploy.encoder.frame import EXTENDED, Frame
from ramsight.deploy.encoder.j1939 import LARGEST, Message, header_of, number
from ramsight.errors import DescriptionError

PERIOD = 1.0
"""Between two of them [s]."""
_LEAST, _COUNTS, _UNUSED = 3200.0, 251, 0b11 << 6  # kg; -; bits


@dataclass(frozen=True)
class WeighingMessages:
    """Which messages.

    Raises:
        DescriptionError: a value is out of its range.

    Example:
        >>> [hex(one) for one in WeighingMessages(pgn=0xFF41, source=0x80).identifiers]
        ['0x18ff4180', '0x18ff4280']
    """

    pgn: int = 0xFF41  # parameter group of the weighing, FF00h to FFFEh; the next one is the total's
    source: int = 0x80  # source address, 0 to 253
    priority: int = 6  # 0, the highest, to 7
    period: float = PERIOD  # between two of each [s]

    def __post_init__(self) -> None:
        assert self.identifiers

    @property
    def identifiers(self) -> tuple[int, ...]:
        """Identifiers of the two frames, 29 bits."""
        headers = (Message(self.pgn + k, self.source, self.priority, self.period) for k in (0, 1))
        return tuple(one.identifier for one in headers)

    def check(self, encoder: Encoder) -> None:
        """Refuse a machine that may lift more than there are bits for.

        Raises:
            DescriptionError: it may.
        """
        most = LARGEST - _LEAST
        if encoder.weighings.rated > 0.5 * most:
            text = "has no room for twice the rated payload"
            raise DescriptionError(text, key="--j1939-weighing", value=f"{encoder.weighings.rated:g} kg",
                                   allowed=f"{0.5 * most:g} kg or less")  # fmt: skip

    def frames(self, encoder: Encoder) -> list[Frame]:
        """What an encoder says now."""
        one = encoder.weighings
        flags = one.quality & 0xF | one.status << 4 | _UNUSED
        last = struct.pack(
            "<HHHBB",
            number(one.mass + _LEAST),
            number(10.0 * one.std),
            number(1e3 * one.share),
            one.count % _COUNTS,
            flags,
        )
        total = struct.pack("<II", number(one.total, 32), number(one.total_std, 32))
        return [Frame(name | EXTENDED, data) for name, data in zip(self.identifiers, (last, total), strict=True)]


def weighing_messages_of(words: str) -> WeighingMessages:
    """The messages that an option asks for.

    Args:
        words: parameter group and source address, hexadecimal: ``FF41h 80h``.

    Raises:
        DescriptionError: they cannot be read, or are out of range.
    """
    return WeighingMessages(*header_of(words, "--j1939-weighing"))
