"""Tables as CSV, Parquet, MF4 and MCAP files, some rows after others."""

from __future__ import annotations

import gzip
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ramsight.arrays import Array
from ramsight.errors import one_line
from ramsight.output.atomic import atomic_path, check_target, suffix_of
from ramsight.output.cells import Coded, Column, quoted, rows_text
from ramsight.output.table_writer import TableWriter, clock_of, installed, numbers, part

TABLES = (".csv", ".csv.gz")
ROW_FILES = (*TABLES, ".parquet")
TABLE_FILES = (*ROW_FILES, ".mf4", ".mcap")

_ROWS_AT_ONCE = 1 << 14
_PACKED = 4  # gzip's level: twice as fast as its usual 9 is, and a tenth larger


@contextmanager
def open_table(
    path: str | Path, *, formats: Mapping[str, str] | None = None, units: Mapping[str, str] | None = None
) -> Iterator[TableWriter]:
    """A table to be written some rows after others, in the format that the suffix says, whole or not at all.

    The same rows give the same bytes, in however many pieces they come (CSV; the others keep pieces apart).

    Args:
        path: the file: ``.csv``, ``.csv.gz``, ``.parquet``, ``.mf4`` or ``.mcap``.
        formats: for columns of floats in CSV, column name to a format such as ``"%.12g"``.
        units: of the columns, where the format has a place for them.

    Yields:
        Its writer.

    Raises:
        OutputError: the suffix is another one, a package is missing, or the file cannot be written.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = Path(folder) / "rod.csv"
        ...     with open_table(file) as table:
        ...         table.append({"time_s": [0.0], "position_m": [0.1]})
        ...         table.append({"time_s": [0.02], "position_m": [float("nan")]})
        ...     print(file.read_text(), end="")
        time_s,position_m
        0.000000,0.100000
        0.020000,
    """
    suffix = suffix_of(path, TABLE_FILES)
    check_installed(path)
    with atomic_path(path) as draft:
        if suffix in (".parquet", ".mf4"):
            kind = ParquetTable if suffix == ".parquet" else MdfTable
            with kind(draft, units if units is not None else {}) as open_writer:
                yield open_writer
        elif suffix == ".mcap":
            from ramsight.output.mcap import McapTable

            with McapTable(draft, units if units is not None else {}, one_line(path)) as open_writer:
                yield open_writer
        else:
            with open(draft, "wb") as file:
                if suffix.endswith(".gz"):
                    with gzip.GzipFile(filename="", mode="wb", compresslevel=_PACKED, fileobj=file, mtime=0) as packed:
                        yield _CsvTable(packed, formats or {})
                else:
                    yield _CsvTable(file, formats or {})


def write_table(
    columns: Mapping[str, ArrayLike | Coded], path: str | Path, *, formats: Mapping[str, str] | None = None
) -> None:
    """Columns as a file with a header: CSV, or compressed with gzip, or Parquet, MF4 or MCAP, by its suffix.

    The same columns always give the same bytes. In CSV, floats get decimals by the unit that the column's name ends
    in (`DECIMALS`); NaN is written as an empty cell, true and false as 1 and 0.

    Args:
        columns: column name to values, each of shape (n,).
        path: the file, ``.csv``, ``.csv.gz``, ``.parquet``, ``.mf4`` or ``.mcap``.
        formats: for columns of floats, column name to a format such as ``"%.12g"`` in place of the decimals.

    Raises:
        OutputError: the suffix is another one, or the file cannot be written.
        ValueError: the columns are not all of the same length, or not of one dimension.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = Path(folder) / "rod.csv"
        ...     write_table({"time_s": [0.0, 0.02], "position_m": [0.1, float("nan")]}, file)
        ...     print(file.read_text(), end="")
        time_s,position_m
        0.000000,0.100000
        0.020000,
    """
    with open_table(path, formats=formats) as table:
        table.append(columns)


class _CsvTable(TableWriter):
    def __init__(self, stream: IO[bytes] | gzip.GzipFile, formats: Mapping[str, str]) -> None:
        self._stream, self._formats, self._names = stream, formats, list[str]()

    def _write(self, columns: dict[str, Column]) -> None:
        if not self._names:
            self._names = list(columns)
            self._stream.write((",".join(quoted(name) for name in columns) + "\n").encode("utf-8"))
        length = max((len(column) for column in columns.values()), default=0)
        for start in range(0, length, _ROWS_AT_ONCE):
            rows = slice(start, start + _ROWS_AT_ONCE)
            self._stream.write(rows_text([(name, part(columns[name], rows)) for name in self._names], self._formats))


_PACKAGES = {
    ".parquet": ("pyarrow.parquet", "logs"),
    ".mf4": ("asammdf", "logs"),
    ".mcap": ("mcap.writer", "logs"),
    ".nc": ("h5netcdf", "datasets"),
}


def check_installed(path: str | Path) -> None:
    """Reject a file whose format needs a package that is not installed.

    Raises:
        OutputError: states which extra of ramsight installs it.
    """
    for suffix, (package, extra) in _PACKAGES.items():
        if Path(path).name.endswith(suffix):
            installed(package, extra, path)


def check_table(path: Path | None) -> None:
    """Reject a place for a table of rows that cannot be written: no CSV or Parquet, or what that needs is missing.

    Args:
        path: the file to be; `None` is always right.

    Raises:
        OutputError: it cannot be written.
    """
    check_target(path, ROW_FILES)
    if path is not None:
        check_installed(path)


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

    def _signal(self, name: str, column: Column, time: Array) -> Any:
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
