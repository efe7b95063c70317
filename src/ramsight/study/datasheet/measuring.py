"""What is kept of one machine's track: errors by how many references came before, by place, by age; and its statuses.

All of it is counts, sums and a few numbers, so that a study of any size is a table of machines. Errors are those of
positions that the sensor calls ok or uncertain; what it calls invalid, or not referenced, is counted as just that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools
from ramsight.sensor.status import VALIDITIES, Status, validity_levels
from ramsight.tracking.position_errors import stop_visits

TAUGHT = 3
"""References after which the sensor is taken to be taught."""
GROUPS = ("before a reference", "after 1 reference", "after 2 references", "after 3 references and more", "status ok")
"""Of errors: by how many references came before; and those that the sensor vouches for, whatever came before."""
VOUCHED = len(GROUPS) - 1
EDGES = np.concatenate([[0.0], np.logspace(-6.0, 0.0, 241), [np.inf]])
"""Edges of the histogram of errors [m]: 40 a decade from 1 µm to 1 m."""
PLACES, AGES, AGE = 10, 12, 10.0
"""Shares of the stroke; and stretches of time since the last reference, each so long [s]."""
NORMAL_95 = 1.96
SETTLED = 1.0  # s after a stop was reached, from when an error counts as one after that reference
_MOVES = 1e-3  # m/s
UNUSABLE = int(Status.NOT_REFERENCED)
"""Statuses from here on are "not referenced" and "invalid": there is no position to be wrong."""

SHAPES: Mapping[str, tuple[tuple[str, int], ...]] = {
    "errors": (("group", len(GROUPS)), ("bin", len(EDGES) - 1)),
    "largest": (("group", len(GROUPS)),),
    "p95": (("group", len(GROUPS)),),
    "mean": (("group", len(GROUPS)),),
    "square": (("group", len(GROUPS)),),
    "samples": (("group", len(GROUPS)),),
    "inside": (("group", len(GROUPS)),),
    "profile": (("direction", 2), ("place", PLACES), ("moment", 3)),
    "ageing": (("age", AGES), ("moment", 3)),
    "statuses": (("validity", 4),),
    "ok_beyond_4_std": (),
    "ok_beyond_bound": (),
    "bound": (),
    "visits": (),
    "duration": (),
    "first_position": (),
    "first_error": (),
}
"""What is kept of each machine, and over which dimensions."""
COUNTS = ("errors", "samples", "inside", "statuses", "ok_beyond_4_std", "ok_beyond_bound", "visits")
"""Of these, what is counted."""

UNITS = {
    "bound": "m", "largest": "m", "p95": "m", "mean": "m", "square": "m2", "duration": "s", "first_position": "s",
    "first_error": "m",
}  # fmt: skip


@dataclass(frozen=True)
class Track:
    """A track beside the truth."""

    time: Array  # [s], shape (samples,)
    # position, std: of the sensor [m]
    position: Array
    std: Array
    status: NDArray[np.int64]
    true: Array  # position [m]
    stroke: float  # of the cylinder as it is [m]
    bound: Array | None = None  # of the sensor's error [m]; None of one that states none

    @property
    def visits(self) -> Array:
        """When the piston came to an end stop [s]."""
        return stop_visits(self.time, self.true, self.stroke)


def measures(track: Track) -> dict[str, Array | float]:
    """What is kept of a track; see `SHAPES`."""
    time, visits = track.time, track.visits
    known = track.status < UNUSABLE
    error = track.position - track.true
    size = np.abs(error)
    came = np.searchsorted(visits + SETTLED, time, side="right")  # references before each sample
    found: dict[str, Array | float] = {}
    bins = len(EDGES) - 1
    bin_of = np.searchsorted(EDGES, size, side="right") - 1
    counts, rows = np.zeros((len(GROUPS), bins)), []
    for k in range(len(GROUPS)):
        there = track.status == Status.OK if k == VOUCHED else known & (np.minimum(came, TAUGHT) == k)
        one = size[there]
        counts[k] = np.bincount(bin_of[there], minlength=bins)[:bins]
        inside = int((one <= NORMAL_95 * track.std[there]).sum())
        if len(one):
            signed = error[there]
            rows.append([one.max(), np.percentile(one, 95.0), signed.mean(), (signed**2).mean(), len(one), inside])
        else:
            rows.append([np.nan, np.nan, np.nan, np.nan, 0, 0])
    names = ("largest", "p95", "mean", "square", "samples", "inside")
    found |= dict(zip(names, np.array(rows).T, strict=True))
    found["errors"] = counts
    found["profile"] = _profile(track, error, known & (came >= TAUGHT))
    last = np.concatenate([[np.nan], visits])[came]
    found["ageing"] = _ageing(size, time - last, known & (came >= TAUGHT))
    found["statuses"] = np.bincount(validity_levels(track.status), minlength=len(VALIDITIES)).astype(float)
    vouched = track.status == Status.OK
    found["ok_beyond_4_std"] = float((vouched & (size > 4.0 * track.std)).sum())
    bound = np.full(len(time), np.nan) if track.bound is None else track.bound
    found["ok_beyond_bound"] = float((vouched & (size > bound)).sum())
    found["bound"] = float(np.median(bound[vouched])) if vouched.any() else np.nan
    found["visits"], found["duration"] = float(len(visits)), float(time[-1] - time[0])
    return found


def first_position(track: Track) -> dict[str, float]:
    """When a sensor that was started without a position knew its position, and how wrong it was then."""
    known = np.flatnonzero(track.status != Status.NOT_REFERENCED)
    if not len(known):
        return {"first_position": np.nan, "first_error": np.nan}
    k = int(known[0])
    settled = min(int(np.searchsorted(track.time, track.time[k] + SETTLED)), len(track.time) - 1)
    error = abs(float(track.position[settled] - track.true[settled]))
    return {"first_position": float(track.time[k] - track.time[0]), "first_error": error}


def _profile(track: Track, error: Array, there: Bools) -> Array:
    """Number, sum and sum of squares of the errors, by direction of motion and place on the stroke."""
    velocity = np.gradient(track.true, track.time)
    place = np.clip((track.true / track.stroke * PLACES).astype(int), 0, PLACES - 1)
    table = np.zeros((2, PLACES, 3))
    for direction, moving in enumerate((velocity > _MOVES, velocity < -_MOVES)):
        kept = there & moving
        table[direction] = _moments(place[kept], error[kept], PLACES)
    return table


def _ageing(size: Array, age: Array, there: Bools) -> Array:
    kept = there & (age >= 0.0) & (age < AGES * AGE)
    return _moments((age[kept] / AGE).astype(int), size[kept], AGES)


def _moments(group: NDArray[np.int64], value: Array, groups: int) -> Array:
    columns = (np.bincount(group, weight, groups) for weight in (np.ones(len(value)), value, value**2))
    return np.column_stack(list(columns))


def drift_of(ageing: Array) -> tuple[float, float]:
    """Mean error [m] just after a reference, and by how much it grows [m/s]: a straight line through the ages.

    Args:
        ageing: number, sum and sum of squares of errors by age, shape (ages, 3).
    """
    number = ageing[:, 0]
    held = number > 0.01 * number.sum()  # few samples are of few machines, which wait for unusual reasons
    if held.sum() < 3:
        return np.nan, np.nan
    age = (np.arange(len(number))[held] + 0.5) * AGE
    slope, at_once = np.polyfit(age, ageing[held, 1] / number[held], 1, w=np.sqrt(number[held]))
    return float(at_once), float(slope)
