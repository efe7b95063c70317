"""Weighings: each lift of a log as an event with a mass, its deviation, and why it may be bad.

In a window of steady motion the least squares of the force balance, F = B + m P, give the mass

    m = sum P (F - B) / sum P^2,

with F the sensor's load, B the force that the bodies need and P that per kilogram. A mass that changes within the
window, a motion that is not steady and a position that is not known make a weighing bad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.intervals import true_intervals
from ramsight.plant.linked import LinkedMachine
from ramsight.signals import Signals
from ramsight.tool.force_balance import Balance, balance
from ramsight.tool.load_chart import LoadChart, LoadStatus
from ramsight.tool.unit_tracks import Others, Rods
from ramsight.tool.weighing_limits import (
    BLOCK,
    BRIDGED,
    CHANGES,
    INCLINATION_STD,
    MOVING,
    NOISE_STDS,
    ONE_STEP,
    POSITION_SHARE,
    REPEATS_STD,
    SETTLES,
    SHORTEST,
    SLOWS,
    SMOOTHED,
    SPEED_VARIES,
    STEADY,
    STEADY_SHARE,
)


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


class Quality(Enum):
    """Whether a weighing is good; the text of a bad one says why."""

    GOOD = "good"
    TOO_SHORT = "too short: lift steadily for 3 s"
    TOO_FAST = "moved too fast: the speed changed; lift steadily for 3 s"
    DIGGING = "load changing: still digging"
    SPILLED = "spilled: the mass fell within the lift"
    UNKNOWN_POSITION = "position not known: give --start or --beside, or visit an end stop"


@dataclass(frozen=True)
class Moment:
    """Largest load moment of a motion over the rated one."""

    per_mass: float  # [1/kg]
    own_std: float  # deviation of the share that is this lift's own [1]
    covered: bool  # whether the load chart has all of its reach

    def averaged(self, other: Moment) -> Moment:
        """That of two motions of one load."""
        own = 0.5 * math.hypot(self.own_std, other.own_std)
        return Moment(max(self.per_mass, other.per_mass), own, self.covered and other.covered)


@dataclass(frozen=True, eq=False)
class Plain:
    """A lift by the described machine alone."""

    time: float  # middle of its window [s]
    duration: float  # of steady motion [s]
    upwards: bool  # whether it lifts
    mass: float  # [kg]; NaN where there is none
    row: Array  # change of the mass by each term of the scale
    own_std: float  # deviation that is this lift's own: noise, positions, inclination, what no lift repeats [kg]
    others: Array  # positions of the other cylinders [m]
    quality: Quality  # whether it is good
    moment: Moment | None = None  # over the rated one; None without a load chart that has a place of it


@dataclass(frozen=True, eq=False)
class Weighing:
    """A weighing."""

    time: float  # middle of its window [s]
    duration: float  # of steady motion [s]
    cycle: int  # which it is of; a cycle begins with the first lift after lowering
    direction: str  # up, down, or both where up and down of one load are averaged
    # mass, std: [kg]; NaN where there is none
    mass: float
    std: float
    # low, high: the 95 % band [kg]
    low: float
    high: float
    quality: Quality  # whether it is good, or why it is not
    row: Array = field(repr=False)  # change of the mass by each term of the scale, which other weighings share
    own_std: float  # deviation that is its own [kg]
    # rated_share, rated_share_std: largest load moment of the motion over the rated one [1]; NaN where unknown
    rated_share: float = math.nan
    rated_share_std: float = math.nan
    exceeded_probability: float = math.nan  # that the rated load was exceeded [1]; NaN where unknown
    rated_status: LoadStatus = LoadStatus.UNKNOWN  # within, near, exceeded or unknown

    @property
    def is_good(self) -> bool:
        """Whether its mass may be used."""
        return self.quality is Quality.GOOD


@dataclass(frozen=True)
class Scene:
    """What a log is weighed with."""

    machine: LinkedMachine  # with its mechanism
    unit: str  # the unit that lifts
    others: Others  # the units beside it
    inclination: float = 0.0  # of the machine, its front up [rad]
    chart: LoadChart | None = None  # what may be lifted

    @property
    def rated(self) -> float:
        """Rated payload [kg]."""
        return self.machine.mechanism.rated_payload

    @property
    def other_strokes(self) -> Array:
        """Strokes of the other cylinders [m]."""
        return np.array([one.cylinder.stroke for one in self.machine.units if one.name != self.unit])

    @property
    def weight(self) -> float:
        """Force of the unit's rods without payload, in mid-stroke [N]."""
        middle = np.array([[0.5 * one.cylinder.stroke for one in self.machine.units]])
        still = Rods(middle, np.zeros_like(middle), np.zeros_like(middle))
        return float(self.balance(still, still.velocity).bodies[0])

    def balance(self, rods: Rods, acceleration: Array, tilt: float = 0.0) -> Balance:
        """The force balance, in the direction of the unit's load."""
        found = balance(
            self.machine.mechanism, self.unit, rods.position, rods.velocity, acceleration, self.inclination + tilt
        )
        sign = self.machine.unit(self.unit).lift_sign
        return Balance(*(sign * one for one in vars(found).values()))

    def moments(self, rods: Rods, tilt: float = 0.0) -> tuple[Array, Bools]:
        """Load moments of a kilogram over the rated ones [1/kg], and where the load chart has their reach."""
        if self.chart is None:
            return np.full(len(rods.position), np.nan), np.zeros(len(rods.position), dtype=bool)
        return self.chart.shares(self.machine.mechanism, rods.position, self.inclination + tilt)


