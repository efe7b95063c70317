"""Rows of a CSV file as numbers: fast when all is well, exact about the place when it is not.

The C parser of NumPy reads the cells (about 0.3 us a row). Where it stumbles, or where a cell has no finite number, a
slow pass in Python goes through the same text and states which line and which column.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import LogError
from ramsight.logs.digits import decimal
from ramsight.logs.header import split
from ramsight.logs.lines import printable
from ramsight.logs.stamps import stamp_seconds


@dataclass(frozen=True)
class Layout:
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
        """Places of the wanted columns."""
        places = {name: place for place, name in enumerate(self.names)}
        return [places[name] for name in self.wanted]

    def stamp(self, cells: Sequence[str]) -> str:
        """The cells of a row that say when it was."""
        return " ".join(cells[self.names.index(name)].strip() for name in self.stamps)


def parse_fast(body: bytes, layout: Layout) -> Array | None:
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


def _stamped(body: bytes, layout: Layout) -> Array | None:
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


def parse_carefully(body: bytes, layout: Layout, first_line: int) -> Array:
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
            some = "1 cell" if len(cells) == 1 else f"{len(cells)} cells"
            what = "is blank" if not line.strip() else f"has {some} where the header has {width}"
            raise LogError(what, file=layout.file, line=number)
        values = [_number(cells[index], name, number, layout) for index, name in places]
        rows.append([_stamp(cells, number, layout), *values] if layout.stamps else values)
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).T)


def _stamp(cells: Sequence[str], line: int, layout: Layout) -> float:
    text = layout.stamp(cells)
    try:
        return stamp_seconds(text)
    except ValueError:
        what = f"is no date or time of day: '{printable(text)}'"
        raise LogError(what, file=layout.file, line=line, column=layout.stamps[-1]) from None


MISSING = frozenset(("", "n/a", "na", "#n/a", "#nv", "null", "none", "-", "--", "---"))
"""What a cell without a number may say, in small letters."""

_THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(?:([,.'  ])[0-9]{3})+(?:[.,][0-9]+)?")


def number_of(text: str, *, is_decimal_comma: bool) -> float:
    """The number in a cell.

    Raises:
        ValueError: it is none; states what may be the matter.

    Example:
        >>> number_of("12,5", is_decimal_comma=True)
        12.5
    """
    try:
        return decimal(text.replace(",", ".") if is_decimal_comma else text)
    except ValueError:
        hint = ""
        if _THOUSANDS.fullmatch(text):
            hint = "; thousands separators are not read: write the log without them"
        elif not is_decimal_comma and re.fullmatch(r"[+-]?[0-9]+,[0-9]+", text):
            hint = "; for decimal commas in quotes the channel map has [csv] decimal = ','"
        raise ValueError(f"is not a number: '{printable(text)}'{hint}") from None


def _number(cell: str, name: str, line: int, layout: Layout) -> float:
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
