"""Values of a description from runs with a measured position: those with which the sensor's own track follows it.

The volume-balance sensor is run along every log, from the first position that was measured; its equations are those of
the description, so that a value that is found is one of a part. Least squares over the logarithms of the values, with
what was known before as a prior,

    min sum ((x(q) - x_m) / s_x)^2 + sum rho((p(q) - p_m) / s_p)^2 + sum (q / s_q)^2,

the pressures where they were measured. Errors of a track last for a while, so samples count by how far apart they are.

A position sensor that is declared to bend has a curve c of its own, linear between knots and 0 at both ends of what was
measured (terminal-based linearity): x_m is then the reading, and x(q) + c(x_m) - c(x_m at the start) stands for x(q).

Valves and friction that open, close and hold make the sum rough: many minima explain the runs alike, and differ on runs
that are not among them. So none of them is chosen. Residuals and prior are drawn many times, each draw is fitted
(randomized maximum likelihood), and the result is the mean over draws and their opposites; its spread is in the
intervals.

Source: Kitanidis (1995), Quasi-linear geostatistical theory for inversing, Water Resources Research 31(10), 2411-2419.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ramsight.arrays import Array
from ramsight.calibration.free_values import FreeValue, with_values
from ramsight.calibration.identify_record import IdentifyError
from ramsight.engine.recursion import Recursion, replay_many
from ramsight.errors import DescriptionError
from ramsight.logs.mapped import SensorCurve
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.plant.build import build
from ramsight.sensor.balance import balance
from ramsight.sensor.inputs.sample import PRESSURES
from ramsight.sensor.virtual_sensor import VirtualSensor, log_inputs
from ramsight.signals import Dataset

if TYPE_CHECKING:
    from ramsight.machine.description import Machine

DRAWS = 12
"""Fits whose mean is taken: draws and their opposites."""
EVALUATIONS = 25
"""Evaluations of the model, each with its derivatives, that a round of a fit takes at most."""
_POSITION, _POSITION_LASTS = 0.3e-3, 1.0  # m and s: what errors of a good track are, and how long they last
_PRESSURE, _PRESSURE_LASTS = 4e5, 0.8  # Pa and s: the same of a pressure, with its sensor's noise and lag
_FAR = 3.0  # standard deviations; a pressure that is farther away is of something that the model does not have
_EVERY = 5  # samples between two that count; the others say the same
_ROWS = 2_000_000  # samples of all runs and changes that are followed at once; some hundred megabytes
_STEP = 0.05  # of a logarithm, to see which parameters of the equations follow a value
# Of a logarithm, each way, in the rounds of a fit: active sets make the track rough below the smaller one, and the
# larger one looks over the roughness from farther away.
_DIFFERENCES = (0.02, 0.006)
_SETTLED = 1e-4  # change of the sum of squares, relative, at which a round ends
_HALVINGS = 20  # to find how far a value may go
_GAIN, _BEND = 0.3, 0.03  # standard deviations: logarithm of a torque's gain, share that saturation takes at the most
_KNOTS = 7  # of a position sensor's curve, between the ends of what was measured: waves down to a quarter of that show


@dataclass(frozen=True)
class MeasuredRun:
    """A run of a machine that has a position sensor."""

    name: str  # for messages
    log: Dataset  # what the drive reported, and the commands that the circuit takes, over `time` [s]
    # measured: `position` [m] and maybe `pressure_a`, `pressure_b` [Pa] over the same `time`; NaN where unknown
    measured: Dataset
    # linearity: standard deviation of what the position sensor reads from what it should, along its way [m]
    linearity: float = 0.0

    @property
    def start(self) -> float:
        """First position that was measured [m]."""
        known = self.measured["position"].values
        return float(known[np.isfinite(known)][0])


@dataclass(frozen=True)
class Torque:
    """What a reported torque is: gain t (1 - loss abs(t))."""

    gain: float = 1.0  # over what was reported [1]
    loss: float = 0.0  # of the torque that a motor gives per current, by saturation, over the torque [1/(N m)]

    def of(self, reported: Array) -> Array:
        """The torque that acts [N m], from the reported one."""
        return np.asarray(self.gain * reported * (1.0 - self.loss * np.abs(reported)))


@dataclass(frozen=True)
class FittedValues:
    """What was found."""

    machine: Machine  # the description with the values that were found
    # values: by their paths in the unit: the value, and the limits of its 95 % interval, no farther than a
    # description may have it [SI]
    values: dict[str, tuple[float, float, float]]
    identified: frozenset[str]  # those of them whose interval is less than half of what it was before
    # torque, torque_std: what the reported torque is, and the standard deviation of the logarithm of its gain
    torque: Torque
    torque_std: float
    # curve: of the position sensor, the one that was known with what was found beside it; None where the sensor is
    # declared to have none
    curve: SensorCurve | None
    # rms, rms_of: of the position's errors over all runs [m], and of each, by name
    rms: float
    rms_of: dict[str, float]


def fit_track(
    machine: Machine,
    unit: str,
    runs: Sequence[MeasuredRun],
    free: Sequence[FreeValue],
    *,
    advance: Callable[[float], object] | None = None,
) -> FittedValues:
    """Find values of a description from runs with a measured position.

    Args:
        machine: the description to begin with.
        unit: the unit's name.
        runs: all of the same machine; several loads and strokes tell values apart.
        free: the values to be found, from `free_values`.
        advance: called with the share of the work done since the last call.

    Raises:
        IdentifyError: there is no run, or one whose position was not measured.
    """
    if not runs:
        raise IdentifyError("there is no run")
    for run in runs:
        if not np.isfinite(run.measured["position"].values).any():
            raise IdentifyError(f"{run.name}: no position was measured")
    model = _Model(machine, unit, runs, free)
    changes = np.array([_fit(model, noise, advance) for noise in _draws(model)])
    # Values that may be have a mean that may be, but for what ties them together.
    mean = model.possible(changes.mean(axis=0))
    return _fitted(model.around(mean), mean, changes.std(axis=0, ddof=1))


def _draws(model: _Model) -> Iterator[Array]:
    """Of all residuals, the prior's first: standard deviation 1, one after the other with its opposite."""
    random = np.random.default_rng(0)
    number = len(model.residuals(np.zeros(len(model.prior))))
    for _ in range(DRAWS // 2):
        noise = random.standard_normal(number)
        yield noise
        yield -noise


def _fit(model: _Model, noise: Array, advance: Callable[[float], object] | None) -> Array:
    """The change that fits a draw."""
    wide, narrow = _DIFFERENCES
    change = _round(model, np.zeros(len(model.prior)), noise, wide, advance)
    return _round(model.around(change), change, noise, narrow, advance)


def _round(
    model: _Model, change: Array, noise: Array, difference: float, advance: Callable[[float], object] | None
) -> Array:
    """The same around a change that is nearly it."""
    with needing("identify"):
        from scipy.optimize import least_squares

    share, seen = 1.0 / (DRAWS * len(_DIFFERENCES) * EVALUATIONS), 0

    def slopes(change: Array) -> Array:
        nonlocal seen
        if advance is not None:
            advance(share)
        seen += 1
        return model.slopes(change, difference)

    found = least_squares(
        lambda change: model.residuals(change) - noise,
        change,
        jac=slopes,
        x_scale=model.prior,
        max_nfev=EVALUATIONS,
        ftol=_SETTLED,
    )
    if advance is not None:
        advance(share * (EVALUATIONS - seen))
    return model.possible(found.x)


class _Model:
    """The sensor along all runs as a function of changes; its graph is compiled once."""

    def __init__(
        self,
        machine: Machine,
        unit: str,
        runs: Sequence[MeasuredRun],
        free: Sequence[FreeValue],
        around: Array | None = None,
        recursion: Recursion | None = None,
    ) -> None:
        self.machine, self.unit, self.runs, self.free = machine, unit, runs, free
        self._curve = _Curve.of(runs)
        self._driven = len(free) + 2  # changes that the track follows; those after them are of what it is held against
        self._around = np.zeros(self._driven + self._curve.knots) if around is None else around
        self._sensor = self.sensor(self._around)
        # Values are parameters of the equations, which are those of the first description for all that come after it.
        self._recursion = recursion or self._sensor.recursion
        self._follow = np.array([self._elasticity(k) for k in range(len(free))])
        self._inputs = [log_inputs(self._sensor, run.log) for run in runs]
        self._starts = np.array([self._start(run) for run in runs])
        self._largest = max(float(np.nanmax(np.abs(inputs[:, 2]))) for inputs in self._inputs)
        self.prior = np.array([*(one.std for one in free), _GAIN, _BEND, *[self._curve.std] * self._curve.knots])

    def _start(self, run: MeasuredRun) -> list[float]:
        self._sensor.start(run.start)
        return list(self._sensor.state.values())

    def around(self, change: Array) -> _Model:
        """The same with the equations' parameters followed from a change on."""
        return _Model(self.machine, self.unit, self.runs, self.free, change, self._recursion)

    def described(self, change: Array) -> Machine:
        """The description after a change."""
        values = {one.key: one.at(float(c)) for one, c in zip(self.free, change, strict=False)}
        return with_values(self.machine, self.unit, values)

    def possible(self, change: Array) -> Array:
        """A change with values that a description may have: one that goes too far goes as far as it may."""
        found = change.copy()
        for k, one in enumerate(self.free):
            near, far = float(self._around[k]), float(change[k])
            if self._may_be(one, far):
                continue
            for _ in range(_HALVINGS):
                middle = 0.5 * (near + far)
                near, far = (middle, far) if self._may_be(one, middle) else (near, middle)
            found[k] = near
        return found

    def _may_be(self, one: FreeValue, change: float) -> bool:
        try:
            with_values(self.machine, self.unit, {one.key: one.at(change)})
        except DescriptionError:
            return False
        return True

    def sensor(self, change: Array) -> VirtualSensor:
        """The sensor of the description after a change."""
        return balance(build(self.described(change), self.unit))

    def torque(self, change: Array) -> Torque:
        """What the reported torque is after a change."""
        return Torque(float(np.exp(change[len(self.free)])), float(change[len(self.free) + 1]) / self._largest)

    def curve(self, change: Array) -> SensorCurve | None:
        """The curve of the position sensor after a change."""
        return self._curve.after(change[self._driven :])

    def _elasticity(self, k: int) -> Array:
        """How the logarithm of each parameter follows a value's: nearly every one by a power."""
        more = self._around.copy()
        more[k] += _STEP
        try:
            after = self.sensor(more).parameters
        except DescriptionError:  # at the end of its range: the other way
            more[k] -= 2.0 * _STEP
            after = self.sensor(more).parameters
        before = self._sensor.parameters
        ratio = np.divide(after, before, out=np.ones_like(before), where=before != 0.0)
        return np.asarray(np.log(np.where(ratio > 0.0, ratio, 1.0)) / (more[k] - self._around[k]))

    def tracks(self, changes: Array) -> list[tuple[Array, ...]]:
        """What the sensor reports along every run after each of some changes, the runs side by side.

        Returns:
            For each change the position [m] and both pressures [Pa] along each run, shape (samples, 3).
        """
        parameters, inputs = [], []
        for change in changes:
            of_it = self._sensor.parameters * np.exp((change - self._around)[: len(self.free)] @ self._follow)
            parameters += [of_it] * len(self.runs)
            torque = self.torque(change)
            inputs += [np.column_stack([i[:, :2], torque.of(i[:, 2]), i[:, 3:]]) for i in self._inputs]
        states = np.tile(self._starts, (len(changes), 1))
        said = replay_many(self._recursion, inputs, np.array(parameters), states, ("position", *PRESSURES))
        count = len(self.runs)
        return [said[k : k + count] for k in range(0, len(said), count)]

    def errors(self, change: Array) -> list[Array]:
        """Errors of the position along each run [m]."""
        (said,) = self.tracks(change[None, :])
        return [self._error(one, k, change) for k, one in enumerate(said)]

    def _error(self, said: Array, k: int, change: Array) -> Array:
        """Error of the position along the k-th run [m]: where the piston would be read, less what was read."""
        read = said[:, 0] + self._curve.hats[k] @ change[self._driven :]
        return np.asarray(read - self.runs[k].measured["position"].values)

    def residuals(self, change: Array) -> Array:
        """Everything that is to be small, over its standard deviation."""
        return self._residuals(change[None, :])[0]

    def _residuals(self, changes: Array) -> list[Array]:
        """The same after each of some changes."""
        return [
            np.concatenate([change / self.prior, *(self._missed(k, one, change) for k, one in enumerate(said))])
            for change, said in zip(changes, self.tracks(changes), strict=True)
        ]

    def _missed(self, k: int, said: Array, change: Array) -> Array:
        """What is measured of the k-th run and not said, over its standard deviation."""
        run = self.runs[k]
        period = float(np.median(np.diff(run.log["time"].values))) * _EVERY
        error = self._error(said, k, change)[::_EVERY] / _POSITION
        parts = [np.nan_to_num(error) * np.sqrt(period / _POSITION_LASTS)]
        for column, name in enumerate(PRESSURES, 1):
            if name in run.measured:
                off = (said[:, column] - run.measured[name].values)[::_EVERY] / _PRESSURE
                parts.append(_FAR * np.tanh(np.nan_to_num(off) / _FAR) * np.sqrt(period / _PRESSURE_LASTS))
        return np.concatenate(parts)

    def slopes(self, change: Array, difference: float = _DIFFERENCES[-1]) -> Array:
        """Derivatives of the residuals by central differences, shape (residuals, changes)."""
        steps = difference * np.eye(len(change))[: self._driven]
        at_once = max(_ROWS // (2 * sum(map(len, self._inputs))), 1)
        columns: list[Array] = []
        for first in range(0, len(steps), at_once):
            some = steps[first : first + at_once]
            found = self._residuals(np.concatenate([change + some, change - some]))
            columns += [(a - b) / (2.0 * difference) for a, b in zip(found, found[len(some) :], strict=False)]
        return np.column_stack([*columns, *self._bent(change)])

    def _bent(self, change: Array) -> list[Array]:
        """The same with respect to the sensor's curve, on which they depend linearly, and no track does."""
        still = [np.zeros((len(inputs), 1 + len(PRESSURES))) for inputs in self._inputs]
        unbent = [self._missed(run, one, np.zeros(len(change))) for run, one in enumerate(still)]
        columns = []
        for k in range(self._driven, len(change)):
            step = np.zeros(len(change))
            step[k] = 1.0
            bent = [self._missed(run, one, step) for run, one in enumerate(still)]
            columns.append(np.concatenate([step / self.prior, *map(np.subtract, bent, unbent)]))
        return columns


@dataclass(frozen=True)
class _Curve:
    """What a position sensor reads beside its line, as it was measured along runs."""

    known: Array  # the curve's knots [m]; none where the sensor is declared to have no curve
    std: float  # of a knot [m]
    hats: list[Array]  # of each run, shape (samples, knots): how a knot moves the reading from that at the run's start

    @property
    def knots(self) -> int:
        """How many there are."""
        return len(self.known)

    @classmethod
    def of(cls, runs: Sequence[MeasuredRun]) -> _Curve:
        """That of the runs' sensor, as far as they went; a straight line between both ends is displacement."""
        std = max(run.linearity for run in runs)
        read = [run.measured["position"].values for run in runs]
        if not std:
            return cls(np.empty(0), 0.0, [np.zeros((len(one), 0)) for one in read])
        least, most = min(map(np.nanmin, read)), max(map(np.nanmax, read))
        knots = np.linspace(least, most, _KNOTS + 2)
        hats = [_hats(one, knots)[:, 1:-1] for one in read]
        starts = [_hats(np.array([run.start]), knots)[:, 1:-1] for run in runs]
        return cls(knots[1:-1], std, [np.nan_to_num(one - start) for one, start in zip(hats, starts, strict=True)])

    def after(self, change: Array) -> SensorCurve | None:
        """The curve after a change of its knots."""
        if not self.knots:
            return None
        step = self.known[1] - self.known[0]
        at = (self.known[0] - step, *self.known, self.known[-1] + step)
        return SensorCurve(tuple(map(float, at)), (0.0, *map(float, change), 0.0))


def _hats(x: Array, knots: Array) -> Array:
    """Piecewise linear functions that are 1 at a knot and 0 at the others, shape (len(x), len(knots))."""
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(x[:, None] - knots) / (knots[1] - knots[0])))


