"""Visits to the ends of the stroke, and to whatever else stops the rod, as a track of the kalman sensor shows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import true_intervals
from ramsight.sensor.contacts.mode import Mode
from ramsight.sensor.thresholds import MIXED_FRICTION_SPEED
from ramsight.signals import Samples

_AT_END = 0.02  # share of the stroke within which a contact is one with the end
_LONG = 0.2  # s that a contact lasts at least
_APART = 5.0  # s between two visits
_DRIVEN = 0.5  # s; oil that is pressed takes no longer to show a contact


@dataclass(frozen=True)
class Visit:
    """One visit that the sensor saw."""

    # begins, ends: [s]
    begins: float
    ends: float
    position: float  # in the end [m]; NaN where it is unknown
    where: str  # `retracted`, `extended` or `elsewhere`
    way: int  # 1 of a rod that was driven out, -1 of one that was driven in


def visits(track: Samples, stroke: float) -> list[Visit]:
    """The visits to the ends that a track of the kalman sensor shows, in order.

    Between the ends only a piston that the motor drives meets something: a load that is taken off while it stands is
    nothing that was met.

    Args:
        track: with `mode`, `position` [m], NaN where it is unknown, and `motor_speed` [rad/s] over `time` [s].
        stroke: of the cylinder [m].
    """
    time, mode, position, speed = (track[name].values for name in ("time", "mode", "position", "motor_speed"))
    found = []
    for held, end, name, way in (
        (Mode.HELD_RETRACTING, 0.0, "retracted", -1),
        (Mode.HELD_EXTENDING, stroke, "extended", 1),
    ):
        last = -np.inf
        for first, after in true_intervals(mode == int(held)):
            begins, ends, at = float(time[first]), float(time[after - 1]), float(position[after - 1])
            where = "elsewhere" if abs(at - end) >= _AT_END * stroke else name
            # At an end with an empty chamber, noise looks like a contact release: until it is surely away, it is there.
            stays = ends if where == "elsewhere" else float(time[_left(mode, after) - 1])
            if stays - begins < _LONG or begins - last < _APART:
                continue
            before = speed[(time >= begins - _DRIVEN) & (time <= begins)]
            if where == "elsewhere" and not (np.abs(before) > MIXED_FRICTION_SPEED).any():
                continue
            last = ends
            found.append(Visit(begins, ends, at, where, way))
    return sorted(found, key=lambda one: one.begins)


def _left(mode: NDArray[np.int64], after: int) -> int:
    """The first index from which a released piston is surely away."""
    away = np.flatnonzero(mode[after:] != int(Mode.LEAVING))
    return after + int(away[0]) if away.size else len(mode)
