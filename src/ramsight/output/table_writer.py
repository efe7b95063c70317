"""Takes rows of a table, some after others, whatever the format; what formats have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ramsight.arrays import Array
from ramsight.errors import OutputError, one_line
from ramsight.optional import imported
from ramsight.output.cells import Coded, Column


class TableWriter(ABC):
    """Takes rows of a table, some after others; made by `open_table`."""

    def append(self, columns: Mapping[str, ArrayLike | Coded]) -> None:
        """Write rows.

        Args:
            columns: column name to values, each of shape (n,); the same names each time.

        Raises:
            ValueError: the columns are not all of the same length, or not of one dimension.
        """
        arrays: dict[str, Column] = {
            name: values if isinstance(values, Coded) else np.asarray(values) for name, values in columns.items()
        }
        shapes = {name: a.codes.shape if isinstance(a, Coded) else a.shape for name, a in arrays.items()}
        if len(set(shapes.values())) > 1 or any(len(shape) != 1 for shape in shapes.values()):
            said = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
            raise ValueError(f"columns of a table have one length and one dimension: {said}")
        self._write(arrays)

    @abstractmethod
    def _write(self, columns: dict[str, Column]) -> None:
        """Write rows of arrays of one length."""

    def finish(self) -> None:  # noqa: B027 - most have nothing left to do
        """Write what is left after the last row."""


def part(column: Column, rows: slice) -> Column:
    """Some rows of a column."""
    return Coded(column.codes[rows], column.words) if isinstance(column, Coded) else column[rows]


def numbers(column: NDArray[Any]) -> NDArray[Any]:
    """A column as one that binary formats take: text as text, all else as it is."""
    return column if column.dtype.kind in "iufb" else column.astype(str)


_CLOCKS = ("time_s", "time")


def clock_of(columns: Mapping[str, Column]) -> tuple[Array, dict[str, Column]]:
    """The time of some rows, their number where no column is a clock, and the other columns."""
    clock = next((name for name in _CLOCKS if name in columns), None)
    length = max((len(column) for column in columns.values()), default=0)
    time = np.arange(length, dtype=np.float64) if clock is None else np.asarray(columns[clock], dtype=np.float64)
    return time, {name: column for name, column in columns.items() if name != clock}


def installed(package: str, extra: str, path: str | Path) -> ModuleType:
    """A package that not everybody has.

    Raises:
        OutputError: it is not installed.
    """
    return imported(package, extra, lambda text: OutputError(f"{one_line(path)}: {text}"))