def _fitted(model: _Model, change: Array, spread: Array) -> FittedValues:
    """What was found, with intervals from its curvature, widened where the residuals are larger than assumed."""
    count = len(model.prior)
    data, jacobian = model.residuals(change)[count:], model.slopes(change)
    worse = max(float(np.sum(data**2)) / max(_independent(model) - count, 1.0), 1.0)
    information = jacobian[count:].T @ jacobian[count:] / max(worse, 1.0) + np.diag(model.prior**-2.0)
    std = np.maximum(np.sqrt(np.diag(np.linalg.inv(information))), spread)
    values = {}
    # An interval ends where a description does: no rod is wider than its bore.
    ends = (model.possible(change - TWO_SIDED_95 * std), model.possible(change + TWO_SIDED_95 * std))
    for one, c, *limits in zip(model.free, change, *ends, strict=False):
        low, high = sorted(one.at(float(limit)) for limit in limits)
        values[one.key] = (one.at(float(c)), low, high)
    identified = frozenset(one.key for one, s in zip(model.free, std, strict=False) if s < 0.5 * one.std)
    errors = zip(model.runs, model.errors(change), strict=True)
    squares = {run.name: np.nanmean(error**2) for run, error in errors}
    return FittedValues(
        machine=model.described(change),
        values=values,
        identified=identified,
        torque=model.torque(change),
        torque_std=float(std[len(model.free)]),
        curve=model.curve(change),
        rms=float(np.sqrt(np.mean(list(squares.values())))),
        rms_of={name: float(np.sqrt(value)) for name, value in squares.items()},
    )


def _independent(model: _Model) -> float:
    """How many independent measurements all runs have."""
    number = 0.0
    for run in model.runs:
        time = run.log["time"].values
        length = float(time[-1] - time[0])
        pressures = sum(name in run.measured for name in PRESSURES)
        number += length / _POSITION_LASTS + pressures * length / _PRESSURE_LASTS
    return number
