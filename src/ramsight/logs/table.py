"""Columns of numbers out of a CSV file: fast when all is well, exact about the place when it is not.

The C parser of NumPy reads the cells (about 0.3 us a row), some megabytes at a time. Where it stumbles, or where a
cell has no finite number, a slow pass in Python goes through the same text and says which line and which column.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import DescriptionError, LogError, MissingColumnError
from ramsight.logs.lines import BLOCK, Advance, file_name, line_blocks, printable
from ramsight.units import parse

FIRST_ROW = 2
"""Line of the first row: the header is line 1, and every row is one line."""

SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab"}
_COLUMNS_SHOWN = 20
_BRACKETS = re.compile(r"\s*[\[(](.*)[\])]\s*")


@dataclass(frozen=True)
class CsvForm:
    """How a CSV file is laid out, where that cannot be seen from its first line.

    Args:
        header_line: line with the names of the columns, from 1; lines before it are passed over.
        separator: between cells; None looks at the header.
        encoding: of the letters.
    """

    header_line: int = 1
    separator: str | None = None
    encoding: str = "utf-8"


class CsvTable:
    """A CSV file that is read some rows at a time.

    Cells are separated by commas, or by semicolons or tabs with a decimal comma or point. A row of units may stand
    under the header: it is one if its cell in the first column is a unit of time, and it is passed over.

    Args:
        path: the file, compressed with gzip if its name ends in ``.gz``.
        form: its layout.
        advance: told how much of the file has been read.
        size: bytes read at once.

    Attributes:
        file: the file as messages name it.
        names: of the columns, in order.
        units: of the columns as the row of units has them, "" without one.
        separator: between cells.
        first_row: line of the first row.

    Raises:
        LogError: the file cannot be read, has no header or no rows.
    """

    def __init__(
        self, path: str | Path, form: CsvForm | None = None, *, advance: Advance | None = None, size: int = BLOCK
    ) -> None:
        form = form or CsvForm()
        self.file = file_name(path)
        self._blocks = line_blocks(path, encoding=form.encoding, advance=advance, size=size)
        data = self._next()
        if data is None:
            raise LogError("is empty", file=self.file)
        for _ in range(form.header_line - 1):
            data = self._after_a_line(data)[1]
        head, self._body = self._after_a_line(data)
        if not head.strip():
            raise LogError("is blank where the header should stand", file=self.file, line=form.header_line)
        self.separator = form.separator or separator_of(head)
        self.names = [name.strip() for name in split(head, self.separator)]
        self.units = [""] * len(self.names)
        self.first_row = form.header_line + 1
        under, below = self._after_a_line(self._body)
        units = units_row(under, self.separator)
        if units is not None and len(units) == len(self.names):
            self.units, self._body = units, below
            self.first_row += 1
        if not self._body:
            raise LogError("has a header but no rows", file=self.file)

    def blocks(self, wanted: Sequence[str], gaps: Collection[str] = ()) -> Iterator[NDArray[np.float64]]:
        """The rows, once.

        Args:
            wanted: names of columns that are there.
            gaps: those among them in which a cell may hold no number: empty, ``nan`` and ``inf`` read as NaN.

        Yields:
            Values in the file's units, shape (columns, rows), rows >= 1; finite but for the gaps.

        Raises:
            LogError: a row has too few or too many cells, or a cell has no (finite) number; with line and column.
        """
        for name in wanted:
            if self.names.count(name) > 1:
                raise LogError("is there more than once", file=self.file, line=self.first_row - 1, column=name)
        layout = _Layout(self.file, self.separator, tuple(self.names), tuple(wanted), frozenset(gaps))
        line, body = self.first_row, self._body
        self._body = b""
        while body:
            table = _parse_fast(body, layout)
            yield _parse_carefully(body, layout, line) if table is None else table
            line += body.count(b"\n")
            body = self._next() or b""

    def first_cells(self, rows: int) -> list[list[str]]:
        """The cells of the first rows as text, before `blocks` takes them."""
        lines = self._body.split(b"\n", rows)[:rows]
        return [split(line.decode("utf-8"), self.separator) for line in lines if line]

    def _next(self) -> bytes | None:
        return next(self._blocks, None)

    def _after_a_line(self, data: bytes) -> tuple[str, bytes]:
        """The first line of what is left, and the rest; more is read where the rest would be empty."""
        head, _, body = data.partition(b"\n")
        return head.decode("utf-8"), body or self._next() or b""


def read_columns(
    path: str | Path, needed: Sequence[str], optional: Sequence[str] = (), gaps: Collection[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Columns of a CSV file, or of one compressed with gzip if its name ends in ``.gz``.

    The columns may stand in any order; others are ignored. A byte-order mark, CRLF line ends, blanks around cells
    and blank lines at the end are fine.

    Args:
        path: the file.
        needed: columns that must be there.
        optional: columns that are read if they are there.
        gaps: those among them in which a cell may hold no number, which reads as NaN.

    Returns:
        Column name to values in the file's units, each of shape (n,), n >= 1; finite but for the gaps.

    Raises:
        MissingColumnError: a needed column is absent.
        LogError: the file cannot be read or decoded, a column is there twice, a row has too few or too many
            cells, or a cell has no finite number; with line and column where there is one.
    """
    table = CsvTable(path)
    check_columns(table.names, needed, table.file)
    wanted = [*needed, *(name for name in optional if name in table.names)]
    rows = np.concatenate(list(table.blocks(wanted, gaps)), axis=1)
    return dict(zip(wanted, rows, strict=True))


