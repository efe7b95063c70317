"""What every kind of log file looks like to the rest: channels with names and units, and blocks of their samples."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import LogError, UnknownNameError
from ramsight.logs.align import Block, Samples
from ramsight.logs.column_names import is_series_name, is_value_name
from ramsight.logs.digits import is_digits
from ramsight.logs.lines import Advance, file_name, printable
from ramsight.logs.mapped import ChannelMap, Timed
from ramsight.logs.row_clock import RowClock, Rows, turned
from ramsight.optional import imported

_MOST_SERIES = 100  # texts of a column that are looked at
_LISTED = 6
_IN_BRACKETS = re.compile(r".*[\[(]([^\[\]()]*)[\])]\s*")
_ENDINGS = {
    "rpm": "rpm", "nm": "N m", "c": "degC", "degc": "degC", "k": "K", "s": "s", "ms": "ms", "us": "us", "m": "m",
    "mm": "mm", "percent": "percent", "pct": "percent", "permille": "permille", "rad_per_s": "rad/s",
    "perc": "percent", "prozent": "percent", "proz": "percent", "promille": "permille",
}  # fmt: skip
_OBJECTS = {"606c": "rpm", "6077": "permille"}  # of CiA 402, as drives have them by default
_OBJECT = re.compile(rf"(?<![0-9a-f])({'|'.join(_OBJECTS)})(?![0-9a-g])")


@dataclass(frozen=True)
class Offered:
    """A channel that a file has."""

    name: str
    unit: str = ""  # as the file states it, "" if it does not
    note: str = ""


class Source(ABC):
    """A log file of one kind."""

    has_clock_watched = False
    """Whether it warns by itself of a clock that goes back."""
    has_frames = False
    """Whether it holds CAN frames, of which a map alone knows the meaning."""

    def __init__(self, path: str | Path, advance: Advance | None = None) -> None:
        self.path, self.file, self.advance = Path(path), file_name(path), advance

    @abstractmethod
    def offered(self) -> list[Offered]:
        """The channels of the file."""

    @abstractmethod
    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """The samples of some channels, block by block in the order in which they came; once.

        Raises:
            UnknownNameError: the file has no such channel.
            LogError: the file cannot be read on.
        """

    def unit_of(self, channel: str) -> str:
        """The unit of a channel as the file states it, "" if it does not."""
        return next((one.unit for one in self.offered() if one.name == channel), "")

    def notes(self, names: Sequence[str]) -> dict[str, str]:
        """Why channels cannot be read as numbers over time, "" or nothing for those that can."""
        return {}

    def clock_report(self) -> list[str]:
        """From what the channels have their times, where they do not share one."""
        return []

    def missed(self, known: ChannelMap) -> str:
        """What of a map never came, where the file can tell."""
        return ""

    def check(self, channels: Sequence[str]) -> None:
        """Refuse channels that are not in the file."""
        names = dict.fromkeys(one.name for one in self.offered())
        for channel in channels:
            if channel not in names:
                raise UnknownNameError("channel", channel, names, where=self.file)


class TableSource(Source):
    """A source of rows: all channels come together, unless empty cells are no samples.

    Attributes:
        time: its clock, None where none is known.
        is_clock_needed: whether samples without a time are rejected.
    """

    is_clock_needed = True

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, advance)
        self.sparse = file_map is not None and file_map.sparse
        self.time: Timed | None = None if file_map is None else file_map.time

    @abstractmethod
    def rows(self, numbers: Sequence[str], stamps: Sequence[str]) -> Iterator[Rows]:
        """The rows in their order, some at a time; once."""

    @abstractmethod
    def first_numbers(self, name: str) -> Array:
        """The numbers in the first rows of a column, NaN where there is none; asked before `rows`."""

    def first_stamp(self, name: str) -> str:
        """The first cell of a column if it is a date or a time of day, else ""; asked before `rows`."""
        return ""

    def first_stamps(self, names: Sequence[str]) -> Array:
        """The times in the first rows of columns of dates and times of day [s]; asked before `rows`."""
        return np.empty(0)

    @property
    def head(self) -> list[str]:
        """The lines of text before the table."""
        return []

    def texts(self, name: str, most: int) -> list[str]:
        """The different texts in a column, some of them where there are more; read apart from the rows."""
        return []

    def check_wide(self) -> None:
        """Refuse a table with a row for each value of a series, where a column each is needed."""
        names = [one.name for one in self.offered()]
        if not any(is_value_name(name) for name in names):
            return
        for name in filter(is_series_name, names):
            series = self.texts(name, _MOST_SERIES)
            if len(series) > 1:
                listed = ", ".join(map(printable, series[:_LISTED]))
                raise LogError(
                    f"there is a row for each value of a series ({listed}), one below the other: write a column for"
                    " each series, over one clock",
                    file=self.file,
                    column=name,
                )

    def check_one_clock(self) -> None:
        """Refuse a table in which columns have clocks of their own; by the look of its first rows."""

    def row_clock(self) -> RowClock:
        """How the rows have their times; asked before `rows`."""
        timed = self.time
        if timed is None and self.is_clock_needed:
            text = "a table needs a clock: the map has no [time] with channel and unit, or with a period"
            raise LogError(text, file=self.file)
        if timed is None:
            return RowClock(self.file, Timed(), {}, "", np.empty(0))
        self.check(timed.columns)
        stamps = {name: cell for name in timed.columns if (cell := self.first_stamp(name))}
        is_stamped = timed.date is not None or timed.channel in stamps
        first = np.empty(0)
        if timed.channel:
            first = self.first_stamps(timed.columns) if is_stamped else self.first_numbers(timed.channel)
        unit = self.unit_of(timed.channel) if timed.channel else ""
        return RowClock(self.file, timed, stamps, unit, first, is_stamped=is_stamped)

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """The rows, some at a time, over the seconds of their clock; all at once where the newest is first."""
        self.check_one_clock()
        self.check_wide()
        clock = self.row_clock()
        self.check(channels)
        wanted = list(dict.fromkeys([*clock.numbers, *channels]))
        rows = self.rows(wanted, clock.stamps)
        row = 0
        for block in turned(rows, self.file) if clock.is_newest_first else rows:
            time = clock.seconds(block, row)
            order = np.arange(row, row + len(time), dtype=np.float64)
            found = {name: Samples(order, time, block.columns[name]) for name in channels}
            if self.sparse:
                found = {name: samples.where(np.isfinite(samples.value)) for name, samples in found.items()}
            yield found
            row += len(time)


def unit_in_name(name: str) -> str:
    """The unit that a column carries in its name, "" if none.

    Example:
        >>> unit_in_name("Speed [1/min]"), unit_in_name("motor_torque_nm"), unit_in_name("M_ist")
        ('1/min', 'N m', '')
        >>> unit_in_name("6077h"), unit_in_name("torque_percent")
        ('permille', 'percent')
    """
    if match := _IN_BRACKETS.fullmatch(name):
        return "" if is_digits(match[1].strip()) else match[1].strip()  # "Time (2)" is the second of its name
    small = name.lower()
    if match := _OBJECT.search(small):
        return _OBJECTS[match[1]]
    fitting = [ending for ending in _ENDINGS if small.endswith(f"_{ending}")]
    return _ENDINGS[max(fitting, key=len)] if fitting else ""


def needs(package: str, extra: str, file: str) -> ModuleType:
    """A package that not everybody has.

    Raises:
        LogError: it is not installed.
    """
    return imported(package, extra, lambda text: LogError(text, file=file))
