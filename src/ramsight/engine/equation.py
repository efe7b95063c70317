"""An ordinary differential equation as a CasADi graph: the plain thing that the plant hands to the engine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import casadi as ca

from ramsight.expression import Real, Vector


@dataclass(frozen=True)
class State:
    """A state of the equation."""

    name: str
    unit: str  # SI unit, for labels
    tolerance: float  # absolute error that a step may leave in it, in its unit
    # true for a pure integral of the other states (an energy, a volume): nothing depends on it, and the step size is
    # chosen without it
    integral: bool = False


@dataclass(frozen=True)
class Output:
    """A quantity computed from states, inputs and parameters at one instant."""

    name: str
    unit: str
    expression: Real

    def __getattr__(self, name: str) -> Any:
        """The expression of an equation that is not made yet."""
        if name != "expression" or "_made" not in self.__dict__:
            raise AttributeError(name)
        self.__dict__["expression"] = self.__dict__["_made"]()
        return self.__dict__["expression"]


def _late_output(name: str, unit: str, place: int, made: Callable[[], OdeModel]) -> Output:
    output = object.__new__(Output)
    output.__dict__.update(name=name, unit=unit, _made=lambda: made().outputs[place].expression)
    return output


_GRAPH = ("x", "u", "slope", "p", "rhs")


@dataclass(frozen=True, eq=False)
class OdeModel:
    """dx/dt = f(x, u, du/dt, p) with inputs u that are piecewise linear in time."""

    name: str
    states: tuple[State, ...]  # the states, in the order of `x`; integrals last
    inputs: tuple[str, ...]  # names of the inputs, in the order of `u` and of its slope `slope`
    parameters: tuple[str, ...]  # names of the parameters, in the order of `p`; constant while a segment lasts
    # x, u, slope, p: the SX symbols, column vectors
    x: Vector
    u: Vector
    slope: Vector
    p: Vector
    rhs: Vector  # SX expression of dx/dt
    outputs: tuple[Output, ...] = ()  # further quantities

    @classmethod
    def late(
        cls,
        name: str,
        states: tuple[State, ...],
        inputs: tuple[str, ...],
        parameters: tuple[str, ...],
        outputs: Mapping[str, str],
        made: Callable[[], OdeModel],
        known: object,
    ) -> OdeModel:
        """An equation whose graph is made when it is asked for.

        Args:
            outputs: their units by their names.
            known: where its machine code is (`engine.ode_module.Integrated`).
        """
        model, whole = object.__new__(cls), cache(made)
        model.__dict__.update(name=name, states=states, inputs=inputs, parameters=parameters, known=known)
        shown = [_late_output(one, unit, place, whole) for place, (one, unit) in enumerate(outputs.items())]
        model.__dict__.update(outputs=tuple(shown), _made=whole)
        return model

    def __getattr__(self, name: str) -> Any:
        """What of the graph is not made yet."""
        if name not in _GRAPH or "_made" not in self.__dict__:
            raise AttributeError(name)
        whole = self.__dict__["_made"]()
        self.__dict__.update({one: getattr(whole, one) for one in _GRAPH})
        return self.__dict__[name]

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