def lifts(scene: Scene, track: Signals) -> list[Plain]:
    """All motions of a log as lifts by the described machine; each follows from the samples of its own motion alone.

    Args:
        track: of the unit that lifts, with position, velocity, load, load_std, load_age and status.
    """
    time = track["time"].values
    track = track.rows(time > np.maximum.accumulate(np.concatenate([[-np.inf], time[:-1]])))
    unit = scene.machine.unit(scene.unit)
    shown = track["load_age"].values <= 0.0
    found = windows(track["time"].values, track["velocity"].values, shown, unit.cylinder.stroke, unit.lift_sign)
    rods = scene.others.rods(scene.machine, scene.unit, track)
    column = scene.machine.mechanism.cylinders.index(scene.unit)
    return [_lift(scene, track.rows(one.motion), rods.rows(one.motion), one, column) for one in found]


def _lift(scene: Scene, track: Signals, rods: Rods, window: Window, column: int) -> Plain:
    first, time = window.motion.start, track["time"].values
    rows = slice(window.rows.start - first, window.rows.stop - first)
    force, force_std = track["load"].values[rows], track["load_std"].values[rows]
    duration = float(time[rows][-1] - time[rows][0]) if len(force) else 0.0
    middle = float(time[rows].mean()) if len(force) else 0.5 * float(time[0] + time[-1])
    others = np.delete(rods.position[rows], column, axis=1)[-1] if len(force) else np.zeros(0)
    nothing = Plain(middle, duration, window.upwards, math.nan, np.zeros(4), math.nan, others, Quality.TOO_SHORT)
    if len(force) == 0:
        return nothing
    rods = replace(rods, velocity=smoothed(time, np.nan_to_num(rods.velocity)))
    acceleration = np.gradient(rods.velocity, time, axis=0)[rows]
    here = rods.rows(rows)
    found = scene.balance(here, acceleration)
    known = np.isfinite(found.payload) & np.isfinite(force) & np.isfinite(here.std).all(axis=1)
    if not known.all():
        return replace(nothing, quality=Quality.UNKNOWN_POSITION)
    b, p = found.in_motion()
    squares = float(p @ p)
    mass, push, shift = float(p @ (force - b)) / squares, float(p @ force) / squares, float(p.sum()) / squares
    direction = 1.0 if window.upwards else -1.0
    row = np.array([push, direction * push, shift, direction * shift])
    blocks, noise = _blocks(time[rows], (force - b) / p)
    by_position, share_by_position = _by_positions(scene, rods, rows, acceleration, force)
    observed = shift * float(np.sqrt(np.mean(force_std**2))) / math.sqrt(max(duration / BLOCK, 1.0))
    by_noise = min(noise / math.sqrt(max(len(blocks), 1)), observed)
    repeats = REPEATS_STD * abs(push)
    steady = np.abs(found.bodies_moving + mass * found.payload_moving) <= STEADY * np.abs(force)
    speed = here.velocity[:, column]
    varies = float(np.std(speed)) > SPEED_VARIES * abs(float(np.mean(speed)))
    is_steady = float(steady.mean()) >= STEADY_SHARE and not varies
    quality = _quality(scene, duration, is_steady, by_position, blocks, noise)
    moments, inside = scene.moments(rods)
    moment = None
    if inside.any():
        per_mass = float(moments[inside].max())
        own = math.hypot(per_mass * math.hypot(by_noise, repeats), share_by_position)
        moment = Moment(per_mass, own, bool(inside.all()))
    own_std = math.hypot(by_noise, by_position, repeats)
    return Plain(middle, duration, window.upwards, mass, row, own_std, others, quality, moment)


