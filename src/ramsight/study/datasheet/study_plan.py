"""What a study is: the machine, what varies of it, what its machines do, and which of them belong to which task."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import DescriptionError
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Machine
from ramsight.study.datasheet.design import check_method, correlation_of, points, values_at
from ramsight.study.datasheet.machine_tasks import Bench, Order, bench_of
from ramsight.study.datasheet.quantities import Varied, varied
from ramsight.study.datasheet.store import Layout
from ramsight.study.datasheet.studied_duties import Work

TASK = 32
"""Machines a task: some seconds of work, so that handing tasks out costs little and a stop loses little."""


@dataclass(frozen=True)
class Plan:
    """A study."""

    toml: str  # the description as text, as far as it matters for the unit
    unit: str
    work: Work
    sensor: str  # kind of the sensor, or its file
    quantities: tuple[Varied, ...]
    correlations: tuple[tuple[str, float], ...] = ()  # of pairs of them, by two names with a hyphen between
    seed: int = 0  # decides everything
    method: str = "sobol"
    count: int = 1000  # machines; of a Latin hypercube it belongs to the design
    common: int | None = None  # number of the machine whose duty and noise all have; None if each has its own
    moments: tuple[float, ...] = ()  # times at which signed errors are kept [s]
    saltelli: int = 0  # base points of the design for Sobol's indices, which then is the design; 0 for none

    @property
    def bench(self) -> Bench:
        """What its machines have in common, compiled."""
        return bench_of(self.toml, self.unit, self.work, self.sensor)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what varies."""
        return tuple(one.name for one in self.quantities)

    @cached_property
    def _correlation(self) -> Array | None:
        return correlation_of(self.quantities, dict(self.correlations))

    @cached_property
    def _cube(self) -> Array:
        from ramsight.study.datasheet.statistics import saltelli

        return saltelli(len(self.quantities), self.saltelli, self.seed)

    def values(self, rows: range) -> Array:
        """What was drawn for some machines [SI], shape (machines, quantities)."""
        dimensions = len(self.quantities)
        if self.saltelli:
            cube = self._cube[rows.start : rows.stop]
        elif self.method == "latin-hypercube":
            cube = points(self.method, self.count, dimensions, self.seed)[rows.start : rows.stop]
        else:
            cube = points(self.method, len(rows), dimensions, self.seed, rows.start)
        return values_at(cube, self.quantities, self._correlation)

    def order(self, rows: range) -> Order:
        """Some machines, to be worked through."""
        return Order(tuple(rows), self.names, self.values(rows), self.seed, self.common, np.array(self.moments))

    @property
    def identity(self) -> dict[str, Any]:
        """What makes the study what it is; the number of machines does so only where the design depends on it."""
        number = self.count if self.method == "latin-hypercube" else 0
        return {
            "description": hashlib.sha256(self.toml.encode()).hexdigest(),
            "unit": self.unit,
            "duty": {**asdict(self.work), "content": _content(self.work)},
            "sensor": self.sensor,
            "tolerances": {one.name: asdict(one.spread) for one in self.quantities},
            "correlations": dict(self.correlations),
            "seed": self.seed,
            "design": [self.method, number, self.saltelli],
            "moments": [self.common, *self.moments],
            "task": TASK,
        }

    @property
    def layout(self) -> Layout:
        """Layout of the study's store."""
        units = ["K" if one.unit == "degC" else one.unit for one in self.quantities]
        return Layout(self.identity, self.names, units, np.array(self.moments), TASK)


def plan(
    machine: Machine,
    unit: str,
    work: Work,
    sensor: str = "kalman",
    *,
    vary: Mapping[str, str] | None = None,
    correlations: Mapping[str, float] | None = None,
    count: int = 1000,
    seed: int = 0,
    method: str = "sobol",
) -> Plan:
    """A study of a unit.

    Raises:
        DescriptionError: a tolerance has no meaning, correlations contradict each other, or there is no such duty.
        UnknownNameError: there is no such unit or quantity.
    """
    work.check()
    check_method(method)
    quantities = varied(machine, unit, vary)
    if work.has_own_oil:
        quantities = tuple(one for one in quantities if one.name not in ("oil_temperature", "warming"))
    pairs = dict(machine.unit(unit).tolerances.correlations if correlations is None else correlations)
    if (angle := machine.unit(unit).assumptions.link_angle.std) > 0.0:
        text = "a data sheet is of a unit without its mechanism: leave the sensor of its angle out"
        raise DescriptionError(text, key=f"units.{unit}.assumptions.link_angle.std", value=angle, allowed="0")
    alone = machine.model_copy(update={"units": {unit: machine.unit(unit)}, "linkage": None})
    correlated = tuple(sorted((pair, float(value)) for pair, value in pairs.items()))
    made = Plan("\n".join(as_toml(alone, {})), unit, work, sensor, quantities, correlated, seed, method, count)
    _ = made._correlation  # refused here if it is none
    return made


def _content(work: Work) -> str:
    """What is in a duty's file."""
    from pathlib import Path

    return hashlib.sha256(Path(work.kind).read_bytes()).hexdigest() if work.has_own_oil else ""
