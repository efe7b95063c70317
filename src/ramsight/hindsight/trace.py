"""The sensor with all that its hypotheses are in a sample among its outputs: before a measurement, and after it.

    before   x-, P-     predicted from the sample before:  x- = F x + ..., P- = F P F' + Q
    after    x, P       corrected by what was measured
    F        [[1, dx/dq], [0, I]]

It is the same graph as the sensor's, with more outputs; what it says of a position is the same to the last digit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import combinations_with_replacement

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.engine.recursion import replay
from ramsight.expression import Scalar, all_of, count, negated
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.belief.hypothesis import Hypothesis, choose
from ramsight.sensor.belief.lineage import used
from ramsight.sensor.belief.mixture import of_likeliest
from ramsight.sensor.kalman import Passage, Pipe
from ramsight.sensor.kept_sensor import kept_sensor
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import TINY
from ramsight.sensor.virtual_sensor import IS_REFERENCED, POSITION, VirtualSensor

_PREFIX = "trace."

ASIDE = (
    "others", "unseen", "unseen_most", "offset", "width", "wrong", "status", "beneath", "by_start", "updated",
    "put_back", "accepted", "rejected", "normal", "moved",
)  # fmt: skip
"""What is traced of a sample beside the hypotheses, in the order of a row."""


@dataclass(frozen=True)
class Layout:
    """Where what is traced stands in a row."""

    hypotheses: int  # how many there are
    quantities: tuple[Quantity, ...]  # that are uncertain, the position first
    steps: tuple[Quantity, ...]  # those that a step of the position depends on
    first: int  # place of the first traced number

    @cached_property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Rows and columns of the upper triangle of a covariance."""
        return tuple(combinations_with_replacement(range(len(self.quantities)), 2))

    @cached_property
    def spans(self) -> Mapping[str, slice]:
        """Of each kind of number."""
        k, n, m = self.hypotheses, len(self.quantities), len(self.pairs)
        sizes = {
            "mean_before": k * n,
            "covariance_before": k * m,
            "mean": k * n,
            "covariance": k * m,
            "log_weight": k,
            "parent": k,
            "independent": k,
            "travel_by": len(self.steps),
            "aside": len(ASIDE),
        }
        ends = np.cumsum([self.first, *sizes.values()])
        return {name: slice(int(a), int(b)) for name, a, b in zip(sizes, ends, ends[1:], strict=False)}


def probabilities(log_weight: Array) -> Array:
    """Of hypotheses, by the logarithms of their weights.

    Example:
        >>> probabilities(np.log([1.0, 3.0])).tolist()
        [0.25, 0.75]
    """
    shares = np.exp(log_weight - log_weight.max())
    return np.asarray(shares / shares.sum())


@lru_cache(maxsize=8)
def square(n: int) -> NDArray[np.intp]:
    """Of each entry of a covariance of so many quantities its place in the upper triangle, row after row."""
    places = np.zeros((n, n), dtype=np.intp)
    upper = np.triu_indices(n)
    places[upper] = np.arange(len(upper[0]))
    return np.asarray(np.maximum(places, places.T))


@dataclass(frozen=True)
class Trace:
    """What the hypotheses were in consecutive samples."""

    # mean_before, covariance_before: before a measurement, shapes (samples, hypotheses, quantities) and (samples,
    # hypotheses, entries of the upper triangle) [SI]
    mean_before: Array
    covariance_before: Array
    # mean, covariance: after it, of the same shapes
    mean: Array
    covariance: Array
    unknown: Array  # variance of the position beside these, before and after it [m2], shape (samples, 2)
    parent: NDArray[np.int64]  # the hypothesis that each one continues, shape (samples, hypotheses)
    independent: NDArray[np.bool_]  # whether its position is another one since then, of the same shape
    travel_by: Array  # derivatives of the travel by the quantities, shape (samples, quantities); 0 by the position
    aside: Mapping[str, Array]  # by the names in `ASIDE`, shape (samples,)

    def before(self, sample: int, hypotheses: NDArray[np.int64]) -> Array:
        """Covariances before the measurement of a sample, shape (hypotheses, quantities, quantities)."""
        found: Array = self.covariance_before[sample, hypotheses][:, square(self.mean.shape[2])]
        found[:, 0, 0] += self.unknown[sample, 0]
        return found

    def after(self, sample: int, hypotheses: NDArray[np.int64]) -> Array:
        """The same after it."""
        found: Array = self.covariance[sample, hypotheses][:, square(self.mean.shape[2])]
        found[:, 0, 0] += self.unknown[sample, 1]
        return found

    def rows(self, span: slice, hypotheses: NDArray[np.int64], quantities: NDArray[np.int64]) -> Array:
        """Rows of these, after the measurements of samples, shape (samples, rows, quantities).

        Args:
            hypotheses: of each row its hypothesis.
            quantities: and its quantity.
        """
        found: Array = self.covariance[span][:, hypotheses[:, None], square(self.mean.shape[2])[quantities]]
        found[:, quantities == 0, 0] += self.unknown[span, 1][:, None]
        return found

    @cached_property
    def updates(self) -> NDArray[np.bool_]:
        """In which samples something was measured, or a hypothesis continues another one."""
        other = (self.parent != np.arange(self.parent.shape[1])) | self.independent
        updates: NDArray[np.bool_] = (self.aside["updated"] > 0.0) | (self.aside["put_back"] != 0.0) | other.any(axis=1)
        return updates


