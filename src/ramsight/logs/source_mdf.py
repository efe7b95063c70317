"""Logs in MDF files (``.mf4``): groups of channels, each group with a clock of its own."""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import DescriptionError, LogError
from ramsight.logs.align import Block, Samples
from ramsight.logs.arrival import arrivals
from ramsight.logs.clock_watch import warn_of_clocks
from ramsight.logs.frames import EXTENDED, Frame
from ramsight.logs.frames_text import FD_LENGTHS
from ramsight.logs.lines import Advance, file_name
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.mdf_file import MdfFile
from ramsight.logs.row_clock import rising, whole_clock
from ramsight.logs.source import Offered, Source

_AT_ONCE = 1 << 16  # samples of the busiest group


class MdfSource(Source):
    """An MDF file. A channel is called by its name, or by ``GROUP/NAME`` where several groups have it."""

    has_clock_watched = True

    def __init__(self, path: str | Path, file_map: ChannelMap | None = None, advance: Advance | None = None) -> None:
        super().__init__(path, advance)
        self._mdf = MdfFile(path)
        self._places = self._find()
        self.time = None if file_map is None else file_map.time
        self._check_time()
        self.has_frames = bool(frame_groups(self._mdf))

    def _find(self) -> dict[str, tuple[int, int]]:
        places: dict[str, list[tuple[int, int]]] = {}
        for number, group in enumerate(self._mdf.groups):
            for index, name in enumerate(group.names):
                if index != group.master and group.cycles:
                    places.setdefault(name, []).append((number, index))
        return {
            name if len(found) == 1 else f"{place[0]}/{name}": place
            for name, found in places.items()
            for place in found
        }

    def _check_time(self) -> None:
        """Refuse a clock that no group has: groups bring their own."""
        if self.time is None or not self.time.channel:
            return
        names = [name for group in self._mdf.groups for name in group.names]
        if self.time.channel not in names or self.time.date or self.time.week:
            raise DescriptionError(
                "is no channel of a group, and each group of MDF brings its own clock", file=self.file,
                key="time.channel", value=self.time.channel, allowed="no [time], or a channel of a group",
            )  # fmt: skip

    def _clock(self, group: int) -> Array:
        """The times of a group: by the channel or the period that the map states, else by its master channel [s]."""
        timed, of = self.time, self._mdf.groups[group]
        if timed is None or (timed.channel and timed.channel not in of.names):
            return self._mdf.clock(group)
        if not timed.channel:
            return (timed.period or 0.0) * np.arange(float(of.cycles))
        index = of.names.index(timed.channel)
        numbers = self._values(timed.channel, group, index, slice(0, of.cycles))
        return rising(self.file, whole_clock(self.file, timed, of.units[index], numbers), timed.channel)

    def offered(self) -> list[Offered]:
        """The channels of all groups that have samples, the clocks not among them."""
        found = []
        for name, (group, index) in self._places.items():
            found.append(Offered(name, self._mdf.groups[group].units[index], f"group {group}"))
        return found

    def notes(self, names: Sequence[str]) -> dict[str, str]:
        """Why channels have no time, for those of groups whose master channel is none."""
        groups = {name: self._places[name][0] for name in names}
        is_timed = self.time is not None and not self.time.channel
        reasons = {number: "" if is_timed else self._mdf.groups[number].timeless for number in set(groups.values())}
        return {name: f"group {group}: {reasons[group]}" for name, group in groups.items() if reasons[group]}

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """65 536 samples of the busiest group at a time, and those of the others that came before its next one."""
        self.check(channels)
        if not channels:
            return
        groups = sorted({self._places[channel][0] for channel in channels})
        times = {group: self._clock(group) for group in groups}
        came = arrivals(times)
        orders = {group: one.order for group, one in came.items()}
        busiest = max(groups, key=lambda group: len(times[group]))
        total = max(len(times[busiest]), 1)
        before = dict.fromkeys(groups, 0)
        for first in range(_AT_ONCE, total + _AT_ONCE, _AT_ONCE):
            ends = {group: len(times[group]) for group in groups}
            if first < total:
                limit = orders[busiest][first]
                ends = {group: int(np.searchsorted(orders[group], limit, side="left")) for group in groups}
            shared = {group: slice(before[group], ends[group]) for group in groups if ends[group] > before[group]}
            clocks = {group: (orders[group][rows], times[group][rows]) for group, rows in shared.items()}
            yield {
                channel: Samples(*clocks[group], self._values(channel, group, index, shared[group]))
                for channel, (group, index) in ((channel, self._places[channel]) for channel in channels)
                if group in shared
            }
            if self.advance is not None:
                self.advance((ends[busiest] - before[busiest]) / total)
            before = ends
        warn_of_clocks(self.file, times, came, {group: f"group {group}" for group in groups})

    def _values(self, channel: str, group: int, index: int, rows: slice) -> Array:
        start, count = rows.start, rows.stop - rows.start
        values, invalid = self._mdf.values(group, index, start, count)
        if values.dtype.kind not in "iufb":  # numbers with words for them: the numbers
            values, invalid = self._mdf.values(group, index, start, count, raw=True)
        return _numbers(values, invalid, self.file, channel)


