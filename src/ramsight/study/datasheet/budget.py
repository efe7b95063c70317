"""The error budget: Sobol's indices on runs of their own, and the linear budget beside them.

All machines of the budget do the same duty with the same noise, so that what differs between them is what they were
drawn from. The errors that count are those of every second after the third reference. An error beyond the 95 % error of
them all counts as that: of a sensor that has lost its way, which it says, the size of the error would drown the rest.

The linear budget says what each tolerance makes of the error by itself, from the sensor alone. One machine as described
is simulated once. A sensor that assumes another machine, or a drive that reports something else, shows in the estimate;
and to first order a machine that is not what the sensor assumes does just that, with the other sign. So a quantity
costs two replays of the sensor and no simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.argument_kinds import whole_argument
from ramsight.arrays import Array
from ramsight.engine.run import Outcome
from ramsight.errors import DescriptionError, SimulationError
from ramsight.optional import needing
from ramsight.plant.circuit import parameter_values
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.signals import Dataset
from ramsight.study.datasheet.cluster import run
from ramsight.study.datasheet.drawn import draw
from ramsight.study.datasheet.machine_tasks import Bench, Order, runs, work_through
from ramsight.study.datasheet.measuring import SETTLED, TAUGHT, UNUSABLE, Run, tracked
from ramsight.study.datasheet.quantities import Varied
from ramsight.study.datasheet.statistics import Indices, indices
from ramsight.study.datasheet.study_plan import Plan

REPORTED = (
    "torque_gain", "torque_offset", "torque_drift", "torque_delay", "torque_noise", "thermometer_offset",
    "thermometer_lag",
)  # fmt: skip
"""Kinds that only change what is reported."""
OUTSIDE = ("oil_temperature", "warming")
"""Kinds that machine and sensor know alike: to first order no error comes of them."""
_STEP = 1.0  # of a standard deviation: as far as the tolerance goes, and large beside what rounding and decisions make
_CIRCUIT = "circuit."


@dataclass(frozen=True)
class Linear:
    """The budget."""

    names: tuple[str, ...]  # of what varies
    # effect: of one standard deviation of each on the error at each moment [m], shape (quantities, moments); NaN
    # where the sensor calls one of the two positions invalid that it is the difference of
    effect: Array

    @property
    def rms(self) -> Array:
        """Root of the mean square over the moments, of each quantity [m]."""
        known = np.isfinite(self.effect)
        square = np.where(known, self.effect, 0.0) ** 2
        return np.asarray(np.sqrt(square.sum(axis=1) / np.maximum(known.sum(axis=1), 1)))

    @property
    def shares(self) -> Array:
        """Share of each in the variance of the error [1]."""
        square = self.rms**2
        return np.asarray(square / square.sum() if square.sum() > 0.0 else square)


def linear_budget(bench: Bench, quantities: tuple[Varied, ...], moments: Array, common: int, seed: int) -> Linear:
    """The linear budget of a study.

    Args:
        moments: times at which the error counts [s].
        common: number of the machine whose duty and noise it is made for.

    Raises:
        SimulationError: the machine as described does not do the duty.
    """
    centres = {one.name: centre_of(one) for one in quantities}
    run = nominal_run(bench, quantities, common, seed)
    effect = np.zeros((len(quantities), len(moments)))
    counted = [k for k, one in enumerate(quantities) if one.name not in OUTSIDE]
    sides = [
        _otherwise(bench, run, quantities[k].name, value, centres) for k in counted for value in ends_of(quantities[k])
    ]
    positions = _positions(sides, moments)
    for k, low, high in zip(counted, positions[::2], positions[1::2], strict=True):
        ends = ends_of(quantities[k])
        effect[k] = (high - low) / (ends[1] - ends[0]) * quantities[k].spread.std
    return Linear(tuple(one.name for one in quantities), effect)


def differences(
    bench: Bench, quantities: tuple[Varied, ...], names: tuple[str, ...], moments: Array, common: int, seed: int
) -> Array:
    """The same by finite differences through machine, drive and sensor, shape (names, moments) [m]; arguments as above.

    Args:
        moments: [s].
    """
    all_of_them = tuple(one.name for one in quantities)
    rows, spans = [], []
    for name in names:
        one = quantities[all_of_them.index(name)]
        ends = ends_of(one)
        spans.append(one.spread.std / (ends[1] - ends[0]))
        rows += [[value if other.name == name else centre_of(other) for other in quantities] for value in ends]
    order = Order(tuple(range(len(rows))), all_of_them, np.array(rows), seed, common, moments)
    error = work_through(bench, order)["moment_error"]
    return np.asarray((error[1::2] - error[::2]) * np.array(spans)[:, None])


def centre_of(one: Varied) -> float:
    """The value that a machine as described has [SI]."""
    low, high = one.spread.ends
    return min(max(one.spread.centre, low), high)


def ends_of(one: Varied) -> tuple[float, float]:
    """Two values beside that, within what can be [SI]."""
    low, high = one.spread.ends
    step = _STEP * one.spread.std
    return max(centre_of(one) - step, low), min(centre_of(one) + step, high)


@dataclass(frozen=True)
class Nominal:
    """A run of the machine as described, and the seed of its noise."""

    run: Run
    seed: int


def nominal_run(bench: Bench, quantities: tuple[Varied, ...], common: int, seed: int) -> Nominal:
    """The machine as described, doing the duty of machine `common`.

    Raises:
        SimulationError: it does not reach its end.
    """
    names, values = tuple(one.name for one in quantities), np.array([[centre_of(one) for one in quantities]])
    order = Order((common,), names, values, seed, common)
    (run,) = runs(bench, order, range(1))
    if isinstance(run, Outcome):
        raise SimulationError(f"{bench.unit}: the machine as described does not do the duty: {run.name.lower()}")
    return Nominal(run, order.seed_of(common))


@dataclass(frozen=True)
class _Side:
    """A run, the sensor that watches it, and the sign with which what it says counts."""

    run: Run
    sensor: VirtualSensor
    sign: float = 1.0


def _otherwise(bench: Bench, nominal: Nominal, name: str, value: float, centres: dict[str, float]) -> _Side:
    """What the run looks like with another value of a quantity."""
    run = nominal.run
    if name == "start":
        start = run.start + value - centres[name]
        return _Side(replace(run, start=min(max(start, 0.0), run.stroke)), bench.virtual)
    if name in REPORTED:
        return _Side(_otherwise_reported(run, {**centres, name: value}, nominal.seed), bench.virtual)
    of_machine = {one: at for one, at in centres.items() if one not in (*REPORTED, *OUTSIDE, "start")}
    return _Side(run, _assuming(bench, {**of_machine, name: value}), -1.0)


def _positions(sides: list[_Side], moments: Array) -> list[Array]:
    """Estimated positions at the moments, to be compared with others of the same run [m]."""
    found = []
    for side, track in zip(sides, tracked([s.run for s in sides], [s.sensor for s in sides]), strict=True):
        position = np.where(track.status < UNUSABLE, track.position, np.nan)
        found.append(side.sign * position[np.clip(np.searchsorted(track.time, moments), 0, len(position) - 1)])
    return found


def _otherwise_reported(run: Run, values: dict[str, float], seed: int) -> Run:
    reports = replace(run.drawn, values=values).reported(run.time, *run.true_signals, seed)
    inputs = run.inputs.copy()
    inputs[:, 1:4] = np.column_stack(reports)
    return replace(run, inputs=inputs)


def _assuming(bench: Bench, values: dict[str, float]) -> VirtualSensor:
    """The sensor of another machine."""
    unit = draw(bench.described, bench.unit, bench.nominal, values).unit
    known = dict(
        zip(
            bench.model.ode.parameters,
            parameter_values(bench.model, unit.oil, unit.tank_pressure, unit.parts()).tolist(),
            strict=True,
        )
    )
    known["oil_temperature"] = float("nan")  # an input of the sensor, no belief
    sensor, stroke = bench.virtual, float(unit.cylinder.stroke)
    values_of = [
        stroke if name == "stroke" else known.get(name.removeprefix(_CIRCUIT), old)
        if name.startswith(_CIRCUIT) and name != f"{_CIRCUIT}oil_temperature" else old
        for name, old in zip(sensor.recursion.parameters, sensor.parameters.tolist(), strict=True)
    ]  # fmt: skip
    return replace(sensor, parameters=np.array(values_of))


_DAYS = 8  # days that are looked at for one with references enough
_EVERY = 1.0  # s, at which an error counts
_COUNTED = 0.95  # of the errors; the others count as the largest of these
_ENOUGH = 60  # moments of a day with references enough
_MOST_POINTS = 2**20  # base points


@dataclass(frozen=True)
class Budget:
    """The error budget of a study."""

    names: tuple[str, ...]  # of what varies
    linear: Linear  # what each quantity makes of the error by itself
    moments: int  # how many
    indices: Indices | None = None  # Sobol's, of the errors at the moments; None if there are only linear ones
    std: float = math.nan  # of the error over the machines of the indices, root of its mean square over the moments [m]
    limit: float = math.nan  # error that larger ones count as [m]
    failed: int = 0  # machines that could not be simulated, whose error counts as the mean of the others'

    @property
    def agreement(self) -> float:
        """Largest difference between a first-order index and the linear budget's share [1]."""
        if self.indices is None:
            return math.nan
        return float(np.abs(self.indices.first - self.linear.shares).max())

    def dataset(self) -> Dataset:
        """All of it over `quantity`: shares [1], and effects of one standard deviation [m]."""
        with needing("study"):
            import xarray

        shares = {"linear_share": self.linear.shares}
        if (found := self.indices) is not None:
            shares |= {"first": found.first, "first_half": found.first_half}
            shares |= {"total": found.total, "total_half": found.total_half}
        data: dict[str, Any] = {name: ("quantity", values, {"units": "1"}) for name, values in shares.items()}
        data["linear"] = ("quantity", self.linear.rms, {"units": "m"})
        attributes = {"kind": "error budget", "moments": self.moments}
        return xarray.Dataset(data, {"quantity": list(self.names)}, attributes)


