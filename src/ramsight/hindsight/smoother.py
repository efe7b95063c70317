"""The Rauch-Tung-Striebel smoother of the hypotheses: each filter backward over its own stored predictions.

Forward the traced sensor goes through a log in blocks. What the hypotheses are in each sample is too much to be kept.
The state at the beginning of each block is, and a block is gone through again where its trace is needed.

Between two measurements nothing is learned, and the gains of single samples are one. With i before the measurement at j

    C = P_i (F_i+1 ... F_j)',   x_s,i = x_i + C (P_j-)^-1 (x_s,j - x_j-)
                                P_s,i = P_i + C (P_j-)^-1 (P_s,j - P_j-) (P_j-)^-1 C'

A hypothesis is followed back through its births: what it continues is the hypothesis that it came from. Where its
position was another one until then, the position has the variance of the whole stroke more in between, so that nothing
of it is carried back.

Source: Rauch, Tung and Striebel (1965), Maximum likelihood estimates of linear dynamic systems, AIAA Journal 3, 1445;
Särkkä and Svensson (2023), Bayesian Filtering and Smoothing, section 12.2.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.hindsight.innovations import Innovations
from ramsight.hindsight.trace import Trace, Tracer

Advance = Callable[[float], object]
BLOCK = 4096
"""Samples between two states that are kept: some 30 MB of a trace."""


@dataclass(frozen=True)
class Forward:
    """What is kept of a log that the sensor has gone through."""

    tracer: Tracer  # the sensor
    inputs: Array  # of the log, shape (samples, inputs)
    states: list[Array]  # at the beginning of each block, and after the last one
    said: dict[str, Array]  # what the sensor said, by its names
    log_weight: Array  # of the hypotheses after the last sample
    innovations: Innovations  # the measurements of the place
    by_start: int  # how many samples there are until a place is measured, if a start was entered; else 0

    def blocks(self) -> list[slice]:
        """The samples of each block, in order."""
        return list(_blocks(len(self.inputs)))

    def rows(self, number: int, beyond: int = 0) -> Array:
        """A block again: what the sensor says and the trace (`Tracer.rows`)."""
        span = self.blocks()[number]
        return self.tracer.rows(self.inputs[span.start : span.stop + beyond], self.states[number].copy())

    def row(self, sample: int) -> Array:
        """The same of one sample."""
        number, place = divmod(sample, BLOCK)
        found: Array = self.rows(number)[place]
        return found


def gone_through(
    tracer: Tracer, inputs: Array, time: Array, begun: Array, names: Collection[str], advance: Advance
) -> Forward:
    """A log by the sensor.

    Args:
        inputs: of the log, shape (samples, inputs).
        time: of its samples [s].
    """
    states, innovations, log_weight, by_start = [begun.copy()], Innovations(), np.empty(0), 0
    said = {name: np.empty(len(inputs)) for name in names}
    for span in _blocks(len(inputs)):
        state = states[-1].copy()
        rows = tracer.rows(inputs[span], state)
        for name, column in said.items():
            column[span] = rows[:, tracer.names.index(name)]
        aside = tracer.aside(rows)
        innovations.append(span.start, time[span], aside)
        by_start += int((aside["by_start"] > 0.0).sum())
        states.append(state)
        log_weight = tracer.log_weight(rows)[-1].copy()
        advance(len(rows) / len(inputs))
    return Forward(tracer, inputs, states, said, log_weight, innovations, by_start)


def _blocks(samples: int) -> Iterator[slice]:
    """The samples in order."""
    return (slice(first, min(first + BLOCK, samples)) for first in range(0, samples, BLOCK))


def silent(share: float) -> None:
    """No one asks how much is done."""


_LEAST = 1e-12  # of a variance over itself: a matrix of what is known exactly has an inverse


@dataclass(frozen=True)
class Ahead:
    """What is known, by the whole log, after a sample."""

    mean: Array  # of each hypothesis at the log's end, shape (hypotheses, quantities)
    covariance: Array  # of these, shape (hypotheses, quantities, quantities)
    place: NDArray[np.int64]  # the filter of that sample that each of them comes from, shape (hypotheses,)

    @classmethod
    def end(cls, trace: Trace) -> Ahead:
        """After the last sample of a log: the filters themselves."""
        return cls(trace.mean[-1], trace.covariance[-1], np.arange(trace.mean.shape[1]))


@dataclass(frozen=True)
class Smoothed:
    """The hypotheses at the log's end, looked back at."""

    mean: Array  # shape (samples, hypotheses, quantities)
    variance: Array  # of these, of the same shape

    def followed(self, trace: Trace) -> Smoothed:
        """With the log's last sample after these: there the filters are all that is known."""
        last = np.diagonal(trace.covariance[-1:], axis1=2, axis2=3)
        return Smoothed(np.concatenate([self.mean, trace.mean[-1:]]), np.concatenate([self.variance, last]))


def backward(trace: Trace, ahead: Ahead, stroke: float) -> tuple[Smoothed, Ahead]:
    """The hypotheses in all samples of a trace but the last one, of which it is known.

    Args:
        stroke: of the cylinder [m].

    Returns:
        Of the samples before the last one, and what is known of the first of them.
    """
    n, k, size = trace.mean.shape
    mean, variance = np.empty((n - 1, k, size)), np.empty((n - 1, k, size))
    way = np.cumsum(trace.travel_by, axis=0)
    knots = np.flatnonzero(trace.updates)
    ends = [0, *knots[(knots > 0) & (knots < n - 1)].tolist(), n - 1]
    for first, last in zip(ends[-2::-1], ends[:0:-1], strict=True):
        span = slice(first, last)
        place = trace.parent[last, ahead.place]
        by_state, by_covariance = _pulls(trace, last, place, ahead, stroke)
        covariance = trace.covariance[span][:, place]
        cross = covariance.copy()
        cross[..., 0] += np.einsum("shij,sj->shi", covariance, way[last] - way[span])
        mean[span] = trace.mean[span][:, place] + np.einsum("shij,hj->shi", cross, by_state)
        pulled = np.matmul(cross, by_covariance)
        variance[span] = np.diagonal(covariance, axis1=2, axis2=3) + (pulled * cross).sum(axis=-1)
        ahead = Ahead(mean[first], covariance[0] + pulled[0] @ np.swapaxes(cross[0], -1, -2), place)
    return Smoothed(mean, np.maximum(variance, 0.0)), ahead


def _pulls(trace: Trace, at: int, place: NDArray[np.int64], ahead: Ahead, stroke: float) -> tuple[Array, Array]:
    """(P-)^-1 (x_s - x-), and (P-)^-1 (P_s - P-) (P-)^-1, of each hypothesis at a sample."""
    before = trace.covariance_before[at, place].copy()
    before[:, 0, 0] += np.where(trace.independent[at, ahead.place], stroke**2, 0.0)
    after = ahead.covariance
    own = np.diagonal(before, axis1=1, axis2=2)
    scale = np.where(own > 0.0, 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0)), 0.0)
    both = scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.inv(before * both + _LEAST * np.eye(before.shape[-1])) * both
    off = ahead.mean - trace.mean_before[at, place]
    by_state = (inverse @ off[..., None])[..., 0]
    return by_state, inverse @ (after - before) @ inverse