def _numbers(values: Any, invalid: Any, file: str, channel: str) -> Array:
    if values.dtype.kind not in "iufb" or values.ndim != 1:
        raise LogError("holds text or arrays where numbers are needed", file=file, column=channel)
    numbers: Array = values.astype(np.float64)
    bad = ~np.isfinite(numbers)
    if invalid is not None:
        bad |= np.asarray(invalid, dtype=np.bool_)
    numbers[bad] = np.nan
    return numbers


_FRAMES_AT_ONCE = 1 << 15  # frames
_NAME = "CAN_DataFrame."


def frame_groups(mdf: MdfFile) -> list[int]:
    """The groups of a file that hold CAN frames."""
    return [number for number, group in enumerate(mdf.groups) if f"{_NAME}ID" in group.names]


def mdf_frames(path: str | Path, advance: Advance | None = None) -> Iterator[Frame]:
    """The data frames of a file, in the order in which they came; arguments and errors as `open_frames`."""
    mdf = MdfFile(path)
    groups = frame_groups(mdf)
    total = sum(mdf.groups[group].cycles for group in groups)
    if not total:
        raise LogError("holds no CAN frames: a channel map with [can] is for bus logging", file=file_name(path))
    times = {group: mdf.clock(group) for group in groups}
    came = arrivals(times)
    merged = heapq.merge(
        *(zip(came[group].order.tolist(), _group_frames(mdf, group, times[group]), strict=True) for group in groups),
        key=lambda placed: placed[0],
    )
    for number, (_, frame) in enumerate(merged, start=1):
        if advance is not None and number % 4096 == 0:
            advance(4096 / total)
        yield frame


def _group_frames(mdf: MdfFile, group: int, times: Array) -> Iterator[Frame]:
    names, cycles = mdf.groups[group].names, mdf.groups[group].cycles
    is_code = f"{_NAME}DataLength" not in names
    length_name = f"{_NAME}DLC" if is_code else f"{_NAME}DataLength"
    for first in range(0, cycles, _FRAMES_AT_ONCE):
        count = min(_FRAMES_AT_ONCE, cycles - first)

        def column(name: str, first: int = first, count: int = count) -> Any:
            return mdf.values(group, names.index(name), first, count, raw=True)[0]

        ids, data, lengths = column(f"{_NAME}ID"), column(f"{_NAME}DataBytes"), column(length_name)
        buses = column(f"{_NAME}BusChannel") if f"{_NAME}BusChannel" in names else [1] * count
        wide = column(f"{_NAME}IDE") if f"{_NAME}IDE" in names else (ids & EXTENDED != 0) | (ids > 0x7FF)
        rows = zip(
            times[first : first + count].tolist(), ids.tolist(), wide, buses, lengths.tolist(), data, strict=True
        )
        for time, key, is_wide, bus, length, content in rows:
            key = (key & 0x1FFFFFFF) | (EXTENDED if is_wide else 0)
            stored = bytes(content)
            if is_code:  # 9 to 15 are 12 to 64 bytes of CAN FD, and 8 of a frame that has room for no more
                length = min(FD_LENGTHS[length & 0xF], len(stored))
            yield Frame(time, key, max(int(bus) - 1, 0), stored[:length])
