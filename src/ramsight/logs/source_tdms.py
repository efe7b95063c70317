"""Logs in TDMS files (LabVIEW, DIAdem): groups of channels, as npTDMS reads them."""

from __future__ import annotations

import logging
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ramsight.errors import LogError, warn_of_log
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
                groups = [one for group in file.groups() for one in _split(group, most)]
        except _DAMAGE as error:
            raise LogError(f"is no TDMS file, or a damaged one: {first_line(error)}", file=self.file) from None
        if said:
            warn_of_log(f"is read as far as it goes: {said[0]}", file=self.file)
        if not groups:
            raise LogError("has no channels with samples", file=self.file)
        return _from_first(groups)


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


def _split(group: Any, most: int) -> list[Group]:
    """The channels of a group by their clocks."""
    waves: dict[tuple[float, float, float, int], dict[str, Recorded]] = {}
    others: dict[str, Recorded] = {}
    for channel in group.channels():
        count = len(channel)
        if channel.dtype is None or channel.dtype.kind not in "iufbM" or not count:
            continue
        if count > most:  # a byte a sample at least: more are claimed than are there
            raise ValueError(f"channel {channel.name} claims {count} samples")
        known = channel.properties
        values = channel[:]
        if values.dtype.kind == "M":
            values, unit = values.astype("datetime64[ns]").astype(np.int64) / NANOSECONDS, "s"
        else:
            unit = str(known.get(_UNIT, ""))
        one = Recorded(np.asarray(values, dtype=np.float64), unit)
        step = float(known.get(_STEP, 0.0))
        if step > 0.0:
            clock = (step, float(known.get(_OFFSET, 0.0)), _seconds(known.get(_START)), count)
            waves.setdefault(clock, {})[channel.name] = one
        else:
            others[channel.name] = one
    several = len(waves) > 1
    timed = [
        Group(f"{group.name}[{k}]" if several else group.name, of, start + offset + step * np.arange(float(count)))
        for k, ((step, offset, start, count), of) in enumerate(waves.items())
    ]
    return [*timed, *by_length(group.name, others)]


def _seconds(start: Any) -> float:
    """When a waveform began, since 1970 [s]; 0 where it is not said."""
    return 0.0 if start is None else float(np.datetime64(start, "us").astype(np.int64)) / 1e6


def _from_first(groups: list[Group]) -> list[Group]:
    """The same with times from the first of all."""
    begun = min((float(one.time[0]) for one in groups if one.time is not None and len(one.time)), default=0.0)
    return [one if one.time is None else Group(one.name, one.channels, one.time - begun) for one in groups]
