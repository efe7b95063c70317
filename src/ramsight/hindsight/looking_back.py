"""A recorded log, looked back at: forward by the sensor, then backward by the smoother, in blocks.

What the hypotheses are in each sample is too much to be kept. The state at the beginning of each block is, and the
block is gone through again where the smoother comes to it.

The circuit's equations are linearised at the position of the filter, which begins in the middle of the stroke where no
start is known. Where the smoothed start is elsewhere, the log is gone through again from there, with as little known of
it as before: a linearisation point is no evidence.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.hindsight.said import ASIDE_SAID, Believed, said_of
from ramsight.hindsight.smoother import Ahead, Smoothed, backward
from ramsight.hindsight.surprise import Surprises
from ramsight.hindsight.trace import Tracer
from ramsight.sensor.quantity import FACTOR_OF, Quantity
from ramsight.sensor.virtual_sensor import IS_REFERENCED, OF_POSITION, POSITION, log_inputs
from ramsight.signals import Signal, Signals

Array = NDArray[np.float64]
Advance = Callable[[float], object]
BLOCK = 4096
"""Samples between two states that are kept: some 30 MB of a trace."""
PASSES = 3
"""How often a log is gone through at most until the smoothed start is where it was linearised."""
CLOSE = 0.1
"""Standard deviations of the smoothed start within which it is there [1]."""
LIVE = "live_"
"""Before the names of what the live sensor said of the position."""
SURPRISE = "surprise"
_POSITION, _VARIANCE = "positions", "variances"
_JUDGED = (*sorted(OF_POSITION), "status")


@dataclass(frozen=True)
class LookedBack:
    """A log by all that it says.

    Attributes:
        track: as the sensor's, with `surprise`, and with what the live sensor said of the position.
        state: of the sensor after the log.
        passes: how often the log was gone through.
        text: how well the log fits the machine, in a line.
    """

    track: Signals
    state: Array
    passes: int
    text: str


@dataclass(frozen=True)
class _Forward:
    """What is kept of a log that the sensor has gone through.

    Attributes:
        states: at the beginning of each block, and after the last one.
        said: what the sensor said, by its names.
        log_weight: of the hypotheses after the last sample.
        surprises: the measurements of the place.
    """

    states: list[Array]
    said: dict[str, Array]
    log_weight: Array
    surprises: Surprises

    @property
    def position(self) -> Array:
        """That the sensor said [m]."""
        return self.said[POSITION]


def looked_back(
    tracer: Tracer,
    log: Signals,
    state: Array,
    *,
    names: Collection[str] | None = None,
    advance: Advance = lambda share: None,
) -> LookedBack:
    """Where the piston was, by all that a log says.

    Args:
        tracer: the sensor of the log's machine.
        log: all of it.
        state: of the sensor before it; stays as it is.
        names: of the sensor's outputs that are kept; None for all.
        advance: is passed the share of a way through the log that was done since the last call, twice forward and
            backward of each pass.
    """
    place = tracer.sensor.recursion.state.index
    position, known = place(POSITION), place(IS_REFERENCED)
    inputs, time, begun = log_inputs(tracer.sensor, log), log["time"].values, state.copy()
    wanted = {*_JUDGED, *(tracer.names if names is None else (one for one in tracer.names if one in names))}
    live: dict[str, Array] = {}
    found: dict[str, Array] = {}
    for passes in range(1, PASSES + 1):
        gone = _forward(tracer, inputs, time, begun, wanted, advance)
        live = live or {name: gone.said[name] for name in _JUDGED}
        if gone.states[-1][known] == 0.0:
            break
        found = _backward(tracer, inputs, gone, advance)
        off = abs(found["position"][0] - begun[position])
        if state[known] > 0.0 or off < CLOSE * found["position_std"][0]:
            break
        begun[position] = found["position"][0]
    found |= {SURPRISE: gone.surprises.column(len(time))} | {f"{LIVE}{name}": one for name, one in live.items()}
    track = _signals(tracer, time, gone.said | found)
    return LookedBack(track, gone.states[-1], passes, gone.surprises.text)


def _forward(
    tracer: Tracer, inputs: Array, time: Array, begun: Array, names: Collection[str], advance: Advance
) -> _Forward:
    """The log by the sensor."""
    states, surprises, end = [begun.copy()], Surprises(), np.empty(0)
    place = {name: tracer.names.index(name) for name in names}
    said = {name: np.empty(len(inputs)) for name in names}
    for span in _blocks(len(inputs)):
        state = states[-1].copy()
        rows = tracer.rows(inputs[span], state)
        for name, k in place.items():
            said[name][span] = rows[:, k]
        surprises.append(span.start, time[span], tracer.aside(rows))
        states.append(state)
        end = rows[-1, tracer.layout.spans["log_weight"]].copy()
        advance(len(rows) / len(inputs))
    return _Forward(states, said, end, surprises)


def _backward(tracer: Tracer, inputs: Array, gone: _Forward, advance: Advance) -> dict[str, Array]:
    """What is said in hindsight, by the names of the sensor's outputs."""
    stroke, samples = float(tracer.unit.cylinder.stroke), len(inputs)
    unknown = gone.surprises.unknown(gone.position)
    found: dict[str, Array] = {}
    ahead: Ahead | None = None
    for number, span in reversed(list(enumerate(_blocks(samples)))):
        rows = tracer.rows(inputs[span.start : span.stop + 1], gone.states[number].copy())
        trace = tracer.trace(rows, unknown[span.start : span.stop + 1])
        ahead = ahead or Ahead.end(trace)
        smoothed, ahead = backward(trace, ahead, stroke)
        if span.stop == samples:
            smoothed = smoothed.followed(trace)
        count = span.stop - span.start
        part = {name: trace.aside[name][:count] for name in ASIDE_SAID} | _learned(smoothed, tracer, gone.log_weight)
        part |= {_POSITION: smoothed.mean[..., 0], _VARIANCE: smoothed.variance[..., 0]}
        for name, one in part.items():
            found.setdefault(name, np.empty((samples, *one.shape[1:])))[span] = one
        advance(count / samples)
    believed = Believed(found.pop(_POSITION), found.pop(_VARIANCE), gone.log_weight)
    aside = {name: found.pop(name) for name in ASIDE_SAID}
    return found | said_of(believed, aside, tracer.unit)


