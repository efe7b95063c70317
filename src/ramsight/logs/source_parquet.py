"""Logs in Parquet files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import LogError
from ramsight.logs.clock_units import DAY
from ramsight.logs.lines import Advance, check_file, first_line
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.row_clock import Rows
from ramsight.logs.source import Offered, TableSource, needs, unit_in_name
from ramsight.units.algebra import NANOSECONDS

_ROWS = 1 << 16
_LOOKED_AT = 200  # rows


class ParquetSource(TableSource):
    """A Parquet file: one clock column, a channel a column.

    The clock is a column of numbers, or of time stamps, which count from the first.
    """

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, file_map, advance)
        check_file(path)
        self._arrow = needs("pyarrow", "logs", self.file)
        parquet = needs("pyarrow.parquet", "logs", self.file)
        try:
            self._opened = parquet.ParquetFile(path, pre_buffer=False, page_checksum_verification=True)
            self._schema = self._opened.schema_arrow
        except (self._arrow.ArrowException, OSError, ValueError, OverflowError) as error:
            raise LogError(f"is no Parquet file, or a damaged one: {first_line(error)}", file=self.file) from None
        self._since: int | None = None

    def offered(self) -> list[Offered]:
        """The columns, the clock among them; text is noted."""
        found = []
        for one in self._schema:
            unit = (one.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            note = "" if self._is_number(one.type) or self._is_stamp(one.type) else self._kind(one.type)
            found.append(Offered(one.name, "s" if self._is_stamp(one.type) else unit or unit_in_name(one.name), note))
        return found

    def rows(self, numbers: Sequence[str], stamps: Sequence[str]) -> Iterator[Rows]:
        """65 536 rows at a time; null is NaN."""
        counts = Counter(self._schema.names)
        for name in (*stamps, *numbers):
            if counts[name] > 1:
                raise LogError("is there more than once", file=self.file, column=name)
            kind = self._schema.field(name).type
            if not (self._is_number(kind) or name in stamps):
                raise LogError(f"holds {kind} where numbers are needed", file=self.file, column=name)
        if len(stamps) > 1:
            raise LogError(
                "is no time of day beside a date: one column holds both here", file=self.file, column=stamps[-1]
            )
        wanted = list(dict.fromkeys([*stamps, *numbers]))
        row, total = 0, max(self._opened.metadata.num_rows, 1)
        try:
            for batch in self._opened.iter_batches(batch_size=_ROWS, columns=wanted, use_threads=False):
                columns = {name: self._numbers(batch.column(name)) for name in numbers}
                yield Rows(batch.num_rows, columns, self._seconds(batch.column(stamps[0])) if stamps else None)
                row += batch.num_rows
                if self.advance is not None:
                    self.advance(batch.num_rows / total)
        except (self._arrow.ArrowException, OSError, ValueError, OverflowError, MemoryError) as error:
            raise LogError(f"is damaged after row {row}: {first_line(error)}", file=self.file) from None

    def first_stamp(self, name: str) -> str:
        """A stamp as text where a column holds time stamps, which says whether they have a zone; else ""."""
        kind = self._schema.field(name).type if name in self._schema.names else None
        if kind is None or not self._is_stamp(kind):
            return ""
        is_local = self._arrow.types.is_timestamp(kind) and kind.tz is None
        return "1970-01-01 00:00:00" if is_local else "1970-01-01 00:00:00Z"

    def texts(self, name: str, most: int) -> list[str]:
        """The different texts in a column, in their order."""
        if self._kind(self._schema.field(name).type) != "text" and not self._arrow.types.is_dictionary(
            self._schema.field(name).type
        ):
            return []
        found = dict[str, None]()
        try:
            for batch in self._opened.iter_batches(batch_size=_ROWS, columns=[name], use_threads=False):
                found |= dict.fromkeys(str(one) for one in batch.column(0).unique().to_pylist() if one is not None)
                if len(found) > most:
                    break
        except (self._arrow.ArrowException, OSError, ValueError, OverflowError, MemoryError):
            return []  # `rows` says it
        return list(found)

    def first_stamps(self, names: Sequence[str]) -> Array:
        """The times in the first rows of a column of time stamps [s]."""
        column = self._first(names[-1])
        return np.empty(0) if column is None else self._seconds(column)

    def first_numbers(self, name: str) -> Array:
        """The numbers in the first rows of a column, NaN where there is none."""
        column = self._first(name) if self._is_number(self._schema.field(name).type) else None
        return np.empty(0) if column is None else self._numbers(column)

    def _first(self, name: str) -> Any:
        try:
            batch = next(self._opened.iter_batches(batch_size=_LOOKED_AT, columns=[name], use_threads=False), None)
        except (self._arrow.ArrowException, OSError, ValueError, OverflowError, MemoryError):
            return None  # `rows` says it
        return None if batch is None else batch.column(0)

    def _kind(self, kind: Any) -> str:
        types = self._arrow.types
        return "text" if types.is_string(kind) or types.is_large_string(kind) else str(kind)

    def _is_number(self, kind: Any) -> bool:
        types = self._arrow.types
        return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind))

    def _is_stamp(self, kind: Any) -> bool:
        return bool(self._arrow.types.is_timestamp(kind) or self._arrow.types.is_duration(kind))

    def _seconds(self, column: Any) -> Array:
        """Seconds of time stamps from the midnight before the first of all."""
        stamps = self._arrow.types.is_timestamp(column.type)
        kind = self._arrow.timestamp("ns", column.type.tz) if stamps else self._arrow.duration("ns")
        ticks = column.cast(kind, safe=False).cast(self._arrow.int64())
        if self._since is None:
            known = ticks.drop_null()
            first = known[0].as_py() if len(known) and stamps else 0
            self._since = first - first % int(DAY * NANOSECONDS)
        missing = ticks.is_null().to_numpy(zero_copy_only=False)
        counted = ticks.fill_null(self._since).to_numpy(zero_copy_only=False) - self._since
        return np.where(missing, np.nan, counted / NANOSECONDS)

    def _numbers(self, column: Any) -> Array:
        values = column.cast(self._arrow.float64(), safe=False).to_numpy(zero_copy_only=False)
        return np.where(np.isfinite(values), values, np.nan)
