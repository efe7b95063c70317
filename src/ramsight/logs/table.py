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
from ramsight.logs.lines import BLOCK, Advance, cut_short, file_name, line_blocks, printable
from ramsight.logs.stamps import stamp_seconds
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
        first_row: line of the first row of numbers; None if it follows the header, or a row of units under it.
        decimal: comma or point; None reads both, a comma only where it does not separate cells.
    """

    header_line: int = 1
    separator: str | None = None
    encoding: str = "utf-8"
    first_row: int | None = None
    decimal: str | None = None


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
        self._decimal = form.decimal
        self._blocks, self._body = line_blocks(path, encoding=form.encoding, advance=advance, size=size), b""
        if self._peek() is None:
            raise LogError("is empty", file=self.file)
        for _ in range(form.header_line - 1):
            self._take()
        head = self._take() or ""
        if not head.strip():
            raise LogError("is blank where the header should stand", file=self.file, line=form.header_line)
        self.separator = form.separator or separator_of(head)
        self.names = [name.strip() for name in _split(head, self.separator, self.file, form.header_line)]
        self.units = [""] * len(self.names)
        self.first_row = form.header_line + 1
        self._pass_over(form.first_row)
        if self._peek() is None:
            raise LogError("has a header but no rows", file=self.file)

    def _pass_over(self, first_row: int | None) -> None:
        """Take what stands between the header and the first row; one line of it may be the units."""
        while first_row is None or self.first_row < first_row:
            under = self._peek()
            if under is None:
                return
            units = units_row(under, self.separator, strict=first_row is None)
            if units is None and first_row is None:
                return
            if units is not None and len(units) == len(self.names):
                self.units = units
            elif first_row is None:
                return
            self._take()
            self.first_row += 1
            if first_row is None:
                return

    def blocks(
        self, wanted: Sequence[str], gaps: Collection[str] = (), stamps: Sequence[str] = ()
    ) -> Iterator[NDArray[np.float64]]:
        """The rows, once. A last line that breaks off in the middle of a row is left out, with a warning.

        Args:
            wanted: names of columns that are there.
            gaps: those among them in which a cell may hold no number: empty, ``nan``, ``inf`` and words such as ``N/A``
                read as NaN.
            stamps: columns that together are a date and a time of day, or one of the two.

        Yields:
            Values in the file's units, shape (columns, rows), rows >= 1; finite but for the gaps. With `stamps` one row
            more, the first: seconds since 1970, or since midnight.

        Raises:
            LogError: a row has too few or too many cells, or a cell has no (finite) number; with line and column.
        """
        for name in (*stamps, *wanted):
            if self.names.count(name) > 1:
                raise LogError("is there more than once", file=self.file, line=self.first_row - 1, column=name)
        layout = _Layout(
            self.file,
            self.separator,
            tuple(self.names),
            tuple(wanted),
            frozenset(gaps),
            tuple(stamps),
            self.is_decimal_comma,
        )
        line, rows = self.first_row, 0
        while self._peek() is not None:
            body, self._body = self._body, b""
            if body.endswith(b"\n"):
                table = _parse_fast(body, layout)
                table = _parse_carefully(body, layout, line) if table is None else table
            else:
                last = self._parse_last(body, layout, line, rows)
                if last is None:
                    return
                table = last
            yield table
            line, rows = line + body.count(b"\n"), rows + table.shape[1]

    def _parse_last(self, body: bytes, layout: _Layout, line: int, rows: int) -> NDArray[np.float64] | None:
        """The last line of a file that does not end in a newline; None if it breaks off in the middle of a row."""
        try:
            return _parse_carefully(body + b"\n", layout, line)
        except LogError:
            if not rows or body.startswith(b"\n"):
                raise
            cut_short(self.file, line)
            return None

    @property
    def is_decimal_comma(self) -> bool:
        """Whether a comma in a cell is a decimal one."""
        return self._decimal == "," or (self._decimal is None and self.separator != ",")

    def first_cells(self, rows: int) -> list[tuple[int, list[str]]]:
        """The first rows as text, each with its line, before `blocks` takes them."""
        if self._peek() is None:
            return []
        found = []
        for line, text in enumerate(self._body.split(b"\n", rows)[:rows], start=self.first_row):
            if text:
                found.append((line, _split(text.decode("utf-8"), self.separator, self.file, line)))
        return found

    def _peek(self) -> str | None:
        """The next line, which stays; None at the end of the file."""
        if not self._body:
            self._body = next(self._blocks, b"")
        return self._body.partition(b"\n")[0].decode("utf-8") if self._body else None

    def _take(self) -> str | None:
        """The next line; None at the end of the file."""
        line = self._peek()
        self._body = self._body.partition(b"\n")[2]
        return line


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


def _split(line: str, separator: str, file: str, number: int | None) -> list[str]:
    try:
        return split(line, separator)
    except csv.Error as error:
        raise LogError(f"is no row of a CSV file: {error}", file=file, line=number) from None


def units_row(line: str, separator: str, *, strict: bool = True) -> list[str] | None:
    """The units in a line, brackets taken off, if it is a row of units: no numbers, and a unit of time first.

    Args:
        line: the line.
        separator: between its cells.
        strict: whether the first unit is one of time; else any unit in it makes it a row of units.

    Example:
        >>> units_row("[s];[1/min];[Nm];", ";")
        ['s', '1/min', 'Nm', '']
        >>> units_row("0,0;1;2", ";") is None
        True
    """
    try:
        cells = [_BRACKETS.sub(r"\1", cell).strip() for cell in split(line, separator)]
        if strict:
            parse(f"1 {cells[0]}", "s")
        elif not any(is_unit(cell) for cell in cells):
            return None
    except (DescriptionError, csv.Error):
        return None
    return None if any(_is_number(cell) for cell in cells) else cells


def is_unit(text: str) -> bool:
    """Whether a text is a unit of time, speed, torque, temperature or length, or a share.

    Example:
        >>> is_unit("1/min"), is_unit("measured")
        (True, False)
    """
    for quantity in ("s", "rad/s", "N m", "K", "m", "1"):
        try:
            parse(f"1 {text}", quantity)
        except DescriptionError:
            continue
        return bool(text)
    return False


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


@dataclass(frozen=True)
class _Layout:
    """How the rows of one file are read: all its columns, those wanted, with gaps, and of the clock."""

    file: str
    separator: str
    names: tuple[str, ...]
    wanted: tuple[str, ...]
    gaps: frozenset[str]
    stamps: tuple[str, ...]
    is_decimal_comma: bool

    @property
    def indices(self) -> list[int]:
        return [self.names.index(name) for name in self.wanted]

    def stamp(self, cells: Sequence[str]) -> str:
        """The cells of a row that say when it was."""
        return " ".join(cells[self.names.index(name)].strip() for name in self.stamps)


def _parse_fast(body: bytes, layout: _Layout) -> NDArray[np.float64] | None:
    """The wanted columns, shape (columns, rows), or None where the careful pass has to look."""
    if b'"' in body:
        return None
    if layout.separator != "," and not layout.is_decimal_comma and b"," in body:
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
    text = (_name_gaps(body) if layout.gaps.intersection(layout.wanted) else body).decode("utf-8")
    rows = np.empty((len(is_newline), 0))
    try:
        if layout.wanted:
            rows = np.loadtxt(io.StringIO(text), delimiter=",", comments=None, usecols=layout.indices, ndmin=2)
        clock = _stamped(body, layout)
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
    return table if clock is None else np.vstack([clock, table])


def _stamped(body: bytes, layout: _Layout) -> NDArray[np.float64] | None:
    """The clock of rows whose cells are separated by commas, None if it is no date or time of day."""
    if not layout.stamps:
        return None
    lines = body.decode("utf-8")[:-1].split("\n")
    return np.array([stamp_seconds(layout.stamp(line.split(","))) for line in lines], dtype=np.float64)


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
        values = [_number(cells[index], name, number, layout) for index, name in places]
        rows.append([_stamp(cells, number, layout), *values] if layout.stamps else values)
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).T)


def _count(cells: int) -> str:
    return "1 cell" if cells == 1 else f"{cells} cells"


def _stamp(cells: Sequence[str], line: int, layout: _Layout) -> float:
    text = layout.stamp(cells)
    try:
        return stamp_seconds(text)
    except ValueError:
        what = f"is no date or time of day: '{printable(text)}'"
        raise LogError(what, file=layout.file, line=line, column=layout.stamps[-1]) from None


MISSING = frozenset(("", "n/a", "na", "#n/a", "#nv", "null", "none", "-", "--", "---"))
"""What a cell without a number may say, in small letters."""

_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:([,.'  ])\d{3})+(?:[.,]\d+)?")


def number_of(text: str, *, is_decimal_comma: bool) -> float:
    """The number in a cell.

    Args:
        text: the cell.
        is_decimal_comma: whether a comma in it is a decimal one.

    Raises:
        ValueError: it is none; says what may be the matter.

    Example:
        >>> number_of("12,5", is_decimal_comma=True)
        12.5
    """
    try:
        if "_" in text or not text.isascii():  # float() takes 1_000 and digits of every script
            raise ValueError
        return float(text.replace(",", ".") if is_decimal_comma else text)
    except ValueError:
        hint = ""
        if _THOUSANDS.fullmatch(text):
            hint = "; thousands separators are not read: write the log without them"
        elif not is_decimal_comma and re.fullmatch(r"[+-]?\d+,\d+", text):
            hint = "; for decimal commas in quotes the channel map has [csv] decimal = ','"
        raise ValueError(f"is not a number: '{printable(text)}'{hint}") from None


def _number(cell: str, name: str, line: int, layout: _Layout) -> float:
    text = cell.strip()
    if name in layout.gaps and text.lower() in MISSING:
        return math.nan
    if not text:
        raise LogError("is empty where a number should stand", file=layout.file, line=line, column=name)
    try:
        value = number_of(text, is_decimal_comma=layout.is_decimal_comma)
    except ValueError as error:
        raise LogError(str(error), file=layout.file, line=line, column=name) from None
    if math.isfinite(value):
        return value
    if name in layout.gaps:
        return math.nan
    raise LogError(f"is not finite: '{printable(text)}'", file=layout.file, line=line, column=name)
