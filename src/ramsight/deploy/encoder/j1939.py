"""The position and weighings as J1939 messages beside CANopen, for machines whose controllers speak that.

No parameter group is known for the position of an implement's cylinder; sensors send a proprietary one (Proprietary B,
PGN FF00h to FFFFh), as this one does. Numbers are little-endian with the ranges of SAE J1939-71: of 16 bits the values
above FAFFh are none, FE00h to FEFFh mean an error, FF00h and above that nothing is known.

| bytes | what | a bit is | offset |
|---|---|---|---|
| 1, 2 | position | 0.1 mm (`resolution`) | 0 |
| 3, 4 | velocity, extension positive | 0.1 mm/s | -3200 mm/s |
| 5 | bits 1-2 position valid, 3-4 known, 5-6 a warning holds, 7-8 referenced since power-up; 0 no, 1 yes | | |
| 6 | number of the sensor's status | 1 | 0 |
| 7, 8 | standard deviation | 0.01 mm | 0 |

The last weighing and the total are two further proprietary groups, sent one after the other:

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

import math
import struct
from dataclasses import dataclass
from typing import Protocol

from ramsight.deploy.encoder.alarms import warnings
from ramsight.deploy.encoder.encoder import Encoder
from ramsight.deploy.encoder.frame import EXTENDED, Frame
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.errors import DescriptionError
from ramsight.sensor.status import Status
from ramsight.units import parse_option

LARGEST, _ERROR, _NOTHING = 0xFAFF, 0xFE00, 0xFFFF
"""Of 16 bits: the largest that is a number, what means an error, and that nothing is known."""
_SLOWEST, _VELOCITY, _STD = 3.2, 1e-4, 1e-5  # m/s; m/s and m a bit
_PGNS = 0xFF00, 0xFFFF
_PERIODS = 5e-3, 5.0  # s


@dataclass(frozen=True)
class Message:
    """Which message, and how often.

    Args:
        pgn: parameter group, FF00h to FFFFh.
        source: source address, 0 to 253.
        priority: 0, the highest, to 7.
        period: between two messages, 5 ms to 5 s [s].
        resolution: of the position [m].

    Raises:
        DescriptionError: a value is out of its range.

    Example:
        >>> hex(Message(pgn=0xFF40, source=0x80).identifier)
        '0x18ff4080'
    """

    pgn: int = 0xFF40
    source: int = 0x80
    priority: int = 6
    period: float = SAMPLE_PERIOD  # s; as often as a drive reports there is something new to say
    resolution: float = 1e-4

    def __post_init__(self) -> None:
        for name, value, least, most in (
            ("pgn", self.pgn, *_PGNS),
            ("source", self.source, 0, 253),
            ("priority", self.priority, 0, 7),
            ("period", self.period, *_PERIODS),
            ("resolution", self.resolution, 1e-6, 1e-2),
        ):
            if not least <= value <= most:
                raise DescriptionError("is out of range", key=name, value=value, allowed=f"{least:g} to {most:g}")

    @property
    def identifier(self) -> int:
        """Identifier of the frame, 29 bits."""
        return self.priority << 26 | self.pgn << 8 | self.source

    def data(
        self, position: float, velocity: float, std: float, status: int, *, valid: bool, warns: bool, referenced: bool
    ) -> bytes:
        """The eight bytes.

        Args:
            position: [m]; not looked at unless `valid`.
            velocity: [m/s].
            std: standard deviation of the position [m].
            status: number of the sensor's status.
            valid: whether the position may be used.
            warns: whether a warning holds.
            referenced: whether a reference has come since power-up.

        Example:
            >>> Message().data(0.1, 0.0, 1e-3, 0, valid=True, warns=False, referenced=True).hex()
            'e803007d45006400'
        """
        known = status < Status.NOT_REFERENCED
        flags = int(valid) | int(known) << 2 | int(warns) << 4 | int(referenced) << 6
        return struct.pack(
            "<HHBBH",
            number(position / self.resolution) if valid else _ERROR,
            number((velocity + _SLOWEST) / _VELOCITY),
            flags,
            status,
            number(std / _STD) if known else _NOTHING,
        )

    def check(self, encoder: Encoder) -> None:
        """Refuse a stroke that needs more bits than there are.

        Raises:
            DescriptionError: it does.
        """
        if encoder.stroke / self.resolution > LARGEST:
            allowed = f"{encoder.stroke / LARGEST:.2g} m or more"
            text = "is too fine for the stroke"
            raise DescriptionError(text, key="resolution", value=self.resolution, allowed=allowed)

    def frames(self, encoder: Encoder) -> list[Frame]:
        """What an encoder says now."""
        data = self.data(
            encoder.position,
            encoder.velocity,
            encoder.std,
            encoder.status,
            valid=encoder.valid,
            warns=bool(warnings(encoder.faults)),
            referenced=encoder.referenced,
        )
        return [Frame(self.identifier | EXTENDED, data)]


def message_of(words: str, period: str) -> Message:
    """The message that options ask for.

    Args:
        words: parameter group and source address, hexadecimal: ``FF40h 80h``.

    Raises:
        DescriptionError: they cannot be read, or are out of range.

    Example:
        >>> hex(message_of("FF41h 81h", "50 ms").identifier)
        '0x18ff4181'
    """
    pgn, source = header_of(words, "--j1939")
    return Message(pgn, source, period=parse_option(period, "s", "--j1939-period", least="5 ms", most="5 s"))


def header_of(words: str, option: str) -> tuple[int, int]:
    """Parameter group and source address of an option.

    Raises:
        DescriptionError: they cannot be read.
    """
    try:
        pgn, source = (int(word.rstrip("hH"), 16) for word in words.split())
    except ValueError:
        allowed = "a PGN and a source address, as in 'FF40h 80h'"
        raise DescriptionError("cannot be read", key=option, value=words, allowed=allowed) from None
    return pgn, source


def number(value: float, bits: int = 16) -> int:
    """A value in bits, within what may be sent; none if it is none.

    Example:
        >>> number(2.6), number(-1.0), hex(number(1e9)), hex(number(1e12, 32)), hex(number(math.nan))
        (3, 0, '0xfaff', '0xfaffffff', '0xffff')
    """
    more = (1 << bits - 16) - 1
    nothing, largest = (_NOTHING << bits - 16) + more, (LARGEST << bits - 16) + more
    return min(max(round(value), 0), largest) if math.isfinite(value) else nothing


class Broadcast(Protocol):
    """Messages that are sent at equal distances."""

    @property
    def period(self) -> float:
        """Between two times [s]."""

    def check(self, encoder: Encoder) -> None:
        """Refuse an encoder that they have no room for."""

    def frames(self, encoder: Encoder) -> list[Frame]:
        """What an encoder says now."""


class Broadcasting:
    """An encoder that sends J1939 messages, too; it is used as the encoder is.

    Args:
        encoder: of CANopen.
        messages: which ones.

    Raises:
        DescriptionError: a value needs more bits than there are.
    """

    def __init__(self, encoder: Encoder, *messages: Broadcast) -> None:
        for one in messages:
            one.check(encoder)
        self._encoder, self._messages = encoder, messages
        self._next = [math.inf for _ in messages]

    @property
    def said(self) -> str:
        """The position in words, or why there is none."""
        return self._encoder.said

    @property
    def due(self) -> float:
        """When something is to be done next [s]."""
        return min(self._encoder.due, *self._next)

    def start(self, now: float) -> list[Frame]:
        """Power up at a time [s]; a message comes a period later for the first time."""
        self._next = [now + one.period for one in self._messages]
        return self._encoder.start(now)

    def receive(self, now: float, frame: Frame) -> list[Frame]:
        """Take a frame that came from the bus at a time [s]."""
        return [*self._encoder.receive(now, frame), *self._due(now)]

    def advance(self, now: float) -> list[Frame]:
        """Do whatever is due by now [s]."""
        return [*self._encoder.advance(now), *self._due(now)]

    def stop(self) -> None:
        """Power down in order."""
        self._encoder.stop()

    def _due(self, now: float) -> list[Frame]:
        frames = []
        for k, message in enumerate(self._messages):
            if now >= self._next[k]:
                late = math.fmod(now - self._next[k], message.period)
                self._next[k] = now + message.period - late  # what was missed is gone, the beat stays
                frames += message.frames(self._encoder)
        return frames


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
