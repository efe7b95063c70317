"""Positions of all the cylinders of a mechanism at the times of one unit's track."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ramsight.arrays import Array
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.linked import LinkedMachine
from ramsight.sensor.status import is_invalid
from ramsight.signals import Samples
from ramsight.tracking.figures import half_band


@dataclass(frozen=True)
class Rods:
    """Cylinders of a mechanism over time, in its order; each an array of shape (samples, cylinders)."""

    # position, velocity: [m], [m/s]; NaN where unknown
    position: Array
    velocity: Array
    std: Array  # standard deviation of the position, from the half width of its band [m]


@dataclass(frozen=True)
class Others:
    """What is known of the units whose log is not the one that is followed."""

    tracks: Mapping[str, Samples] = field(default_factory=dict)  # of the units that have one, over the same clock
    # positions of those that stand still [m]; a unit with neither may be anywhere
    held: Mapping[str, float] = field(default_factory=dict)
    held_std: float = 2e-3  # standard deviation of these [m]

    def rods(self, machine: LinkedMachine, unit: str, track: Samples) -> Rods:
        """All cylinders at the times of a unit's track."""
        time = track["time"].values
        names = machine.mechanism.cylinders
        columns = [self._one(machine, name, track if name == unit else None, time) for name in names]
        return Rods(*(np.column_stack(parts) for parts in zip(*columns, strict=True)))

    def _one(self, machine: LinkedMachine, name: str, own: Samples | None, time: Array) -> tuple[Array, Array, Array]:
        track = self.tracks.get(name) if own is None else own
        if track is not None:
            return _at(track, time)
        position, velocity, std = standing(machine, name, self)
        still = np.zeros(len(time))
        return still + position, still + velocity, still + std


def standing(machine: LinkedMachine, name: str, others: Others) -> tuple[float, float, float]:
    """Position [m], velocity [m/s] and deviation [m] of a unit that no track is known of."""
    if name in others.held:
        return others.held[name], 0.0, others.held_std
    stroke = machine.unit(name).cylinder.stroke
    return 0.5 * stroke, 0.0, stroke / math.sqrt(12.0)


def _at(track: Samples, time: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and deviation at times [s]; NaN outside the track, and where its position is invalid."""
    known = track["time"].values
    position = np.where(is_invalid(track["status"].values), np.nan, track["position"].values)
    velocity = track["velocity"].values if "velocity" in track else np.full(len(known), np.nan)  # a place needs none
    columns = (position, velocity, half_band(track) / TWO_SIDED_95)
    if np.array_equal(known, time):
        return columns
    return tuple(np.interp(time, known, one, left=np.nan, right=np.nan) for one in columns)  # type: ignore[return-value]