def check_columns(names: Sequence[str], needed: Sequence[str], file: str) -> None:
    """Refuse a table without a column that is needed.

    Raises:
        MissingColumnError: names those that are missing and some of those that are there.
    """
    missing = [name for name in needed if name not in names]
    if missing:
        found = [printable(name) or "(no name)" for name in names[:_COLUMNS_SHOWN]]
        if len(names) > _COLUMNS_SHOWN:
            found.append(f"and {len(names) - _COLUMNS_SHOWN} more")
        raise MissingColumnError(file=file, missing=missing, found=found)


def check_increasing(time: NDArray[np.float64], column: str, file: str, first_row: int = FIRST_ROW) -> None:
    """Refuse times that do not increase.

    Args:
        time: times as read [s], shape (n,).
        column: name of their column.
        file: the file they were read from.
        first_row: line of the first.

    Raises:
        LogError: a time is not above the one before it; names the line.
    """
    stuck = np.flatnonzero(time[1:] <= time[:-1])
    if stuck.size:
        row = int(stuck[0]) + 1
        now, before = float(time[row]), float(time[row - 1])
        what = "does not increase" if now == before else "goes backwards"
        raise LogError(f"time {what}: {now!r} after {before!r}", file=file, line=first_row + row, column=column)


def separator_of(head: str) -> str:
    r"""What separates the cells of a header: commas if there are any, else semicolons, else tabs.

    Example:
        >>> separator_of("time_s;motor_speed_rpm")
        ';'
    """
    return next((mark for mark in (",", ";", "\t") if mark in head), ",")


def split(line: str, separator: str) -> list[str]:
    """The cells of a line."""
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [""])


def units_row(line: str, separator: str) -> list[str] | None:
    """The units in a line, brackets taken off, if it is a row of units: no numbers, and a unit of time first.

    Example:
        >>> units_row("[s];[1/min];[Nm];", ";")
        ['s', '1/min', 'Nm', '']
        >>> units_row("0,0;1;2", ";") is None
        True
    """
    try:
        cells = [_BRACKETS.sub(r"\1", cell).strip() for cell in split(line, separator)]
        parse(f"1 {cells[0]}", "s")
    except (DescriptionError, csv.Error):
        return None
    return None if any(_is_number(cell) for cell in cells) else cells


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class _Layout:
    """How the rows of one file are read: all its columns, those wanted, and those that may have gaps."""

    file: str
    separator: str
    names: tuple[str, ...]
    wanted: tuple[str, ...]
    gaps: frozenset[str]

    @property
    def indices(self) -> list[int]:
        return [self.names.index(name) for name in self.wanted]


