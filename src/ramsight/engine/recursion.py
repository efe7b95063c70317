"""A discrete recursion x[k+1] = F(x[k], u[k], p), y[k] = G(x[k], u[k], p), compiled once for replay and for life."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.engine.cache import CompiledModule, generated_module, hold

Array = NDArray[np.float64]

_CHUNK = 500_000  # samples between two looks at the progress

_REPLAY = """
def replay(inputs, p, state, out):
    q = np.empty(NQ)
    prepare(p, q)
    for i in range(inputs.shape[0]):
        advance(state, inputs[i], q, out[i])
"""


@dataclass(frozen=True, eq=False)
class Recursion:
    """A recursion as a CasADi graph without branches.

    Args:
        state, inputs, parameters, outputs: names.
        x, u, p: the SX symbols, column vectors.
        next_state, output: SX expressions.
    """

    state: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]
    x: Any
    u: Any
    p: Any
    next_state: Any
    output: Any

    def function(self) -> ca.Function:
        """The step as `step(x, u, p) -> (x_new, y)`."""
        return ca.Function(
            "step", [self.x, self.u, self.p], [self.next_state, self.output], ["x", "u", "p"], ["x_new", "y"]
        )


@lru_cache(maxsize=64)
def _compile(recursion: Recursion) -> CompiledModule:
    n = recursion.x.numel()
    both, q, prepare = hold(ca.densify(ca.vertcat(recursion.next_state, recursion.output)), recursion.p)
    new, out = ca.vertsplit(both, [0, n, both.numel()])
    step = ca.Function(
        "advance", [recursion.x, recursion.u, q], [new, out], ["x", "u", "q"], ["x_new", "out"], {"cse": True}
    )
    return generated_module({"prepare": prepare, "advance": step}, {"NQ": q.numel()}, _REPLAY)


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
        recursion: the graph.
        inputs: shape (samples, inputs), C-contiguous.
        parameters: shape (parameters,).
        state: shape (states,); is overwritten by the state after the last sample.
        advance: called now and then with the number of samples done since the last call.

    Returns:
        The outputs, shape (samples, outputs).
    """
    compiled = _compile(recursion)
    out = np.empty((len(inputs), len(recursion.outputs)))
    for first in range(0, len(inputs), _CHUNK):
        rows = slice(first, first + _CHUNK)
        compiled.replay(inputs[rows], parameters, state, out[rows])
        if advance is not None:
            advance(len(inputs[rows]))
    return out
