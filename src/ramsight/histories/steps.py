"""Steps and odd records of a trend: looked for one after the other, each with its Bayes factor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools
from ramsight.histories.trend import STEP_STD, Series, Trend, trend

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
