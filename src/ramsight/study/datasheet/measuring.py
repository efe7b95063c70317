"""Sensors along the reports of many machines, several side by side, and what is kept of a track.

Kept are errors by how many references came before, by place, by age; and statuses. All of it is counts, sums and a few
numbers, so that a study of any size is a table of machines. Errors are those of positions that the sensor calls ok or
uncertain; what it calls invalid, or not referenced, is counted as just that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools
from ramsight.engine.recursion import replay_many
from ramsight.sensor.status import VALIDITIES, Status, validity_levels
from ramsight.sensor.virtual_sensor import BOUND, VirtualSensor
from ramsight.study.datasheet.drawn import Drawn
from ramsight.tracking.track_errors import stop_visits

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


_POWER_UP = 5.0  # s after the first stop, up to which a sensor that was started without a position is looked at


@dataclass(frozen=True)
class Run:
    """One machine's duty done: truth, and what its drive reported."""

    drawn: Drawn
    time: Array  # [s], shape (samples,)
    true: Array  # position [m]
    inputs: Array  # of the sensor, shape (samples, inputs)
    start: float  # the sensor's start position [m]
    # motor speed [rad/s], motor torque [N m] and oil temperature [K] as they are
    true_signals: tuple[Array, Array, Array]

    @property
    def stroke(self) -> float:
        """Stroke of the cylinder as it is built [m]."""
        return float(self.drawn.unit.cylinder.stroke)

    @property
    def visits(self) -> Array:
        """When the piston came to an end stop [s]."""
        return stop_visits(self.time, self.true, self.stroke)

    def beginning(self) -> Array:
        """The inputs as far as they show when a sensor that was started without a position knows where it is."""
        visits = self.visits
        return self.inputs[self.time <= visits[0] + _POWER_UP + SETTLED] if len(visits) else self.inputs


def tracked(several: Sequence[Run], sensors: Sequence[VirtualSensor], *, start_known: bool = True) -> list[Track]:
    """What sensors make of runs; a track is the same to the last bit whatever is tracked beside it.

    Args:
        sensors: of each run; they may assume different machines, but are of one kind.
        start_known: whether they start at the known position; of the others only so much is tracked that the
            time of the first position shows.
    """
    if not several:
        return []
    recursion = sensors[0].recursion
    says = recursion.outputs
    kept = [says[0], says[1], says[4], *([BOUND] if BOUND in says else [])]
    inputs = [run.inputs if start_known else run.beginning() for run in several]
    parameters = np.array([sensor.parameters for sensor in sensors])
    states = np.array([_first_state(sensor, run, start_known) for sensor, run in zip(sensors, several, strict=True)])
    found = replay_many(recursion, inputs, parameters, states, kept)
    return [_track(run, columns) for run, columns in zip(several, found, strict=True)]


def _first_state(sensor: VirtualSensor, run: Run, start_known: bool) -> Array:
    own = replace(sensor)  # with a state of its own: others may be tracked beside it
    own.start(run.start if start_known else None)
    return np.array(list(own.state.values()))


def _track(run: Run, columns: Array) -> Track:
    n = len(columns)
    position, std, status = columns[:, :3].T
    bound = columns[:, 3] if columns.shape[1] > 3 else None
    return Track(run.time[:n], position, std, status.astype(np.int64), run.true[:n], run.stroke, bound)
