"""A log by the traced sensor, in blocks: of each sample what it says, of each block the state that it begins with.

What the hypotheses are in each sample is too much to be kept. The state at the beginning of each block is, and a block
is gone through again where its trace is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.hindsight.innovations import Innovations
from ramsight.hindsight.trace import Tracer

Array = NDArray[np.float64]
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
