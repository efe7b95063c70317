"""A machine whose units move one mechanism: all circuits and the mechanism as one equation.

Every unit keeps its circuit as it is; its cylinder's position and velocity are those that the mechanism has, and the
force of its rods works on the mechanism by virtual work. Names of a unit's states, inputs, parameters and outputs begin
with the unit's, as in `boom.pressure_chamber_a`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.engine.equation import OdeModel, Output, State
from ramsight.errors import DescriptionError
from ramsight.expression import Real, Scalar, Vector, scalar_symbol
from ramsight.machine.description import Machine
from ramsight.plant.build import build
from ramsight.plant.circuit import Audited, Circuit, Closed
from ramsight.plant.cylinder import Cylinder
from ramsight.plant.linkage.dynamics import WORKS, Moving, moving
from ramsight.plant.linkage.mechanism import Mechanism, build_mechanism
from ramsight.plant.linkage.survey import holding_forces, joints
from ramsight.plant.symbols import Parameters
from ramsight.plant.unit import HydraulicUnit, rest_pressures


@dataclass(frozen=True)
class LinkedMachine:
    """Units and the mechanism that they move."""

    name: str  # of the machine
    units: tuple[HydraulicUnit, ...]  # those that move the mechanism, in the order of its cylinders
    mechanism: Mechanism  # what they move

    def unit(self, name: str) -> HydraulicUnit:
        """One of the units."""
        return self.units[self.mechanism.cylinders.index(name)]


@dataclass(frozen=True)
class LinkedModel:
    """A linked machine as an equation."""

    # ode: the equation; its inputs are each unit's `motor_speed`, the payload [kg] and the force on the tip [N]
    ode: OdeModel
    values: Array  # the parameters' values; `UNIT.oil_temperature` are among them
    audit_terms: dict[str, Audited]  # what the audit needs, by unit; names are without the unit's


def build_linked(machine: Machine) -> LinkedMachine:
    """The parts of a described machine.

    Args:
        machine: the description.

    Raises:
        DescriptionError: it has no mechanism.

    Example:
        >>> from ramsight import machine
        >>> [unit.name for unit in build_linked(machine.load_machine("mining-loader")).units]
        ['boom', 'bucket']
    """
    if machine.linkage is None:
        raise DescriptionError("is missing: the machine has no mechanism", file=machine.origin or None, key="linkage")
    units = tuple(build(machine, name) for name in machine.linkage.cylinders)
    return LinkedMachine(machine.name, units, build_mechanism(machine.linkage))


def linked_model(machine: LinkedMachine, *, audited: bool = False) -> LinkedModel:
    """The machine as an equation."""
    parameters = Parameters()
    mechanism = moving(machine.mechanism, parameters)
    found = mechanism.equations
    closed: dict[str, Closed] = {}
    forces = []
    for k, unit in enumerate(machine.units):
        circuit = Circuit(unit.oil, unit.tank_pressure)
        force = _guided(circuit, unit, found.positions[k], found.velocities[k], audited)
        forces.append(force)
        closed[unit.name] = circuit.close(audited=audited)
    rates = found.accelerations(ca.vertcat(*forces), mechanism.works[1:])
    symbols, changes = ca.vertcat(mechanism.q, mechanism.rates), ca.vertcat(mechanism.rates, rates)
    rows: list[tuple[State, Scalar, Real]]
    rows = list(zip(mechanism.states, ca.vertsplit(symbols), ca.vertsplit(changes), strict=True))
    for name, one in closed.items():
        rows += [(replace(state, name=f"{name}.{state.name}"), symbol, rate) for state, symbol, rate in one.states]
    if audited:
        rows += _integrals(mechanism, ca.vertcat(*forces))
    rows.sort(key=lambda row: row[0].integral)
    outputs = [Output(f"{name}.{o.name}", o.unit, o.expression) for name, one in closed.items() for o in one.outputs]
    speeds = [one.motor_speed for one in closed.values()]
    accelerations = [one.motor_acceleration for one in closed.values()]
    ode = OdeModel(
        name=machine.name,
        states=tuple(state for state, _, _ in rows),
        inputs=(*(f"{name}.motor_speed" for name in closed), *WORKS),
        parameters=(
            *parameters.names,
            *(f"{name}.{key}" for name, one in closed.items() for key in one.parameters.names),
        ),
        x=ca.vertcat(*(symbol for _, symbol, _ in rows)),
        u=ca.vertcat(*speeds, mechanism.works),
        slope=ca.vertcat(*accelerations, mechanism.work_rates),
        p=ca.vertcat(parameters.column, *(one.parameters.column for one in closed.values())),
        rhs=ca.vertcat(*(rate for _, _, rate in rows)),
        outputs=(*mechanism.outputs, *outputs),
    )
    values = np.concatenate([parameters.values, *(one.parameters.values for one in closed.values())])
    return LinkedModel(ode, values, {name: one.names for name, one in closed.items()})


def _guided(circuit: Circuit, unit: HydraulicUnit, position: Scalar, velocity: Scalar, audited: bool) -> Real:
    """Add a unit's parts to its circuit, its cylinder guided by the mechanism; returns the force of its rods [N]."""
    force: Real | None = None
    for part in unit.parts():
        if isinstance(part, Cylinder):
            force = circuit.symbolic(part).push(circuit, position, velocity)
        else:
            circuit.add(part)
    assert force is not None, "a unit has a cylinder"
    circuit.output("position", "m", position)
    circuit.output("velocity", "m/s", velocity)
    circuit.output("load", "N", unit.lift_sign * force)
    if audited:
        circuit.work("rods", force * velocity)
    return force