def check_base(base: int) -> None:
    """Reject a number of base points that Sobol's indices cannot be made of.

    Args:
        base: how many; 0 for none.

    Raises:
        DescriptionError: it is no power of two, or too many.
    """
    whole_argument(base, "budget", 0, _MOST_POINTS)
    if base & (base - 1):
        raise DescriptionError("is no power of two", key="budget", value=base, allowed="0, 16, 32, 64, …")


def budget_plan(plan: Plan, base: int) -> Plan:
    """The runs that a budget of a study needs.

    Args:
        base: base points of the design, a power of two; runs are so many times the quantities and two.
    """
    common, found = 0, None
    for number in range(_DAYS):
        one = nominal_run(plan.bench, plan.quantities, number, plan.seed).run
        if found is None or len(one.visits) > len(found.visits):
            common, found = number, one
        if len(one.visits) > TAUGHT and len(_moments(one)) > _ENOUGH:
            break
    assert found is not None
    moments = tuple(round(float(moment), 3) for moment in _moments(found))
    count = base * (len(plan.quantities) + 2)
    return replace(plan, correlations=(), count=count, common=common, moments=moments, saltelli=base)


def budget(
    plan: Plan,
    base: int,
    path: Path | None,
    *,
    client: Any = None,
    threads: int | None = None,
    advance: Callable[[int], object] = lambda machines: None,
) -> Budget:
    """The error budget of a study; correlations are left out of it, because an index has a meaning without them.

    Args:
        base: as `budget_plan`'s; 0 for the linear budget alone.
        path: folder of its store; None keeps everything in memory.
    """
    own = budget_plan(plan, base)
    common, moments = own.common or 0, np.array(own.moments)
    linear = linear_budget(plan.bench, plan.quantities, moments, common, plan.seed)
    if base == 0:
        return Budget(plan.names, linear, len(moments))
    found = run(own, path, client=client, threads=threads, advance=advance)
    error = found["moment_error"].values
    bad = ~np.isfinite(error).all(axis=1)
    error = np.where(bad[:, None], error[~bad].mean(axis=0), error)
    limit = float(np.quantile(np.abs(error), _COUNTED))
    error = np.clip(error, -limit, limit)
    return Budget(
        names=plan.names,
        linear=linear,
        moments=len(moments),
        indices=indices(len(plan.quantities), error, plan.seed),
        std=float(np.sqrt(error.var(axis=0).mean())),
        limit=limit,
        failed=int(bad.sum()),
    )


def _moments(one: Run) -> Array:
    """Every second after the third reference; of a duty with fewer, after the last one; without any, all of it."""
    visits = one.visits
    after = visits[min(len(visits), TAUGHT) - 1] + SETTLED if len(visits) else 0.0
    return np.arange(np.ceil(after), one.time[-1], _EVERY)
