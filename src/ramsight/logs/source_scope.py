"""Logs of TwinCAT Scope (Beckhoff) as text: properties of each channel, then times and values side by side."""

from __future__ import annotations

import math

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import LogError
from ramsight.logs.digits import decimal
from ramsight.logs.header import split
from ramsight.logs.lines import cut_short, line_blocks, printable
from ramsight.logs.source_groups import Group, GroupSource, Recorded
from ramsight.logs.table_kind import SCOPE_NAME

_UNIT = "Unit"
_END = "EOF"
_FILETIME = 1e16  # numbers above it are steps of 100 ns since 1601, not milliseconds
_TICK, _MILLISECOND = 1e-7, 1e-3  # s


class ScopeSource(GroupSource):
    """An export of TwinCAT Scope. A column of times stands before each channel, or before those of one sample time."""

    def read(self) -> list[Group]:
        """The channels by the columns of times before them."""
        rows = _Rows(self.file)
        number = 0
        for block in line_blocks(self.path, encoding="latin-1", advance=self.advance, blank=b" \t\n\x0b\x0c"):
            is_whole = block.endswith(b"\n")
            for text in block.decode("utf-8").removesuffix("\n").split("\n"):
                number += 1
                if not rows.take(text, number, is_whole=is_whole):
                    return rows.groups()
        return rows.groups()


class _Rows:
    """Takes the lines of an export: properties by their first cell, then rows of numbers."""

    def __init__(self, file: str) -> None:
        self._file, self._separator = file, ""
        self._properties: dict[str, list[str]] = {}
        self._clocks: list[int] = []
        self._numbers: list[list[float]] = []

    def take(self, text: str, number: int, *, is_whole: bool) -> bool:
        """Take a line; false after the last row."""
        self._separator = self._separator or next((mark for mark in "\t;," if mark in text), "")
        cells = [cell.strip() for cell in split(text, self._separator or "\t")]
        if not any(cells):
            return not self._numbers
        if cells[0] == _END:
            return False
        if not self._numbers and not _is_number(cells[0], self._separator):
            self._properties[cells[0]] = cells  # of the project first, of the channels then
            return True
        if not self._clocks:
            names = self._properties.get(SCOPE_NAME, [])
            self._clocks = [place for place, cell in enumerate(names) if cell == SCOPE_NAME]
            if len(names) < 2 or not self._clocks:
                raise LogError("has no line 'Name' before its rows", file=self._file, line=number)
        try:
            self._numbers.append([_number(cell, self._separator) for cell in cells])
        except ValueError:
            if not is_whole:
                cut_short(self._file, number)
                return False
            if not _is_number(cells[0], self._separator):
                return False  # tables of markers
            raise LogError(f"is no row of numbers: '{printable(text)}'", file=self._file, line=number) from None
        return True

    def groups(self) -> list[Group]:
        """What was found."""
        if not self._numbers:
            raise LogError("has no rows of numbers", file=self._file)
        names = self._properties[SCOPE_NAME]
        width = len(names)
        table = np.full((len(self._numbers), width), math.nan)
        for place, row in enumerate(self._numbers):
            table[place, : min(len(row), width)] = row[:width]
        units = self._properties.get(_UNIT, [])
        begun = math.inf
        found: list[tuple[str, dict[str, Recorded], Array]] = []
        for clock, end in zip(self._clocks, [*self._clocks[1:], width], strict=True):
            ticks = table[:, clock]
            known = np.isfinite(ticks)
            if not known.any():
                continue
            time = ticks[known] * (_TICK if np.nanmax(ticks) > _FILETIME else _MILLISECOND)
            begun = min(begun, float(time[0]))
            channels = {
                names[place]: Recorded(table[known, place], units[place] if place < len(units) else "")
                for place in range(clock + 1, end)
                if names[place]
            }
            found.append((str(len(found)), channels, time))
        return [Group(name, channels, time - begun) for name, channels, time in found]


def _number(cell: str, separator: str) -> float:
    """A number of a cell, NaN of an empty one."""
    if not cell:
        return math.nan
    return decimal(cell if separator == "," else cell.replace(",", "."))


def _is_number(cell: str, separator: str) -> bool:
    try:
        return not math.isnan(_number(cell, separator))
    except ValueError:
        return False
