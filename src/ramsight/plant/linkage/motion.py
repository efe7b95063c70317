"""A mechanism alone as an ordinary differential equation: forces of its cylinders in, joint coordinates out."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.arrays import Array
from ramsight.engine.equation import OdeModel, Output, State
from ramsight.expression import Scalar, Vector
from ramsight.plant.linkage.dynamics import Equations, equations
from ramsight.plant.linkage.mechanism import Mechanism
from ramsight.plant.symbols import Parameters

#: what works on a mechanism beside its cylinders: payload [kg], force on the tip, forward and up [N]
WORKS = ("payload", "tip_force_x", "tip_force_z")

_TOLERANCES = (1e-11, 1e-8)  # of a joint's coordinate and rate [rad or m, per s], as of a piston


@dataclass(frozen=True)
class Moving:
    """The states and symbols of a mechanism, before anything moves it."""

    equations: Equations
    states: tuple[State, ...]  # coordinates and rates
    # q, rates: their symbols, columns
    q: Vector
    rates: Vector
    # works, work_rates: symbols of what works on it beside the cylinders, and of their slopes; columns
    works: Vector
    work_rates: Vector
    # joint coordinates are states; these are angles of the bodies as cosine and sine, tip and energies
    outputs: tuple[Output, ...]

    @property
    def payload_power(self) -> Scalar:
        """Energy that payload brings with it as it comes [W]."""
        return self.work_rates[0] * self.equations.payload_energy

    @property
    def tip_power(self) -> Scalar:
        """Power of the force on the tip [W]."""
        return ca.dot(self.works[1:], ca.mtimes(self.equations.tip_jacobian, self.rates))


def moving(mechanism: Mechanism, parameters: Parameters) -> Moving:
    """A mechanism with symbols for its coordinates and for what works on it."""
    names, units = mechanism.joints, mechanism.joint_units
    q = ca.vertcat(*(ca.SX.sym(f"joint_{name}") for name in names))
    rates = ca.vertcat(*(ca.SX.sym(f"joint_rate_{name}") for name in names))
    works = ca.vertcat(*(ca.SX.sym(name) for name in WORKS))
    found = equations(mechanism.symbolic(parameters), q, rates, works[0])
    fine, coarse = _TOLERANCES
    states = [State(f"joint_{name}", unit, fine) for name, unit in zip(names, units, strict=True)]
    states += [State(f"joint_rate_{name}", f"{unit}/s", coarse) for name, unit in zip(names, units, strict=True)]
    return Moving(
        equations=found,
        states=tuple(states),
        q=q,
        rates=rates,
        works=works,
        work_rates=ca.vertcat(*(ca.SX.sym(f"{name}_rate") for name in WORKS)),
        outputs=(
            Output("tip_x", "m", found.tip_x),
            Output("tip_z", "m", found.tip_z),
            Output("kinetic", "J", found.kinetic),
            Output("potential", "J", found.potential),
        ),
    )


def motion(mechanism: Mechanism) -> tuple[OdeModel, Array]:
    """The mechanism alone: its equation and the values of its parameters.

    Inputs are the force of each cylinder [N], positive extends, the payload [kg] and the force on the tip [N].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linkage import build_mechanism, motion
        >>> ode, values = motion(build_mechanism(machine.load_machine("mining-loader").linkage))
        >>> ode.inputs
        ('force_boom', 'force_bucket', 'payload', 'tip_force_x', 'tip_force_z')
    """
    parameters = Parameters()
    found = moving(mechanism, parameters)
    forces = ca.vertcat(*(ca.SX.sym(f"force_{name}") for name in mechanism.cylinders))
    cylinders = zip(mechanism.cylinders, ca.vertsplit(found.equations.positions), strict=True)
    ode = OdeModel(
        name="linkage",
        states=found.states,
        inputs=(*(f"force_{name}" for name in mechanism.cylinders), *WORKS),
        parameters=parameters.names,
        x=ca.vertcat(found.q, found.rates),
        u=ca.vertcat(forces, found.works),
        slope=ca.vertcat(ca.SX.sym("force_rates", forces.numel()), found.work_rates),
        p=parameters.column,
        rhs=ca.vertcat(found.rates, found.equations.accelerations(forces, found.works[1:])),
        outputs=(*found.outputs, *(Output(f"position_{name}", "m", position) for name, position in cylinders)),
    )
    return ode, parameters.values
