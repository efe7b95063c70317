"""Logs in CSV files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import DescriptionError, LogError
from ramsight.logs.clock_units import second_of
from ramsight.logs.column_names import are_two_clocks, is_clock_like
from ramsight.logs.csv_table import CsvTable
from ramsight.logs.header import split
from ramsight.logs.lines import Advance, line_blocks
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.row_clock import Rows
from ramsight.logs.rows import MISSING, number_of
from ramsight.logs.source import Offered, TableSource, unit_in_name
from ramsight.logs.stamps import is_stamp, stamp_seconds


class CsvSource(TableSource):
    """A CSV file: one clock column, a channel a column; by default the header is its first line."""

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, file_map, advance)
        self.table_path = Path(path)
        self.table = CsvTable(path, None if file_map is None else file_map.form, advance=advance)

    def offered(self) -> list[Offered]:
        """The columns, the clock among them."""
        pairs = zip(self.table.names, self.table.units, strict=True)
        return [Offered(name, unit or unit_in_name(name)) for name, unit in pairs if name]

    def rows(self, numbers: Sequence[str], stamps: Sequence[str]) -> Iterator[Rows]:
        """Some megabytes of rows at a time; cells without a number are NaN."""
        for rows in self.table.blocks(numbers, gaps=numbers, stamps=stamps):
            named = dict(zip(numbers, rows[1:] if stamps else rows, strict=True))
            yield Rows(rows.shape[1], named, rows[0] if stamps else None)

    def first_stamps(self, names: Sequence[str]) -> Array:
        """The times in the first rows of columns of dates and times of day [s]; looked at before `rows`."""
        places = [self.table.places[name][0] for name in names]
        times = np.full(len(self._first_rows), math.nan)
        for number, (_, row) in enumerate(self._first_rows):
            with suppress(ValueError, IndexError):
                times[number] = stamp_seconds(" ".join(row[place].strip() for place in places))
        return times

    def first_stamp(self, name: str) -> str:
        """The first cell of a column if it is a date or a time of day, else ""; looked at before `rows`."""
        places = self.table.places.get(name, [])
        if len(places) != 1:
            return ""
        (place,) = places
        cells = (row[place].strip() for _, row in self._first_rows if len(row) > place)
        first = next((cell for cell in cells if cell), "")
        return first if is_stamp(first) else ""

    def check_one_clock(self) -> None:
        """Refuse a table in which columns have clocks of their own; looked at before `rows`."""
        named = "" if self.time is None else self.time.channel
        if self.time is None or named not in self.table.places:
            return
        if len(self.table.places[named]) > 1:
            raise LogError(
                "is there more than once: a table has one clock; write all channels over one, or a file for each",
                file=self.file,
                line=self.table.first_row - 1,
                column=named,
            )
        period = self.time.period
        clock = self._first_times(self.table.places[named][0], f"{period} s" if period else self.time.unit)
        others = []
        for place, name in enumerate(self.table.names):
            unit = self.table.units[place] or unit_in_name(name)
            if name in ("", *self.time.columns) or not is_clock_like(name, unit):
                continue
            if are_two_clocks(clock, self._first_times(place, unit)):
                others.append(name)
        if others:
            raise LogError(
                f"the columns {', '.join(others[:_LISTED])} are clocks that go on otherwise than {named}: a table"
                " has one clock; write all channels over one, or a file for each",
                file=self.file,
            )

    def _first_times(self, place: int, unit: str | None) -> Array:
        """The first numbers of a column in seconds, NaN where it has none."""
        try:
            second = second_of(unit or "s")
        except DescriptionError:
            second = math.nan
        times = np.full(len(self._first_rows), math.nan)
        for number, (_, row) in enumerate(self._first_rows):
            with suppress(ValueError):
                times[number] = self._number(row[place]) * second if len(row) > place else math.nan
        return times

    def first_numbers(self, name: str) -> Array:
        """The numbers in the first rows of a column, NaN where there is none; looked at before `rows`."""
        return self._first_times(self.table.places[name][0], "s")

    def texts(self, name: str, most: int) -> list[str]:
        """The different texts in a column, in their order; in a pass of its own over the file."""
        place, found = self.table.places[name][0], dict[str, None]()
        if not self._note(place).startswith("text"):
            return []
        lines = self.table.first_row - 1
        for block in line_blocks(self.table_path, encoding=self.table.encoding):
            for text in block.decode("utf-8").removesuffix("\n").split("\n")[lines:]:
                cells = split(text, self.table.separator)
                if len(cells) == len(self.table.names) and cells[place].strip():
                    found[cells[place].strip()] = None
            if len(found) > most:
                break
            lines = 0
        return list(found)

    @property
    def head(self) -> list[str]:
        """The lines before the header."""
        return self.table.head

    def notes(self, names: Sequence[str]) -> dict[str, str]:
        """Why columns cannot be read as numbers, "" for those that can by the look of their first rows."""
        return {name: self._note(*self.table.places[name]) for name in names}

    @cached_property
    def _first_rows(self) -> list[tuple[int, list[str]]]:
        """The first rows as text, but for the header once more; taken before `rows` for all columns at once."""
        rows = self.table.first_cells(_LOOKED_AT)
        return [(line, row) for line, row in rows if [cell.strip() for cell in row] != self.table.names]

    def _note(self, place: int, *others: int) -> str:
        if others:
            return "not read: its name is there more than once"
        for line, row in self._first_rows:
            if len(row) <= place:
                continue
            try:
                self._number(row[place])
            except ValueError as error:
                kind = "date or time" if is_stamp(row[place]) else "text"
                return f"text: {error} (line {line})" if kind == "text" else f"{kind}: not the clock (line {line})"
        return ""

    def _number(self, cell: str) -> float:
        text = cell.strip()
        return math.nan if text.lower() in MISSING else number_of(text, is_decimal_comma=self.table.is_decimal_comma)


_LOOKED_AT = 200  # rows
_LISTED = 6  # columns in a message
