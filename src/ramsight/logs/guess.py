"""First guesses at a log: how a CSV file is laid out, and which channels are which. A person checks them."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Sequence
from pathlib import Path

from ramsight.errors import DescriptionError, LogError
from ramsight.logs.digits import decimal, is_digits
from ramsight.logs.header import NEVER_FILLED, SEPARATORS, CsvForm, separator_of, split, units_row, whole_lines
from ramsight.logs.lines import line_blocks
from ramsight.logs.source import Offered
from ramsight.logs.stamps import is_stamp
from ramsight.units import parse

_LOOKED_AT = 1 << 16  # bytes
_PREAMBLE = 200  # lines

_NAMES = {
    "speed": r"speed|rpm|drehzahl|geschwindigkeit|velo|vitesse|r[ée]gime|(^|[^a-z])n_?(ist|act|mot)|606c|omega",
    "torque": r"torque|moment|effort|couple|coppia|(^|[^a-z])par([^a-z]|$)|(^|[^a-z])m_?(ist|act|mot)|6077|4602h:0c",
    "reference": r"^reference",
}
_WORSE = {
    "speed": r"soll|target|demand|command|cmd|setp|limit|max|min\b|wheel|vehicle|fan|60ff|606b",
    "torque": r"soll|target|demand|command|cmd|setp|limit|max|min\b|6071|6074",
    "temperature": r"max|min\b|limit|engine|gear",
    "reference": r"speed|torque",
}
ROLES = ("speed", "torque", "temperature", "reference")
_BETTER = r"ist(?![a-z])|istw|act|actual|feedback|meas"
_SI = {"speed": "rad/s", "torque": "N m", "temperature": "K", "reference": "m"}
USUAL = {"speed": "rpm", "torque": "N m", "temperature": "degC", "reference": "m"}
"""The unit that is proposed where the file states none."""

_HEADER_ROWS = 8  # names, and what may stand between them and the first row of numbers
_ANNOTATION = re.compile(r'"?#(group|datatype|default|constant)\b')  # lines before a header of InfluxDB's
_SUMMARY = re.compile(
    r"(min|max|mean|avg|average|std|rms|mittel(wert)?|minimum|maximum|offset|gain|scale|fa[ck]tor)[.:]?", re.IGNORECASE
)


def guess_form(path: str | Path) -> CsvForm:
    """How a CSV file is laid out: lines before the header, separator and encoding.

    Raises:
        LogError: the file cannot be read.
    """
    encoding = "utf-8"
    try:
        block = next(line_blocks(path, size=_LOOKED_AT), b"")
    except LogError as error:
        if "UTF-8" not in str(error):
            raise
        encoding = "cp1252"
        block = next(line_blocks(path, encoding="latin-1", size=_LOOKED_AT), b"")
    is_whole = len(block) < _LOOKED_AT
    numbered = whole_lines(block.decode("utf-8").removesuffix("\n").split("\n"))
    best = _best_header(numbered, is_whole=is_whole)
    if best is None:
        return CsvForm(encoding=encoding)
    place, separator, below = best
    (number, head), lines = numbered[place], [line for _, line in numbered[place + 1 :]]
    seen = separator if separator != separator_of(head) else None
    is_plain = not below or (below == 1 and units_row(lines[0], separator) is not None)
    decimal = "," if separator == "," and _has_decimal_commas(lines[below : below + _PREAMBLE]) else None
    first = None if is_plain else numbered[place + 1 + below][0]
    return CsvForm(number, seen, encoding, first, decimal)


def _best_header(numbered: Sequence[tuple[int, str]], *, is_whole: bool) -> tuple[int, str, int] | None:
    """The line above the most rows of numbers, its separator, and how many lines stand between them.

    A few pairs, or a table of statistics, may stand before; of two with as many rows those that go on to the end count.
    """
    lines = [line for _, line in numbered]
    best: tuple[tuple[int, bool], int, str, int] | None = None
    for place, head in enumerate(lines[:_PREAMBLE]):
        if best is not None and head == lines[best[1]]:
            continue  # the same header again is none of its own
        for separator in sorted(SEPARATORS, key=head.count, reverse=True):
            below = _rows_between(lines[place:], separator)
            if below is None:
                continue
            rows = lines[place + 1 + below :]
            run = _run(rows if is_whole else rows[:-1], _cells(head, separator), separator)
            is_to_end = run >= len(rows) - (0 if is_whole else 1)
            if best is None or (run, is_to_end) > best[0]:
                best = ((run, is_to_end), place, separator, below)
            break
    return None if best is None else best[1:]


def _run(rows: Sequence[str], names: Sequence[str], separator: str) -> int:
    """How many rows of numbers follow one another."""
    for number, row in enumerate(rows):
        cells = _cells(row, separator)
        if not _is_wide(cells, names) or not any(_is_value(cell) or not cell for cell in cells):
            return number
    return len(rows)


def _is_wide(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a row has as many cells as the header, an empty one more, or none of the column of comments."""
    return (
        len(cells) == len(names)
        or (len(cells) == len(names) + 1 and not cells[-1])
        or (len(cells) == len(names) - 1 and names[-1].lower() == NEVER_FILLED)
    )


