"""Whether points and commas in numbers are decimal or separate thousands, seen from all numbers of a file."""

from __future__ import annotations

import re
from collections.abc import Collection

from ramsight.errors import LogError
from ramsight.logs.header import split
from ramsight.logs.lines import printable

_MARKS = {".": ",", ",": "."}


def _cell(inner: str, separator: str) -> re.Pattern[bytes]:
    """Cells of this form; a cell begins after a separator or a line and ends before one."""
    edge = re.escape(separator)
    return re.compile(rf'(?:^|(?<={edge}))[ ]*"?[+-]?(?:{inner})"?[ ]*(?=[{edge}\r\n]|$)'.encode(), re.MULTILINE)


class Decimals:
    """Looks at the numbers of a file where both a decimal comma and a decimal point could be read.

    A cell like ``1.500`` is one and a half, or one thousand five hundred where other cells have decimal commas; the
    second is refused, and so is ``1,500`` beside decimal points.
    """

    def __init__(self, file: str, separator: str, names: list[str]) -> None:
        self._file, self._separator, self._names = file, separator, names
        self._proven: set[str] = set()
        self._open: dict[str, tuple[int, str, str]] = {}
        marks = {mark: re.escape(mark) for mark in _MARKS}
        self._decimal = {
            mark: _cell(
                rf"[0-9]*{m}(?:[0-9]{{1,2}}|[0-9]{{4,}})(?:[eE][+-]?[0-9]+)?|(?:0[0-9]*|[0-9]{{4,}}){m}[0-9]+",
                separator,
            )
            for mark, m in marks.items()
        }
        self._either = {mark: _cell(rf"[1-9][0-9]{{0,2}}(?:{m}[0-9]{{3}})+", separator) for mark, m in marks.items()}

    def check(self, body: bytes, first_line: int, wanted: Collection[str]) -> None:
        """Take lines of the file.

        Raises:
            LogError: a number may be a thousand times what it seems; with line and column.
        """
        for mark in _MARKS:
            if mark.encode() not in body:
                continue
            if mark not in self._proven and self._decimal[mark].search(body):
                self._proven.add(mark)
            if mark not in self._proven and mark not in self._open:
                self._note(mark, body, first_line, wanted)
        for mark, other in _MARKS.items():
            if mark in self._open and mark not in self._proven and other in self._proven:
                self._refuse(mark, other)

    def _note(self, mark: str, body: bytes, first_line: int, wanted: Collection[str]) -> None:
        """Keep the first cell of a wanted column that can be read in two ways."""
        for match in self._either[mark].finditer(body):
            begin = body.rfind(b"\n", 0, match.start()) + 1
            end = body.find(b"\n", match.start())
            row = body[begin : None if end < 0 else end].decode("utf-8")
            place = body.count(self._separator.encode(), begin, match.start())
            cells = split(row, self._separator)
            if place < min(len(cells), len(self._names)) and self._names[place] in wanted:
                line = first_line + body.count(b"\n", 0, match.start())
                self._open[mark] = (line, self._names[place], cells[place].strip())
                return

    def _refuse(self, mark: str, other: str) -> None:
        line, column, text = self._open[mark]
        words = {".": "point", ",": "comma"}
        raise LogError(
            f"'{printable(text)}' beside numbers with a decimal {words[other]} may be thousands: thousands separators"
            f" are not read; write the log without them, or with one decimal mark",
            file=self._file,
            line=line,
            column=column,
        )
