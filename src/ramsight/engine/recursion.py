"""A discrete recursion x[k+1] = F(x[k], u[k], p), y[k] = G(x[k], u[k], p), compiled once for live use and replay."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.engine.cache import CompiledModule, generated_module, hold, kept_module
from ramsight.engine.typed_state import column, initial_values, leaves, symbols
from ramsight.expression import Real

_CHUNK = 500_000  # samples between two looks at the progress
_BESIDE = 4
"""Runs side by side. A sensor has hundreds of states and thousands of intermediate results: those of eight runs are
more than a first-level cache holds, and a sample of each takes a tenth longer than with four."""

_REPLAY = """
def replay(inputs, q, state, out):
    for i in range(inputs.shape[0]):
        advance(state, inputs[i], q, out[i])
"""

# The lanes of a run that has ended, and those without a run, go on with what they have; nobody looks.
_REPLAY_LANES = """
def replay_lanes(inputs, begin, length, p, states, kept, out):
    runs = states.shape[0]
    x, u, y = np.empty((N, W)), np.empty((NU, W)), np.empty((NO, W))
    q, one = np.empty((NQ, W)), np.empty(NQ)
    first, last = np.zeros(W, np.int64), np.zeros(W, np.int64)
    for group in range(0, runs, W):
        longest = 0
        for lane in range(W):
            run = min(group + lane, runs - 1)
            first[lane], last[lane] = begin[run], begin[run] + length[run] - 1
            longest = max(longest, length[run])
            prepare(p[run], one)
            for k in range(NQ):
                q[k, lane] = one[k]
            for k in range(N):
                x[k, lane] = states[run, k]
        for i in range(longest):
            for lane in range(W):
                row = max(min(first[lane] + i, last[lane]), 0)
                for k in range(NU):
                    u[k, lane] = inputs[row, k]
            advance(x, u, q, y)
            for lane in range(min(W, runs - group)):
                row = first[lane] + i
                if row <= last[lane]:
                    for k in range(len(kept)):
                        out[row, k] = y[kept[k], lane]