def _parse_fast(body: bytes, layout: _Layout) -> NDArray[np.float64] | None:
    """The wanted columns, shape (columns, rows), or None where the careful pass has to look."""
    if b'"' in body:
        return None
    if layout.separator != ",":
        body = body.translate(bytes.maketrans(layout.separator.encode() + b",", b",."))
    letters = np.frombuffer(body, dtype=np.uint8)
    ends = letters[(letters == ord(",")) | (letters == ord("\n"))]
    width = len(layout.names)
    if ends.size % width:
        return None
    is_newline = ends.reshape(-1, width) == ord("\n")
    if not is_newline[:, -1].all() or is_newline[:, :-1].any():
        return None
    if layout.gaps.intersection(layout.wanted):
        body = _name_gaps(body)
    try:
        rows = np.loadtxt(
            io.StringIO(body.decode("utf-8")), delimiter=",", comments=None, usecols=layout.indices, ndmin=2
        )
    except ValueError:
        return None
    if len(rows) != len(is_newline):
        return None  # NumPy passes over blank lines
    table = np.ascontiguousarray(rows.T)
    for name, column in zip(layout.wanted, table, strict=True):
        bad = ~np.isfinite(column)
        if bad.any():
            if name not in layout.gaps:
                return None
            column[bad] = math.nan
    return table


def _name_gaps(body: bytes) -> bytes:
    """Empty cells written as ``nan``, so that the fast parser reads them."""
    if b",," in body:
        body = body.replace(b",,", b",nan,").replace(b",,", b",nan,")
    if b",\n" in body:
        body = body.replace(b",\n", b",nan\n")
    if b"\n," in body:
        body = body.replace(b"\n,", b"\nnan,")
    return b"nan" + body if body.startswith(b",") else body


def _parse_carefully(body: bytes, layout: _Layout, first_line: int) -> NDArray[np.float64]:
    """The wanted columns, shape (columns, rows), or a `LogError` that names line and column."""
    width = len(layout.names)
    places = list(zip(layout.indices, layout.wanted, strict=True))
    rows: list[list[float]] = []
    for number, line in enumerate(body.decode("utf-8")[:-1].split("\n"), start=first_line):
        try:
            cells = split(line, layout.separator)
        except csv.Error as error:
            raise LogError(f"is no row of a CSV file: {error}", file=layout.file, line=number) from None
        if len(cells) != width:
            what = "is blank" if not line.strip() else f"has {_count(len(cells))} where the header has {width}"
            raise LogError(what, file=layout.file, line=number)
        rows.append([_number(cells[index], name, number, layout) for index, name in places])
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).T)


def _count(cells: int) -> str:
    return "1 cell" if cells == 1 else f"{cells} cells"


def _number(cell: str, name: str, line: int, layout: _Layout) -> float:
    text = cell.strip()
    if not text:
        if name in layout.gaps:
            return math.nan
        raise LogError("is empty where a number should stand", file=layout.file, line=line, column=name)
    try:
        if "_" in text or not text.isascii():  # float() takes 1_000 and digits of every script
            raise ValueError
        value = float(text.replace(",", ".") if layout.separator != "," else text)
    except ValueError:
        raise LogError(f"is not a number: '{printable(text)}'", file=layout.file, line=line, column=name) from None
    if math.isfinite(value):
        return value
    if name in layout.gaps:
        return math.nan
    raise LogError(f"is not finite: '{printable(text)}'", file=layout.file, line=line, column=name)
