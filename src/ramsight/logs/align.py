"""Channels at different rates onto one clock, honestly: nothing is known before it has arrived.

Every sample has an *order*, the place at which it came: a frame's number, a row's, or its time. At a sample of the
base channel the other channels have the last value that came before it or with it. A value that is older than its
channel may hold is NaN. Samples of the base before every channel has has_come once are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array, Bools


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
