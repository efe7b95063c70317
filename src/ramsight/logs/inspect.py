"""What is in a log: its channels with units, rates and ranges, and a first channel map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.constant import Constant
from ramsight.errors import LogError, warn_of_log
from ramsight.logs.align import Samples
from ramsight.logs.can_origins import Origins
from ramsight.logs.channel_map import known_map
from ramsight.logs.clock import Clock, find_clock
from ramsight.logs.guess import guess_form, guess_roles
from ramsight.logs.lines import Advance
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import Offered, TableSource
from ramsight.logs.source_by_suffix import is_table, open_source
from ramsight.logs.source_can import CanSource
from ramsight.logs.source_mdf import MdfSource
from ramsight.logs.source_parquet import ParquetSource

STEPS = Constant(250.0, "1", "steps of a decade in which distances are counted: the median is right to half a percent")
_SHORTEST, _LONGEST = 1e-7, 1e9  # s; a clock's step, and more than any log lasts


class Distances:
    """Counts distances in time by their size, in memory that does not grow with the log.

    Attributes:
        longest: of the distances [s].
    """

    def __init__(self) -> None:
        decades = math.log10(_LONGEST / _SHORTEST)
        self._counts = np.zeros(int(STEPS * decades) + 1, dtype=np.int64)
        self._sums = np.zeros(len(self._counts))
        self._last = math.nan
        self.longest = 0.0

    def take(self, times: Array) -> None:
        """Take the next times [s], finite, shape (n,); steps back and repeated times are no distances."""
        steps = np.diff(times, prepend=self._last)
        self._last = float(times[-1])
        steps = steps[(steps >= _SHORTEST) & (steps < _LONGEST)]
        self.longest = max(self.longest, float(steps.max(initial=0.0)))
        places = (STEPS * np.log10(steps / _SHORTEST)).astype(np.int64)
        self._counts += np.bincount(places, minlength=len(self._counts))
        self._sums += np.bincount(places, weights=steps, minlength=len(self._sums))

    @property
    def usual(self) -> float:
        """The median [s], NaN if there are none.

        Example:
            >>> found = Distances()
            >>> found.take(np.array([0.0, 0.02, 0.04, 1800.0, 1800.02]))
            >>> round(found.usual, 9)
            0.02
        """
        total = int(self._counts.sum())
        if not total:
            return math.nan
        place = int(np.searchsorted(np.cumsum(self._counts), 0.5 * total))
        return float(self._sums[place] / self._counts[place])


@dataclass
class Channel:
    """A channel of a log and what was seen of it."""

    name: str
    unit: str  # as the file states it, "" if it does not
    note: str = ""  # group of an MDF file, kind of a text column
    samples: int = 0
    missing: int = 0
    least: float = np.nan
    most: float = np.nan
    # first, last: least and greatest time [s]
    first: float = np.nan
    last: float = np.nan
    role: str = ""  # what it is proposed for, "" if nothing
    distances: Distances = field(default_factory=Distances)

    @property
    def rate(self) -> float:
        """Samples per second where it comes as usual [Hz], NaN if unknown."""
        return 1.0 / self.distances.usual

    @property
    def figures(self) -> dict[str, Any]:
        """All that is known of it, with its rate [1/s]."""
        names = ("name", "unit", "note", "samples", "missing", "least", "most", "first", "last", "role", "rate")
        return {name: getattr(self, name) for name in names}

    def count(self, samples: Samples) -> None:
        """Count further samples of the channel."""
        known = np.isfinite(samples.value)
        self.missing += int(np.count_nonzero(~known))
        if not known.any():
            return
        values, times = samples.value[known], samples.time[known]
        self.samples += len(values)
        self.least = float(np.fmin(self.least, values.min()))
        self.most = float(np.fmax(self.most, values.max()))
        times = times[np.isfinite(times)]
        if times.size:
            self.first = float(np.fmin(self.first, times.min()))
            self.last = float(np.fmax(self.last, times.max()))
            self.distances.take(times)


@dataclass
class Inspection:
    """What was found in a log."""

    file: str
    channels: list[Channel]  # all of them, the clock not among them
    # of a CAN log, identifier (bit 31 set for an extended one) to how many frames and bytes
    frames: dict[int, tuple[int, int]] = field(default_factory=dict)
    clock: Clock | None = None
    # the map that was looked through, with what could be guessed of the file's layout
    known: ChannelMap = field(default_factory=ChannelMap)
    origins: Origins | None = None  # of a CAN log, the buses and addresses that its frames came from
    clocks: list[str] = field(default_factory=list)  # of groups, from what each has its time

    def of(self, role: str) -> Channel | None:
        """The channel that is proposed for a role."""
        return next((one for one in self.channels if one.role == role), None)


def inspect_log(
    path: str | Path,
    channel_map: ChannelMap | str | Path | None = None,
    *,
    dbc: Sequence[Path] = (),
    advance: Advance | None = None,
) -> Inspection:
    """Look through a whole log.

    Args:
        channel_map: what is known of it already: a CSV file's layout, a CAN log's DBC files and PDOs.

    Raises:
        LogError: the file cannot be read.
    """
    known = known_map(channel_map) or ChannelMap()
    known = replace(known, dbc=(*known.dbc, *dbc))
    if channel_map is None and is_table(path):
        known = replace(known, form=guess_form(path))
    bad: dict[str, str] = {}
    while True:
        found, wrong = _look_through(path, known, bad, advance)
        if wrong is None or wrong.column is None or wrong.column in bad:
            break
        bad[wrong.column] = f"not read: {str(wrong).removeprefix(found.file)[2:]}"
    if wrong is not None:
        warn_of_log(f"only what stands before this is listed: {wrong}", file=found.file)
    if found.origins is not None and found.origins.mixed:
        warn_of_log(found.origins.mixed, file=found.file)
    roles = {role: one.channel for role, one in known.roles.items()} or guess_roles(
        [Offered(one.name, one.unit) for one in found.channels if one.samples]
    )
    for role, name in roles.items():
        for one in found.channels:
            if one.name == name and one.samples:
                one.role = role
    return found


def _look_through(
    path: str | Path, known: ChannelMap, bad: Mapping[str, str], advance: Advance | None
) -> tuple[Inspection, LogError | None]:
    """What is in a log but for some columns that cannot be read, and what else stopped the reading."""
    source = open_source(path, known, advance)
    if isinstance(source, MdfSource) and source.has_frames:
        source = CanSource(path, known, advance)
    if isinstance(source, CanSource):
        source.origins.is_mixture_refused = False
    clock = find_clock(source, known) if isinstance(source, TableSource) else None
    taken = () if clock is None else clock.timed.columns
    listed = [one for one in source.offered() if one.name not in taken]
    notes = source.notes([one.name for one in listed])
    channels = [Channel(one.name, one.unit, bad.get(one.name) or notes.get(one.name) or one.note) for one in listed]
    unread = {name for name, note in {**notes, **bad}.items() if note}
    if isinstance(source, ParquetSource):
        unread |= {one.name for one in listed if one.note}
    found = {one.name: one for one in channels if one.name not in unread}
    wrong = None
    try:
        for block in source.blocks(list(found)):
            for name, samples in block.items():
                found[name].count(samples)
    except LogError as error:
        wrong = error
    frames = source.seen if isinstance(source, CanSource) else {}
    if isinstance(source, CanSource) and wrong is not None and not frames:
        raise wrong
    origins = source.origins if isinstance(source, CanSource) else None
    return Inspection(source.file, channels, frames, clock, known, origins, source.clock_report()), wrong
