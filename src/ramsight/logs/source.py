"""What every kind of log file looks like to the rest: channels with names and units, and blocks of their samples."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import LogError, UnknownNameError
from ramsight.logs.align import Block, Samples
from ramsight.logs.digits import is_digits
from ramsight.logs.lines import Advance, file_name
from ramsight.logs.mapped import ChannelMap
from ramsight.optional import imported

_DAY = 86400.0  # s
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
    """A channel that a file has.

    Args:
        name: what a map calls it.
        unit: as the file states it, "" if it does not.
        note: what else is to be said of it.
    """

    name: str
    unit: str = ""
    note: str = ""


class Source(ABC):
    """A log file of one kind.

    Args:
        path: the file.
        advance: is passed how much of the file has been read.
    """

    has_clock_watched = False
    """Whether it warns by itself of a clock that goes back."""

    clock: str | None = None
    """The column that is the clock, where the kind of file needs one."""

    def __init__(self, path: str | Path, advance: Advance | None = None) -> None:
        self.path, self.file, self.advance = Path(path), file_name(path), advance

    @abstractmethod
    def offered(self) -> list[Offered]:
        """The channels of the file."""

    @abstractmethod
    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """The samples of some channels, block by block in the order in which they came; once.

        Args:
            channels: names of channels.

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

    def check(self, channels: Sequence[str]) -> None:
        """Refuse channels that are not in the file."""
        names = dict.fromkeys(one.name for one in self.offered())
        for channel in channels:
            if channel not in names:
                raise UnknownNameError("channel", channel, names, where=self.file)


class TableSource(Source):
    """A source of rows with a clock column: all channels come together, unless empty cells are no samples."""

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, advance)
        self.sparse = file_map is not None and file_map.sparse
        if file_map is not None and file_map.time is not None:
            self.clock = file_map.time.channel
            self.clock_unit = file_map.time.unit
            self.date = file_map.date

    clock_unit: str | None = None
    date: str | None = None
    """A column of dates beside a clock that is a time of day."""
    _is_in_days = False
    _begun: float | None = None
    is_clock_needed = True
    """Whether samples without a time are rejected."""

    def clocked(self) -> tuple[str, float]:
        """The clock column, and seconds for one of its units; "" if there is none and none is needed."""
        from ramsight.logs.mapped import to_si_of

        if self.clock is None and not self.is_clock_needed:
            return "", 1.0
        if self.clock is None:
            raise LogError("a table needs a clock: the map has no [time] with channel and unit", file=self.file)
        self.check([self.clock])
        unit = self.clock_unit or self.unit_of(self.clock) or "s"
        second = to_si_of(unit, "time", None, file=self.file, key=self.clock)[0]
        self._is_in_days = second == _DAY
        return self.clock, second

    def check_one_clock(self) -> None:
        """Refuse a table in which columns have clocks of their own; by the look of its first rows."""

    @abstractmethod
    def first_numbers(self, name: str) -> NDArray[np.float64]:
        """The numbers in the first rows of a column, NaN where there is none; asked before `blocks`."""

    def as_block(
        self, first_row: int, time: NDArray[np.float64], columns: dict[str, NDArray[np.float64]]
    ) -> dict[str, Samples]:
        """Rows of a table as samples of each channel; days count from the first, as dates do."""
        if self._is_in_days:
            known = time[np.isfinite(time)]
            if self._begun is None and known.size:
                self._begun = float(known[0])
            time = time - (self._begun or 0.0)
        order = np.arange(first_row, first_row + len(time), dtype=np.float64)
        block = {name: Samples(order, time, values) for name, values in columns.items()}
        if self.sparse:
            block = {name: samples.where(np.isfinite(samples.value)) for name, samples in block.items()}
        return block


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

    Args:
        package: to be imported.
        extra: the extra of ramsight that installs it.
        file: what it is needed for.

    Raises:
        LogError: it is not installed.
    """
    return imported(package, extra, lambda text: LogError(text, file=file))
