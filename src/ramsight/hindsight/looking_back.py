"""A recorded log, looked back at: forward by the sensor, then backward by the smoother, in blocks.

The circuit's equations are linearised at the position of the filter, which begins in the middle of the stroke where no
start is known. Where the smoothed start is elsewhere, the log is gone through again from there, with as little known of
it as before: a linearisation point is no evidence.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ramsight.arrays import Array
from ramsight.hindsight.innovations import NIS
from ramsight.hindsight.positions import ASIDE_SAID, Positions, said_of
from ramsight.hindsight.smoother import CLOSE, Advance, Ahead, Forward, Sought, backward, silent
from ramsight.hindsight.trace import Tracer, probabilities
from ramsight.sensor.quantity import FACTOR_OF, Quantity
from ramsight.sensor.virtual_sensor import IS_REFERENCED, LIVE, OF_POSITION, POSITION, STATUS, log_inputs, said_signals
from ramsight.signals import Signal, Signals

PASSES = 3
"""How often a log is gone through at most until the smoothed start is where it was linearised."""
JUDGED = (*sorted(OF_POSITION), STATUS)
"""What is said otherwise in hindsight, and as the live sensor said it."""


@dataclass(frozen=True)
class LookedBack:
    """A log by all that it says."""

    track: Signals  # as the sensor's, with `nis`, and with what the live sensor said of the position
    state: Mapping[str, float]  # of the sensor after the log, by name
    passes: int  # how often the log was gone through
    text: str  # how well the log fits the machine, in a line; empty where nothing was measured

    @property
    def further(self) -> tuple[str, ...]:
        """Names of what a live sensor does not say."""
        return (*(f"{LIVE}{name}" for name in JUDGED), NIS)

    def recalled(self) -> Recalled:
        """For what takes a sensor that follows the log piece by piece."""
        return Recalled(self)


def ways_of(state: Mapping[str, float]) -> int:
    """How often `looked_back` goes through a log at most, forward or backward.

    Args:
        state: of the sensor before it, by name.
    """
    return 2 if state[IS_REFERENCED] > 0.0 else 2 * PASSES


@dataclass(frozen=True)
class _Known:
    """What is known by the whole log, block after block from the last one."""

    gone: Forward  # the log by the sensor
    sought: Sought  # the position under each hypothesis, then factors of the likeliest
    factors: tuple[str, ...]  # their names
    # mean, variance: of what is sought, shape (samples, sought)
    mean: Array
    variance: Array
    aside: Mapping[str, Array]  # what is traced beside it
    ahead: dict[int, Ahead]  # what is known of the first sample of each block, by its number

    @classmethod
    def of(cls, gone: Forward, names: set[str]) -> _Known:
        """With nothing known yet.

        Args:
            names: of the sensor's outputs, of which the factors are looked back at.
        """
        known, hypotheses, samples = gone.tracer.layout.quantities, gone.tracer.layout.hypotheses, len(gone.inputs)
        # Where the oil in the gaps is warmer the sensor says what leaks by another law.
        learned = {} if Quantity.WARMER in known else FACTOR_OF
        factors = {
            name: known.index(one)
            for name, one in learned.items()
            if one in known and not names.isdisjoint((f"{name}_factor", f"{name}_factor_std"))
        }
        likeliest = int(np.argmax(gone.log_weight))
        of = np.array([*range(hypotheses), *[likeliest] * len(factors)])
        by = np.array([*[0] * hypotheses, *factors.values()])
        shape = samples, len(of)
        aside = {name: np.empty(samples) for name in ASIDE_SAID}
        return cls(gone, Sought(of, by), tuple(factors), np.empty(shape), np.empty(shape), aside, {})

    def look(self, blocks: int, advance: Advance) -> None:
        """Look back at the first blocks, from what is known of the next one."""
        gone, tracer = self.gone, self.gone.tracer
        unknown = gone.innovations.unknown(gone.said[POSITION])
        for number, rows in gone.rows_backward(blocks):
            span = gone.span(number)
            trace = tracer.trace(rows, unknown[span.start : span.stop + 1])
            ahead, last = self.ahead.get(number + 1) or Ahead.end(trace), span.start + len(trace.mean) - 1
            *found, self.ahead[number] = backward(trace, ahead, float(tracer.unit.cylinder.stroke), self.sought)
            self.mean[span.start : last], self.variance[span.start : last] = found
            if last < span.stop:
                self.mean[last], self.variance[last] = self.sought.last(trace)
            for name, one in self.aside.items():
                one[span] = trace.aside[name][: span.stop - span.start]
            advance((span.stop - span.start) / len(gone.inputs))

    @property
    def positions(self) -> Positions:
        """Of the piston."""
        gone, k = self.gone, len(self.gone.log_weight)
        stroke = float(gone.tracer.unit.cylinder.stroke)
        return Positions(self.mean[:, :k], self.variance[:, :k], gone.log_weight, stroke)

    def said(self) -> dict[str, Array]:
        """What is said in hindsight, by the names of the sensor's outputs."""
        gone, k = self.gone, len(self.gone.log_weight)
        # What passed a relief valve has shown at the next measurement of the place.
        last = max((one.sample for one in gone.innovations.measured if one.accepted), default=0)
        status = np.concatenate([self.aside["beneath"][:last], self.aside["status"][last:]])
        found = said_of(self.positions, {**self.aside, "status": status}, gone.tracer.unit)
        for place, name in enumerate(self.factors, start=k):
            found[f"{name}_factor"], found[f"{name}_factor_std"] = self.mean[:, place], np.sqrt(self.variance[:, place])
        for kind, chance in zip(gone.tracer.kinds, probabilities(gone.log_weight), strict=True):
            found[f"{kind.text}_probability"] = np.full(len(self.mean), chance)
        return found


