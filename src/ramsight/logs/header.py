"""The lines of a CSV file before its first row of numbers: how it is laid out, names and units of columns."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

from ramsight.errors import DescriptionError, LogError
from ramsight.logs.digits import decimal
from ramsight.units import parse

SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab"}
MOST_BREAKS = 100  # lines of a header whose cells have line breaks
NEVER_FILLED = "comment"
"""The last column of LabVIEW's tables, of which rows have no cell."""
_BRACKETS = re.compile(r"\s*[\[(](.*)[\])]\s*")


@dataclass(frozen=True)
class CsvForm:
    """How a CSV file is laid out, where that cannot be seen from its first line."""

    header_line: int = 1  # line with the names of the columns, from 1; lines before it are passed over
    separator: str | None = None  # between cells; None looks at the header
    encoding: str = "utf-8"  # of the letters
    # first_row: line of the first row of numbers; None if it follows the header, or a row of units under it
    first_row: int | None = None
    decimal: str | None = None  # comma or point; None reads both, a comma only where it does not separate cells


def separator_of(head: str) -> str:
    r"""What separates the cells of a header: commas if there are any, else semicolons, else tabs.

    Example:
        >>> separator_of("time_s;motor_speed_rpm")
        ';'
    """
    return next((mark for mark in (",", ";", "\t") if mark in head), ",")


def whole_lines(lines: Sequence[str]) -> list[tuple[int, str]]:
    """Lines with their numbers, from 1; those of a cell in quotes that has line breaks are one.

    Example:
        >>> whole_lines(['"Time', '[s]",n', "0,1"])
        [(1, '"Time [s]",n'), (3, '0,1')]
    """
    found: list[tuple[int, str]] = []
    place = 0
    while place < len(lines):
        end = place
        while lines[place : end + 1] and _is_open(lines[place : end + 1]) and end - place < MOST_BREAKS:
            end += 1
        if end >= len(lines) or _is_open(lines[place : end + 1]):
            end = place  # a single quotation mark: inches
        found.append((place + 1, " ".join(lines[place : end + 1])))
        place = end + 1
    return found


def _is_open(lines: Sequence[str]) -> bool:
    return sum(line.count('"') for line in lines) % 2 == 1


def split(line: str, separator: str) -> list[str]:
    """The cells of a line."""
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [""])


def cells_of(line: str, separator: str, file: str, number: int | None) -> list[str]:
    """The cells of a line, or an error with its number."""
    try:
        return split(line, separator)
    except csv.Error as error:
        raise LogError(f"is no row of a CSV file: {error}", file=file, line=number) from None


def units_row(line: str, separator: str, *, strict: bool = True) -> list[str] | None:
    """The units in a line, brackets taken off, if it is a row of units: no numbers, and a unit of time first.

    Args:
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
        decimal(cell.replace(",", "."))
    except ValueError:
        return False
    return True
