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
from ramsight.hindsight.positions import ASIDE_SAID, Positions, probabilities, said_of
from ramsight.hindsight.smoother import Advance, Ahead, Forward, Smoothed, backward, gone_through, silent
from ramsight.hindsight.trace import Tracer
from ramsight.sensor.quantity import FACTOR_OF, Quantity
from ramsight.sensor.virtual_sensor import IS_REFERENCED, LIVE, OF_POSITION, POSITION, STATUS, log_inputs, said_signals
from ramsight.signals import Signal, Signals

PASSES = 3
"""How often a log is gone through at most until the smoothed start is where it was linearised."""
CLOSE = 0.1
"""Standard deviations of the smoothed start within which it is there [1]."""
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
class _Backward:
    """What is known by the whole log."""

    positions: Positions  # of the position
    aside: Mapping[str, Array]  # what is traced beside it
    learned: dict[str, Array]  # factors, deviations and probabilities, by the names of the sensor's outputs


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
    gone = gone_through(tracer, inputs, time, begun, wanted, advance)
    said = {name: gone.said[name] for name in JUDGED}
    passes, back = 1, None
    if gone.states[-1][order.index(IS_REFERENCED)] > 0.0:
        back = _backward(gone, wanted, advance)
    while back is not None and not is_known and passes < PASSES:
        start, std = back.positions.start
        if abs(start - begun[position]) < CLOSE * std:
            break
        begun[position] = start
        del gone, back  # a long log fills the memory once
        gone = gone_through(tracer, inputs, time, begun, wanted, advance)
        back, passes = _backward(gone, wanted, advance), passes + 1
    found = gone.said if back is None else gone.said | back.learned | said_of(back.positions, back.aside, tracer.unit)
    track, live = (said_signals(tracer.sensor, clock, one) for one in (found, said))
    columns = {**track.columns, **{f"{LIVE}{name}": live[name] for name in JUDGED}}
    columns[NIS] = Signal(gone.innovations.column(len(time)), {"units": "1", "long_name": NIS})
    after = dict(zip(order, gone.states[-1].tolist(), strict=True))
    return LookedBack(replace(track, columns=columns), after, passes, gone.innovations.text)


def _backward(gone: Forward, names: Collection[str], advance: Advance) -> _Backward:
    """The smoother, block after block from the last one; what was learned by these names."""
    tracer, samples = gone.tracer, len(gone.inputs)
    stroke = float(tracer.unit.cylinder.stroke)
    unknown = gone.innovations.unknown(gone.said[POSITION], gone.by_start)
    hypotheses = len(gone.log_weight)
    position, variance = np.empty((samples, hypotheses)), np.empty((samples, hypotheses))
    found: dict[str, Array] = {}
    ahead: Ahead | None = None
    for number, span in reversed(list(enumerate(gone.blocks()))):
        trace = tracer.trace(gone.rows(number, beyond=1), unknown[span.start : span.stop + 1])
        ahead = ahead or Ahead.end(trace)
        smoothed, ahead = backward(trace, ahead, stroke)
        if span.stop == samples:
            smoothed = smoothed.followed(trace)
        position[span], variance[span] = smoothed.mean[..., 0], smoothed.variance[..., 0]
        part = {name: trace.aside[name][: span.stop - span.start] for name in ASIDE_SAID}
        learned = {name: one for name, one in _learned(smoothed, tracer, gone.log_weight).items() if name in names}
        for name, one in (part | learned).items():
            found.setdefault(name, np.empty(samples))[span] = one
        advance((span.stop - span.start) / samples)
    aside = {name: found.pop(name) for name in ASIDE_SAID}
    # What passed a relief valve has shown at the next measurement of the place.
    last = max((one.sample for one in gone.innovations.measured if one.accepted), default=0)
    aside["status"][:last] = aside["beneath"][:last]
    positions = Positions.within_cylinder(position, variance, gone.log_weight, stroke)
    return _Backward(positions, aside, found)


def _learned(smoothed: Smoothed, tracer: Tracer, log_weight: Array) -> dict[str, Array]:
    """Factors of the likeliest hypothesis with their deviations, and the hypotheses' probabilities."""
    likeliest, known, found = int(np.argmax(log_weight)), tracer.layout.quantities, {}
    for name, quantity in FACTOR_OF.items():
        if quantity in known and Quantity.WARMER not in known:  # with it the sensor says what leaks by another law
            place = known.index(quantity)
            found[f"{name}_factor"] = smoothed.mean[:, likeliest, place]
            found[f"{name}_factor_std"] = np.sqrt(smoothed.variance[:, likeliest, place])
    for kind, chance in zip(tracer.kinds, probabilities(log_weight), strict=True):
        found[f"{kind.text}_probability"] = np.full(len(smoothed.mean), chance)
    return found


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