"""


@dataclass(frozen=True)
class Graph:
    """What a recursion computes, a CasADi graph without branches."""

    # x, u, p: the SX symbols, column vectors
    x: Any
    u: Any
    p: Any
    # next_state, output: SX expressions
    next_state: Any
    output: Any


@dataclass(frozen=True)
class Replayed:
    """Where the machine code of `replay` is: all that is needed of it beside the names."""

    module: str
    held: int  # size of what is computed once of the parameters


@dataclass(frozen=True, eq=False)
class Recursion:
    """A recursion: names, and a graph that is made when it is asked for."""

    state: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    drawn: Callable[[], Graph]
    known: Replayed | None = None  # where its machine code is, if that was made before

    @cached_property
    def graph(self) -> Graph:
        """Its graph."""
        return self.drawn()

    @property
    def replayed(self) -> Replayed:
        """Where its machine code is."""
        return self.known or Replayed(_compile(self).name, int(_compile(self).NQ))

    def function(self) -> ca.Function:
        """The step as `step(x, u, p) -> (x_new, y)`."""
        return ca.Function(
            "step",
            [self.graph.x, self.graph.u, self.graph.p],
            [self.graph.next_state, self.graph.output],
            ["x", "u", "p"],
            ["x_new", "y"],
        )


def _pieces(recursion: Recursion) -> tuple[dict[str, ca.Function], dict[str, object]]:
    """The functions that a loop calls, and the constants that it knows."""
    graph = recursion.graph
    n = graph.x.numel()
    both, q, prepare = hold(ca.densify(ca.vertcat(graph.next_state, graph.output)), graph.p)
    new, out = ca.vertsplit(both, [0, n, both.numel()])
    step = ca.Function("advance", [graph.x, graph.u, q], [new, out], ["x", "u", "q"], ["x_new", "out"], {"cse": True})
    sizes = {"N": n, "NU": graph.u.numel(), "NO": out.numel(), "NQ": q.numel()}
    return {"prepare": prepare, "advance": step}, dict(sizes)


@lru_cache(maxsize=64)
def _compile(recursion: Recursion) -> CompiledModule:
    if (known := recursion.known) is not None:
        widths = {"prepare": 1, "advance": 1}
        return kept_module(known.module, lambda: _pieces(recursion)[0], {"NQ": known.held}, _REPLAY, widths)
    functions, constants = _pieces(recursion)
    return generated_module(functions, {"NQ": constants["NQ"]}, _REPLAY)


@lru_cache(maxsize=16)
def _compile_lanes(recursion: Recursion) -> CompiledModule:
    functions, constants = _pieces(recursion)
    return generated_module(functions, constants | {"W": _BESIDE}, _REPLAY_LANES, {"advance": _BESIDE})


def _held(compiled: CompiledModule, parameters: Array) -> Array:
    """What is computed of the parameters alone."""
    held = np.empty(compiled.NQ)
    compiled.prepare(parameters, held)
    return held


def replay(
    recursion: Recursion,
    inputs: Array,
    parameters: Array,
    state: Array,
    *,
    advance: Callable[[int], object] | None = None,
) -> Array:
    """Step through many samples.

    Args:
        inputs: shape (samples, inputs), C-contiguous.
        parameters: shape (parameters,).
        state: shape (states,); is overwritten by the state after the last sample.

    Returns:
        The outputs, shape (samples, outputs).
    """
    compiled = _compile(recursion)
    held, out = _held(compiled, parameters), np.empty((len(inputs), len(recursion.outputs)))
    for first in range(0, len(inputs), _CHUNK):
        rows = slice(first, first + _CHUNK)
        compiled.replay(inputs[rows], held, state, out[rows])
        if advance is not None:
            advance(len(inputs[rows]))
    return out


def replay_many(
    recursion: Recursion,
    inputs: Sequence[Array],
    parameters: Array,
    states: Array,
    outputs: Sequence[str] | None = None,
) -> tuple[Array, ...]:
    """Step through the samples of many runs, several side by side in vector registers.

    A run's numbers are the same to the last bit whatever runs beside it; from `replay` they may differ by rounding.

    Args:
        inputs: of each run, shape (samples, inputs).
        parameters: of all runs, shape (parameters,), or of each, (runs, parameters).
        states: shape (runs, states); first states. They stay as they are.
        outputs: names of those that are kept; all, if None.

    Returns:
        The outputs of each run, shape (samples, outputs).
    """
    if not inputs:
        return ()
    length = np.array([len(rows) for rows in inputs])
    begin = np.cumsum(length) - length
    beside = np.argsort(length, kind="stable")  # a lane waits for the longest run beside it
    each = np.broadcast_to(parameters, (len(inputs), np.shape(parameters)[-1]))
    kept = np.array([recursion.outputs.index(name) for name in (outputs or recursion.outputs)])
    out = np.empty((int(length.sum()), len(kept)))
    _compile_lanes(recursion).replay_lanes(
        np.concatenate(inputs), begin[beside], length[beside], each[beside], states[beside], kept, out
    )
    return tuple(np.split(out, begin[1:]))


S = TypeVar("S")
I = TypeVar("I")  # noqa: E741


def recursion_of(
    initial: S,
    inputs: I,
    outputs: Sequence[str],
    stage: Callable[[S, I], tuple[S, Sequence[Real]]],
    parameters: object = (),
) -> Recursion:
    """A stage as a recursion."""
    before = symbols(initial)
    after, given = stage(before, inputs)
    names = [tuple(one.name for one in leaves(tree)) for tree in (before, inputs, parameters)]
    graph = Graph(column(before), column(inputs), ca.SX(column(parameters)), column(after), ca.vertcat(*given))
    constants = tuple(str(one.value) for one in leaves(parameters))
    return Recursion(names[0], names[1], constants, tuple(outputs), lambda: graph)


class Stepper:
    """A recursion that is taken sample by sample, in memory that is made once.

    Args:
        state: first one, shape (states,); is overwritten by the state after each sample.

    Attributes:
        out: outputs of the last sample; overwritten by the next one.
        prepare: is called after parameters have changed.
    """

    def __init__(self, recursion: Recursion, parameters: Array, state: Array) -> None:
        compiled = _compile(recursion)
        self.parameters, self.state = parameters, state
        self._inputs, out = np.empty((1, len(recursion.inputs))), np.empty((1, len(recursion.outputs)))
        self.out: Array = out[0]
        held = _held(compiled, parameters)
        self._run = compiled.replay.bound(self._inputs, held, state, out)
        self.prepare: Callable[[], int] = compiled.prepare.bound(parameters, held)

    def step(self, inputs: Sequence[float]) -> Array:
        """The outputs of the next sample."""
        self._inputs[0] = inputs
        self._run()
        return self.out


class Live:
    """A recursion that goes on sample by sample."""

    def __init__(self, recursion: Recursion, initial: object, parameters: Sequence[float] = ()) -> None:
        self.recursion = recursion
        self.parameters, self._state = np.array(parameters, dtype=np.float64), initial_values(initial)

    @cached_property
    def _stepper(self) -> Stepper:
        return Stepper(self.recursion, self.parameters, self._state)

    def compiled(self) -> Live:
        """The same with its machine code made, so that the first sample takes no longer than others."""
        _ = self._stepper
        return self

    def step(self, inputs: Sequence[float]) -> list[float]:
        """The outputs of a sample."""
        found: list[float] = self._stepper.step(inputs).tolist()
        return found

    def set(self, name: str, value: float) -> None:
        """Give a state another value."""
        self._state[self.recursion.state.index(name)] = value

    def set_parameter(self, place: int, value: float) -> None:
        """Give a parameter another value."""
        self.parameters[place] = value
        self._stepper.prepare()

    @property
    def state(self) -> dict[str, float]:
        """All states, by name."""
        return dict(zip(self.recursion.state, self._state.tolist(), strict=True))

    @state.setter
    def state(self, values: Mapping[str, float]) -> None:
        self._state[:] = [values[name] for name in self.recursion.state]
