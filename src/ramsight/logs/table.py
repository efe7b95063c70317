"""Columns of numbers out of a CSV file: fast when all is well, exact about the place when it is not.

The C parser of NumPy reads the cells (about 0.4 us a row). Where it stumbles, or where a cell has no finite
number, a slow pass in Python goes through the same text and says which line and which column.
"""

from __future__ import annotations

import csv
import gzip
import io
import math
import zlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import LogError, MissingColumnError

FIRST_ROW = 2
"""Line of the first row: the header is line 1, and every row is one line."""

_SHOWN = 40
_COLUMNS_SHOWN = 20


def printable(text: object) -> str:
    r"""Text fit for a one-line message: control characters escaped, cut after 40 characters.

    Example:
        >>> printable("a\nb")
        'a\\nb'
    """
    shown = str(text)
    if len(shown) > _SHOWN:
        shown = shown[:_SHOWN] + "…"
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in shown)


def file_name(path: str | Path) -> str:
    """A path as messages name it: whole, and on one line."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(path))


def read_columns(
    path: str | Path, needed: Sequence[str], optional: Sequence[str] = (), gaps: Collection[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Columns of a CSV file, or of one compressed with gzip if its name ends in ``.gz``.

    Cells are separated by commas, or by semicolons with a decimal comma. The columns may stand in any order;
    others are ignored. A byte-order mark, CRLF line ends, blanks around cells and blank lines at the end are
    fine.

    Args:
        path: the file.
        needed: columns that must be there.
        optional: columns that are read if they are there.
        gaps: those among them in which a cell may be empty, which reads as NaN.

    Returns:
        Column name to values in the file's units, each of shape (n,), n >= 1; finite but for the gaps.

    Raises:
        MissingColumnError: a needed column is absent.
        LogError: the file cannot be read or decoded, a column is there twice, a row has too few or too many
            cells, or a cell has no finite number; with line and column where there is one.
    """
    file = file_name(path)
    head, body = _head_and_body(_read_bytes(path, file), file)
    separator = ";" if ";" in head and "," not in head else ","
    names = [name.strip() for name in _split(head, separator)]
    wanted = _wanted(names, needed, optional, file)
    layout = _Layout(file, separator, tuple(names), tuple(wanted), frozenset(gaps))
    table = _parse_fast(body, layout)
    if table is None:
        table = _parse_carefully(body, layout)
    return dict(zip(wanted, table, strict=True))


def check_increasing(time: NDArray[np.float64], column: str, file: str) -> None:
    """Refuse times that do not increase.

    Args:
        time: times as read [s], shape (n,).
        column: name of their column.
        file: the file they were read from.

    Raises:
        LogError: a time is not above the one before it; names the line.
    """
    stuck = np.flatnonzero(time[1:] <= time[:-1])
    if stuck.size:
        row = int(stuck[0]) + 1
        now, before = float(time[row]), float(time[row - 1])
        what = "does not increase" if now == before else "goes backwards"
        raise LogError(f"time {what}: {now!r} after {before!r}", file=file, line=FIRST_ROW + row, column=column)


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


def _read_bytes(path: str | Path, file: str) -> bytes:
    try:
        data = Path(path).read_bytes()
    except FileNotFoundError:
        raise LogError("no such file", file=file) from None
    except IsADirectoryError:
        raise LogError("is a directory, not a file", file=file) from None
    except OSError as error:
        raise LogError(f"cannot be read: {error.strerror or error}", file=file) from None
    except ValueError as error:  # a null character in the path
        raise LogError(f"cannot be read: {error}", file=file) from None
    if str(path).endswith(".gz"):
        try:
            return gzip.decompress(data)
        except gzip.BadGzipFile:
            raise LogError("is not a gzip file though its name ends in .gz", file=file) from None
        except EOFError:
            raise LogError("is a gzip file that breaks off before its end", file=file) from None
        except zlib.error:
            raise LogError("is a damaged gzip file", file=file) from None
    if data.startswith(b"\x1f\x8b"):
        raise LogError("is a gzip file; give it a name that ends in .csv.gz", file=file)
    return data


def _head_and_body(data: bytes, file: str) -> tuple[str, bytes]:
    """The header line as text, and the rows as UTF-8 bytes, each ended by a newline."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise LogError("is UTF-16 text; save it as UTF-8", file=file)
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if not data.isascii():
        try:
            data.decode("utf-8")
        except UnicodeDecodeError as error:
            line = data.count(b"\n", 0, error.start) + 1
            raise LogError(f"byte 0x{data[error.start]:02x} is not UTF-8 text", file=file, line=line) from None
    if not data.strip():
        raise LogError("is empty", file=file)
    head, _, body = data.partition(b"\n")
    if not head.strip():
        raise LogError("is blank where the header should stand", file=file, line=1)
    body = body.rstrip()
    if not body:
        raise LogError("has a header but no rows", file=file)
    return head.decode("utf-8"), body + b"\n"


def _split(line: str, separator: str) -> list[str]:
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [""])


def _wanted(names: Sequence[str], needed: Sequence[str], optional: Sequence[str], file: str) -> list[str]:
    missing = [name for name in needed if name not in names]
    if missing:
        found = [printable(name) or "(no name)" for name in names[:_COLUMNS_SHOWN]]
        if len(names) > _COLUMNS_SHOWN:
            found.append(f"and {len(names) - _COLUMNS_SHOWN} more")
        raise MissingColumnError(file=file, missing=missing, found=found)
    wanted = [*needed, *(name for name in optional if name in names)]
    for name in wanted:
        if names.count(name) > 1:
            raise LogError("is there more than once", file=file, line=1, column=name)
    return wanted


def _parse_fast(body: bytes, layout: _Layout) -> NDArray[np.float64] | None:
    """The wanted columns, shape (columns, rows), or None where the careful pass has to look."""
    if b'"' in body:
        return None
    if layout.separator == ";":
        body = body.translate(bytes.maketrans(b";,", b",."))
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
    table = np.ascontiguousarray(rows.T)
    for name, column in zip(layout.wanted, table, strict=True):
        good = ~np.isinf(column) if name in layout.gaps else np.isfinite(column)
        if not good.all():
            return None
    return table


def _name_gaps(body: bytes) -> bytes:
    """Empty cells written as ``nan``, so that the fast parser reads them."""
    body = body.replace(b",,", b",nan,").replace(b",,", b",nan,").replace(b",\n", b",nan\n")
    body = body.replace(b"\n,", b"\nnan,")
    return b"nan" + body if body.startswith(b",") else body


def _parse_carefully(body: bytes, layout: _Layout) -> NDArray[np.float64]:
    """The wanted columns, shape (columns, rows), or a `LogError` that names line and column."""
    width = len(layout.names)
    places = list(zip(layout.indices, layout.wanted, strict=True))
    rows: list[list[float]] = []
    for number, line in enumerate(body.decode("utf-8")[:-1].split("\n"), start=FIRST_ROW):
        try:
            cells = _split(line, layout.separator)
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
        value = float(text.replace(",", ".") if layout.separator == ";" else text)
    except ValueError:
        raise LogError(f"is not a number: '{printable(text)}'", file=layout.file, line=line, column=name) from None
    if math.isinf(value) or (math.isnan(value) and name not in layout.gaps):
        raise LogError(f"is not finite: '{printable(text)}'", file=layout.file, line=line, column=name)
    return value
