"""CAN frames in MDF files (``.mf4``): bus logging as ASAM has it, groups with ``CAN_DataFrame``."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ramsight.arrays import Array
from ramsight.errors import LogError
from ramsight.logs.arrival import arrivals
from ramsight.logs.frames import EXTENDED, Frame
from ramsight.logs.frames_text import FD_LENGTHS
from ramsight.logs.lines import Advance, file_name
from ramsight.logs.mdf_file import MdfFile

_AT_ONCE = 1 << 15  # frames
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
    for first in range(0, cycles, _AT_ONCE):
        count = min(_AT_ONCE, cycles - first)

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
