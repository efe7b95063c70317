"""First guesses at a log: how a CSV file is laid out, and which channels are which. A person checks them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ramsight.errors import DescriptionError, LogError
from ramsight.logs.lines import line_blocks
from ramsight.logs.source import Offered
from ramsight.logs.table import SEPARATORS, CsvForm, separator_of, split, units_row
from ramsight.units import parse

_LOOKED_AT = 1 << 16  # bytes
_PREAMBLE = 60  # lines

_NAMES = {
    "speed": r"speed|rpm|drehzahl|velocity|(^|[^a-z])n_?(ist|act|mot)|606c|omega",
    "torque": r"torque|moment|(^|[^a-z])m_?(ist|act|mot)|6077|4602h:0c",
    "temperature": r"(oil|öl|oel|hyd|fluid).*(temp|[^a-z]t$|_t_)|(temp|^t[^a-z]).*(oil|öl|oel|hyd|fluid)",
    "reference": r"^reference",
}
_WORSE = {
    "speed": r"soll|target|demand|command|cmd|setp|limit|max|min\b|wheel|vehicle|fan|60ff|606b",
    "torque": r"soll|target|demand|command|cmd|setp|limit|max|min\b|6071|6074",
    "temperature": r"max|min\b|limit|engine|gear",
    "reference": r"speed|torque",
}
_BETTER = r"ist(?![a-z])|act|actual|feedback|meas"
_SI = {"speed": "rad/s", "torque": "N m", "temperature": "K", "reference": "m"}
USUAL = {"speed": "rpm", "torque": "N m", "temperature": "degC", "reference": "m"}
"""The unit that is proposed where the file says none."""

_CLOCK = re.compile(r"(time|zeit|timestamps?|t|elapsed|seconds)([ _\[(].*)?", re.IGNORECASE)


def guess_form(path: str | Path) -> CsvForm:
    """How a CSV file is laid out: lines before the header, separator and encoding.

    Args:
        path: the file, compressed with gzip if its name ends in ``.gz``.

    Raises:
        LogError: the file cannot be read.
    """
    encoding = "utf-8"
    try:
        block = next(line_blocks(path, size=_LOOKED_AT), b"")
    except LogError as error:
        if "UTF-8" not in str(error) or "UTF-16" in str(error):
            raise
        encoding = "cp1252"
        block = next(line_blocks(path, encoding="latin-1", size=_LOOKED_AT), b"")
    lines = block.decode("utf-8").split("\n")[: _PREAMBLE + 3]
    for number, head in enumerate(lines[:_PREAMBLE]):
        for separator in sorted(SEPARATORS, key=head.count, reverse=True):
            if _is_header(lines[number:], separator):
                seen = separator if separator != separator_of(head) else None
                return CsvForm(number + 1, seen, encoding)
    return CsvForm(encoding=encoding)


def _is_header(lines: Sequence[str], separator: str) -> bool:
    """Whether the first of these lines names columns of numbers in the next, or in the next but one."""
    names = [name.strip() for name in split(lines[0], separator)]
    if len(names) < 2 or any(is_number(name) for name in names) or sum(map(bool, names)) < 2:
        return False
    row = 2 if len(lines) > 1 and units_row(lines[1], separator) is not None else 1
    cells = split(lines[row], separator) if len(lines) > row else []
    return len(cells) == len(names) and any(is_number(cell.replace(",", ".")) for cell in cells)


def is_number(cell: str) -> bool:
    """Whether a cell is one."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def guess_clock(names: Sequence[str]) -> str | None:
    """The column that is the clock, by its name.

    Example:
        >>> guess_clock(["n_ist", "Zeit [ms]"])
        'Zeit [ms]'
    """
    return next((name for name in names if _CLOCK.fullmatch(name)), None)


def guess_roles(offered: Sequence[Offered]) -> dict[str, str]:
    """Which channel is ``speed``, ``torque``, ``temperature`` and ``reference``, by names and units.

    Example:
        >>> guess_roles([Offered("n_soll", "1/min"), Offered("n_ist", "1/min"), Offered("M_ist", "Nm")])
        {'speed': 'n_ist', 'torque': 'M_ist'}
    """
    found: dict[str, str] = {}
    for role in _NAMES:
        scored = [(_score(one, role), -place, one.name) for place, one in enumerate(offered)]
        best = max(scored, default=(0, 0, ""))
        if best[0] > 0 and best[2] not in found.values():
            found[role] = best[2]
    return found


def _score(channel: Offered, role: str) -> int:
    name = channel.name.lower()
    named = re.search(_NAMES[role], name) is not None
    fits = fits_role(channel.unit, role)
    if not named or (channel.unit and not fits):
        return 0
    worse = re.search(_WORSE[role], name) is not None
    better = re.search(_BETTER, name) is not None
    return 4 + fits + better - 3 * worse


def fits_role(unit: str, role: str) -> bool:
    """Whether a unit is one of this quantity; a share fits speed and torque."""
    try:
        parse(f"1 {unit}", _SI[role])
    except DescriptionError:
        return is_share(unit) and role in ("speed", "torque")
    return True


def is_share(unit: str) -> bool:
    """Whether a unit is percent or permille."""
    try:
        return parse(f"1 {unit}", "1") in (0.01, 0.001)
    except DescriptionError:
        return False
