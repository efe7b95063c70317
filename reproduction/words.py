"""How the report puts figures of both units into a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def both(values: Mapping[str, float], digits: int = 1, unit: str = "mm") -> str:
    """A figure of each unit with the unit's name behind it.

    Args:
        values: by name of the unit.
        digits: behind the point.
        unit: of the figures, as text.

    Example:
        >>> both({"boom": 4.59, "bucket": 8.81})
        '4.6 mm (boom) and 8.8 mm (bucket)'
    """
    return " and ".join(f"{figure(value, digits)} {unit} ({name})" for name, value in values.items())


def figure(value: float, digits: int = 1) -> str:
    """A number with so many digits behind the point, and no minus before a zero.

    Example:
        >>> figure(-0.04), figure(-0.06)
        ('0.0', '-0.1')
    """
    return f"{round(value, digits) + 0.0:.{digits}f}"


def slashed(values: Any, digits: int = 1) -> str:
    """Numbers in a row, as in a table's cell.

    Example:
        >>> slashed([1.38, 2.7])
        '1.4 / 2.7'
    """
    return " / ".join(figure(value, digits) for value in values)
