r"""A quantity over months: a local linear trend through records of stated deviations, its steps and odd records.

The logarithm y of a factor (an exponent itself) in record k has a level l that moves with a slope b, which changes
slowly. A thermometer that is off by o kelvins adds what the oil's viscosity does to it, with its derivatives x and z. A
scatter s between records is in no record's own deviation:

    y_k = l_k + x_k o + z_k o^2 / 2 + e_k,         e_k ~ N(0, r_k^2 + s^2)
    l_{k+1} = l_k + b_k dt + w,  b_{k+1} = b_k + u,     w ~ N(0, ql dt),  u ~ N(0, qb dt)

s, ql and qb are not known: the model is worked out for each of `KINDS`, and each counts by its likelihood. Where a step
is declared or was found, level and slope get the variance of one. The state has the level at the beginning, too, so
that the change since then has a deviation of its own, in which a thermometer's error is not counted twice.

Forward it is the Kalman filter, backward the smoother with r and N of de Jong and Penzer (1998), Diagnosing shocks in
time series, JASA 93, 796: from one pass they give the Bayes factor of a step at each record.

All arrays are over records first and series last, so that hundreds of series take little longer than one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools

YEAR = 365.25 * 86400.0
"""[s]"""
LEVEL_STD, SLOPE_STD = 1.0, 0.4
"""Prior deviations of a level [1] and a slope [1/year], both of a logarithm: wear of 30 % a year is usual."""
THERMOMETER_STD = 3.0
"""Deviation of a thermometer [K]: most are within 5 K."""
STEP_STD = 0.25
"""Deviation of a step of the level [1], and of the slope after it [1/year]."""
_SCATTER = (0.0, 0.03, 0.08)
_WALKS = ((0.02, 0.02), (0.06, 0.05), (0.06, 0.25))
KINDS = np.array([(s, level, slope) for s in _SCATTER for level, slope in _WALKS])
"""Scatter [1], how much a level walks in a year [1] and how much a slope changes in one [1/year], of each kind."""
_STATES = 4  # level, slope, thermometer, level at the beginning


@dataclass(frozen=True)
class Series:
    """Quantities over records, shape (records, series); NaN where a record says nothing of one."""

    time: Array  # of the records [s since 1970], not decreasing
    value: Array  # logarithm of a factor, or an exponent [1]
    std: Array  # its deviation [1]
    per_kelvin: Array  # by how much it is off where the oil is 1 K warmer than reported [1/K]
    per_kelvin2: Array  # derivative of that [1/K^2]
    jumps: Bools  # whether a step lies between a record and the one before

    @cached_property
    def known(self) -> Bools:
        """Where a record says something."""
        return np.isfinite(self.value) & np.isfinite(self.std) & (self.std > 0.0)


@dataclass(frozen=True)
class Trend:
    """Series by all that their records say; `kinds` come before series."""

    weight: Array  # probability of each kind, shape (kinds, series)
    log_likelihood: Array  # of each kind, shape (kinds, series)
    # mean, covariance: of level, slope, thermometer and first level after the last record, shapes (4, kinds, series)
    # and (4, 4, kinds, series) [1, 1/year, K]
    mean: Array
    covariance: Array
    # level, level_std: of the smoothed level at each record, all kinds together, shape (records, series) [1]
    level: Array
    level_std: Array
    # step_score, step_information: of a step just before each record, shape (records, kinds, series)
    step_score: Array
    step_information: Array
    # blip_score, blip_information: of an error of that record alone, shape (records, kinds, series)
    blip_score: Array
    blip_information: Array


@dataclass
class _Gone:
    """What the filter keeps of each record for the way back."""

    mean: Array
    covariance: Array
    gain: Array
    innovation: Array
    precision: Array


def trend(series: Series) -> Trend:
    """Filter and smooth, linearised at a thermometer that is right, and then at what that gives of it.

    Args:
        series: at least one record.

    Example:
        >>> time = np.arange(20.0)[:, None] * YEAR / 20.0
        >>> zeros = np.zeros((20, 1))
        >>> worn = Series(time, 0.3 * time / YEAR, zeros + 0.01, zeros, zeros, zeros.astype(bool))
        >>> found = trend(worn)
        >>> slope = float((found.weight * found.mean[1]).sum())
        >>> round(slope, 2)  # 1/year
        0.3
    """
    found = _linear(series, np.zeros(series.value.shape[1]))
    is_curved = np.where(series.known, series.per_kelvin2, 0.0).any()
    return _linear(series, (found.weight * found.mean[2]).sum(axis=0)) if is_curved else found


def _linear(series: Series, at: Array) -> Trend:
    """The same, linearised at an error of the thermometer [K], shape (series,).

    With y = l + x o + z o^2 / 2 and o near a it is y + z a^2 / 2 = l + (x + z a) o.
    """
    scatter, walk_level, walk_slope = (KINDS[:, k, None] for k in range(3))
    records, count = series.value.shape
    shape = (len(KINDS), count)
    steps = np.diff(series.time, axis=0, prepend=series.time[:1]) / YEAR
    known = series.known
    noise = np.where(known, series.std, 1.0) ** 2
    value = np.where(known, series.value + 0.5 * series.per_kelvin2 * at**2, 0.0)
    warm = np.where(known, series.per_kelvin + series.per_kelvin2 * at, 0.0)
    mean, covariance = _prior(shape)
    sizes: tuple[tuple[int, ...], ...] = ((_STATES,), (_STATES, _STATES), (_STATES,), (), ())
    gone = _Gone(*(np.empty((records, *size, *shape)) for size in sizes))
    likelihood = np.zeros(shape)
    for k in range(records):
        dt, jump = steps[k], np.where(series.jumps[k], STEP_STD**2, 0.0)
        _move(mean, covariance, dt)
        covariance[0, 0] += walk_level**2 * dt + walk_slope**2 * dt**3 / 3.0 + jump
        covariance[0, 1] += walk_slope**2 * dt**2 / 2.0
        covariance[1, 0] = covariance[0, 1]
        covariance[1, 1] += walk_slope**2 * dt + jump
        gone.mean[k], gone.covariance[k] = mean, covariance
        seen = covariance[:, 0] + warm[k] * covariance[:, 2]
        precision = known[k] / (seen[0] + warm[k] * seen[2] + noise[k] + scatter**2)
        innovation = value[k] - mean[0] - warm[k] * mean[2]
        gain = seen * precision
        mean += gain * innovation
        covariance -= gain[:, None] * seen[None]
        gone.gain[k], gone.innovation[k], gone.precision[k] = gain, innovation * precision, precision
        likelihood += 0.5 * (np.log(np.where(known[k], precision, 1.0)) - innovation**2 * precision)
    weight = np.exp(likelihood - likelihood.max(axis=0))
    return _smoothed(gone, (mean, covariance), weight / weight.sum(axis=0), likelihood, steps, warm)


def _prior(shape: tuple[int, int]) -> tuple[Array, Array]:
    """Before the first record; the level at the beginning is the level."""
    mean, covariance = np.zeros((_STATES, *shape)), np.zeros((_STATES, _STATES, *shape))
    for one, std in enumerate((LEVEL_STD, SLOPE_STD, THERMOMETER_STD, LEVEL_STD)):
        covariance[one, one] = std**2
    covariance[0, 3] = covariance[3, 0] = LEVEL_STD**2
    return mean, covariance


def _move(mean: Array, covariance: Array, dt: Array) -> None:
    """The level moves with the slope."""
    mean[0] += dt * mean[1]
    covariance[0] += dt * covariance[1]
    covariance[:, 0] += dt * covariance[:, 1]


def _smoothed(
    gone: _Gone, last: tuple[Array, Array], weight: Array, likelihood: Array, steps: Array, warmth: Array
) -> Trend:
    """Backward from the last record."""
    records, shape = len(gone.mean), weight.shape
    score, information = np.zeros((_STATES, *shape)), np.zeros((_STATES, _STATES, *shape))
    level, level_std = np.empty((records, shape[1])), np.empty((records, shape[1]))
    of_step, of_blip = ([np.empty((records, *shape)) for _ in range(2)] for _ in range(2))
    for k in reversed(range(records)):
        gain, precision, warm = gone.gain[k], gone.precision[k], warmth[k]
        turned = (information * gain[None]).sum(axis=1)
        through = (gain * turned).sum(axis=0)
        of_blip[0][k] = gone.innovation[k] - (gain * score).sum(axis=0)
        of_blip[1][k] = precision + through
        _seen(score, of_blip[0][k], warm)
        for place, by in ((0, 1.0), (2, warm)):
            information[place] -= by * turned
            information[:, place] -= by * turned
        corner = of_blip[1][k]
        information[0, 0] += corner
        information[0, 2] += warm * corner
        information[2, 0] += warm * corner
        information[2, 2] += warm**2 * corner
        of_step[0][k], of_step[1][k] = score[0], information[0, 0]
        row = gone.covariance[k][0]
        here = gone.mean[k][0] + (row * score).sum(axis=0)
        spread = gone.covariance[k][0, 0] - (row[:, None] * information * row[None]).sum(axis=(0, 1))
        level[k] = (weight * here).sum(axis=0)
        level_std[k] = np.sqrt((weight * (np.maximum(spread, 0.0) + (here - level[k]) ** 2)).sum(axis=0))
        score[1] += steps[k] * score[0]
        information[1] += steps[k] * information[0]
        information[:, 1] += steps[k] * information[:, 0]
    return Trend(weight, likelihood, *last, level, level_std, *of_step, *of_blip)


def _seen(score: Array, by: Array, warm: Array) -> None:
    """A record's part of the score, along what it has seen."""
    score[0] += by
    score[2] += warm * by


