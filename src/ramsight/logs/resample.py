"""Samples at a drive's usual period, resampled from a faster log, or from one that counts an angle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.errors import LogError
from ramsight.logs.channels import MOTOR_SPEED, READINGS, REFERENCE

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
