"""The sensor with all that its hypotheses are in a sample among its outputs: before a measurement, and after it.

    before   x-, P-     predicted from the sample before:  x- = F x + ..., P- = F P F' + Q
    after    x, P       corrected by what was measured
    F        [[1, dx/dq], [0, I]]

It is the same graph as the sensor's, with more outputs; what it says of a position is the same to the last digit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
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
from ramsight.sensor.virtual_sensor import VirtualSensor

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
    def square(self) -> NDArray[np.intp]:
        """Of each entry of a covariance, row by row, its place in the upper triangle."""
        n = len(self.quantities)
        place = np.empty((n, n), dtype=np.intp)
        for k, (i, j) in enumerate(self.pairs):
            place[i, j] = place[j, i] = k
        return place.ravel()

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


@dataclass(frozen=True)
class Trace:
    """What the hypotheses were in consecutive samples."""

    # mean_before, covariance_before: before a measurement, shapes (samples, hypotheses, quantities) and (samples,
    # hypotheses, quantities, quantities) [SI]; the latter in `updates` and in the last sample
    mean_before: Array
    covariance_before: Array
    # mean, covariance: after it, of the same shapes
    mean: Array
    covariance: Array
    parent: NDArray[np.int64]  # the hypothesis that each one continues, of the same shape
    independent: NDArray[np.bool_]  # whether its position is another one since then, of the same shape
    travel_by: Array  # derivatives of the travel by the quantities, shape (samples, quantities); 0 by the position
    aside: Mapping[str, Array]  # by the names in `ASIDE`, shape (samples,)

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
        covariance = self._square(rows, "covariance")
        covariance[:, :, 0, 0] += (np.append(start[1:], 0.0) + unknown[:, 1])[:, None]
        trace = Trace(
            mean_before=rows[:, at["mean_before"]].reshape(-1, k, n),
            covariance_before=np.zeros((len(rows), k, n, n)),
            mean=rows[:, at["mean"]].reshape(-1, k, n),
            covariance=covariance,
            parent=rows[:, at["parent"]].astype(np.int64),
            independent=rows[:, at["independent"]] > 0.5,  # 0 or 1
            travel_by=travel_by,
            aside=aside,
        )
        needed = trace.updates.copy()
        needed[-1:] = True
        before = self._square(rows[needed], "covariance_before")
        before[:, :, 0, 0] += (start + unknown[:, 0])[needed, None]
        trace.covariance_before[needed] = before
        return trace

    def _square(self, rows: Array, name: str) -> Array:
        """Covariances of all hypotheses, of their upper triangles."""
        k, n, m = self.layout.hypotheses, len(self.layout.quantities), len(self.layout.pairs)
        places = self.layout.spans[name].start + m * np.arange(k)[:, None] + self.layout.square
        found: Array = np.take(rows, places.ravel(), axis=1, mode="clip").reshape(-1, k, n, n)
        return found


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
