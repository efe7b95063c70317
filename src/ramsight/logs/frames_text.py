"""CAN frames in text files: ASC (Vector), candump (can-utils, as logged and as shown on a screen) and BUSMASTER."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

from ramsight.errors import LogError, warn_of_log
from ramsight.logs.digits import decimal, is_digits, whole
from ramsight.logs.frames import Frame, frame_key
from ramsight.logs.lines import Advance, cut_short, file_name, line_blocks, printable
from ramsight.logs.stamps import stamp_seconds

_KNOWN = re.compile(
    r"\s*(//|date\b|base\b|(no\s+)?internal\s+events|begin\s+trigger|end\s+trigger|[0-9]+\.[0-9]+\s|#|$)", re.I
)
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
_DIRECTIONS = ("rx", "tx", "txrq")
_RAW_LENGTH = re.compile(r"_[9A-Fa-f]$")  # of a frame of 8 bytes that states more: candump -8
_LENGTH = re.compile(r"\[([0-9]+)\]|\{([0-9A-Fa-f])\}")
_FIRST_DELTAS = 50
_BLANK = b" \t\n\x0b\x0c"


def asc_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of an ASC file; arguments and errors as `open_frames`.

    Its header states whether numbers are hexadecimal, and whether times are absolute or relative to the event before.
    """
    reader, count = _Asc(), 0
    for frame in text_frames(path, advance, reader.frame):
        count += 1
        yield frame
    if reader.strange and not count:
        raise LogError("is no ASC file: this line is not understood", file=file_name(path), line=reader.first_strange)
    if reader.strange:
        what = "line is" if reader.strange == 1 else "lines are"
        warn_of_log(
            f"{reader.strange} {what} not understood and left out, this one first",
            file=file_name(path),
            line=reader.first_strange,
        )


