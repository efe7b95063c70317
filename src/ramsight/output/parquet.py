"""Tables in Parquet files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from ramsight.output.cells import Coded, Column
from ramsight.output.table_writer import TableWriter, installed, numbers


class ParquetTable(TableWriter):
    """A Parquet file, a row group a piece; words are a dictionary column, units stand in the fields' metadata."""

    def __init__(self, path: Path, units: Mapping[str, str]) -> None:
        self._path, self._units = path, units
        self._arrow: Any = installed("pyarrow", "logs", path)
        self._parquet: Any = installed("pyarrow.parquet", "logs", path)
        self._writer: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.close()

    def _write(self, columns: dict[str, Column]) -> None:
        arrays = [self._array(column) for column in columns.values()]
        if self._writer is None:
            fields = [
                self._arrow.field(name, array.type, metadata={"unit": self._units.get(name, "")})
                for name, array in zip(columns, arrays, strict=True)
            ]
            self._schema = self._arrow.schema(fields)
            self._writer = self._parquet.ParquetWriter(
                self._path, self._schema, compression="zstd", write_page_checksum=True
            )
        self._writer.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))

    def _array(self, column: Column) -> Any:
        if isinstance(column, Coded):
            words, places = column.places()
            return self._arrow.DictionaryArray.from_arrays(places.astype(np.int32), words)
        values = numbers(column)
        if values.dtype.kind == "f":
            return self._arrow.array(values, from_pandas=True)  # NaN is null, as an empty cell is
        return self._arrow.array(values if values.dtype.kind in "iub" else values.tolist())