def _integrals(mechanism: Moving, forces: Vector) -> list[tuple[State, Scalar, Real]]:
    """What the audit of the mechanism adds up: work of the rods, of the tip, and what payload brings."""
    powers = {
        "rods": ca.dot(forces, mechanism.equations.velocities),
        "tip": mechanism.tip_power,
        "payload": mechanism.payload_power,
    }
    return [
        (State(f"energy.{key}", "J", float("inf"), integral=True), scalar_symbol(key), power)
        for key, power in powers.items()
    ]


def start_state(
    machine: LinkedMachine,
    model: LinkedModel,
    positions: Mapping[str, float],
    payload: float = 0.0,
    tip_force: tuple[float, float] = (0.0, 0.0),
    motor_speed: Mapping[str, float] | None = None,
) -> Array:
    """States of the machine at rest: each unit's held chamber carries what the mechanism puts on it.

    Args:
        positions: of the cylinders, by unit [m].
        payload: [kg].
        tip_force: on the tip, forward and up [N].
        motor_speed: of servo drives, by unit [rad/s].

    Raises:
        DescriptionError: the mechanism cannot be assembled there.
    """
    wanted = np.array([positions[unit.name] for unit in machine.units])
    coordinates = joints(machine.mechanism, wanted)
    if not np.all(np.isfinite(coordinates)):
        where = ", ".join(f"{name} {1e3 * positions[name]:g} mm" for name in machine.mechanism.cylinders)
        raise DescriptionError("the mechanism cannot be assembled at these positions", key="linkage", value=where)
    state = np.zeros(len(model.ode.states))
    state[: len(coordinates)] = coordinates
    forces = holding_forces(machine.mechanism, coordinates, payload, tip_force)
    speeds = motor_speed or {}
    for unit, force in zip(machine.units, forces, strict=True):
        pressures = rest_pressures(unit, model.audit_terms[unit.name].nodes, unit.lift_sign * float(force))
        for node, level in pressures.items():
            state[model.ode.state_index(f"{unit.name}.pressure_{node}")] = level
        name = f"{unit.name}.motor_speed"
        if any(known.name == name for known in model.ode.states):
            state[model.ode.state_index(name)] = speeds.get(unit.name, 0.0)
    return state
