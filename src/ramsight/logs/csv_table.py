"""Columns of numbers out of a CSV file, some megabytes at a time."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import LogError, MissingColumnError, warn_of_log
from ramsight.logs import header
from ramsight.logs.channels import TIME
from ramsight.logs.lines import BLOCK, Advance, cut_short, file_name, line_blocks, printable
from ramsight.logs.rows import MISSING, Layout, parse_carefully, parse_fast

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
            cells = header.split(row, self._separator)
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


FIRST_ROW = 2
"""Line of the first row: the header is line 1, and every row is one line."""

_COLUMNS_SHOWN = 20
_LOOKED_AT = 200  # rows, for columns without a name


class CsvTable:
    """A CSV file that is read some rows at a time.

    Cells are separated by commas, or by semicolons or tabs with a decimal comma or point. A row of units may stand
    under the header: it is one if its cell in the first column is a unit of time, and it is passed over.

    Attributes:
        file: the file as messages name it.
        units: of the columns as the row of units has them, "" without one.
        head: the lines before the header.

    Raises:
        LogError: the file cannot be read, has no header or no rows.
    """

    def __init__(
        self, path: str | Path, form: header.CsvForm | None = None, *, advance: Advance | None = None, size: int = BLOCK
    ) -> None:
        form = form or header.CsvForm()
        self.file = file_name(path)
        self._decimal, self.encoding = form.decimal, form.encoding
        self._blocks, self._body = line_blocks(path, encoding=form.encoding, advance=advance, size=size), b""
        if self._peek() is None:
            raise LogError("is empty", file=self.file)
        self.head = [self._take() or "" for _ in range(form.header_line - 1)]
        head, lines = self._take_header()
        if not head.strip():
            raise LogError("is blank where the header should stand", file=self.file, line=form.header_line)
        self.separator = form.separator or header.separator_of(head)
        head = head.strip(" ").removeprefix("#")  # as NumPy's savetxt begins a header
        self.names = [name.strip() for name in header.cells_of(head, self.separator, self.file, form.header_line)]
        self.units = [""] * len(self.names)
        self.first_row = form.header_line + lines
        self._pass_over(form.first_row)
        first = self._peek()
        if first is None:
            raise LogError("has a header but no rows", file=self.file)
        cells = header.cells_of(first, self.separator, self.file, self.first_row)
        if len(cells) == len(self.names) + 1 and not cells[-1].strip():  # rows end in a separator, the header does not
            self.names.append("")
            self.units.append("")
        if len(cells) == len(self.names) - 1 and self.names[-1].lower() == header.NEVER_FILLED:
            del self.names[-1], self.units[-1]
        self._name_columns()

    def _name_columns(self) -> None:
        """Name the columns that have cells, and no name, by their place: what stands beside a merged cell."""
        filled = {place for _, row in self.first_cells(_LOOKED_AT) for place, cell in enumerate(row) if cell.strip()}
        for place, name in enumerate(self.names):
            if not name and place in filled:
                self.names[place] = f"column {place + 1}"

    def _take_header(self) -> tuple[str, int]:
        """The header, and how many lines it takes: cells in quotes may have line breaks."""
        first = self._take() or ""
        ahead = self._body.split(b"\n", header.MOST_BREAKS)[: header.MOST_BREAKS] if '"' in first else []
        (_, head), *rest = header.whole_lines([first, *(line.decode("utf-8") for line in ahead)])
        lines = rest[0][0] - 1 if rest else 1 + len(ahead)
        for _ in range(lines - 1):
            self._take()
        return head, lines

    def _pass_over(self, first_row: int | None) -> None:
        """Take what stands between the header and the first row; one line of it may be the units."""
        while first_row is None or self.first_row < first_row:
            under = self._peek()
            if under is None:
                return
            units = header.units_row(under, self.separator, strict=first_row is None)
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

    def blocks(self, wanted: Sequence[str], gaps: Collection[str] = (), stamps: Sequence[str] = ()) -> Iterator[Array]:
        """The rows, once. A last line that breaks off in the middle of a row is left out, with a warning.

        Args:
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
            if len(self.places[name]) > 1:
                raise LogError("is there more than once", file=self.file, line=self.first_row - 1, column=name)
        layout = Layout(
            self.file,
            self.separator,
            tuple(self.names),
            tuple(wanted),
            frozenset(gaps),
            tuple(stamps),
            self.is_decimal_comma,
        )
        line, rows = self.first_row, 0
        decimals = Decimals(self.file, self.separator, self.names) if self.is_decimal_comma else None
        while self._peek() is not None:
            body, self._body = self._body, b""
            if decimals is not None:
                decimals.check(body, line, wanted)
            table = parse_fast(body, layout) if body.endswith(b"\n") else self._parse_last(body, layout, line, rows)
            if table is None and not body.endswith(b"\n"):
                return
            if table is None:
                before, wrong = self._parse_to_fault(body, layout, line)
                if before is not None:
                    yield before
                if wrong is not None:
                    self._end_of_table(body, wrong, line, has_rows=rows > 0 or before is not None)
                    return
            else:
                yield table
            line, rows = line + body.count(b"\n"), rows + body.count(b"\n")

    def _parse_to_fault(self, body: bytes, layout: Layout, line: int) -> tuple[Array | None, LogError | None]:
        """The rows before the first that is none, None if there are none, and what is wrong with that one."""
        try:
            return parse_carefully(body, layout, line), None
        except LogError as error:
            good = (error.line or line) - line
            before = b"".join(one + b"\n" for one in body.split(b"\n", good)[:good])
            return (parse_carefully(before, layout, line) if before else None), error

    def _end_of_table(self, body: bytes, wrong: LogError, line: int, *, has_rows: bool) -> None:
        """Warn where lines that are no rows stand at the end of the file, a summary or the header again; else raise."""
        at = wrong.line or line
        rest = body.split(b"\n", at - line)[-1].removesuffix(b"\n").decode("utf-8").split("\n")
        while len(rest) <= MOST_AFTER and (more := self._take()) is not None:
            rest.append(more)
        rows = [header.cells_of(text, self.separator, self.file, at + k) for k, text in enumerate(rest)]
        if not has_rows or len(rest) > MOST_AFTER or not is_after_table(rows, self.names):
            raise wrong
        warn_of_log(
            "from this line on stand no rows, a summary perhaps; they are left out, what stands before is read",
            file=self.file,
            line=at,
        )

    def _parse_last(self, body: bytes, layout: Layout, line: int, rows: int) -> Array | None:
        """The last line of a file that does not end in a newline; None if it breaks off in the middle of a row."""
        try:
            return parse_carefully(body + b"\n", layout, line)
        except LogError:
            if not rows or body.startswith(b"\n"):
                raise
            cut_short(self.file, line)
            return None

    @property
    def is_decimal_comma(self) -> bool:
        """Whether a comma in a cell is a decimal one."""
        return self._decimal == "," or (self._decimal is None and self.separator != ",")

    @cached_property
    def places(self) -> dict[str, list[int]]:
        """In which columns each name stands."""
        found: dict[str, list[int]] = {}
        for place, name in enumerate(self.names):
            found.setdefault(name, []).append(place)
        return found

    def first_cells(self, rows: int) -> list[tuple[int, list[str]]]:
        """The first rows as text, each with its line, before `blocks` takes them."""
        if self._peek() is None:
            return []
        found = []
        for line, text in enumerate(self._body.split(b"\n", rows)[:rows], start=self.first_row):
            if text:
                found.append((line, header.cells_of(text.decode("utf-8"), self.separator, self.file, line)))
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
) -> dict[str, Array]:
    """Columns of a CSV file, or of one compressed with gzip if its name ends in ``.gz``.

    The columns may stand in any order; others are ignored. A byte-order mark, CRLF line ends, blanks around cells
    and blank lines at the end are fine.

    Args:
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


def read_timed(path: str | Path, needed: Sequence[str], optional: Sequence[str] = ()) -> dict[str, Array]:
    """Columns of a CSV file over the time in its column ``time_s``, as `read_columns` reads them.

    Returns:
        As `read_columns`, with the times [s], which increase.

    Raises:
        MissingColumnError: a needed column is absent.
        LogError: as `read_columns`, or the times do not increase.
    """
    columns = read_columns(path, [TIME, *needed], optional)
    check_increasing(columns[TIME], TIME, file_name(path))
    return columns


def check_columns(names: Sequence[str], needed: Sequence[str], file: str) -> None:
    """Reject a table without a column that is needed.

    Raises:
        MissingColumnError: names those that are missing and some of those that are there.
    """
    missing = [name for name in needed if name not in names]
    if missing:
        found = [printable(name) or "(no name)" for name in names[:_COLUMNS_SHOWN]]
        if len(names) > _COLUMNS_SHOWN:
            found.append(f"and {len(names) - _COLUMNS_SHOWN} more")
        raise MissingColumnError(file=file, missing=missing, found=found)


def check_increasing(time: Array, column: str, file: str) -> None:
    """Refuse times that do not increase.

    Args:
        time: times as read [s], shape (n,).

    Raises:
        LogError: a time is not above the one before it; names the line.
    """
    stuck = np.flatnonzero(time[1:] <= time[:-1])
    if stuck.size:
        row = int(stuck[0]) + 1
        now, before = float(time[row]), float(time[row - 1])
        what = "does not increase" if now == before else "goes backwards"
        raise LogError(f"time {what}: {now!r} after {before!r}", file=file, line=FIRST_ROW + row, column=column)


MOST_AFTER = 60
"""Lines of a summary at most; more are a table that is damaged."""


def is_after_table(rows: Sequence[Sequence[str]], names: Sequence[str]) -> bool:
    """Whether lines are a summary: each is blank, the header, or begins with a word; and there is one with text.

    Example:
        >>> is_after_table([[""], ["Min", "0", "1"]], ["t", "n", "M"]), is_after_table([["0.5", "x"]], ["t", "n"])
        (True, False)
    """
    filled = [cells for cells in rows if any(cell.strip() for cell in cells)]
    return bool(filled) and all(_is_remark(cells, names) for cells in filled)


def _is_remark(cells: Sequence[str], names: Sequence[str]) -> bool:
    first = next(cell for cell in (cell.strip().lstrip("#*=[(</;!_- ") for cell in (*cells, "-")) if cell)
    return [cell.strip() for cell in cells] == list(names) or (
        first[:1].isalpha() and len(first) > 1 and first.lower() not in MISSING | _NUMBERS
    )


_NUMBERS = frozenset(("nan", "inf", "infinity", "true", "false", "ok"))
