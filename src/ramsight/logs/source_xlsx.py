"""Logs in Excel's files (``.xlsx``, ``.xlsm``): the sheet with the most rows, read as if it was saved as text."""

from __future__ import annotations

import csv
import datetime
import re
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any
from weakref import finalize
from xml.etree.ElementTree import ParseError

from ramsight.errors import LogError, warn_of_log
from ramsight.logs.guess import guess_form
from ramsight.logs.header import CsvForm
from ramsight.logs.lines import Advance, check_file, file_name, first_line
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.packed import check_unpacked
from ramsight.logs.source import needs
from ramsight.logs.source_csv import CsvSource

_SEPARATOR = "\t"
_CELLS = 1_000_000  # of a sheet, or one for each byte: empty ones are not written, and are read all the same
_FORMULA = re.compile(rb"<f(?:\s[^>]*)?(?:/>|>[^<]*</f>)\s*(?:</c>|<v\s*/>|<v>\s*</v>)")
_DAMAGE = (zipfile.BadZipFile, ParseError, ValueError, KeyError, TypeError, IndexError, AttributeError, OSError,
           EOFError, zlib.error, MemoryError, OverflowError, NotImplementedError, SyntaxError)  # fmt: skip


class XlsxSource(CsvSource):
    """An Excel file. Its longest sheet is written as a table of text and read from there; rows keep their numbers."""

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        check_file(path)
        file = file_name(path)
        folder = mkdtemp(prefix="ramsight-")
        finalize(self, rmtree, folder, True)
        text = Path(folder) / "sheet.txt"
        _write_text(path, text, file)
        form = file_map.form if file_map is not None and file_map.form != CsvForm() else guess_form(text)
        known = replace(file_map or ChannelMap(), form=replace(form, separator=_SEPARATOR, encoding="utf-8"))
        try:
            super().__init__(text, known, advance)
        except LogError as error:
            raise LogError(str(error).partition(": ")[2], file=file, line=error.line, column=error.column) from None
        self.path, self.file, self.table.file = Path(path), file, file


def _write_text(path: str | Path, text: Path, file: str) -> None:
    """The longest sheet as a table of text."""
    openpyxl: Any = needs("openpyxl", "logs", file)
    damage = (*_DAMAGE, openpyxl.utils.exceptions.InvalidFileException)
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(one.file_size for one in packed.infolist())  # no more is read of any
        check_unpacked(size, path)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: list(_rows(sheet, max(_CELLS, size))) for sheet in book.worksheets}
        book.close()
        formulas = _without_value(path)
    except damage as error:
        raise LogError(f"is no Excel file, or a damaged one: {first_line(error)}", file=file) from None
    longest = max(sheets, key=lambda title: len(sheets[title]), default="")
    if not longest or not any(any(row) for row in sheets[longest]):
        raise LogError("has no sheet with rows", file=file)
    others = [title for title, rows in sheets.items() if title != longest and any(any(row) for row in rows)]
    if others:
        warn_of_log(f"sheet {longest!r} is read, not {', '.join(map(repr, others[:6]))}", file=file)
    if formulas:
        warn_of_log(
            f"{formulas} formulas have no stored value, and are read as empty cells: open the file in a spreadsheet"
            " program and save it",
            file=file,
        )
    rows = sheets[longest]
    while not any(rows[-1]):
        rows.pop()
    with text.open("w", encoding="utf-8", newline="") as target:
        csv.writer(target, delimiter=_SEPARATOR, lineterminator="\n").writerows(rows)


def _rows(sheet: Any, most: int) -> Iterator[list[str]]:
    """The cells of a sheet as text, up to the last column that has any, whatever size the sheet says it has.

    Raises:
        ValueError: there are more cells than so many, almost all of them empty.
    """
    sheet.reset_dimensions()
    rows: list[list[str]] = []
    count = 0
    for row in sheet.iter_rows(values_only=True):
        count += len(row)
        if count > most:
            raise ValueError(f"sheet {sheet.title!r} has more than {most} cells, almost all of them empty")
        rows.append([_text(cell) for cell in row])
    width = max((place + 1 for row in rows for place, cell in enumerate(row) if cell), default=0)
    for row in rows:
        yield (row + [""] * width)[:width]


def _without_value(path: str | Path) -> int:
    """How many formulas of a book have no value beside them, as programs write them that do not calculate."""
    with zipfile.ZipFile(path) as book:
        names = [name for name in book.namelist() if name.startswith("xl/worksheets/") and name.endswith(".xml")]
        return sum(len(_FORMULA.findall(book.read(name))) for name in names)


def _text(cell: object) -> str:
    """A cell as text: numbers in full, dates as ISO 8601 has them."""
    if cell is None:
        return ""
    if isinstance(cell, (datetime.datetime, datetime.time, datetime.date)):
        return cell.isoformat()
    if isinstance(cell, datetime.timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, bool):
        return str(int(cell))
    return repr(cell) if isinstance(cell, (int, float)) else " ".join(str(cell).split())
