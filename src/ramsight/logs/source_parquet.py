"""Logs in Parquet files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import LogError
from ramsight.logs.align import Block
from ramsight.logs.lines import Advance, check_file, first_line
from ramsight.logs.mapped import ChannelMap
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

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """65 536 rows at a time; null is NaN."""
        clock, second = self.clocked()
        self.check(channels)
        counts = Counter(self._schema.names)
        for name in (*([clock] if clock else []), *channels):
            if counts[name] > 1:
                raise LogError("is there more than once", file=self.file, column=name)
            kind = self._schema.field(name).type
            if not (self._is_number(kind) or (name == clock and self._is_stamp(kind))):
                raise LogError(f"holds {kind} where numbers are needed", file=self.file, column=name)
        wanted = list(dict.fromkeys([*([clock] if clock else []), *channels]))
        places = {name: place for place, name in enumerate(wanted)}
        row, total = 0, max(self._opened.metadata.num_rows, 1)
        try:
            for batch in self._opened.iter_batches(batch_size=_ROWS, columns=wanted, use_threads=False):
                time = np.full(batch.num_rows, np.nan)
                if clock:
                    time = self._seconds(batch.column(places[clock]), second)
                columns = {name: self._numbers(batch.column(places[name])) for name in channels}
                yield self.as_block(row, time, columns)
                row += len(time)
                if self.advance is not None:
                    self.advance(len(time) / total)
        except (self._arrow.ArrowException, OSError, ValueError, OverflowError, MemoryError) as error:
            raise LogError(f"is damaged after row {row}: {first_line(error)}", file=self.file) from None

    def first_numbers(self, name: str) -> NDArray[np.float64]:
        """The numbers in the first rows of a column, NaN where there is none."""
        if not self._is_number(self._schema.field(name).type):
            return np.empty(0)
        try:
            batch = next(self._opened.iter_batches(batch_size=_LOOKED_AT, columns=[name], use_threads=False), None)
        except (self._arrow.ArrowException, OSError, ValueError, OverflowError, MemoryError):
            return np.empty(0)  # `blocks` says it
        return np.empty(0) if batch is None else self._numbers(batch.column(0))

    def _kind(self, kind: Any) -> str:
        types = self._arrow.types
        return "text" if types.is_string(kind) or types.is_large_string(kind) else str(kind)

    def _is_number(self, kind: Any) -> bool:
        types = self._arrow.types
        return bool(types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind))

    def _is_stamp(self, kind: Any) -> bool:
        return bool(self._arrow.types.is_timestamp(kind) or self._arrow.types.is_duration(kind))

    def _seconds(self, column: Any, second: float) -> NDArray[np.float64]:
        if not self._is_stamp(column.type):
            return self._numbers(column) * second
        stamps = self._arrow.types.is_timestamp(column.type)
        kind = self._arrow.timestamp("ns", column.type.tz) if stamps else self._arrow.duration("ns")
        ticks = column.cast(kind, safe=False).cast(self._arrow.int64())
        if self._since is None:
            known = ticks.drop_null()
            self._since = known[0].as_py() if len(known) and stamps else 0
        missing = ticks.is_null().to_numpy(zero_copy_only=False)
        counted = ticks.fill_null(self._since).to_numpy(zero_copy_only=False) - self._since
        return np.where(missing, np.nan, counted / NANOSECONDS)

    def _numbers(self, column: Any) -> NDArray[np.float64]:
        values = column.cast(self._arrow.float64(), safe=False).to_numpy(zero_copy_only=False)
        return np.where(np.isfinite(values), values, np.nan)
