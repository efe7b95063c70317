"""A stage of typed states as a recursion, and a recursion that goes on live, a sample at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.engine.recursion import Graph, Recursion, replay
from ramsight.engine.typed_state import column, initial_values, leaves, symbols
from ramsight.expression import Real

S = TypeVar("S")
I = TypeVar("I")  # noqa: E741
Array = NDArray[np.float64]


def recursion_of(
    initial: S,
    inputs: I,
    outputs: Sequence[str],
    stage: Callable[[S, I], tuple[S, Sequence[Real]]],
    parameters: object = (),
) -> Recursion:
    """A stage as a recursion.

    Args:
        initial: its first state.
        inputs: symbols that it takes.
        outputs: names of what it gives.
        stage: state and inputs to state and outputs.
        parameters: symbols of values that stay from sample to sample.
    """
    before = symbols(initial)
    after, given = stage(before, inputs)
    names = [tuple(one.name for one in leaves(tree)) for tree in (before, inputs, parameters)]
    graph = Graph(column(before), column(inputs), ca.SX(column(parameters)), column(after), ca.vertcat(*given))
    constants = tuple(str(one.value) for one in leaves(parameters))
    return Recursion(names[0], names[1], constants, tuple(outputs), lambda: graph)


class Live:
    """A recursion that goes on sample by sample.

    Args:
        recursion: its graph.
        initial: its first state.
        parameters: values of its parameters.
    """

    def __init__(self, recursion: Recursion, initial: object, parameters: Sequence[float] = ()) -> None:
        self.recursion, self.parameters = recursion, np.array(parameters, dtype=np.float64)
        self._state = initial_values(initial)

    def step(self, inputs: Sequence[float]) -> list[float]:
        """The outputs of a sample."""
        found: list[float] = replay(self.recursion, np.array([inputs], dtype=np.float64), self.parameters, self._state)[
            0
        ].tolist()
        return found

    def set(self, name: str, value: float) -> None:
        """Give a state another value."""
        self._state[self.recursion.state.index(name)] = value

    @property
    def state(self) -> dict[str, float]:
        """All states, by name."""
        return dict(zip(self.recursion.state, self._state.tolist(), strict=True))

    @state.setter
    def state(self, values: Mapping[str, float]) -> None:
        self._state = np.array([values[name] for name in self.recursion.state], dtype=np.float64)
