"""Many runs of one model at once, of which only summaries are kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.engine.equation import OdeModel
from ramsight.engine.ode_module import compile_lanes
from ramsight.engine.run import DEFAULT_MAX_STEPS, DEFAULT_RTOL, Outcome, Segments
from ramsight.system import processors

_CHUNK = 1024  # runs that are held in memory at once, for all threads together


@dataclass(frozen=True)
class Job:
    """One run of a batch."""

    initial: Array  # states at the start, shape (states,)
    segments: Segments


@dataclass(frozen=True)
class Summaries:
    """What is kept of a number of runs, in their order."""

    # final, least, most: last, smallest and largest value of every state, shape (runs, states)
    final: Array
    least: Array
    most: Array
    outcome: list[Outcome]  # how each ended
    time: Array  # when each ended [s], shape (runs,)
    # accepted, rejected: steps of each, shape (runs,)
    accepted: NDArray[np.int64]
    rejected: NDArray[np.int64]


def batches(
    model: OdeModel,
    jobs: Iterable[Job],
    *,
    rtol: float = DEFAULT_RTOL,
    max_steps: int = DEFAULT_MAX_STEPS,
    threads: int | None = None,
    advance: Callable[[int], object] | None = None,
) -> Iterator[Summaries]:
    """Run jobs on all cores, several side by side on each, and hand out summaries about a thousand at a time.

    However many jobs there are, only some thousand are in memory.
    """
    loop = compile_lanes(model).integrate_lanes
    threads = threads or processors()
    atol = np.array([np.inf if s.integral else s.tolerance for s in model.states])
    supply = iter(jobs)
    with ThreadPoolExecutor(threads) as pool:
        while chunk := list(islice(supply, _CHUNK)):
            share = -(-len(chunk) // threads)
            parts = [chunk[k : k + share] for k in range(0, len(chunk), share)]
            done = list(pool.map(lambda part: _run(loop, part, rtol, atol, max_steps), parts))
            yield _summaries(*(np.concatenate(pieces) for pieces in zip(*done, strict=True)))
            if advance is not None:
                advance(len(chunk))


@dataclass(frozen=True)
class Sampled:
    """Runs of a batch with their states over time, in the order of the jobs."""

    time: list[Array]  # of the samples of each run [s], one array a run
    state: list[Array]  # states at those times, shape (samples, states), one array a run
    # how each ended, and its extremes; of a run that did not reach its end only what came before counts
    summaries: Summaries

    @property
    def outcome(self) -> list[Outcome]:
        """How each ended."""
        return self.summaries.outcome

    @property
    def ended(self) -> Array:
        """When each ended [s], shape (runs,)."""
        return self.summaries.time


def sampled(
    model: OdeModel, jobs: Sequence[Job], period: float, *, rtol: float = DEFAULT_RTOL, tolerance_scale: float = 1.0
) -> Sampled:
    """Run jobs on one core, several side by side, and keep their states at equal distances of time.

    All samples are in memory. What a run gives does not depend on the runs beside it.

    Args:
        period: distance of the samples [s].
        rtol: relative tolerance; the absolute ones are the states' own times `tolerance_scale`.
        tolerance_scale: factor on the states' absolute tolerances.
    """
    loop = compile_lanes(model).integrate_lanes
    atol = np.array([np.inf if s.integral else s.tolerance * tolerance_scale for s in model.states])
    spans = [float(job.segments.end[-1] - job.segments.start[0]) for job in jobs]
    counts = [int(np.floor(span / period + 1e-9)) + 1 for span in spans]
    first = np.concatenate([[0], np.cumsum(counts)])
    samples = np.empty((int(first[-1]), len(model.states)))
    ended = _run(loop, jobs, rtol, atol, DEFAULT_MAX_STEPS, period, first, samples)
    return Sampled(
        time=[job.segments.start[0] + period * np.arange(n) for job, n in zip(jobs, counts, strict=True)],
        state=[samples[first[k] : first[k + 1]] for k in range(len(jobs))],
        summaries=_summaries(*ended),
    )


_OUTCOMES = (Outcome.DONE, Outcome.TOO_MANY_STEPS, Outcome.STEP_TOO_SMALL)


def _summaries(final: Array, least: Array, most: Array, ended: Array) -> Summaries:
    """What `_run` returns, by name."""
    return Summaries(
        final=final,
        least=least,
        most=most,
        outcome=[_OUTCOMES[int(code)] for code in ended[:, 0]],
        time=ended[:, 3],
        accepted=ended[:, 1].astype(np.int64),
        rejected=ended[:, 2].astype(np.int64),
    )


def _run(
    loop: Callable[..., None],
    jobs: Sequence[Job],
    rtol: float,
    atol: Array,
    max_steps: int,
    period: float = np.inf,
    sample_of: NDArray[np.int64] | None = None,
    samples: Array | None = None,
) -> tuple[Array, Array, Array, Array]:
    segments = [job.segments for job in jobs]
    counts = [len(s.start) for s in segments]
    first = np.concatenate([[0], np.cumsum(counts)])
    one_each = all(len(s.parameters) == 1 for s in segments)
    parameters = [
        s.parameters if one_each else np.broadcast_to(s.parameters, (n, s.parameters.shape[1]))
        for s, n in zip(segments, counts, strict=True)
    ]
    corners = np.concatenate([np.column_stack([s.start, s.end]) for s in segments])
    values, slopes = np.concatenate([s.value for s in segments]), np.concatenate([s.slope for s in segments])
    states = np.array([job.initial for job in jobs], dtype=np.float64)
    least, most, ended = np.empty_like(states), np.empty_like(states), np.zeros((len(jobs), 4))
    rows = np.zeros(len(jobs) + 1, np.int64) if sample_of is None else sample_of
    loop(
        corners, values, slopes, np.ascontiguousarray(np.concatenate(parameters)), first, rtol, atol,
        float(max_steps), states, least, most, ended, period, rows,
        np.empty((0, states.shape[1])) if samples is None else samples,
    )  # fmt: skip
    return states, least, most, ended
