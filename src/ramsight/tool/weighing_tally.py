"""Weighings one after another: cycles, up and down of one load averaged, and the total since the start."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ramsight.arrays import Array
from ramsight.engine.recursion import Live
from ramsight.normal import TWO_SIDED_95
from ramsight.tool.force_scale import TERMS, Scale
from ramsight.tool.lift_values import QUALITIES
from ramsight.tool.load_chart import RatedLoad
from ramsight.tool.tally_law import tally_law
from ramsight.tool.weighing_events import Moment, Plain, Weighing
from ramsight.tool.weighing_limits import EMPTY_SHARE


@dataclass(frozen=True, eq=False)
class Total:
    """What several cycles lifted, one good weighing of each."""

    mass: float = 0.0  # [kg]
    # row: change of it by each term of the scale, which all of them share
    row: Array = field(default_factory=lambda: np.zeros(len(TERMS)))
    own_variance: float = 0.0  # of what is each weighing's own [kg2]
    cycles: int = 0  # how many

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
    """Counts lifts as they come, by the recursion of `tally_law`.

    Args:
        strokes: of the other cylinders [m].
        rated: payload [kg]; a lift of next to nothing of it is of an empty tool, and no load.

    Attributes:
        last: the last weighing; None before the first one.
        count: how many weighings there were.
        total: of each cycle the surest good weighing, unless the tool was empty.
    """

    def __init__(self, scale: Scale, strokes: Array, rated: float = 0.0) -> None:
        self.scale = scale
        law = tally_law(len(strokes) + 1)
        self._live = Live(law.recursion, law.initial, settings_of(scale, strokes, rated)).compiled()
        self.last: Weighing | None = None
        self.count = 0
        self.total = Total()

    def add(self, one: Plain) -> Weighing | None:
        """Take a motion; the last weighing, where this completed it or made it better."""
        said = dict(zip(self._live.recursion.outputs, self._live.step(_values(one)), strict=True))
        row = np.array([said[f"total.row[{k}]"] for k in range(len(TERMS))])
        self.total = Total(said["total.mass"], row, said["total.own_variance"], int(said["total.cycles"]))
        self.count = int(said["count"])
        if said["new"] > 0.0:
            self.last = _weighing(said)
            return self.last
        return None


def settings_of(scale: Scale, strokes: Array, rated: float) -> list[float]:
    """The parameters of the recursion: strokes of the other cylinders, scale, and the mass of an empty tool."""
    covariance = scale.covariance[np.triu_indices(len(TERMS))]
    return [*map(float, strokes), *scale.value.tolist(), *covariance.tolist(), EMPTY_SHARE * rated]


def _values(one: Plain) -> list[float]:
    """The inputs of the recursion."""
    moment = one.moment or Moment(math.nan, math.nan, covered=False)
    return [
        *one.row.tolist(), *one.others.tolist(), one.time, one.duration, float(one.upwards), one.mass, one.own_std,
        float(QUALITIES.index(one.quality)), moment.per_mass, moment.own_std, float(moment.covered),
    ]  # fmt: skip


def _weighing(said: Mapping[str, float]) -> Weighing:
    """The outputs of the recursion as a weighing."""
    mass, std, share = said["mass"], said["std"], said["rated_share"]
    half = TWO_SIDED_95 * std
    rated = RatedLoad()
    if math.isfinite(share):
        rated = RatedLoad.of(share, said["rated_share_std"], covered=said["covered"] > 0.0)
    return Weighing(
        said["time"], said["duration"], int(said["cycle"]), "up" if said["new"] == 1.0 else "both", mass, std,
        mass - half, mass + half, QUALITIES[int(said["quality"])],
        np.array([said[f"row[{k}]"] for k in range(len(TERMS))]), said["own_std"], rated.share, rated.std,
        rated.exceeded, rated.status,
    )  # fmt: skip


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