def candump_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of what candump logs (``-L``) or shows with time stamps; arguments and errors as `open_frames`."""
    yield from text_frames(path, advance, _Candump().frame)


def text_frames(path: str | Path, advance: Advance | None, read: Callable[[str, int], Frame | None]) -> Iterator[Frame]:
    """Frames line by line; a last line that breaks off is left out, with a warning.

    Args:
        read: the frame in a line, by its text and number; None if there is none, a `ValueError` if it is damaged.

    Raises:
        LogError: the file cannot be read, or a line is no frame; names the line.
    """
    file, line = file_name(path), 0
    for block in line_blocks(path, encoding="latin-1", advance=advance, blank=_BLANK):
        is_whole = block.endswith(b"\n")
        for text in block.decode("utf-8").removesuffix("\n").split("\n"):
            line += 1
            try:
                frame = read(text, line)
            except (ValueError, IndexError) as error:
                if not is_whole and line > 1:
                    cut_short(file, line)
                    return
                hint = f": {error}" if isinstance(error, SaidError) else ""
                raise LogError(f"is no CAN frame: '{printable(text.strip())}'{hint}", file=file, line=line) from None
            if frame is not None:
                yield frame


class SaidError(ValueError):
    """A line that cannot be read, with the reason."""


class _Asc:
    """Reads lines of an ASC file.

    Attributes:
        strange: lines that are neither events, comments nor of the header.
    """

    def __init__(self) -> None:
        self._base, self._is_relative, self._clock = 16, False, 0.0
        self.strange, self.first_strange = 0, 0

    def frame(self, text: str, line: int) -> Frame | None:
        """The frame in a line, if it is one."""
        cells = text.split()
        if not cells or not is_digits(cells[0][0]) or "." not in cells[0]:
            self._header(cells)
            if _KNOWN.match(text) is None:
                self.strange += 1
                self.first_strange = self.first_strange or line
            return None
        time = decimal(cells[0])
        self._clock = self._clock + time if self._is_relative else time
        if len(cells) < 3:
            raise ValueError
        if cells[1] == "CANFD":
            is_frame = is_digits(cells[2]) and len(cells) > 3 and cells[3].lower() in _DIRECTIONS
            return self._fd(cells) if is_frame else None  # the start of a measurement, statistics
        if not is_digits(cells[1]):
            return None
        if cells[2].lower().startswith("errorframe"):
            return Frame(self._clock, 0, whole(cells[1]) - 1, None)
        if len(cells) < 4 or cells[3].lower() not in _DIRECTIONS:
            if len(cells) < 5 and re.fullmatch(r"[0-9A-Fa-f]+[xX]?", cells[2]):
                raise ValueError
            return None  # statistics, J1939 and the like
        is_data = cells[4].lower() == "d"
        if not is_data and cells[4].lower() != "r":
            raise ValueError
        data = self._bytes(cells[6:], min(FD_LENGTHS[whole(cells[5], self._base)], 8)) if is_data else None
        return Frame(self._clock, self._key(cells[2]), whole(cells[1]) - 1, data)

    def _header(self, cells: list[str]) -> None:
        words = [cell.lower() for cell in cells]
        if words[:1] == ["base"] and len(words) > 1:
            self._base = 10 if words[1] == "dec" else 16
            self._is_relative = "relative" in words

    def _fd(self, cells: list[str]) -> Frame:
        bus = whole(cells[2]) - 1
        if cells[4].lower().startswith("errorframe"):
            return Frame(self._clock, 0, bus, None)
        first = (
            5 if is_digits(cells[5]) and len(cells[5]) == 1 else 6
        )  # a name may stand before the switch of the bit rate
        length = whole(cells[first + 3])
        data = self._bytes(cells[first + 4 :], length) if length else None
        return Frame(self._clock, self._key(cells[4]), bus, data)

    def _key(self, text: str) -> int:
        wide = text[-1:] in "xX"
        return frame_key(whole(text[:-1] if wide else text, self._base), is_extended=wide)

    def _bytes(self, cells: list[str], length: int) -> bytes:
        if len(cells) < length:
            raise ValueError
        return bytes(whole(cell, self._base) for cell in cells[:length])


class _Candump:
    """Reads lines of candump."""

    def __init__(self) -> None:
        self._buses: dict[str, int] = {}
        self._shown, self._falls, self._last = 0, 0, -1.0

    def frame(self, text: str, line: int) -> Frame | None:
        """The frame in a line, if there is any."""
        text = text.strip()
        if not text or text.startswith("#"):
            return None
        if not text.startswith("("):
            if re.match(r"\S+\s.*\[[0-9]+\]", text):
                raise SaidError("it has no time stamp; record with candump -L")
            raise ValueError
        stamp, _, rest = text[1:].partition(")")
        time = decimal(stamp) if re.fullmatch(r"[0-9]+\.[0-9]+", stamp) else stamp_seconds(stamp)
        cells = rest.split()
        if "#" in cells[1]:
            return self._logged(time, cells)
        return self._on_screen(time, cells)

    def _bus(self, name: str) -> int:
        if name not in self._buses:
            digits = re.search(r"[0-9]+$", name)
            number = int(digits[0]) if digits else len(self._buses)
            while number in self._buses.values():  # can0 and vcan0 are two
                number += 1
            self._buses[name] = number
        return self._buses[name]

    def _logged(self, time: float, cells: list[str]) -> Frame | None:
        identifier, _, data = cells[1].partition("#")
        content: bytes | None = None
        if ":" in data:  # CAN XL: other frames than those that drives send
            return Frame(time, 0, self._bus(cells[0]), None)
        data = _RAW_LENGTH.sub("", data)
        if data.startswith("#"):
            whole(data[1], 16)
            content = hex_bytes(data[2:])
        elif data[:1].lower() != "r":
            content = hex_bytes(data)
        return self._frame(time, identifier, cells[0], content)

    def _on_screen(self, time: float, cells: list[str]) -> Frame | None:
        self._shown += 1
        self._falls += time <= self._last
        self._last = time
        if self._shown == _FIRST_DELTAS and self._falls > _FIRST_DELTAS // 5:
            raise SaidError("time stamps do not increase up to here (candump -td?); record with candump -L")
        place = next((k for k, cell in enumerate(cells) if k > 1 and _LENGTH.fullmatch(cell)), 0)
        if not place:
            raise ValueError
        length = whole(cells[place][1:-1]) if cells[place][0] == "[" else min(whole(cells[place][1:-1], 16), 8)
        data = cells[place + 1 :]
        if data[:1] == ["remote"] or data[:1] == ["ERRORFRAME"]:
            return self._frame(time, cells[place - 1], cells[0], None)
        if len(data) < length:
            raise ValueError
        return self._frame(time, cells[place - 1], cells[0], hex_bytes("".join(data[:length])))

    def _frame(self, time: float, identifier: str, bus: str, data: bytes | None) -> Frame:
        key, wide = whole(identifier, 16), len(identifier) > 3
        if key & 0x20000000:  # an error frame
            return Frame(time, 0, self._bus(bus), None)
        if not re.fullmatch(r"[0-9A-Fa-f]{1,8}", identifier):
            raise ValueError
        return Frame(time, frame_key(key, is_extended=wide), self._bus(bus), data)


def hex_bytes(text: str) -> bytes:
    """Bytes of hexadecimal digits; a `ValueError` if they are none, or more than a frame has."""
    if len(text) > 128:
        raise ValueError
    return bytes.fromhex(text.replace(".", ""))


BEGINS = "***"
"""What each line of a header begins with."""

_CLOCK = re.compile(r"([0-9]{1,3}):([0-9]{1,2}):([0-9]{1,2}):([0-9]{4})")  # the last are tenths of a millisecond
_DAY = 86400.0  # s
_TYPES = {"s": False, "x": False, "sr": True, "xr": True}  # whether it is a remote frame


def busmaster_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a log of BUSMASTER, whatever its numbers and times; arguments and errors as `open_frames`."""
    yield from text_frames(path, advance, _Busmaster().frame)