@dataclass(frozen=True)
class Tracer:
    """The sensor of a unit with its trace."""

    sensor: VirtualSensor  # whose outputs are those of the unit's sensor, then the trace
    layout: Layout  # of the trace
    unit: HydraulicUnit  # that it watches

    @property
    def names(self) -> tuple[str, ...]:
        """What the sensor says, the trace left out."""
        return self.sensor.recursion.outputs[: self.layout.first]

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """Of the hypotheses."""
        return KINDS

    @property
    def start_variance(self) -> float:
        """What an entered start is uncertain by, beside its stated deviation, until a place is measured [m2]."""
        stops = self.unit.assumptions.stops
        return float(stops.entered * (stops.elsewhere * self.unit.cylinder.stroke) ** 2)

    @classmethod
    def of(cls, unit: HydraulicUnit) -> Tracer:
        """Of a unit's sensor, as it was kept or made."""
        sensor = kept_sensor("traced", unit, _traced)
        return cls(sensor, _layout_of(sensor), unit)

    def rows(self, inputs: Array, state: Array) -> Array:
        """What the sensor says and the trace of consecutive samples; the state goes on.

        Args:
            inputs: shape (samples, inputs).
            state: shape (states,); is overwritten.
        """
        return replay(self.sensor.recursion, inputs, self.sensor.parameters, state)

    def alike(self, state: Array, other: Array, close: float) -> bool:
        """Whether a place was measured, and what is known is the same in two states of the sensor.

        Args:
            close: root mean square over the hypotheses of the largest difference of a mean over its deviation, or of a
                deviation's logarithm; and sum of the differences of their probabilities.
        """
        order, (means, variances, weights) = self.sensor.recursion.state, self._uncertain
        if min(state[order.index(IS_REFERENCED)], other[order.index(IS_REFERENCED)]) == 0.0:
            return False
        std, was = np.sqrt(state[variances]) + TINY, np.sqrt(other[variances]) + TINY
        off = state[means] - other[means]
        off[:, 0] += state[order.index(POSITION)] - other[order.index(POSITION)]
        apart = np.maximum(np.abs(off) / np.minimum(std, was), np.abs(np.log(std / was))).max(axis=1)
        chances, before = probabilities(state[weights]), probabilities(other[weights])
        return bool(chances @ apart**2 <= close**2 and np.abs(chances - before).sum() <= close)

    @cached_property
    def _uncertain(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Places among the states: of the hypotheses' means and variances, a row each, and of their weights."""
        order = {name: k for k, name in enumerate(self.sensor.recursion.state)}
        names, known = [f"hypotheses[{k}]" for k in range(self.layout.hypotheses)], self.layout.quantities
        means = [[order[f"{name}.{one}"] for one in known] for name in names]
        variances = [[order[f"{name}.covariance[{one},{one}]"] for one in known] for name in names]
        return np.array(means), np.array(variances), np.array([order[f"{name}.log_weight"] for name in names])

    def aside(self, rows: Array) -> dict[str, Array]:
        """What is traced of each sample beside the hypotheses, by the names in `ASIDE`."""
        return dict(zip(ASIDE, rows[:, self.layout.spans["aside"]].T, strict=True))

    def log_weight(self, rows: Array) -> Array:
        """Of the hypotheses, shape (samples, hypotheses)."""
        return rows[:, self.layout.spans["log_weight"]]

    def trace(self, rows: Array, unknown: Array) -> Trace:
        """The trace as arrays.

        An error of an entered start is in every sample until a place is measured (`Bank.placed` adds it there).

        Args:
            unknown: variance of the position in each by what changed unknown [m2], shape (samples, 2): before a
                measurement, and after it.
        """
        at, k, n = self.layout.spans, self.layout.hypotheses, len(self.layout.quantities)
        travel_by = np.zeros((len(rows), n))
        travel_by[:, [self.layout.quantities.index(one) for one in self.layout.steps]] = rows[:, at["travel_by"]]
        aside = self.aside(rows)
        start = self.start_variance * aside["by_start"]
        return Trace(
            mean_before=rows[:, at["mean_before"]].reshape(-1, k, n),
            covariance_before=rows[:, at["covariance_before"]].reshape(len(rows), k, -1),
            mean=rows[:, at["mean"]].reshape(-1, k, n),
            covariance=rows[:, at["covariance"]].reshape(len(rows), k, -1),
            unknown=unknown + np.column_stack([start, np.append(start[1:], 0.0)]),
            parent=rows[:, at["parent"]].astype(np.int64),
            independent=rows[:, at["independent"]] > 0.5,  # 0 or 1
            travel_by=travel_by,
            aside=aside,
        )


def _traced(unit: HydraulicUnit) -> VirtualSensor:
    """The unit's sensor with its trace as further outputs."""
    passage = Pipe.of(unit).passage()
    quantities = _uncertain(passage)
    more = {f"{_PREFIX}{name}": (value, "SI") for name, value in _traced_of(passage, quantities)}
    said = replace(passage.said, more={**passage.said.more, **more})
    return replace(passage, said=said).sensor()


def _uncertain(passage: Passage) -> tuple[Quantity, ...]:
    """The quantities that are not known exactly before the first sample under every hypothesis."""
    first = passage.initial.bank.hypotheses
    known = [one for one in first[0].mean if all(float(h.covariance[one, one]) == 0.0 for h in first)]
    return tuple(one for one in first[0].mean if one == Quantity.POSITION or one not in known)


def _traced_of(passage: Passage, quantities: Sequence[Quantity]) -> Iterator[tuple[str, Scalar]]:
    """Names and expressions, in the order of `Layout.spans`."""
    updated, now, over = passage.updated, passage.after.bank, passage.at.intake.passed_over
    was = passage.before.bank.hypotheses
    before = [choose(over, one, other) for one, other in zip(was, passage.predicted.free.hypotheses, strict=True)]
    yield from _of_hypotheses("before", before, ca.if_else(over, passage.before.position, passage.came_to), quantities)
    yield from _of_hypotheses("after", now.hypotheses, passage.after.position, quantities)
    for k, h in enumerate(now.hypotheses):
        yield f"log_weight[{k}]", h.log_weight
    parents = used(negated(over), updated.measured.parents, passage.pipe.model.kinds)
    for k, one in enumerate(parents):
        yield f"parent[{k}]", one.place
    for k, one in enumerate(parents):
        yield f"independent[{k}]", count(one.independent)
    for quantity, by in passage.at.travel_by.items():
        if quantity in quantities:
            yield f"travel_by[{quantity}]", ca.if_else(over, 0.0, by)
    aside = _aside(passage)
    yield from ((name, ca.SX(aside[name])) for name in ASIDE)


def _aside(passage: Passage) -> dict[str, Scalar]:
    """What is traced of a sample beside the hypotheses, by its name."""
    updated, state, aside = passage.updated, passage.before.bank, passage.aside
    counts = negated(passage.at.intake.passed_over)
    measured, beside = updated.measured, aside.beside
    free, bank = passage.predicted.free, passage.predicted.bank
    put_back = of_likeliest(
        free.hypotheses,
        [
            ca.if_else(counts, h.mean[Quantity.POSITION] - other.mean[Quantity.POSITION], 0.0)
            for h, other in zip(bank.hypotheses, free.hypotheses, strict=True)
        ],
    )
    return {
        "others": beside.others,
        "unseen": beside.unseen.std,
        "unseen_most": beside.unseen.most,
        "offset": beside.offset,
        "width": passage.after.bank.band_width,
        "wrong": ca.SX(updated.bank.together.wrong),
        "status": aside.status,
        "beneath": aside.beneath,
        "by_start": count(all_of(passage.predicted.bank.state.entered, negated(state.confirmed))),
        "updated": count(all_of(counts, updated.is_update)),
        "put_back": put_back,
        "accepted": count(all_of(counts, measured.accepted)),
        "rejected": count(all_of(counts, measured.rejected)),
        "normal": measured.normal,
        "moved": measured.moved,
    }


def _of_hypotheses(
    name: str, hypotheses: Sequence[Hypothesis], nominal: Scalar, quantities: Sequence[Quantity]
) -> Iterator[tuple[str, Scalar]]:
    """Means, then covariances of all hypotheses."""
    for k, h in enumerate(hypotheses):
        for one in quantities:
            yield f"{name}[{k}].{one}", h.mean[one] + (nominal if one == Quantity.POSITION else 0.0)
    for k, h in enumerate(hypotheses):
        for one, other in combinations_with_replacement(quantities, 2):
            yield f"{name}[{k}].{one},{other}", h.covariance[one, other]


def _layout_of(sensor: VirtualSensor) -> Layout:
    """Of a traced sensor, by the names of its outputs."""
    names = sensor.recursion.outputs
    traced = [name.removeprefix(_PREFIX) for name in names if name.startswith(_PREFIX)]
    quantities = tuple(
        Quantity(one.removeprefix("after[0].")) for one in traced if one.startswith("after[0].") and "," not in one
    )
    steps = tuple(Quantity(one[len("travel_by[") : -1]) for one in traced if one.startswith("travel_by["))
    hypotheses = sum(one.startswith("parent[") for one in traced)
    return Layout(hypotheses, quantities, steps, len(names) - len(traced))
