"""What measurement programs write: groups of channels, each group with a clock of its own, all of it in memory."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ramsight.arrays import Array
from ramsight.constant import Constant
from ramsight.errors import DescriptionError, LogError, warn_of_log
from ramsight.logs.align import Block, Samples
from ramsight.logs.arrival import arrivals
from ramsight.logs.clock_units import is_falling, is_time
from ramsight.logs.clock_watch import warn_of_clocks
from ramsight.logs.column_names import are_two_clocks, guess_clock
from ramsight.logs.lines import Advance
from ramsight.logs.mapped import ChannelMap, Timed
from ramsight.logs.row_clock import whole_clock
from ramsight.logs.source import Offered, Source, unit_in_name

_PLACE = re.compile(r"\[[0-9]+\]$")  # column of a matrix
RISING = Constant(0.9, "1", "share of its steps that go up, of a channel that is a clock")
NO_CLOCK = "has no clock: no time of its own, and no channel of times as long as it"
"""Why channels of a group have no time."""
SEVERAL = "has no clock of its own, and the clocks {} beside it go on otherwise"
"""The same where there are several that it could have."""


@dataclass(frozen=True)
class Recorded:
    """A channel as a file has it."""

    values: Array  # shape (n,)
    unit: str = ""  # as the file states it, "" if it does not


@dataclass(frozen=True)
class Group:
    """Channels with one clock."""

    name: str
    channels: Mapping[str, Recorded] = field(default_factory=dict)
    # of their samples [s], shape (n,); None where one of the channels is the clock, or nothing is
    time: Array | None = None
    lacking: str = ""  # why they have no time, "" if they have one
    clock: str = ""  # what their time is taken from, in a few words


class GroupSource(Source):
    """A file of groups. A channel is called by its name, or by ``GROUP/NAME`` where several groups have it.

    The clock of a channel without a time of its own is one of the same length: the one in its own structure, else the
    one that the map names, else the only one there is, or several that agree. A clock is nothing else.
    """

    has_clock_watched = True

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, advance)
        self.time = None if file_map is None else file_map.time
        self._roles = frozenset(() if file_map is None else (one.channel for one in file_map.roles.values()))
        self._apart: set[str] = set()
        self._groups = [part for group in self.read() if group.channels for part in self._timed(group)]
        self._places = self._named()
        if self._apart:
            warn_of_log(
                f"{', '.join(sorted(self._apart)[:_LISTED])} go on otherwise than the clock that the map names: is each"
                " channel over its own?",
                file=self.file,
            )

    @abstractmethod
    def read(self) -> list[Group]:
        """The groups of the file.

        Raises:
            LogError: it cannot be read.
        """

    def _named(self) -> dict[str, tuple[int, str]]:
        found: dict[str, list[int]] = {}
        for number, group in enumerate(self._groups):
            for name in group.channels:
                found.setdefault(name, []).append(number)
        return {
            name if len(numbers) == 1 else f"{self._groups[number].name}/{name}": (number, name)
            for name, numbers in found.items()
            for number in numbers
        }

    def _timed(self, group: Group) -> list[Group]:
        """The channels of a group by the clocks that they have."""
        if group.time is not None:
            return [Group(group.name, *_oldest_first(group.channels, group.time), clock=group.clock)]
        clocks = self._clocks(group.channels)
        parts: dict[tuple[str, str], dict[str, Recorded]] = {}
        for name, one in group.channels.items():
            if name not in clocks:
                parts.setdefault(self._clock_of(name, clocks, group.channels), {})[name] = one
        found = []
        for (clock, lacking), channels in parts.items():
            time = None
            try:
                time = self._seconds(clock, group.channels, len(next(iter(channels.values())).values))
            except DescriptionError as error:
                lacking = f"has the clock {clock}, whose unit {error.message}"
            if time is None:
                found.append(Group(group.name, channels, lacking=lacking or NO_CLOCK))
            else:
                found.append(Group(group.name, *_oldest_first(channels, time), clock=clock or "a period of rows"))
        return found

    def _clocks(self, channels: Mapping[str, Recorded]) -> list[str]:
        """The channels that are clocks: that of the map first, then those that are called so and rise."""
        named = "" if self.time is None else self.time.channel
        return [
            name
            for name in sorted(channels, key=lambda name: name != named)
            if name == named or (name not in self._roles and self._is_clock(name, channels))
        ]

    def _is_clock(self, name: str, channels: Mapping[str, Recorded]) -> bool:
        one = channels[name]
        place = _PLACE.search(name)
        is_called = guess_clock([_PLACE.sub("", name), _PLACE.sub("", name).rpartition(".")[2]]) is not None
        is_first = place is not None and place[0] == "[1]" and f"{name[: place.start()]}[2]" in channels
        if not (is_called or (is_first and _is_even(one.values))) or not is_time(_unit_of(name, one) or "s"):
            return False
        steps = np.diff(one.values[np.isfinite(one.values)])
        return steps.size > 0 and bool(max(np.mean(steps > 0.0), np.mean(steps < 0.0)) >= RISING)

    def _clock_of(self, name: str, clocks: Sequence[str], channels: Mapping[str, Recorded]) -> tuple[str, str]:
        """The clock of a channel; else "", and the reason if there is one."""
        if self.time is not None and not self.time.channel:
            return "", ""
        own = max(clocks, key=lambda one: _shared(one, name), default="")
        named = clocks[0] if clocks and self.time is not None and clocks[0] == self.time.channel else ""
        if own and _shared(own, name) > (_shared(named, name) if named else 0):
            return own, ""
        near = [clock for clock in clocks if clock == named or _shared(clock, name) == 0] or list(clocks)
        apart = [one for one in near[1:] if are_two_clocks(channels[near[0]].values, channels[one].values)]
        if apart and not named:
            return "", SEVERAL.format(", ".join([near[0], *apart][:_LISTED]))
        if apart:
            self._apart.update(apart)
        return named or (near[0] if near else ""), ""

    def _seconds(self, clock: str, channels: Mapping[str, Recorded], count: int) -> Array | None:
        """The times of a clock [s]; of rows at a period without one; None where there is neither."""
        if not clock:
            period = None if self.time is None or self.time.channel else self.time.period
            return None if period is None else period * np.arange(float(count))
        is_alike = self.time is not None and self.time.channel.rpartition(".")[2] == clock.rpartition(".")[2]
        timed = self.time if self.time is not None and is_alike else Timed(clock)
        one = channels[clock]
        return whole_clock(self.file, timed, _unit_of(clock, one), one.values)

    def clock_report(self) -> list[str]:
        """From what the channels have their times."""
        found: dict[str, list[str]] = {}
        for name, (number, _) in self._places.items():
            found.setdefault(self._groups[number].clock, []).append(name)
        return [
            f"clock of {', '.join(names[:_LISTED])}{' and others' if len(names) > _LISTED else ''}: {clock}"
            for clock, names in found.items()
            if clock
        ]

    def offered(self) -> list[Offered]:
        """The channels of all groups, the clocks not among them."""
        return [
            Offered(name, _unit_of(inner, self._groups[number].channels[inner]), self._groups[number].name)
            for name, (number, inner) in self._places.items()
        ]

    def notes(self, names: Sequence[str]) -> dict[str, str]:
        """Why channels have no time, for those of groups without a clock."""
        groups = {name: self._groups[self._places[name][0]] for name in names}
        return {name: f"not read: {group.lacking}" for name, group in groups.items() if group.time is None}

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """All samples at once, in the order of the groups' clocks."""
        self.check(channels)
        times: dict[int, Array] = {}
        for channel in channels:
            number, _ = self._places[channel]
            time = self._groups[number].time
            if time is None:
                text = f"{self._groups[number].lacking}: name one (time = ...), or a period of rows"
                raise LogError(text, file=self.file, column=channel)
            times[number] = time
        if not times:
            return
        came = arrivals(times)
        block = {}
        for channel in channels:
            number, inner = self._places[channel]
            values = self._groups[number].channels[inner].values
            finite = np.where(np.isfinite(values), values, np.nan)
            block[channel] = Samples(came[number].order, times[number], finite)
        yield block
        if self.advance is not None:
            self.advance(1.0)
        warn_of_clocks(self.file, times, came, {number: self._groups[number].name for number in times})


