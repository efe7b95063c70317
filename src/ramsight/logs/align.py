"""Channels at different rates onto one clock, honestly: nothing is known before it has arrived.

Every sample has an *order*, the place at which it came: a frame's number, a row's, or its time. At a sample of the
base channel the other channels have the last value that came before it or with it. A value that is older than its
channel may hold is NaN. Samples of the base before every channel has has_come once are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.errors import LogError
from ramsight.logs.channels import MOTOR_SPEED, READINGS, REFERENCE


@dataclass(frozen=True)
class Samples:
    """Samples of one channel."""

    order: Array  # when each came, not falling, shape (n,); channels that come together share one array
    time: Array  # [s], shape (n,); may be NaN, repeat or jump
    value: Array  # shape (n,); may be NaN

    def __len__(self) -> int:
        return len(self.order)

    def where(self, chosen: Bools) -> Samples:
        """The samples that are chosen."""
        return Samples(self.order[chosen], self.time[chosen], self.value[chosen])

    @classmethod
    def join(cls, parts: list[Samples]) -> Samples:
        """Samples one after the other."""
        if len(parts) == 1:
            return parts[0]
        fields = zip(*((part.order, part.time, part.value) for part in parts), strict=True)
        return cls(*(np.concatenate(field) for field in fields))


NONE = Samples(np.empty(0), np.empty(0), np.empty(0))
Block = Mapping[str, Samples]
"""Samples by channel. Blocks come in order: nothing in the next one came before anything in this one."""


class Aligner:
    """Puts blocks of samples onto the clock of the base channel; what it needs of earlier blocks it keeps.

    Args:
        holds: each channel that is held, the base among them, and for how long [s].
        events: channels whose values count once, at the first sample of the base that comes with them or after
            them, and for how long they wait for it [s].
    """

    def __init__(self, base: str, holds: Mapping[str, float], events: Mapping[str, float]) -> None:
        self._base, self._holds, self._events = base, dict(holds), dict(events)
        self._last: dict[str, Samples] = dict.fromkeys(holds, NONE)
        self._waiting: dict[str, Samples] = dict.fromkeys(events, NONE)

    def push(self, block: Block) -> dict[str, Array]:
        """Take a block.

        Returns:
            ``time`` [s] and a column for each held channel and each event, all of one length.
        """
        base = block.get(self._base, NONE)
        columns, begun = {"time": base.time}, np.ones(len(base), dtype=np.bool_)
        for channel, hold in self._holds.items():
            columns[channel], has_come = self._held(channel, block.get(channel, NONE), base, hold)
            begun &= has_come
        for channel, patience in self._events.items():
            columns[channel] = self._happened(channel, block.get(channel, NONE), base, patience)
        return columns if begun.all() else {name: column[begun] for name, column in columns.items()}

    @property
    def silent(self) -> list[str]:
        """The held channels of which not one sample has come."""
        return [channel for channel, last in self._last.items() if not len(last)]

    def _held(self, channel: str, new: Samples, base: Samples, hold: float) -> tuple[Array, Bools]:
        known = Samples.join([self._last[channel], new]) if len(self._last[channel]) else new
        if len(new):
            self._last[channel] = Samples(new.order[-1:].copy(), new.time[-1:].copy(), new.value[-1:].copy())
        if new.order is base.order:  # they came together
            return new.value, np.ones(len(base), dtype=np.bool_)
        if not len(known):
            return np.full(len(base), np.nan), np.zeros(len(base), dtype=np.bool_)
        place = np.searchsorted(known.order, base.order, side="right") - 1
        has_come = place >= 0
        place = np.maximum(place, 0)
        with np.errstate(invalid="ignore"):
            fresh = np.abs(base.time - known.time[place]) <= hold  # a clock set back says nothing of age
        return np.where(has_come & fresh, known.value[place], np.nan), has_come

    def _happened(self, channel: str, new: Samples, base: Samples, patience: float) -> Array:
        new = new.where(np.isfinite(new.value)) if len(new) else new
        waiting = Samples.join([self._waiting[channel], new]) if len(self._waiting[channel]) else new
        column = np.full(len(base), np.nan)
        place = np.searchsorted(base.order, waiting.order, side="left")
        due = place < len(base)
        self._waiting[channel] = waiting.where(~due)
        place, waiting = place[due], waiting.where(due)
        with np.errstate(invalid="ignore"):
            fresh = np.abs(base.time[place] - waiting.time) <= patience
        fresh |= base.order[place] == waiting.order  # together, whatever the clock says
        column[place[fresh]] = waiting.value[fresh]
        return column


class Switch:
    """Turns a channel of 0 and 1 into positions at its edges.

    Args:
        position: what an edge says [m].
        edge: ``rising``, ``falling`` or ``both``.
    """

    def __init__(self, position: float, edge: str) -> None:
        self._position, self._edge = position, edge
        self._was: Array = np.empty(0)

    def events(self, samples: Samples) -> Samples:
        """The edges among samples; the first sample of all is none."""
        known = samples.where(np.isfinite(samples.value))
        is_on = (known.value > 0.5).astype(np.float64)
        step = np.diff(np.concatenate([self._was if self._was.size else is_on[:1], is_on]))
        if len(known):
            self._was = is_on[-1:]
        wanted = {"rising": step > 0, "falling": step < 0, "both": step != 0}[self._edge]
        found = known.where(wanted)
        return Samples(found.order, found.time, np.full(len(found), self._position))


_MOMENTARY = frozenset(one.name for one in (REFERENCE, *READINGS))
_START = 1e-9  # s; rounding of a clock in milliseconds


class Resampler:
    """Takes columns over time and gives them at equal distances; what it needs of earlier ones it keeps.

    A sample is the mean over its period, half before and half after it. A speed that comes from an angle is the angle
    of the period over its length, so that no revolution is missing; none is known where the angle is not. A command is
    the newest one; a reference or an occasional reading is taken by the sample after it.

    Args:
        period: of the new samples [s].
        unknown: spans in which the angle in the column of the speed is not known [s]; None where it is a speed.
    """

    def __init__(
        self, period: float, file: str, unknown: Sequence[tuple[float, float]] | None, newest: frozenset[str]
    ) -> None:
        self._period, self._file, self._unknown, self._newest = period, file, unknown, newest
        self._held: dict[str, Array] = {}
        self._next: float | None = None

    def push(self, columns: dict[str, Array]) -> dict[str, Array]:
        """Take columns, over `time` [s].

        Returns:
            The new samples that are complete, maybe none; speed [rad/s].

        Raises:
            LogError: time does not increase.
        """
        held = {
            name: np.concatenate([self._held[name], column]) if self._held else column.copy()
            for name, column in columns.items()
        }
        time = held["time"]
        if not len(time):
            return held
        back = ~(np.diff(time) > 0.0)
        if back.any():
            place = float(time[int(np.argmax(back)) + 1])
            message = f"time has to increase where samples are resampled: it does not at {place:g} s"
            raise LogError(message, file=self._file)
        half = 0.5 * self._period
        first = time[0] + half if self._next is None else self._next
        count = max(int(np.floor((time[-1] - half - first) / self._period + _START)) + 1, 0)
        at: Array = first + self._period * np.arange(count, dtype=np.float64)
        self._next = first + self._period * count
        made = {name: self._column(name, column, time, at) for name, column in held.items()}
        keep = max(int(np.searchsorted(time, self._next - self._period - half)) - 1, 0)
        self._held = {name: column[keep:] for name, column in held.items()}
        return made | {"time": at}

    def _column(self, name: str, column: Array, time: Array, at: Array) -> Array:
        before, after = at - 0.5 * self._period, at + 0.5 * self._period
        if name == MOTOR_SPEED.name and self._unknown is not None:
            speed = (np.interp(after, time, column) - np.interp(before, time, column)) / self._period
            return np.where(_touches(self._unknown, before, after), np.nan, speed)
        if name in self._newest:
            return np.asarray(column[np.maximum(np.searchsorted(time, at + _START, side="right") - 1, 0)])
        if name in _MOMENTARY:
            return _last_known(column, time, at, self._period)
        return _mean(column, time, before, after)


def _touches(spans: Sequence[tuple[float, float]], before: Array, after: Array) -> Bools:
    """Which periods have a part of one of some spans in them."""
    begins, ends = np.array(sorted(spans) or [(np.inf, -np.inf)]).T
    last = np.searchsorted(begins, after - _START) - 1  # of the spans that begin before the period ends
    return np.asarray((last >= 0) & (np.maximum.accumulate(ends)[last] > before + _START))


def _mean(column: Array, time: Array, before: Array, after: Array) -> Array:
    """Mean of the samples in each span, of those that are numbers; NaN where there are none."""
    good = np.isfinite(column)
    sums = np.concatenate([[0.0], np.cumsum(np.where(good, column, 0.0))])
    counts = np.concatenate([[0], np.cumsum(good)])
    low, high = np.searchsorted(time, before - _START), np.searchsorted(time, after - _START)
    number = counts[high] - counts[low]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(number > 0, (sums[high] - sums[low]) / np.maximum(number, 1), np.nan))


def _last_known(column: Array, time: Array, at: Array, period: float) -> Array:
    """The last number since the sample before, NaN where there is none."""
    place = np.maximum.accumulate(np.where(np.isfinite(column), np.arange(len(column)), -1)) if len(column) else column
    newest = place[np.maximum(np.searchsorted(time, at + _START, side="right") - 1, 0)].astype(int)
    fresh = (newest >= 0) & (time[np.maximum(newest, 0)] > at - period + _START)
    return np.where(fresh, column[np.maximum(newest, 0)], np.nan)
