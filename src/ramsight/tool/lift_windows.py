"""Stretches of a log in which a unit's rods move one way, and the part of each that is steady."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.intervals import true_intervals
from ramsight.tool.weighing_limits import BRIDGED, MOVING, SETTLES, SLOWS, SMOOTHED


@dataclass(frozen=True)
class Window:
    """Motion one way."""

    rows: slice  # samples after it has settled and before it ends; may be empty
    motion: slice  # all its samples
    upwards: bool  # whether it lifts
    moving: float  # for how long it moves [s]


def smoothed(time: Array, values: Array) -> Array:
    """Values averaged over a fixed time around each sample, each column by itself.

    Args:
        time: [s], shape (samples,), at about equal distances.
        values: shape (samples, columns).
    """
    period = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    half = max(round(0.5 * SMOOTHED / period), 0) if period > 0.0 else 0
    padded = np.pad(values, ((half + 1, half), (0, 0)), mode="edge")
    sums = np.cumsum(padded, axis=0)
    width = 2 * half + 1
    return np.asarray((sums[width:] - sums[:-width]) / width)


def windows(time: Array, velocity: Array, shown: Bools, stroke: float, lift_sign: float) -> list[Window]:
    """Motions of a unit's rods, in order.

    Args:
        time: of the samples [s].
        velocity: of the rods [m/s]; NaN stands for rest.
        stroke: of the cylinder [m].
        lift_sign: +1 where extension lifts, -1 where retraction does.

    Example:
        >>> time = np.arange(0.0, 6.0, 0.02)
        >>> speed = np.where(time > 1.0, 0.03, 0.0)
        >>> (found,) = windows(time, speed, np.ones(300, bool), stroke=0.7, lift_sign=1.0)
        >>> found.upwards, round(found.moving, 1), found.rows
        (True, 5.0, slice(91, 279, None))
    """
    found = []
    follows = np.diff(time, prepend=time[:1]) <= BRIDGED  # a motion does not go on over a gap of the log
    for sign in (1.0, -1.0):
        moves = shown & follows & (sign * lift_sign * np.nan_to_num(velocity) > MOVING * stroke)
        for first, end in _bridged(time, true_intervals(moves)):
            begins = int(np.searchsorted(time, time[first] + SETTLES))
            ends = int(np.searchsorted(time, time[end - 1] - SLOWS))
            rows = slice(begins, max(begins, ends))
            found.append(Window(rows, slice(first, end), sign > 0.0, float(time[end - 1] - time[first])))
    return sorted(found, key=lambda one: one.motion.start)


def _bridged(time: Array, intervals: list[tuple[int, int]]) -> list[tuple[int, int]]:
    joined: list[tuple[int, int]] = []
    for first, end in intervals:
        if joined and time[first] - time[joined[-1][1] - 1] <= BRIDGED:
            joined[-1] = joined[-1][0], end
        else:
            joined.append((first, end))
    return joined