def _oldest_first(channels: Mapping[str, Recorded], time: Array) -> tuple[Mapping[str, Recorded], Array]:
    """Channels and times, turned round where the newest sample is first."""
    if not is_falling(time):
        return channels, time
    return {name: Recorded(one.values[::-1], one.unit) for name, one in channels.items()}, time[::-1]


def _shared(clock: str, name: str) -> int:
    """How many structures hold both a clock and a channel; 0 where the clock is in one that the channel is not in."""
    around = _PLACE.sub("", clock).split(".")[:-1] or ([_PLACE.sub("", clock)] if _PLACE.search(clock) else [])
    inside = [*_PLACE.sub("", name).split("."), name]
    return len(around) if inside[: len(around)] == around else 0


def _is_even(values: Array) -> bool:
    """Whether numbers rise by the same from one to the next, but for rounding."""
    steps = np.diff(values)
    return bool(steps.size > 1 and steps.min() > 0.0 and steps.max() - steps.min() <= EVEN * steps.mean())


EVEN = Constant(0.01, "1", "of a step: by which the steps of a clock that nothing names may differ")
_LISTED = 6


def _unit_of(name: str, one: Recorded) -> str:
    return one.unit or unit_in_name(name)


def by_length(name: str, channels: Mapping[str, Recorded]) -> list[Group]:
    """Channels without a time of their own as groups of equal length, of which one may have the clock."""
    groups: dict[int, dict[str, Recorded]] = {}
    for inner, one in channels.items():
        groups.setdefault(len(one.values), {})[inner] = one
    several = len(groups) > 1
    return [Group(f"{name}[{length}]" if several else name, of) for length, of in groups.items() if length > 1]
