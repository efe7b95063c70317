"""CAN frames in logs of BUSMASTER (``.log``): a header of lines in asterisks, and a frame a line."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from ramsight.logs.digits import whole
from ramsight.logs.frames import Frame, frame_key
from ramsight.logs.frames_text import text_frames
from ramsight.logs.lines import Advance

BEGINS = "***"
"""What each line of a header begins with."""

_CLOCK = re.compile(r"([0-9]{1,3}):([0-9]{1,2}):([0-9]{1,2}):([0-9]{4})")  # the last are tenths of a millisecond
_DAY = 86400.0  # s
_TYPES = {"s": False, "x": False, "sr": True, "xr": True}  # whether it is a remote frame


def busmaster_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a log of BUSMASTER, in hexadecimal or decimal numbers, absolute, relative or times of day.

    Args:
        path: the file, compressed with gzip if its name ends in ``.gz``.
        advance: is passed how much of the file has been read.

    Raises:
        LogError: the file cannot be read, or a line is no frame; names the line.
    """
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
