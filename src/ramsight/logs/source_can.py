"""Logs of CAN frames: BLF, ASC, candump and MDF, with a DBC file or CANopen mappings."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import DescriptionError, LogError, UnknownNameError, warn_of_log
from ramsight.logs.align import Block, Samples
from ramsight.logs.arrival import OUT_OF_ORDER
from ramsight.logs.can_dbc import dbc_fields, destination_address, j1939_group, source_address
from ramsight.logs.can_field import Field
from ramsight.logs.can_origins import Origins
from ramsight.logs.can_pdo import pdo_fields
from ramsight.logs.clock_watch import ClockWatch, warn_of_watched
from ramsight.logs.frames import EXTENDED
from ramsight.logs.lines import Advance, check_file
from ramsight.logs.mapped import ChannelMap
from ramsight.logs.source import Offered, Source
from ramsight.logs.source_by_suffix import open_frames

_AT_ONCE = 1 << 15  # frames that are wanted
_WIDEST = 64
_LISTED = 6  # identifiers in a message
_MOST_THERE = 12  # identifiers of a log in a message on those that it lacks


@dataclass
class Frames:
    """Frames of one identifier: their places in the file, times and bytes."""

    order: list[int]
    time: list[float]
    data: list[bytes]


class CanSource(Source):
    """A log of frames; every signal of its DBC files, or every object of its PDOs, is a channel.

    Args:
        file_map: with DBC files or PDOs; None to count frames only.

    Attributes:
        seen: frames by identifier after reading, bit 31 set for an extended one, with the longest one's bytes.
        wanted: identifiers of the channels that were asked for, J1939 groups apart.
        origins: from which buses and addresses the frames of each channel came.
    """

    has_clock_watched = True
    has_frames = True

    def __init__(self, path: str | Path, file_map: ChannelMap | None, advance: Advance | None = None) -> None:
        super().__init__(path, advance)
        check_file(path)
        if file_map is not None and file_map.time is not None:
            raise DescriptionError(
                "is for tables and groups: frames bring their own clock", file=file_map.file or self.file, key="time",
                allowed="no [time]",
            )  # fmt: skip
        self._bus = None if file_map is None else file_map.bus
        self._sources = frozenset(() if file_map is None else file_map.sources)
        self._destinations = frozenset(() if file_map is None else file_map.destinations)
        self.origins = Origins(self.file)
        self.wanted: frozenset[int] = frozenset()
        self._exact: dict[int, list[Field]] = {}
        self._groups: dict[int, list[Field]] = {}
        for dbc in () if file_map is None else file_map.dbc:
            exact, groups = dbc_fields(dbc, file_map.j1939 if file_map is not None else None)
            _merge(self._exact, exact)
            _merge(self._groups, groups)
        if file_map is not None:
            mapped = {cob_id | (EXTENDED if cob_id > 0x7FF else 0): of for cob_id, of in pdo_fields(file_map).items()}
            _merge(self._exact, mapped)
        self._named = self._names()
        self.seen: dict[int, tuple[int, int]] = {}

    def _names(self) -> dict[str, Field]:
        """Fields by the names of their channels; a name that several frames have is preceded by the identifier."""
        placed = [(f"0x{key & ~EXTENDED:X}", field) for key, fields in self._exact.items() for field in fields]
        placed += [(f"0x{key:X}", field) for key, fields in self._groups.items() for field in fields]
        counts = Counter(field.name for _, field in placed)
        return {field.name if counts[field.name] == 1 else f"{place}.{field.name}": field for place, field in placed}

    def offered(self) -> list[Offered]:
        """The signals, called ``Message.Signal``, or the objects of the PDOs."""
        return [Offered(name, field.unit) for name, field in self._named.items()]

    def unit_of(self, channel: str) -> str:
        """The unit of a channel as the DBC file states it, "" if it does not."""
        return self._found(channel).unit

    def check(self, channels: Sequence[str]) -> None:
        """Refuse channels that no frame has."""
        for channel in channels:
            self._found(channel)

    def missed(self, known: ChannelMap) -> str:
        """Which frames of a map never came, and which did: most often the node-ID in a map is another drive's."""
        seen = self.seen
        missed = [
            f"{one.cob_id:X}h (can.pdo[{k}].cob_id)" for k, one in enumerate(known.pdos) if one.cob_id not in seen
        ]
        of_pdos = {pdo.cob_id & ~EXTENDED for pdo in known.pdos}
        of_dbc = sorted(key for key in self.wanted if key not in seen and key & ~EXTENDED not in of_pdos)
        missed += [f"{key & ~EXTENDED:X}h (can.dbc)" for key in of_dbc]
        if not missed or not seen:
            return self.origins.passed
        there = [f"{key & ~EXTENDED:X}h" for key in list(seen)[:_MOST_THERE]]
        more = f" and {len(seen) - _MOST_THERE} more" if len(seen) > _MOST_THERE else ""
        of_map = f"{known.file} names" if known.file else "the map names"
        groups = {j1939_group(key & ~EXTENDED) for key in seen if key & EXTENDED}
        same = any(key & EXTENDED and j1939_group(key & ~EXTENDED) in groups for key in of_dbc)
        hint = "is it the drive's node-ID?" if known.pdos else "is it another machine's file?"
        if same:
            hint = "these are the same J1939 groups from other addresses: [can] j1939 = true reads them"
        return f": {of_map} {', '.join(missed)}, the log has {', '.join(there)}{more}; {hint}"

    def _found(self, channel: str) -> Field:
        """A field by its name, or by its signal's name if one message alone has it."""
        if channel in self._named:
            return self._named[channel]
        short = [field for name, field in self._named.items() if name.rpartition(".")[2] == channel]
        if len(short) == 1:
            return short[0]
        if not self._named:
            raise LogError("holds CAN frames: its map has to name a DBC file or PDOs under [can]", file=self.file)
        raise UnknownNameError("channel", channel, self._named, where=self.file)

    def blocks(self, channels: Sequence[str]) -> Iterator[Block]:
        """The samples of some channels, from 32 768 frames at a time; time counts from the first frame of the file."""
        fields = {channel: self._found(channel) for channel in channels}
        wanted = {id(field) for field in fields.values()}
        exact = {key for key, of in self._exact.items() if any(id(field) in wanted for field in of)}
        groups = {key for key, of in self._groups.items() if any(id(field) in wanted for field in of)}
        self.wanted = frozenset(exact)
        for frames in self.frames(exact, groups):
            block: dict[str, Samples] = {}
            for key, of_key in frames.items():
                inside = {id(field) for field in (self._groups[key] if key in groups else self._exact[key])}
                ready = _Decoder(of_key)
                for channel, field in fields.items():
                    if id(field) in inside:
                        samples = ready.samples(field)
                        if len(samples):
                            block[channel] = samples
            yield block

    def frames(self, exact: set[int], groups: set[int]) -> Iterator[dict[int, Frames]]:
        """Frames of some identifiers and J1939 groups, block by block; counts all of them in `seen`."""
        found: dict[int, Frames] = {}
        waiting, number, begun = 0, -1, None
        counted: dict[int, list[int]] = {}
        clocks: dict[int, ClockWatch] = {}
        leaps: list[tuple[float, float]] = []
        long: set[int] = set()
        last = math.nan
        for time, key, bus, data in open_frames(self.path, self.advance):
            number += 1
            if begun is None:
                begun = time
            if time < last - OUT_OF_ORDER:
                leaps.append((last, time))
            last = time
            if data is None or (self._bus is not None and bus != self._bus):
                continue
            if key not in counted:
                counted[key], clocks[key] = [0, 0], ClockWatch()
            tally = counted[key]
            tally[0] += 1
            tally[1] = max(tally[1], len(data))
            clocks[key].take(time)
            identifier = key
            if key not in exact and key & ~EXTENDED in exact:  # of eight digits in the log, and yet of 11 bits
                key = key & ~EXTENDED
                long.add(key)
            if key not in exact:
                key = j1939_group(key & ~EXTENDED) if groups and key & EXTENDED else -1
                if key not in groups:
                    continue
                source, to = source_address(identifier), destination_address(identifier)
                if self._sources and source not in self._sources:
                    self.origins.pass_over(key, source)
                    continue
                if self._destinations and to is not None and to not in self._destinations:
                    continue
                self.origins.take(key, bus, source, to)
            else:
                self.origins.take(key, bus, None)
            frames = found.get(key)
            if frames is None:
                frames = found[key] = Frames([], [], [])
            frames.order.append(number)
            frames.time.append(time - begun)
            frames.data.append(data)
            waiting += 1
            if waiting >= _AT_ONCE:
                yield found
                found, waiting = {}, 0
        if long:
            listed = ", ".join(f"{key:X}h" for key in sorted(long)[:_LISTED])
            text = f"frames {listed} have identifiers of 29 bits here, and 11 in the map: they are taken for the same"
            warn_of_log(text, file=self.file)
        warn_of_watched(self.file, clocks.values(), leaps)
        self.seen = {key: (count, longest) for key, (count, longest) in sorted(counted.items())}
        if found:
            yield found


class _Decoder:
    """Frames of one identifier as arrays, made once; channels that stand in the same frames share them."""

    def __init__(self, frames: Frames) -> None:
        self._order = np.array(frames.order, dtype=np.float64)
        self._time = np.array(frames.time, dtype=np.float64)
        lengths = np.array([len(data) for data in frames.data])
        packed = b"".join(data.ljust(_WIDEST, b"\0") for data in frames.data)
        self._bytes: NDArray[np.uint8] = np.frombuffer(packed, dtype=np.uint8).reshape(-1, _WIDEST)
        self._lengths = lengths

    def samples(self, field: Field) -> Samples:
        chosen = self._lengths >= field.length
        if field.selector is not None:
            chosen &= field.present(self._bytes)
        if chosen.all():
            return Samples(self._order, self._time, field.values(self._bytes[:, : field.length]))
        every = Samples(self._order, self._time, field.values(self._bytes))
        return every.where(chosen)


def _merge(into: dict[int, list[Field]], more: dict[int, list[Field]]) -> None:
    for key, fields in more.items():
        into.setdefault(key, []).extend(replace(field) for field in fields)