class _Busmaster:
    """Reads lines of a log of BUSMASTER."""

    def __init__(self) -> None:
        self._base, self._is_relative, self._is_of_day = 16, False, False
        self._clock, self._days, self._last = 0.0, 0.0, 0.0

    def frame(self, text: str, line: int) -> Frame | None:
        """The frame in a line, if there is any."""
        text = text.strip()
        if not text:
            return None
        if text.startswith(BEGINS):
            self._header(text.strip("* "))
            return None
        cells = text.split()
        if len(cells) < 6 or cells[1].lower() not in ("rx", "tx") or cells[4].lower() not in _TYPES:
            raise ValueError
        time, length = self._time(cells[0]), whole(cells[5])
        key = frame_key(whole(cells[3], self._base), is_extended=cells[4].lower().startswith("x"))
        if _TYPES[cells[4].lower()]:
            return Frame(time, key, whole(cells[2]) - 1, None)
        if len(cells) != 6 + length:
            raise ValueError
        return Frame(time, key, whole(cells[2]) - 1, bytes(whole(cell, self._base) for cell in cells[6:]))

    def _header(self, text: str) -> None:
        if text in ("HEX", "DEC"):
            self._base = 16 if text == "HEX" else 10
        elif text.endswith(" MODE"):
            self._is_relative, self._is_of_day = text == "RELATIVE MODE", text == "SYSTEM MODE"

    def _time(self, text: str) -> float:
        match = _CLOCK.fullmatch(text)
        if match is None:
            raise ValueError
        hours, minutes, seconds, parts = map(int, match.groups())
        time = 3600.0 * hours + 60.0 * minutes + seconds + parts / 1e4
        if self._is_relative:
            self._clock += time
            return self._clock
        if self._is_of_day and time < self._last - 0.5 * _DAY:
            self._days += _DAY  # midnight
        self._last = time
        return self._days + time
