"""A table of a pump's efficiencies as CSV text in its description."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from functools import lru_cache

from ramsight.machine.declare import refuse
from ramsight.units import to_si

COLUMNS = ("pressure_bar", "speed_rpm", "viscosity_mm2s", "volumetric_efficiency", "hydromechanical_efficiency")
_UNITS = ("bar", "rpm", "mm2/s", "1", "1")
_LEAST, _MOST = (0.001, 0.01, 0.01, 0.001, 0.001), (1e4, 3e4, 1e5, 1.0, 1.0)
_RANGES = tuple((to_si(low, unit), to_si(high, unit)) for low, high, unit in zip(_LEAST, _MOST, _UNITS, strict=True))
_ALLOWED = "0.001 to 10000 bar, 0.01 to 30000 rpm, 0.01 to 100000 mm2/s, efficiencies 0.001 to 1"
_KEY = "efficiency_table"


@dataclass(frozen=True)
class Efficiencies:
    """Efficiencies of pump operation on a full grid, in SI."""

    pressure: tuple[float, ...]  # pressure rises [Pa], increasing
    speed: tuple[float, ...]  # pump speeds [rad/s], increasing
    viscosity: tuple[float, ...]  # [m2/s], increasing
    # volumetric, hydromechanical: efficiencies by viscosity, speed, pressure
    volumetric: tuple[tuple[tuple[float, ...], ...], ...]
    hydromechanical: tuple[tuple[tuple[float, ...], ...], ...]


@lru_cache(maxsize=64)
def read_efficiencies(text: str) -> Efficiencies:
    r"""Read the table.

    Args:
        text: CSV with the columns of `COLUMNS`, one row for each combination of pressure, speed and viscosity.

    Raises:
        PydanticCustomError: it is no such table; the text names the line.

    Example:
        >>> header = ",".join(COLUMNS)
        >>> table = read_efficiencies(header + "\n100, 1500, 46, 0.95, 0.92\n200, 1500, 46, 0.9, 0.94")
        >>> table.pressure, table.volumetric
        ((10000000.0, 20000000.0), (((0.95, 0.9),),))
    """
    try:
        lines = [line for line in csv.reader(io.StringIO(text.strip()), skipinitialspace=True) if line]
    except csv.Error as error:
        raise refuse(_KEY, text.strip()[:60], f"is no CSV text: {error}") from None
    if not lines or tuple(name.strip() for name in lines[0]) != COLUMNS:
        raise refuse(_KEY, text.strip()[:60], "the table needs a first line with its columns", ", ".join(COLUMNS))
    points: dict[tuple[float, float, float], tuple[float, float]] = {}
    for number, line in enumerate(lines[1:], 2):
        row = _row(line, number)
        if row[:3] in points:
            raise refuse(_KEY, f"line {number}", "the same pressure, speed and viscosity stand in an earlier line")
        points[row[0], row[1], row[2]] = row[3], row[4]
    axes = [tuple(sorted({point[k] for point in points})) for k in range(3)]
    if not points or math.prod(map(len, axes)) != len(points):
        words = " x ".join(str(len(axis)) for axis in axes)
        raise refuse(_KEY, f"{len(points)} rows", f"is no full grid of {words} pressures, speeds and viscosities")

    def grid(which: int) -> tuple[tuple[tuple[float, ...], ...], ...]:
        return tuple(tuple(tuple(points[p, w, nu][which] for p in axes[0]) for w in axes[1]) for nu in axes[2])

    return Efficiencies(axes[0], axes[1], axes[2], grid(0), grid(1))


def _row(line: list[str], number: int) -> tuple[float, float, float, float, float]:
    try:
        if not all(cell.isascii() for cell in line):  # float() takes digits of every script
            raise ValueError
        values = [to_si(float(cell), unit) for cell, unit in zip(line, _UNITS, strict=True)]
    except ValueError:
        raise refuse(_KEY, f"line {number}", "is not five numbers", ", ".join(COLUMNS)) from None
    if not all(low <= value <= high for value, (low, high) in zip(values, _RANGES, strict=True)):
        raise refuse(_KEY, f"line {number}", "is out of range", _ALLOWED)
    return values[0], values[1], values[2], values[3], values[4]