def _blocks(time: Array, masses: Array) -> tuple[Array, float]:
    """Means of the mass over blocks of time, and the deviation that noise gives such a mean [kg]."""
    block = np.floor((time - time[0]) / BLOCK).astype(int)
    counts = np.bincount(block)
    full = counts >= 0.5 * counts.max()
    means = (np.bincount(block, masses) / np.maximum(counts, 1))[full]
    noise = float(np.std(np.diff(masses))) / math.sqrt(2.0 * counts.max()) if len(masses) > 1 else 0.0
    return means, noise


def _by_positions(scene: Scene, rods: Rods, rows: slice, acceleration: Array, force: Array) -> tuple[float, float]:
    """Deviations by those of the positions and of the inclination: of a mass [kg], of its share of the rated load [1].

    Both follow from the same positions, so that what their errors have in common counts as it does.
    """
    inside = scene.moments(rods)[1]

    def of(moved: Rods, tilt: float = 0.0) -> Array:
        b, p = scene.balance(moved.rows(rows), acceleration, tilt).in_motion()
        squares = float(np.nansum(p * p))
        mass = float(np.nansum(p * (force - b))) / squares if squares > 0.0 else math.inf  # beyond the mechanism
        return np.array([mass, mass * np.fmax.reduce(scene.moments(moved, tilt)[0][inside], initial=np.nan)])

    here = of(rods)
    parts = [of(rods, INCLINATION_STD) - here]
    for k in range(rods.position.shape[1]):
        if rods.std[rows, k].any():
            one = np.zeros_like(rods.position)
            one[:, k] = rods.std[:, k]
            sides = [np.abs(of(replace(rods, position=rods.position + sign * one)) - here) for sign in (1.0, -1.0)]
            parts.append(np.max(sides, axis=0))
    by_mass, by_share = (math.hypot(*column) for column in zip(*parts, strict=True))
    return by_mass, by_share


def _quality(
    scene: Scene, duration: float, is_steady: bool, by_position: float, blocks: Array, noise: float
) -> Quality:
    """Why a lift's mass is bad, the first cause first."""
    if duration < SHORTEST:
        return Quality.TOO_SHORT
    if not by_position <= POSITION_SHARE * scene.rated:
        return Quality.UNKNOWN_POSITION
    if not is_steady:
        return Quality.TOO_FAST
    if len(blocks) > 1 and np.ptp(blocks) > CHANGES * scene.rated + NOISE_STDS * noise:
        return Quality.SPILLED if _fell(blocks) else Quality.DIGGING
    return Quality.GOOD


def _fell(blocks: Array) -> bool:
    """Whether one step down explains most of how a mass changed."""
    count = len(blocks)
    steps = [(float(blocks[:k].mean() - blocks[k:].mean()), k * (count - k) / count**2) for k in range(1, count)]
    explained, step = max((step**2 * share, step) for step, share in steps)
    return step > 0.0 and explained >= ONE_STEP * float(np.var(blocks))
