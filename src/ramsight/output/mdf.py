"""Tables in MDF files (``.mf4``): one group of channels over its time."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ramsight.output.cells import Coded, Column
from ramsight.output.table_writer import TableWriter, clock_of, installed


class MdfTable(TableWriter):
    """An MDF 4.10 file; the clock is the column ``time_s``, words are a conversion of whole numbers."""

    def __init__(self, path: Path, units: Mapping[str, str]) -> None:
        self._path, self._units = path, units
        self._asammdf: Any = installed("asammdf", "logs", path)
        self._mdf: Any = self._asammdf.MDF(version="4.10")
        self._mdf.header.start_time = datetime(1970, 1, 1, tzinfo=UTC)  # a track has no date
        self._begun = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self._mdf.save(self._path, overwrite=True, compression=2)
        finally:
            self._mdf.close()

    def _write(self, columns: dict[str, Column]) -> None:
        time, others = clock_of(columns)
        if not self._begun:
            signals = [self._signal(name, column, time) for name, column in others.items()]
            self._mdf.append(signals, comment="ramsight", common_timebase=True)
            self._begun = True
        elif len(time):
            self._mdf.extend(0, [(time, None), *((_values(column), None) for column in others.values())])

    def _signal(self, name: str, column: Column, time: NDArray[np.float64]) -> Any:
        conversion: dict[str, Any] | None = None
        if isinstance(column, Coded):
            conversion = {"default": b""}
            for place, (code, word) in enumerate(sorted(column.words.items())):
                conversion |= {f"val_{place}": float(code), f"text_{place}": word.encode("utf-8")}
        return self._asammdf.Signal(
            samples=_values(column), timestamps=time, name=name, unit=self._units.get(name, ""), conversion=conversion
        )


def _values(column: Column) -> NDArray[Any]:
    if isinstance(column, Coded):
        return np.asarray(column.codes)
    return column if column.dtype.kind in "iuf" else column.astype(np.uint8 if column.dtype.kind == "b" else "S")
