"""The linear error budget: what each tolerance makes of the error by itself, from the sensor alone.

One machine as described is simulated once. A sensor that assumes another machine, or a drive that reports something
else, shows in the estimate; and to first order a machine that is not what the sensor assumes does just that, with the
other sign. So a quantity costs two replays of the sensor and no simulation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ramsight.arrays import Array
from ramsight.engine.run import Outcome
from ramsight.errors import SimulationError
from ramsight.plant.circuit import parameter_values
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.study.datasheet.drawn import draw
from ramsight.study.datasheet.machine_tasks import Bench, Order, runs, work_through
from ramsight.study.datasheet.measuring import UNUSABLE
from ramsight.study.datasheet.quantities import Varied
from ramsight.study.datasheet.tracks_of_many import Run, tracked

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