SURE = 10.0
"""Bayes factor from which a step, or an error of a single record, is taken for one."""
MOST = 8
"""Steps and odd records that are looked for in a series."""
BLIP_STD = 0.5
"""Deviation of the error of an odd record [1]."""


@dataclass(frozen=True)
class Step:
    """A step of a series."""

    record: int  # first one after it
    factor: float  # Bayes factor of a step somewhere in the series over none; of a step here, if it was declared
    is_declared: bool = False  # whether somebody did something to the machine there


@dataclass(frozen=True)
class Explained:
    """Series with their steps."""

    series: Series  # without odd records, with steps
    trend: Trend  # of these
    steps: tuple[tuple[Step, ...], ...]  # of each series, by their places
    odd: tuple[tuple[int, ...], ...]  # records that are none of the trend's, of each series


def explained(series: Series) -> Explained:
    """Trend of series, with the steps that were found in them beside those that are declared.

    Args:
        series: `jumps` are the declared steps.

    Example:
        >>> time = np.arange(40.0)[:, None] * 86400.0
        >>> value = np.where(np.arange(40)[:, None] < 25, 0.0, 0.2)
        >>> found = explained(Series(time, value, value * 0.0 + 0.02, value * 0.0, value * 0.0, value < -1.0))
        >>> [(one.record, one.factor > SURE) for one in found.steps[0]]
        [(25, True)]
    """
    count = series.value.shape[1]
    declared = [[Step(int(k), np.inf, is_declared=True) for k in np.flatnonzero(column)] for column in series.jumps.T]
    steps, odd = declared, [[] for _ in range(count)]  # type: ignore[var-annotated]
    found, open_ones = trend(series), np.arange(count)
    series = replace(series, value=series.value.copy(), jumps=series.jumps.copy())
    whole = found
    for _ in range(MOST):
        here = _chosen(series, open_ones)
        is_step, place, factor = likeliest(found, here.known, here.jumps)
        more = factor > SURE
        if not more.any():
            break
        for column in np.flatnonzero(more):
            which = open_ones[column]
            if is_step[column]:
                series.jumps[place[column], which] = True
                steps[which].append(Step(int(place[column]), float(factor[column])))
            else:
                series.value[place[column], which] = np.nan
                odd[which].append(int(place[column]))
        open_ones = open_ones[more]
        series = replace(series)  # what is known of it has changed
        found = trend(_chosen(series, open_ones))
        whole = _put(whole, found, open_ones)
    ordered = tuple(tuple(sorted(one, key=lambda step: step.record)) for one in steps)
    return Explained(series, whole, ordered, tuple(tuple(sorted(one)) for one in odd))


