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
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.hindsight.innovations import Innovations
from ramsight.hindsight.trace import Trace, Tracer

Advance = Callable[[float], object]
BLOCK = 1024
"""Samples between two states that are kept: some 5 MB of a trace."""
KEPT = 32
"""Blocks of a log that is short enough for all of its trace to be kept: some ten minutes at 50 Hz."""
CLOSE = 0.1
"""Standard deviations within which what is known is the same [1]."""


@dataclass(frozen=True)
class Forward:
    """What is kept of a log that the sensor has gone through."""

    tracer: Tracer  # the sensor
    inputs: Array  # of the log, shape (samples, inputs)
    time: Array  # of its samples [s]
    states: list[Array]  # at the beginning of each block, and after the last one
    said: dict[str, Array]  # what the sensor said, by its names
    log_weight: Array  # of the hypotheses after the last sample
    innovations: Innovations  # the measurements of the place
    _rows: dict[int, Array]  # of the blocks of a short log, by their number

    @classmethod
    def through(
        cls, tracer: Tracer, inputs: Array, time: Array, begun: Array, names: Collection[str], advance: Advance
    ) -> Forward:
        """A log by the sensor.

        Args:
            inputs: of the log, shape (samples, inputs).
            time: of its samples [s].
            begun: state of the sensor before it.
            names: what is kept of what the sensor says.
        """
        said = {name: np.empty(len(inputs)) for name in names}
        found = cls(tracer, inputs, time, [], said, np.empty(tracer.layout.hypotheses), Innovations(), {})
        found.again(begun, advance)
        return found

    def again(self, begun: Array, advance: Advance) -> int:
        """Go through the log from another state, until nothing is otherwise than it was the last time.

        Returns:
            How many blocks that took.
        """
        last, innovations = self.states.copy(), Innovations()
        self.states[:] = [begun.copy()]
        for number in range(self.blocks):
            span, state = self.span(number), self.states[-1].copy()
            rows = self.tracer.rows(self.inputs[span], state)
            for name, column in self.said.items():
                column[span] = rows[:, self.tracer.names.index(name)]
            innovations.append(span.start, self.time[span], self.tracer.aside(rows))
            self.states.append(state)
            if self.blocks <= KEPT:
                self._rows[number] = rows
            advance(len(rows) / len(self.inputs))
            if last and self.tracer.alike(state, last[number + 1], CLOSE):
                self.states[number + 1 :] = last[number + 1 :]
                innovations.all += [one for one in self.innovations.all if one.sample >= span.stop]
                break
        else:
            self.log_weight[:] = self.tracer.log_weight(rows)[-1]
        self.innovations.all[:], self.innovations.by_start = innovations.all, innovations.by_start
        return number + 1

    @property
    def blocks(self) -> int:
        """How many there are."""
        return -(-len(self.inputs) // BLOCK)

    def span(self, number: int) -> slice:
        """The samples of a block."""
        return slice(number * BLOCK, min((number + 1) * BLOCK, len(self.inputs)))

    def rows(self, number: int, beyond: int = 0) -> Array:
        """A block again: what the sensor says and the trace (`Tracer.rows`)."""
        kept = [self._rows[k][: None if k == number else beyond] for k in (number, number + 1) if k in self._rows]
        if kept:
            return np.concatenate(kept)
        span = self.span(number)
        return self.tracer.rows(self.inputs[span.start : span.stop + beyond], self.states[number].copy())

    def rows_backward(self, blocks: int) -> Iterator[tuple[int, Array]]:
        """The first blocks again with the sample after each, from the last one on; another thread is a block ahead."""
        numbers = range(blocks - 1, -1, -1)
        with ThreadPoolExecutor(1) as ahead:
            following = ahead.submit(self.rows, numbers[0], 1)
            for number in numbers:
                rows = following.result()
                if number > 0:
                    following = ahead.submit(self.rows, number - 1, 1)
                yield number, rows

    def row(self, sample: int) -> Array:
        """The same of one sample."""
        number, place = divmod(sample, BLOCK)
        found: Array = self.rows(number)[place]
        return found


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
        all_of_them = np.arange(trace.mean.shape[1])
        return cls(trace.mean[-1], trace.after(-1, all_of_them), all_of_them)


@dataclass(frozen=True)
class Sought:
    """What is looked back at: a quantity of a hypothesis at the log's end each."""

    hypothesis: NDArray[np.int64]
    quantity: NDArray[np.int64]  # its place

    def last(self, trace: Trace) -> tuple[Array, Array]:
        """Mean and variance of each after the last sample of a log: there the filters are all that is known."""
        rows = trace.rows(slice(-1, None), self.hypothesis, self.quantity)[0]
        return trace.mean[-1, self.hypothesis, self.quantity], np.take_along_axis(rows, self.quantity[:, None], 1)[:, 0]


def backward(trace: Trace, ahead: Ahead, stroke: float, sought: Sought) -> tuple[Array, Array, Ahead]:
    """What is sought in all samples of a trace but the last one, of which it is known.

    Args:
        stroke: of the cylinder [m].

    Returns:
        Means and variances, shape (samples, sought), and what is known of the first sample.
    """
    n, of, by = len(trace.mean), sought.hypothesis, sought.quantity
    mean, variance = np.empty((n - 1, len(of))), np.empty((n - 1, len(of)))
    way = np.cumsum(trace.travel_by, axis=0)
    knots = np.flatnonzero(trace.updates)
    ends = [0, *knots[(knots > 0) & (knots < n - 1)].tolist(), n - 1]
    for first, last in zip(ends[-2::-1], ends[:0:-1], strict=True):
        span = slice(first, last)
        place = trace.parent[last, ahead.place]
        by_state, by_covariance = _pulls(trace, last, place, ahead, stroke)
        cross = trace.rows(span, place[of], by)
        own = np.take_along_axis(cross, by[None, :, None], axis=2)[..., 0]
        cross[..., 0] += np.einsum("sej,sj->se", cross, way[last] - way[span])
        mean[span] = trace.mean[span][:, place[of], by] + np.einsum("sej,ej->se", cross, by_state[of])
        pulled = np.matmul(cross.swapaxes(0, 1), by_covariance[of])
        variance[span] = own + np.einsum("esj,sej->se", pulled, cross)
        covariance = trace.after(first, place)
        cross = covariance.copy()
        cross[..., 0] += covariance @ (way[last] - way[first])
        ahead = Ahead(
            trace.mean[first, place] + (cross @ by_state[..., None])[..., 0],
            covariance + cross @ by_covariance @ cross.swapaxes(-1, -2),
            place,
        )
    return mean, np.maximum(variance, 0.0), ahead


def _pulls(trace: Trace, at: int, place: NDArray[np.int64], ahead: Ahead, stroke: float) -> tuple[Array, Array]:
    """(P-)^-1 (x_s - x-), and (P-)^-1 (P_s - P-) (P-)^-1, of each hypothesis at a sample."""
    before = trace.before(at, place)
    before[:, 0, 0] += np.where(trace.independent[at, ahead.place], stroke**2, 0.0)
    after = ahead.covariance
    own = np.diagonal(before, axis1=1, axis2=2)
    scale = np.where(own > 0.0, 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0)), 0.0)
    both = scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.inv(before * both + _LEAST * np.eye(before.shape[-1])) * both
    off = ahead.mean - trace.mean_before[at, place]
    by_state = (inverse @ off[..., None])[..., 0]
    return by_state, inverse @ (after - before) @ inverse