def _learned(smoothed: Smoothed, tracer: Tracer, log_weight: Array) -> Mapping[str, Array]:
    """Factors of the likeliest hypothesis with their deviations, and the hypotheses' probabilities."""
    likeliest, found = int(np.argmax(log_weight)), {}
    for name, quantity in FACTOR_OF.items():
        if quantity in tracer.layout.quantities and Quantity.WARMER not in tracer.layout.quantities:
            place = tracer.layout.quantities.index(quantity)
            found[f"{name}_factor"] = smoothed.mean[:, likeliest, place]
            found[f"{name}_factor_std"] = np.sqrt(smoothed.variance[:, likeliest, place])
    chances = np.exp(log_weight - log_weight.max())
    for kind, chance in zip(tracer.kinds, chances / chances.sum(), strict=True):
        found[f"{kind.text}_probability"] = np.full(len(smoothed.mean), chance)
    return found


def _blocks(samples: int) -> Iterator[slice]:
    """The samples in order."""
    return (slice(first, min(first + BLOCK, samples)) for first in range(0, samples, BLOCK))


def _signals(tracer: Tracer, time: Array, columns: Mapping[str, Array]) -> Signals:
    """The columns with their units."""
    found = {"time": Signal(time, {"units": "s"})}
    for name, values in columns.items():
        unit = "1" if name == SURPRISE else tracer.sensor.units[name.removeprefix(LIVE)]
        found[name] = Signal(values, {"units": unit})
    return Signals(found)