def likeliest(found: Trend, known: Bools, jumps: Bools) -> tuple[Bools, Array, Array]:
    """Of each series: whether it is a step (or an odd record), where, and its Bayes factor over neither.

    The factor is the mean over all places: nobody knows before where a step is. The last record alone cannot tell a
    step from an odd record; then it is the record.
    """
    records = np.arange(len(known))[:, None]
    first = np.where(known.any(axis=0), known.argmax(axis=0), len(known))
    step = _factors(found.step_score, found.step_information, STEP_STD, found.weight)
    last = len(known) - 1 - known[::-1].argmax(axis=0)
    step = np.where(known & ~jumps & (records > first) & (records < last), step, 0.0)
    blip = np.where(known, _factors(found.blip_score, found.blip_information, BLIP_STD, found.weight), 0.0)
    size = np.maximum(known.sum(axis=0), 1)
    is_step = step.max(axis=0) > blip.max(axis=0)
    place = np.where(is_step, step.argmax(axis=0), blip.argmax(axis=0))
    return is_step, place, np.where(is_step, step.sum(axis=0), blip.sum(axis=0)) / size


def _factors(score: Array, information: Array, std: float, weight: Array) -> Array:
    """Bayes factor of a disturbance with a normal prior at each record, shape (records, series).

    With r its score and N its information it is exp(r^2 V / (2 (1 + V N))) / sqrt(1 + V N).
    """
    wider = 1.0 + std**2 * np.maximum(information, 0.0)
    power = 0.5 * score**2 * std**2 / wider - 0.5 * np.log(wider)
    return np.asarray((weight * np.exp(np.minimum(power, 300.0))).sum(axis=1))


def _chosen(series: Series, which: NDArray[np.intp]) -> Series:
    """The series with these places, with their steps."""
    value, std = series.value[:, which], series.std[:, which]
    first, second = series.per_kelvin[:, which], series.per_kelvin2[:, which]
    return Series(series.time[:, which], value, std, first, second, series.jumps[:, which])


def _put(whole: Trend, part: Trend, which: NDArray[np.intp]) -> Trend:
    """The trends of some series in their places among all."""
    columns = {}
    for name, one in vars(whole).items():
        columns[name] = one.copy()
        columns[name][..., which] = getattr(part, name)
    return Trend(**columns)
