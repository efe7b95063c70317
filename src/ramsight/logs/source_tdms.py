"""Logs in TDMS files (LabVIEW, DIAdem): groups of channels, as npTDMS reads them."""

from __future__ import annotations

import logging
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ramsight.constant import Constant
from ramsight.errors import LogError, warn_of_log
from ramsight.logs.column_names import guess_clock
from ramsight.logs.lines import check_file, first_line
from ramsight.logs.packed import opened
from ramsight.logs.source import needs
from ramsight.logs.source_groups import Group, GroupSource, Recorded, by_length
from ramsight.units.algebra import NANOSECONDS

_DAMAGE = (ValueError, KeyError, TypeError, IndexError, AttributeError, OSError, EOFError, MemoryError, OverflowError,
           struct.error, NotImplementedError, RuntimeError, AssertionError, ArithmeticError)  # fmt: skip
_UNIT = "unit_string"
_STEP, _OFFSET, _START = "wf_increment", "wf_start_offset", "wf_start_time"


class TdmsSource(GroupSource):
    """A TDMS file. Channels with the properties of a waveform have their time by them, others by a channel of times."""

    def read(self) -> list[Group]:
        """The groups of the file, split where their channels have other clocks."""
        check_file(self.path)
        nptdms: Any = needs("nptdms", "logs", self.file)
        try:
            with _quiet() as said, opened(self.path) as stored, nptdms.TdmsFile.open(stored) as file:
                most = os.path.getsize(self.path)
                named = "" if self.time is None else self.time.channel
                is_period = self.time is not None and not self.time.channel
                groups = [one for group in file.groups() for one in _split(group, most, named, is_period=is_period)]
        except _DAMAGE as error:
            raise LogError(f"is no TDMS file, or a damaged one: {first_line(error)}", file=self.file) from None
        if said:
            warn_of_log(f"is read as far as it goes: {said[0]}", file=self.file)
        if not groups:
            raise LogError("has no channels with samples", file=self.file)
        return _from_first(groups, self.file)


@contextmanager
def _quiet() -> Iterator[list[str]]:
    """What npTDMS would print of a damaged file on standard error, in a list."""
    said: list[str] = []
    loggers = [
        logging.getLogger(name) for name in logging.root.manager.loggerDict if name.partition(".")[0] == "nptdms"
    ]
    before = [(one, one.handlers, one.propagate) for one in loggers]
    handler = logging.Handler()
    handler.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    for one in loggers:
        one.handlers, one.propagate = [handler], False
    try:
        yield said
    finally:
        for one, handlers, propagate in before:
            one.handlers, one.propagate = handlers, propagate


def _split(group: Any, most: int, named: str, *, is_period: bool) -> list[tuple[Group, float | None]]:
    """The channels of a group by their clocks, and when each began since 1970 [s], None where it is not said.

    What the map states counts before the properties of waveforms.
    """
    read: dict[str, tuple[Recorded, Any]] = {}
    for channel in group.channels():
        count = len(channel)
        if channel.dtype is None or channel.dtype.kind not in "iufbM" or not count:
            continue
        if count > most:  # a byte a sample at least: more are claimed than are there
            raise ValueError(f"channel {channel.name} claims {count} samples")
        values = channel[:]
        if values.dtype.kind == "M":
            values, unit = values.astype("datetime64[ns]").astype(np.int64) / NANOSECONDS, "s"
        else:
            unit = str(channel.properties.get(_UNIT, ""))
        read[channel.name] = Recorded(np.asarray(values, dtype=np.float64), unit), channel.properties
    lengths = {len(one.values) for name, (one, _) in read.items() if name == named}
    clocks = {len(one.values) for name, (one, _) in read.items() if guess_clock([name]) is not None}
    waves: dict[tuple[float, float, float | None, int], dict[str, Recorded]] = {}
    others: dict[str, Recorded] = {}
    for name, (one, known) in read.items():
        count, step, start = len(one.values), float(known.get(_STEP, 0.0)), known.get(_START)
        is_default = step == DEFAULT_STEP and start is None and count in clocks
        if step > 0.0 and not (is_period or count in lengths or is_default):
            waves.setdefault((step, float(known.get(_OFFSET, 0.0)), _seconds(start), count), {})[name] = one
        else:
            others[name] = one
    several = len(waves) > 1
    timed: list[tuple[Group, float | None]] = []
    for k, ((step, offset, start, count), of) in enumerate(waves.items()):
        name, clock = f"{group.name}[{k}]" if several else group.name, f"waveforms, a sample every {1e3 * step:.9g} ms"
        timed.append((Group(name, of, offset + step * np.arange(float(count)), clock=clock), start))
    return [*timed, *((one, None) for one in by_length(group.name, others))]


DEFAULT_STEP = Constant(1.0, "s", "that LabVIEW gives a waveform of which nobody said another")


def _seconds(start: Any) -> float | None:
    """When a waveform began, since 1970 [s]; None where it is not said."""
    return None if start is None else float(np.datetime64(start, "us").astype(np.int64)) / 1e6


def _from_first(groups: list[tuple[Group, float | None]], file: str) -> list[Group]:
    """The groups with times from the first of all; waveforms without a start time begin with the others."""
    timed = [(one, start) for one, start in groups if one.time is not None]
    stated = [start for _, start in timed if start is not None]
    unknown = [name for one, start in timed if start is None for name in one.channels]
    if stated and unknown:
        text = f"the waveforms {', '.join(unknown)} have no start time; they are read as if they began with the others"
        warn_of_log(text, file=file)
    first = min(stated, default=0.0)
    placed = [
        one if one.time is None else replace(one, time=one.time + (first if start is None else start))
        for one, start in groups
    ]
    begun = min((float(one.time[0]) for one in placed if one.time is not None), default=0.0)
    return [one if one.time is None else replace(one, time=one.time - begun) for one in placed]