def looked_back(
    tracer: Tracer,
    pieces: Sequence[Signals],
    state: Mapping[str, float],
    *,
    names: Collection[str] | None = None,
    advance: Advance | None = None,
) -> LookedBack:
    """Where the piston was, by all that a log says.

    Args:
        pieces: of the log, one at least, in order.
        state: of the sensor before it, by name.
        names: of the sensor's outputs that are kept beside those of the position; None for all.
    """
    advance = advance or silent
    order = tracer.sensor.recursion.state
    position, is_known = order.index(POSITION), state[IS_REFERENCED] > 0.0
    inputs = np.concatenate([log_inputs(tracer.sensor, piece) for piece in pieces])
    time = np.concatenate([piece["time"].values for piece in pieces])
    clock = Signal(time, pieces[0]["time"].attrs)
    wanted = [one for one in tracer.names if names is None or one in names or one in JUDGED]
    begun = np.array([state[name] for name in order], dtype=np.float64)
    gone = Forward.through(tracer, inputs, time, begun, wanted, advance)
    # What is said otherwise in hindsight is kept once; the position is what the smoother takes the way of.
    live = {name: gone.said[name].copy() if name == POSITION else gone.said.pop(name) for name in JUDGED}
    found, passes = live, 1
    if gone.states[-1][order.index(IS_REFERENCED)] > 0.0:
        known = _Known.of(gone, set(wanted))
        known.look(gone.blocks, advance)
        while not is_known and passes < PASSES:
            start, std = known.positions.start
            if abs(start - begun[position]) < CLOSE * std:
                break
            begun[position], passes = start, passes + 1
            blocks = gone.again(begun, advance)
            if blocks == gone.blocks:  # another hypothesis may be the likeliest
                del known  # a long log fills the memory once
                known = _Known.of(gone, set(wanted))
            known.look(blocks, advance)
        found = known.said()
    said = gone.said | found
    track = said_signals(tracer.sensor, clock, {name: said[name] for name in wanted})
    before = said_signals(tracer.sensor, clock, live)
    columns = {**track.columns, **{f"{LIVE}{name}": before[name] for name in JUDGED}}
    columns[NIS] = Signal(gone.innovations.column(len(time)), {"units": "1", "long_name": NIS})
    after = dict(zip(order, gone.states[-1].tolist(), strict=True))
    return LookedBack(replace(track, columns=columns), after, passes, gone.innovations.text)


class Recalled:
    """A log that was looked back at, for what takes a sensor that follows it piece by piece.

    Attributes:
        outputs: names of what is said of each sample.
    """

    def __init__(self, back: LookedBack) -> None:
        self._track, self._done = back.track, 0
        self.outputs = back.track.names

    def followed(self, piece: Signals) -> Signals:
        """What is said of the next samples."""
        first, self._done = self._done, self._done + len(piece)
        return self._track.rows(slice(first, self._done))
