"""Weighings one after another: cycles, up and down of one load averaged, and the total since the start."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from ramsight.arrays import Array
from ramsight.normal import TWO_SIDED_95
from ramsight.tool.force_scale import TERMS, Scale
from ramsight.tool.load_chart import RatedLoad
from ramsight.tool.weighing_events import Plain, Quality, Weighing
from ramsight.tool.weighing_limits import EMPTY_SHARE, PAIR_STDS, STANDS_STILL


@dataclass(frozen=True, eq=False)
class Total:
    """What several cycles lifted, one good weighing of each."""

    mass: float = 0.0  # [kg]
    # row: change of it by each term of the scale, which all of them share
    row: Array = field(default_factory=lambda: np.zeros(len(TERMS)))
    own_variance: float = 0.0  # of what is each weighing's own [kg2]
    cycles: int = 0  # how many

    @classmethod
    def of(cls, one: Weighing) -> Total:
        """Of one cycle."""
        return cls(one.mass, one.row, one.own_std**2, 1)

    def __add__(self, other: Total) -> Total:
        """Of both."""
        return Total(
            self.mass + other.mass, self.row + other.row, self.own_variance + other.own_variance,
            self.cycles + other.cycles,
        )  # fmt: skip

    def std(self, scale: Scale) -> float:
        """Its standard deviation [kg], with what the scale leaves open counted as all weighings share it."""
        return math.hypot(scale.mass(0.0, self.row)[1], math.sqrt(self.own_variance))


class Tally:
    """Counts lifts as they come, and keeps no more of them than the cycle that has not ended.

    Args:
        strokes: of the other cylinders [m].
        rated: payload [kg]; a lift of next to nothing of it is of an empty tool, and no load.

    Attributes:
        last: the last weighing; None before the first one.
        count: how many weighings there were.
    """

    def __init__(self, scale: Scale, strokes: Array, rated: float = 0.0) -> None:
        self.scale, self._strokes, self._loaded_from = scale, strokes, EMPTY_SHARE * rated
        self.last: Weighing | None = None
        self.count = 0
        self._before = Total()  # of the cycles that have ended
        self._cycle: list[Weighing] = []
        self._number, self._lowered = 0, True
        self._up: Plain | None = None  # the lift that the next motion may lower again

    def add(self, one: Plain) -> Weighing | None:
        """Take a motion; the last weighing, where this completed it or made it better."""
        up, self._up = self._up, one if one.upwards else None
        if not one.upwards:
            self._lowered = True
            if up is None or not is_same_load(up, one, self.scale, self._strokes):
                return None
            self._cycle.pop()
            return self._enter(_mean(up, one), "both")
        if self._lowered:
            self._before, self._cycle = self.total, []
            self._number, self._lowered = self._number + 1, False
        self.count += 1
        return self._enter(one, "up")

    @property
    def total(self) -> Total:
        """Of each cycle the surest good weighing, unless the tool was empty."""
        loaded = [one for one in self._cycle if one.is_good and one.mass > self._loaded_from]
        return self._before + Total.of(min(loaded, key=lambda one: one.std)) if loaded else self._before

    def _enter(self, one: Plain, direction: str) -> Weighing:
        self.last = _weighing(one, self.scale, self._number, direction)
        self._cycle.append(self.last)
        return self.last


def weighed(found: Iterable[Plain], tally: Tally) -> list[Weighing]:
    """Weighings of lifts in order; up and down of one load are averaged, and other lowering is left out."""
    done: list[Weighing] = []
    for one in found:
        extend(done, tally.add(one))
    return done


def extend(done: list[Weighing], one: Weighing | None) -> None:
    """Add a weighing to a list; one that became better takes its place."""
    if one is not None:
        if one.direction == "both":
            done.pop()
        done.append(one)


def _weighing(one: Plain, scale: Scale, cycle: int, direction: str) -> Weighing:
    mass, shared = scale.mass(one.mass, one.row)
    std = math.hypot(shared, one.own_std)
    half = TWO_SIDED_95 * std
    rated = RatedLoad()
    if one.moment is not None and one.quality is Quality.GOOD:
        factor = one.moment.per_mass
        rated = RatedLoad.of(factor * mass, math.hypot(factor * shared, one.moment.own_std), covered=one.moment.covered)
    return Weighing(
        one.time, one.duration, cycle, direction, mass, std, mass - half, mass + half, one.quality, one.row,
        one.own_std, rated.share, rated.std, rated.exceeded, rated.status,
    )  # fmt: skip


def is_same_load(up: Plain, down: Plain, scale: Scale, strokes: Array) -> bool:
    """Whether a motion down carries what the one up before it did: nothing was dumped, and friction explains it.

    Args:
        strokes: of the other cylinders [m].
    """
    if down.upwards or up.quality is not Quality.GOOD or down.quality is not Quality.GOOD:
        return False
    if (np.abs(up.others - down.others) > STANDS_STILL * strokes).any():
        return False
    apart = scale.mass(up.mass, up.row)[0] - scale.mass(down.mass, down.row)[0]
    _, shared = scale.mass(0.0, up.row - down.row)
    return bool(abs(apart) <= PAIR_STDS * math.hypot(shared, up.own_std, down.own_std))


def _mean(up: Plain, down: Plain) -> Plain:
    """Both motions of a load as one lift: what differs by direction cancels."""
    return replace(
        up,
        time=0.5 * (up.time + down.time),
        duration=up.duration + down.duration,
        mass=0.5 * (up.mass + down.mass),
        row=0.5 * (up.row + down.row),
        own_std=0.5 * math.hypot(up.own_std, down.own_std),
        moment=None if up.moment is None or down.moment is None else up.moment.averaged(down.moment),
    )
