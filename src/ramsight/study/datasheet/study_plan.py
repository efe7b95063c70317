"""What a study is: the machine, what varies of it, what its machines do, and which of them belong to which task."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import DescriptionError
from ramsight.machine.as_toml import as_toml
from ramsight.machine.description import Machine
from ramsight.machine.spread import Spread
from ramsight.optional import needing
from ramsight.study.datasheet.machine_tasks import Bench, Order, bench_of
from ramsight.study.datasheet.quantities import Varied, varied
from ramsight.study.datasheet.store import Layout
from ramsight.study.datasheet.studied_duties import Work

METHODS = ("sobol", "latin-hypercube")
_INSIDE = 1e-12  # from the ends of (0, 1), where a normal distribution has no value


def points(method: str, count: int, dimensions: int, seed: int, first: int = 0) -> Array:
    """Points of the unit cube, shape (count, dimensions).

    Those of ``sobol`` (scrambled) are a sequence: more machines begin with the same ones, so that a study can be
    extended. A Latin hypercube is as many as it is made for.

    Args:
        first: number of the first one; of a Latin hypercube 0.

    Example:
        >>> both = points("sobol", 8, 3, seed=1)
        >>> bool((both[4:] == points("sobol", 4, 3, seed=1, first=4)).all())
        True
    """
    with needing("study"):
        from scipy.stats import qmc

    if dimensions == 0:
        return np.zeros((count, 0))
    if method == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed)).random(count))
    sequence = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed))
    with warnings.catch_warnings():  # that a number which is no power of two is less even
        warnings.simplefilter("ignore", UserWarning)
        if first:
            sequence.fast_forward(first)
        return np.asarray(sequence.random(count))


def check_method(method: str) -> None:
    """Reject a design that is not there.

    Raises:
        DescriptionError: it is none.
    """
    if method not in METHODS:
        raise DescriptionError("no such design", key="method", value=method, allowed=", ".join(METHODS))


def correlation_of(quantities: Sequence[Varied], pairs: Mapping[str, float]) -> Array | None:
    """The matrix of correlations, shape (quantities, quantities); None where there is none.

    Args:
        pairs: by two names with a hyphen between; of pairs of which one does not vary nothing is left.

    Raises:
        DescriptionError: together they are no correlation matrix.
    """
    names = [one.name for one in quantities]
    matrix = np.eye(len(names))
    for pair, value in pairs.items():
        one, _, other = pair.partition("-")
        if one in names and other in names:
            i, j = names.index(one), names.index(other)
            matrix[i, j] = matrix[j, i] = value
    if np.array_equal(matrix, np.eye(len(names))):
        return None
    if np.linalg.eigvalsh(matrix)[0] <= 1e-9:
        shown = ", ".join(f"{pair} = {value:g}" for pair, value in pairs.items())
        text = "is no correlation matrix: no quantities can be correlated like that"
        raise DescriptionError(text, key="correlations", value=shown, allowed="positive definite")
    return matrix


def values_at(cube: Array, quantities: Sequence[Varied], correlation: Array | None) -> Array:
    """Values [SI] of points of the unit cube, shape (points, quantities); correlated by a Gaussian copula.

    Args:
        cube: shape (points, quantities).
    """
    if correlation is not None:
        with needing("study"):
            from scipy.special import ndtr, ndtri

        normal = ndtri(np.clip(cube, _INSIDE, 1.0 - _INSIDE)) @ np.linalg.cholesky(correlation).T
        cube = ndtr(normal)
    columns = [value_at(cube[:, k], one.spread) for k, one in enumerate(quantities)]
    return np.column_stack(columns) if columns else np.zeros((len(cube), 0))


def value_at(share: Array, spread: Spread) -> Array:
    """The value [SI] that so large a share of all is below: the inverse of the distribution, cut off where it ends.

    Example:
        >>> wide = Spread(1.0, 0.2, "triangular", least=0.9)
        >>> value_at(np.array([0.0, 1.0]), wide).round(6).tolist()
        [0.9, 1.2]
    """
    low, high = spread.ends
    if spread.distribution == "uniform":
        return np.asarray(low + share * (high - low))
    below, above = _share_below(np.array([low, high]), spread)
    inner = np.clip(below + share * (above - below), _INSIDE, 1.0 - _INSIDE)
    return np.clip(_inverse(inner, spread), low, high)


def _share_below(value: Array, spread: Spread) -> Array:
    with needing("study"):
        from scipy.special import ndtr

    if spread.distribution == "triangular":
        x = np.clip((value - spread.centre) / spread.half, -1.0, 1.0)
        return np.where(x < 0.0, 0.5 * (1.0 + x) ** 2, 1.0 - 0.5 * (1.0 - x) ** 2)
    if spread.distribution == "log-normal":
        return np.asarray(ndtr(np.log(value / spread.centre) / (spread.std / spread.centre)))
    return np.asarray(ndtr((value - spread.centre) / spread.std))


def _inverse(share: Array, spread: Spread) -> Array:
    with needing("study"):
        from scipy.special import ndtri

    if spread.distribution == "triangular":
        x = np.where(share < 0.5, np.sqrt(2.0 * share) - 1.0, 1.0 - np.sqrt(2.0 * (1.0 - share)))
        return np.asarray(spread.centre + spread.half * x)
    if spread.distribution == "log-normal":
        return np.asarray(spread.centre * np.exp(ndtri(share) * spread.std / spread.centre))
    return np.asarray(spread.centre + spread.std * ndtri(share))


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
