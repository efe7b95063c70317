"""The Rauch-Tung-Striebel smoother of the hypotheses: each filter backward over its own stored predictions.

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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.hindsight.trace import Trace

Array = NDArray[np.float64]
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
