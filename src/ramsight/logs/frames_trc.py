"""CAN frames in PEAK's trace files (``.trc``, PCAN-View and PCAN-Explorer), versions 1.0 to 2.1.

python-can reads them too, but passes over lines that are damaged, and knows neither version 1.2 nor FD lengths by code.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from ramsight.logs.digits import decimal, whole
from ramsight.logs.frames import Frame, frame_key
from ramsight.logs.frames_text import FD_LENGTHS, SaidError, hex_bytes, text_frames
from ramsight.logs.lines import Advance

_DIRECTIONS = ("rx", "tx")
_FRAMES = ("DT", "FD", "FB", "FE", "BI", "RR")  # types of rows that are frames, in versions 2
_ERROR = "ER"
_NEEDED, _LENGTHS = "OTID", "lL"  # columns: offset, type, identifier, data; length in bytes, or its code
_STANDARD = 4  # digits of an identifier of 11 bits; one of 29 has 8


@dataclass(frozen=True)
class _Layout:
    """Places of a row's cells in versions 1; None for what they do not have."""

    bus: int | None
    direction: int | None
    identifier: int
    length: int


_LAYOUTS = {
    "1.0": _Layout(None, None, 2, 3),
    "1.1": _Layout(None, 2, 3, 4),
    "1.2": _Layout(2, 3, 4, 5),
    "1.3": _Layout(2, 3, 4, 6),
}


def trc_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a trace file; times count from its beginning; arguments and errors as `open_frames`."""
    yield from text_frames(path, advance, _Trc().frame)


class _Trc:
    """Reads lines of a trace file."""

    def __init__(self) -> None:
        self._version, self._columns = "1.0", ""

    def frame(self, text: str, line: int) -> Frame | None:
        """The frame in a line, if there is any."""
        cells = text.split()
        if not cells:
            return None
        if cells[0].startswith(";"):
            self._header(text.strip())
            return None
        if self._columns:
            if not (set(_NEEDED) <= set(self._columns) and set(_LENGTHS) & set(self._columns)):
                raise SaidError(f"the line ;$COLUMNS has to name {', '.join(_NEEDED)} and one of {', '.join(_LENGTHS)}")
            return self._by_columns(cells)
        if self._version not in _LAYOUTS:
            raise SaidError(f"version {self._version} needs a line ;$COLUMNS before it")
        return self._by_layout(cells, _LAYOUTS[self._version])

    def _header(self, text: str) -> None:
        key, _, value = text.partition("=")
        if key == ";$FILEVERSION":
            self._version = value.strip(" ;")
        elif key == ";$COLUMNS":
            self._columns = value.replace(",", "").strip(" ;")

    def _by_layout(self, cells: Sequence[str], layout: _Layout) -> Frame | None:
        if not cells[0].endswith(")"):
            raise ValueError
        time = decimal(cells[1]) / 1e3
        bus = 0 if layout.bus is None else whole(cells[layout.bus]) - 1
        if layout.direction is not None and cells[layout.direction].lower() not in _DIRECTIONS:
            whole(cells[layout.identifier], 16)
            return Frame(time, 0, bus, None)  # warnings and errors
        identifier, length = cells[layout.identifier], whole(cells[layout.length])
        data = cells[layout.length + 1 :]
        if layout.direction is None and identifier == "FFFFFFFF":
            return Frame(time, 0, bus, None)
        if data[:1] == ["RTR"]:
            return Frame(time, _key(identifier), bus, None)
        return Frame(time, _key(identifier), bus, _data(data, min(length, 8)))

    def _by_columns(self, cells: Sequence[str]) -> Frame | None:
        place = {letter: number for number, letter in enumerate(self._columns)}
        time, kind = decimal(cells[place["O"]]) / 1e3, cells[place["T"]]
        if kind not in _FRAMES:
            if not (kind.isalpha() and kind.isupper()):
                raise ValueError
            return Frame(time, 0, 0, None) if kind == _ERROR else None
        bus = whole(cells[place["B"]]) - 1 if "B" in place else 0
        key = _key(cells[place["I"]])
        if kind == "RR":
            return Frame(time, key, bus, None)
        data = cells[place["D"] :]
        if "l" in place:
            return Frame(time, key, bus, _data(data, whole(cells[place["l"]])))
        code = whole(cells[place["L"]])
        length = FD_LENGTHS[code] if kind != "DT" else min(code, 8)
        return Frame(time, key, bus, _data(data, code if len(data) == code else length))


def _key(text: str) -> int:
    return frame_key(whole(text, 16), is_extended=len(text) > _STANDARD)


def _data(cells: Sequence[str], length: int) -> bytes:
    if len(cells) != length or any(len(cell) != 2 for cell in cells):
        raise ValueError
    return hex_bytes("".join(cells))
