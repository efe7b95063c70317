"""Logs in CSV files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from ramsight.logs.align import Block
from ramsight.logs.channel_map import ChannelMap
from ramsight.logs.lines import Advance
from ramsight.logs.source import Offered, TableSource, unit_in_name
from ramsight.logs.table import CsvTable


class CsvSource(TableSource):
    """A CSV file: one clock column, a channel a column; the header is its first line unless the map says otherwise."""

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, file_map, advance)
        self.table = CsvTable(path, None if file_map is None else file_map.form, advance=advance)

    def offered(self) -> list[Offered]:
        """The columns, the clock among them."""
        pairs = zip(self.table.names, self.table.units, strict=True)
        return [Offered(name, unit or unit_in_name(name)) for name, unit in pairs if name]

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """Some megabytes of rows at a time; cells without a number are NaN."""
        clock, second = self.clocked()
        self.check(channels)
        wanted = list(dict.fromkeys([clock, *channels]))
        row = 0
        for rows in self.table.blocks(wanted, gaps=wanted):
            columns = dict(zip(wanted, rows, strict=True))
            yield self.as_block(row, columns[clock] * second, {name: columns[name] for name in channels})
            row += rows.shape[1]

    def numeric(self, names: Sequence[str]) -> set[str]:
        """Those columns in whose first rows every cell is a number or empty."""
        rows = self.table.first_cells(_LOOKED_AT)
        places = {name: self.table.names.index(name) for name in names}
        fine = {name: [_is_number(row[place]) for row in rows if len(row) > place] for name, place in places.items()}
        return {name for name, cells in fine.items() if all(cells) and names.count(name) == 1}


_LOOKED_AT = 200  # rows


def _is_number(cell: str) -> bool:
    text = cell.strip().replace(",", ".")
    try:
        float(text or "nan")
    except ValueError:
        return False
    return True
