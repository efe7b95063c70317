"""What measurement programs write: groups of channels, each group with a clock of its own, all of it in memory."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import DescriptionError, LogError
from ramsight.logs.align import Block, Samples
from ramsight.logs.arrival import arrivals
from ramsight.logs.clock_warnings import warn_of_clocks
from ramsight.logs.guess import guess_clock
from ramsight.logs.lines import Advance
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import Offered, Source, unit_in_name
from ramsight.units import parse

Array = NDArray[np.float64]
_PLACE = re.compile(r"\[[0-9]+\]$")  # column of a matrix
NO_CLOCK = "has no clock: no time of its own, and no channel of times as long as it"
"""Why channels of a group have no time."""


@dataclass(frozen=True)
class Recorded:
    """A channel as a file has it.

    Args:
        values: shape (n,).
        unit: as the file states it, "" if it does not.
    """

    values: Array
    unit: str = ""


@dataclass(frozen=True)
class Group:
    """Channels with one clock.

    Args:
        name: of the group.
        channels: by their names.
        time: of their samples [s], shape (n,); None where one of the channels is the clock, or nothing is.
    """

    name: str
    channels: Mapping[str, Recorded] = field(default_factory=dict)
    time: Array | None = None


class GroupSource(Source):
    """A file of groups. A channel is called by its name, or by ``GROUP/NAME`` where several groups have it.

    The clock of a group without a time of its own is the channel that the map names, or one whose name is a clock's.
    """

    has_clock_watched = True

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, advance)
        self._known = file_map
        self._groups = [self._timed(group) for group in self.read() if group.channels]
        self._places = self._named()

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

    def _timed(self, group: Group) -> Group:
        """A group with the time of its clock channel, which is none of its channels then."""
        if group.time is not None:
            return group
        said = self._known.time if self._known is not None else None
        clock = said.channel if said is not None else _clock_of(group.channels)
        if clock is None or clock not in group.channels:
            return group
        second = _second((said.unit if said is not None else None) or _unit_of(clock, group.channels[clock]) or "s")
        if second is None:
            return group
        rest = {name: other for name, other in group.channels.items() if name != clock}
        return Group(group.name, rest, second * group.channels[clock].values)

    def offered(self) -> list[Offered]:
        """The channels of all groups, the clocks not among them."""
        return [
            Offered(name, _unit_of(inner, self._groups[number].channels[inner]), self._groups[number].name)
            for name, (number, inner) in self._places.items()
        ]

    def notes(self, names: Sequence[str]) -> dict[str, str]:
        """Why channels have no time, for those of groups without a clock."""
        return {name: f"not read: {NO_CLOCK}" for name in names if self._groups[self._places[name][0]].time is None}

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """All samples at once, in the order of the groups' clocks."""
        self.check(channels)
        times: dict[int, Array] = {}
        for channel in channels:
            number, _ = self._places[channel]
            time = self._groups[number].time
            if time is None:
                raise LogError(f"{NO_CLOCK}: name one (time = ...)", file=self.file, column=channel)
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


def _clock_of(channels: Mapping[str, Recorded]) -> str | None:
    """The channel whose name, in its structure, is a clock's, and whose unit is one of time if it has one."""
    for name, one in channels.items():
        inner = _PLACE.sub("", name).rpartition(".")[2]
        if guess_clock([name, inner]) is not None and _second(_unit_of(name, one) or "s") is not None:
            return name
    return None


def _unit_of(name: str, one: Recorded) -> str:
    return one.unit or unit_in_name(name)


def _second(unit: str) -> float | None:
    """Seconds for a unit of time, None for any other."""
    try:
        return parse(f"1 {unit}", "s")
    except DescriptionError:
        return None


def by_length(name: str, channels: Mapping[str, Recorded]) -> list[Group]:
    """Channels without a time of their own as groups of equal length, of which one may have the clock."""
    groups: dict[int, dict[str, Recorded]] = {}
    for inner, one in channels.items():
        groups.setdefault(len(one.values), {})[inner] = one
    several = len(groups) > 1
    return [Group(f"{name}[{length}]" if several else name, of) for length, of in groups.items() if length > 1]
