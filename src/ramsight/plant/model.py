"""The plant as a CasADi function with names, for model predictive control, identification and linearisation."""

from __future__ import annotations

import re
from typing import Any

import casadi as ca

from ramsight.argument_kinds import by_kind
from ramsight.arrays import Array
from ramsight.errors import DescriptionError
from ramsight.machine.description import Unit
from ramsight.plant.build import build
from ramsight.plant.circuit import CircuitModel
from ramsight.plant.unit import HydraulicUnit, circuit, initial_state

_NAME = re.compile(r"(?!(?:null|jac|hess)\Z)[A-Za-z](?:_?[A-Za-z0-9])*_?")  # as CasADi demands it


class PlantFunction(ca.Function):
    """dx/dt and outputs of a unit: `plant(x=, u=, slope=, p=)` gives `dx` and `y`, all in SI.

    A `casadi.Function` like any other (Jacobians, code generation, `map`), which also knows what its entries are.

    Args:
        function: the plain function, the same graph that ramsight simulates.
        unit: the unit.
        circuit: its closed circuit.

    Attributes:
        states, inputs, parameters, outputs: names of the entries of `x`, `u` (and `slope`), `p` and `y`.
        state_units, output_units: their units.
        p0: the described values of the parameters.
    """

    def __init__(self, function: ca.Function, unit: HydraulicUnit, circuit: CircuitModel) -> None:
        super().__init__(function)
        ode = circuit.ode
        self.unit, self.circuit = unit, circuit
        self.states = tuple(state.name for state in ode.states)
        self.inputs, self.parameters = ode.inputs, ode.parameters
        self.outputs = tuple(output.name for output in ode.outputs)
        self.state_units = tuple(state.unit for state in ode.states)
        self.output_units = tuple(output.unit for output in ode.outputs)
        self.p0 = circuit.values

    def __copy__(self) -> PlantFunction:
        """The same: a function never changes."""
        return self

    def __deepcopy__(self, memo: object) -> PlantFunction:
        """The same."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes, as `multiprocessing` and Dask need it: made of its unit again."""
        return casadi_model, (self.unit, self.name())

    def x0(self, position: float | None = None, load: float = 0.0) -> Array:
        """States at rest with the load carried.

        Args:
            position: [m]; the middle of the stroke if omitted.
            load: [N], positive against lifting.
        """
        middle = 0.5 * self.unit.cylinder.stroke
        return initial_state(self.unit, self.circuit, middle if position is None else position, load)

    def p(self, **changes: float) -> Array:
        """The parameters, in SI units, with some changed, by name with `__` for the dot: `p(oil_temperature=320.0)`."""
        unknown = [name for name in changes if name.replace("__", ".") not in self.parameters]
        if unknown:
            raise ValueError(f"no parameter {unknown[0]!r}; known: {', '.join(self.parameters)}")
        return self.circuit.parameters(**changes)


@by_kind
def casadi_model(unit: HydraulicUnit | Unit, name: str = "plant") -> PlantFunction:
    """The plant of a unit as a `casadi.Function`.

    Inputs `u` are the motor's speed [rad/s] (a servo's reference) and the load [N]; `slope` is their rate of change,
    which only the motor's torque depends on. The oil's temperature is a parameter.

    Args:
        unit: a unit, described or built.
        name: of the function.

    Raises:
        DescriptionError: the circuit cannot move its load, it is no unit, or that is no name of a function.

    Example:
        >>> from ramsight import casadi_model, machine
        >>> model = casadi_model(machine.load_machine("eha-test-bench").unit("axis"))
        >>> model.name_in(), model.name_out()
        (['x', 'u', 'slope', 'p'], ['dx', 'y'])
        >>> model.states[:3], model.inputs
        (('position', 'velocity', 'pressure_chamber_a'), ('motor_speed', 'load'))
        >>> rate = model(x=model.x0(load=5e3), u=[100.0, 5e3], slope=0, p=model.p0)["dx"]
        >>> rate.shape
        (7, 1)
    """
    if not _NAME.fullmatch(name):
        allowed = "letters, digits and single underscores, a letter first"
        raise DescriptionError("is no name of a function", key="name", value=name, allowed=allowed)
    built: Any = build(unit, name) if isinstance(unit, Unit) else build(unit)
    model = circuit(built)
    ode = model.ode
    y = ca.vertcat(*(output.expression for output in ode.outputs))
    arguments, names = [ode.x, ode.u, ode.slope, ode.p], ["x", "u", "slope", "p"]
    return PlantFunction(ca.Function(name, arguments, [ode.rhs, y], names, ["dx", "y"]), built, model)
