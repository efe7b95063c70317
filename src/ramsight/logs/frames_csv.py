"""CAN frames in tables, a row a frame: SavvyCAN, Kvaser's and CSS Electronics' converters, python-can.

What a column is goes by its name: no two of these programs agree on names, times and numbers, but each has its own
header.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from ramsight.logs.digits import decimal, is_digits, whole
from ramsight.logs.frames import Frame, frame_key
from ramsight.logs.frames_text import FD_LENGTHS, SaidError, hex_bytes, text_frames
from ramsight.logs.header import split
from ramsight.logs.lines import Advance
from ramsight.logs.stamps import stamp_seconds
from ramsight.logs.table_kind import FrameTable, frame_table

_FROM_ONE = ("chan", "channel", "chn", "buschannel")  # buses that are counted from 1
_STAMP = re.compile(r"([0-9]*)T([0-9]{2})([0-9]{2})([0-9]{2})([0-9]{3})?")  # 09T164714231: day, h, min, s, ms
_TRUE = ("true", "1", "x", "yes")
_PYTHON_CAN = "arbitration_id"  # its data are in base 64


def csv_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The frames of a table; arguments and errors as `open_frames`."""
    table = frame_table(path)
    if table is not None:
        yield from text_frames(path, advance, _Rows(table).frame)


class _Rows:
    """Reads rows of a table of frames."""

    def __init__(self, table: FrameTable) -> None:
        self._table = table
        self._is_from_one = table.names[table.places["bus"]] in _FROM_ONE if "bus" in table.places else False
        self._is_in_microseconds = table.names[table.places["time"]] == "time stamp" and bool(table.bytes_at)
        self._is_base64 = _PYTHON_CAN in table.names

    def frame(self, text: str, line: int) -> Frame | None:
        """The frame in a line, if there is any."""
        if line <= self._table.header_line or not text.strip() or text.startswith("#"):
            return None
        cells = [cell.strip() for cell in split(text, self._table.separator)]
        time, key, bus = self._time(self._cell(cells, "time")), self._key(cells), self._bus(cells)
        if self._is_true(cells, "remote") or self._is_true(cells, "error") or "r" in self._flags(cells):
            return Frame(time, 0 if self._is_true(cells, "error") else key, bus, None)
        return Frame(time, key, bus, self._data(cells))

    def _cell(self, cells: Sequence[str], what: str) -> str:
        place = self._table.places.get(what)
        return "" if place is None else cells[place]

    def _is_true(self, cells: Sequence[str], what: str) -> bool:
        return self._cell(cells, what).lower() in _TRUE

    def _flags(self, cells: Sequence[str]) -> str:
        flags = self._cell(cells, "flags").lower()
        return "" if is_digits(flags) else flags

    def _time(self, text: str) -> float:
        if match := _STAMP.fullmatch(text):
            day, *clock = (int(part or 0) for part in match.groups())
            return 86400.0 * (day % 100) + 3600.0 * clock[0] + 60.0 * clock[1] + clock[2] + clock[3] / 1e3
        if ":" in text:
            return stamp_seconds(text)
        number = decimal(text)
        return number / 1e6 if self._is_in_microseconds and is_digits(text) else number

    def _key(self, cells: Sequence[str]) -> int:
        text = self._cell(cells, "identifier").lower()
        is_extended = "x" in self._flags(cells) or text.endswith("x") or self._is_true(cells, "extended")
        key = whole(text.removesuffix("x"), 16)
        if "extended" not in self._table.places and "flags" not in self._table.places:
            is_extended = is_extended or key >= 1 << 11
        return frame_key(key, is_extended=is_extended)

    def _bus(self, cells: Sequence[str]) -> int:
        text = self._cell(cells, "bus")
        return whole(text) - self._is_from_one if text else 0

    def _data(self, cells: Sequence[str]) -> bytes:
        length = self._length(cells)
        if self._table.bytes_at:
            data = [cells[place] for place in self._table.bytes_at if place < len(cells) and cells[place]]
            data += [cell for cell in cells[self._table.bytes_at[-1] + 1 :] if cell and length is not None]
            if length is not None and len(data) < length:
                raise ValueError
            return bytes(whole(cell, 16) for cell in data[:length])
        text = self._cell(cells, "data")
        found = base64.b64decode(text, validate=True) if self._is_base64 else hex_bytes(text.replace(" ", ""))
        if length is not None and len(found) != length:
            raise SaidError(f"it has {len(found)} bytes where {length} are stated")
        return found

    def _length(self, cells: Sequence[str]) -> int | None:
        if text := self._cell(cells, "length"):
            return whole(text)
        code = self._cell(cells, "code")
        if not code:
            return None
        if self._is_base64:  # python-can's is a number of bytes
            return whole(code)
        return FD_LENGTHS[whole(code)] if "f" in self._flags(cells) else min(whole(code), 8)
