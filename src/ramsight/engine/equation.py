"""An ordinary differential equation as a CasADi graph: the plain thing that the plant hands to the engine."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from ramsight.expression import Real, Vector


@dataclass(frozen=True)
class State:
    """A state of the equation.

    Args:
        name: unique name.
        unit: SI unit, for labels.
        tolerance: absolute error that a step may leave in it, in its unit.
        integral: true for a pure integral of the other states (an energy, a volume): nothing depends on it,
            and the step size is chosen without it.
    """

    name: str
    unit: str
    tolerance: float
    integral: bool = False


@dataclass(frozen=True)
class Output:
    """A quantity computed from states, inputs and parameters at one instant."""

    name: str
    unit: str
    expression: Real


@dataclass(frozen=True, eq=False)
class OdeModel:
    """dx/dt = f(x, u, du/dt, p) with inputs u that are piecewise linear in time.

    Args:
        name: for messages.
        states: the states, in the order of `x`; integrals last.
        inputs: names of the inputs, in the order of `u` and of its slope `slope`.
        parameters: names of the parameters, in the order of `p`; constant while a segment lasts.
        x, u, slope, p: the SX symbols, column vectors.
        rhs: SX expression of dx/dt.
        outputs: further quantities.
    """

    name: str
    states: tuple[State, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    x: Vector
    u: Vector
    slope: Vector
    p: Vector
    rhs: Vector
    outputs: tuple[Output, ...] = ()

    @property
    def n_coupled(self) -> int:
        """Number of states that are not integrals."""
        return sum(not state.integral for state in self.states)

    @cached_property
    def function(self) -> ca.Function:
        """The right-hand side as `f(x, u, slope, p) -> dx`, for use with any solver."""
        return ca.Function("rhs", [self.x, self.u, self.slope, self.p], [self.rhs], ["x", "u", "slope", "p"], ["dx"])

    @cached_property
    def output_function(self) -> ca.Function:
        """All outputs as one column, `g(x, u, slope, p) -> y`."""
        column = ca.vertcat(*(output.expression for output in self.outputs))
        return ca.Function("outputs", [self.x, self.u, self.slope, self.p], [column], ["x", "u", "slope", "p"], ["y"])

    def state_index(self, name: str) -> int:
        """Place of a state in `x`."""
        return next(i for i, state in enumerate(self.states) if state.name == name)