def _rows_between(lines: Sequence[str], separator: str) -> int | None:
    """How many rows stand between a header and its first row of numbers; None if the first line is no header."""
    if _ANNOTATION.match(lines[0]):
        return None
    names = _cells(lines[0].strip(" ").removeprefix("#"), separator)
    if len(names) < 2 or sum(map(bool, names)) < 2:
        return None
    if any(_is_value(name) for name in names) and not _numbers_channels(names, lines[1:2], separator):
        return None
    in_summary = False
    for below, line in enumerate(lines[1 : _HEADER_ROWS + 1]):
        cells = _cells(line, separator)
        if not line.strip() and not in_summary:
            continue
        if not _is_wide(cells, names):
            return None
        is_row = any(_is_value(cell) for cell in cells)
        is_summary = any(_SUMMARY.fullmatch(cell) for cell in cells)
        if is_row and not is_summary:
            return below
        if in_summary and not is_row:
            return None  # a table of its own
        in_summary = in_summary or (is_row and is_summary)
    return None


def _numbers_channels(names: Sequence[str], below: Sequence[str], separator: str) -> bool:
    """Whether a header numbers the channels behind its first name, and a row of units is below: an oscilloscope's."""
    are_numbers = not _is_value(names[0]) and all(is_digits(name) or not name for name in names[1:])
    return are_numbers and bool(below) and units_row(below[0], separator) is not None


def _cells(line: str, separator: str) -> list[str]:
    try:
        return [cell.strip() for cell in split(line, separator)]
    except csv.Error:
        return []


def _is_value(cell: str) -> bool:
    return is_number(cell.replace(",", ".")) or is_stamp(cell)


