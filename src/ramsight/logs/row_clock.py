"""The one place that says when samples were by a clock's numbers or stamps: unit, epoch, direction, turns, periods."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import DescriptionError, LogError, warn_of_log
from ramsight.logs.clock_going import GoesOn, SinceFirst
from ramsight.logs.clock_units import DAY, Unit, is_falling, second_of, unit_of
from ramsight.logs.mapped import Timed

WEEK = 7.0 * DAY
_LONG_AGO = ("d", "100 ns")
"""Units of clocks that begin long ago; times count from the first, as dates do."""


@dataclass(frozen=True)
class Rows:
    """Rows of a table."""

    count: int
    columns: Mapping[str, Array]  # of numbers, each of shape (count,)
    # seconds since 1970, or since midnight [s], shape (count,); None where the clock is no stamp
    stamps: Array | None = None


def turned(rows: Iterator[Rows], file: str) -> Iterator[Rows]:
    """All rows as one block, the last first; with a warning."""
    warn_of_log("the rows are newest first; they are turned round", file=file)
    held = list(rows)[::-1]
    if held:
        columns = {name: np.concatenate([one.columns[name][::-1] for one in held]) for name in held[0].columns}
        stamps = [one.stamps[::-1] for one in held if one.stamps is not None]
        yield Rows(sum(one.count for one in held), columns, np.concatenate(stamps) if stamps else None)


class NumberClock:
    """Seconds for the numbers of a clock.

    Args:
        said: its unit as the file states it, "" if it does not.
        first: its first numbers, NaN where there is none.

    Attributes:
        unit: of its numbers, with the evidence.

    Raises:
        DescriptionError: nothing says the unit, and numbers and steps leave it open.
    """

    def __init__(self, file: str, timed: Timed, said: str, first: Array) -> None:
        self._timed = timed
        if timed.period is not None:
            self.unit = Unit(f"{timed.period:.9g} s", "a period, stated in the channel map")
        elif timed.unit or said:
            self.unit = Unit(timed.unit or said, "stated in the channel map" if timed.unit else "stated in the file")
        else:
            self.unit = unit_of(first)
        if not self.unit.name:
            raise DescriptionError(
                f"is needed: {self.unit.evidence} would be usual, and nothing says it", file=file, key="time.unit",
                value=None, allowed=f"{self.unit.evidence.rpartition(' ')[2]} or {self.unit.runner_up}",
            )  # fmt: skip
        self.second = timed.period or second_of(self.unit.name)
        self._begun: float | None = None
        self._is_from_first = self.unit.name in _LONG_AGO or timed.week is not None
        self._goes_on = GoesOn(file, self.second, is_local=self.second == DAY)

    def seconds(self, numbers: Array, weeks: Array | None = None) -> Array:
        """Seconds for the next numbers, shape (n,)."""
        numbers = self._goes_on(numbers) if weeks is None else numbers + weeks * (WEEK / self.second)
        if self._is_from_first:
            known = numbers[np.isfinite(numbers)]
            if self._begun is None and known.size:
                self._begun = float(known[0])
            numbers = numbers - (self._begun or 0.0)
        timed = self._timed
        return timed.sign * (timed.scale * numbers + timed.offset) * self.second


class RowClock:
    """When the rows of a table were.

    Args:
        stamped: the first cell of each of its columns that are dates or times of day.
        said: unit of its column as the file states it, "" if it does not.

    Attributes:
        numbers: columns of numbers that it is read from.
        stamps: columns of dates and times of day that it is read from.
        is_newest_first: whether the last row was first.
    """

    def __init__(
        self, file: str, timed: Timed, stamped: Mapping[str, str], said: str, first: Array, *, is_stamped: bool = False
    ) -> None:
        self._timed, self._file = timed, file
        self.stamps = timed.columns if is_stamped else ()
        self.numbers = () if is_stamped else timed.columns
        self._since = SinceFirst(" ".join(stamped.get(name, "") for name in self.stamps).strip(), file)
        self._clock = None
        if self.stamps and (timed.week or (timed.sign, timed.scale, timed.offset) != (1.0, 1.0, 0.0) or timed.period):
            raise DescriptionError(
                "holds dates or times of day, which take no week, period, scale, offset or sign",
                file=file, key="time.channel", value=timed.channel,
            )  # fmt: skip
        if self.numbers:
            self._clock = NumberClock(file, timed, said, first)
        self.is_newest_first = timed.sign > 0.0 and is_falling(first)
        self.evidence = "" if self._clock is None else self._clock.unit.evidence

    def seconds(self, rows: Rows, row: int) -> Array:
        """When the next rows were [s], shape (n,); NaN where it is not known.

        Args:
            row: number of the first, from 0.
        """
        if rows.stamps is not None:
            return self._since(rows.stamps)
        if self._clock is not None:
            weeks = None if self._timed.week is None else rows.columns[self._timed.week]
            return self._clock.seconds(rows.columns[self._timed.channel], weeks)
        if self._timed.period is not None:
            return self._timed.period * np.arange(row, row + rows.count, dtype=np.float64)
        return np.full(rows.count, np.nan)


def whole_clock(file: str, timed: Timed, said: str, numbers: Array) -> Array:
    """Seconds for all numbers of a clock at once.

    Args:
        said: its unit as the file states it, "" if it does not.
        numbers: shape (n,).

    Raises:
        DescriptionError: nothing says the unit, and numbers and steps leave it open.
    """
    return NumberClock(file, timed, said, numbers).seconds(numbers)


def rising(file: str, time: Array, name: str) -> Array:
    """The times of a clock whose samples cannot be turned round.

    Args:
        time: of the samples [s], shape (n,).

    Raises:
        LogError: the newest sample is the first.
    """
    if is_falling(time):
        raise LogError(
            "falls from sample to sample: the newest is first; write the oldest first", file=file, column=name
        )
    return time