def _has_decimal_commas(rows: Sequence[str]) -> bool:
    """Whether cells in quotes are numbers with a decimal comma: one that cannot separate thousands."""
    quoted = [cell for row in rows for cell in _cells(row, ",") if re.fullmatch(r"[+-]?[0-9]+,[0-9]+", cell)]
    return any(not re.fullmatch(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}", cell) for cell in quoted)


def is_number(cell: str) -> bool:
    """Whether a cell holds a number."""
    try:
        decimal(cell)
    except ValueError:
        return False
    return True


def guess_roles(offered: Sequence[Offered]) -> dict[str, str]:
    """Which channel is ``speed``, ``torque``, ``temperature`` and ``reference``, by names and units.

    Example:
        >>> guess_roles([Offered("n_soll", "1/min"), Offered("n_ist", "1/min"), Offered("M_ist", "Nm")])
        {'speed': 'n_ist', 'torque': 'M_ist'}
    """
    found: dict[str, str] = {}
    for role in ROLES:
        scored = [(_score(one, role), -place, one.name) for place, one in enumerate(offered)]
        best = max(scored, default=(0, 0, ""))
        if best[0] > 0 and best[2] not in found.values():
            found[role] = best[2]
    return found


def _score(channel: Offered, role: str) -> int:
    name = channel.name.lower()
    if role == "temperature":
        named = temperature_score(channel.name)
    else:
        named = 4 if re.search(_NAMES[role], name) is not None else 0
    fits = fits_role(channel.unit, role)
    if not named or (channel.unit and not fits):
        return 0
    worse = re.search(_WORSE[role], name) is not None
    better = re.search(_BETTER, name) is not None
    return named + fits + better - 3 * worse


def fits_role(unit: str, role: str) -> bool:
    """Whether a unit is one of this quantity; a share fits speed and torque."""
    try:
        parse(f"1 {celsius(unit) if role == 'temperature' else unit}", _SI[role])
    except DescriptionError:
        return is_share(unit) and role in ("speed", "torque")
    return True


def is_share(unit: str) -> bool:
    """Whether a unit is percent or permille."""
    try:
        return parse(f"1 {unit}", "1") in (0.01, 0.001)
    except DescriptionError:
        return False


_OIL = {
    "English": "oil|hyd|fluid", "German": "öl|oel", "French": "huile", "Spanish and Italian": "aceite|olio",
    "Dutch and Swedish": "olie|olja",
}  # fmt: skip
_TEMPERATURE = {"English, German, French, Italian": "temp", "symbols": r"[^a-zäöü]t$|(^|[^a-zäöü])t[^a-zäöü]|theta|ϑ"}
_TANK = "tank|reservoir|réservoir|serbatoio|depósito|behälter|behaelter|sump|ölsumpf"
_OTHERS = (
    "motor|engine|moteur|wicklung|winding|stator|cool|kühl|kuehl|wasser|water|ambient|umgebung|aussen|außen|luft|air"
    "|gear|getriebe|inverter|umrichter|drive|antrieb|board|cpu|batt|akku|igbt|control|regler|heatsink|kühlkörper"
)
_UNITS = {
    "c", "degc", "deg c", "deg. c", "degreec", "degree c", "degrees c", "gradc", "grad c", "grad", "celsius",
    "°celsius", "grad celsius", "deg celsius", "degrees celsius", "ºc", "℃", "° c",
}  # fmt: skip

_OIL_TEMPERATURE = re.compile(
    rf"({'|'.join(_OIL.values())}|{_TANK}).*({'|'.join(_TEMPERATURE.values())})"
    rf"|(temp|(^|[^a-zäöü])t[^a-zäöü]).*({'|'.join(_OIL.values())}|{_TANK})"
)
_ANY_TEMPERATURE = re.compile(r"temp")
_OTHER_NAME = re.compile(_OTHERS)


def temperature_score(name: str) -> int:
    """How well a name fits the oil's temperature: 4 for one that says oil or tank, 2 for any temperature, 0 for none.

    Example:
        >>> [temperature_score(name) for name in ("Hyd.T_oil", "Öltemp", "Temp", "Motor temperature", "Torque")]
        [4, 4, 2, 0, 0]
    """
    small = re.sub(r"\s*[\[(].*", "", unicodedata.normalize("NFC", name).lower())
    if _OIL_TEMPERATURE.search(small):
        return 4
    own = re.split(r"[./]", small)[-1] or small
    return 2 if _ANY_TEMPERATURE.search(own) and not _OTHER_NAME.search(own) else 0


def celsius(unit: str) -> str:
    """A unit, as ``degC`` where it is a spelling of that which is no unit elsewhere.

    Example:
        >>> celsius("C"), celsius("Grad C"), celsius("K")
        ('degC', 'degC', 'K')
    """
    try:
        parse(f"1 {unit}", "K")
    except DescriptionError:
        return "degC" if unit.strip().lower() in _UNITS else unit
    return unit
