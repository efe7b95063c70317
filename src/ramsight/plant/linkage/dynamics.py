"""How a mechanism moves: M(q) q'' = J' F + J_tip' F_tip - G(q) - c(q, q').

J is the derivative of the cylinders' positions, so J' F is the principle of virtual work; the mass matrix M and the
velocity terms c are sums over the bodies of m J_c' J_c and m J_c' (dJ_c/dt) q', by differentiation of where the
centres of mass are (Kane and Levinson, Dynamics, 1985, ch. 6; for these joints the same as Lagrange's equations).
Links and cylinders have no mass of their own: it is part of the bodies'. Payload that comes or goes has the velocity
of the point where it is carried, so that it gives no force; its energy is work done from outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.arrays import Array
from ramsight.engine.equation import OdeModel, Output, State
from ramsight.expression import Matrix, Real, Scalar, Vector
from ramsight.plant.linkage.mechanism import Mechanism
from ramsight.plant.linkage.members import Spot
from ramsight.plant.linkage.planar import Pose
from ramsight.plant.symbols import Parameters


@dataclass(frozen=True)
class Equations:
    """A mechanism in motion, as expressions."""

    # positions, velocities: of the cylinders, columns [m], [m/s]
    positions: Vector
    velocities: Vector
    jacobian: Matrix  # of the positions by the coordinates, (cylinders, joints)
    mass_matrix: Matrix  # M, (joints, joints)
    weight: Vector  # G, potential energy's derivative by the coordinates, column
    bias: Vector  # c, column
    # tip_x, tip_z: the tip [m]
    tip_x: Real
    tip_z: Real
    tip_jacobian: Matrix  # of these by the coordinates, (2, joints)
    # kinetic, potential: energies [J]; potential energy is 0 at z = 0 of the drawing
    kinetic: Scalar
    potential: Real
    payload_energy: Real  # kinetic and potential energy per payload [J/kg]
    angles: dict[str, Real]  # by which the bodies are turned, by name [rad]

    def accelerations(self, forces: Vector, tip_force: Vector) -> Vector:
        """Second derivatives of the coordinates.

        Args:
            forces: of the cylinders, positive extends, column [N].
            tip_force: on the tip, forward and up, column [N].
        """
        right = ca.mtimes(self.jacobian.T, forces) + ca.mtimes(self.tip_jacobian.T, tip_force) - self.weight - self.bias
        return solve_symmetric(self.mass_matrix, right)


def equations(mechanism: Mechanism, q: Vector, rates: Vector, payload: Scalar) -> Equations:
    """A mechanism's equations.

    Args:
        q: coordinates of the free joints, SX column [rad or m].
        payload: [kg].
    """
    poses = mechanism.poses([q[i] for i in range(q.numel())])
    n = q.numel()
    mass_matrix, weight, bias = ca.SX(n, n), ca.SX(n, 1), ca.SX(n, 1)
    potential: Real = 0.0
    for body in mechanism.bodies:
        x, z = poses[body.name].at(body.centre_x, body.centre_z)
        turning = _turning(poses[body.name], q)
        for weighing, by in ((body.mass, ca.jacobian(ca.vertcat(x, z), q)), (body.inertia, turning)):
            mass_matrix += weighing * ca.mtimes(by.T, by)
            bias += weighing * ca.mtimes(by.T, _along(ca.mtimes(by, rates), q, rates))
        weight += body.mass * mechanism.gravity * ca.jacobian(z, q).T
        potential += body.mass * mechanism.gravity * z
    payload_energy: Real = 0.0
    if mechanism.load is not None:
        x, z = _now(mechanism.load, poses)
        by = ca.jacobian(ca.vertcat(x, z), q)
        mass_matrix += payload * ca.mtimes(by.T, by)
        bias += payload * ca.mtimes(by.T, _along(ca.mtimes(by, rates), q, rates))
        weight += payload * mechanism.gravity * by[1, :].T
        potential += payload * mechanism.gravity * z
        payload_energy = 0.5 * ca.sumsqr(ca.mtimes(by, rates)) + mechanism.gravity * z
    struts = mechanism.struts
    positions = ca.vertcat(*(mechanism.length(strut, poses) - strut.retracted_length for strut in struts))
    jacobian = ca.jacobian(positions, q)
    tip_x, tip_z = _now(mechanism.tip, poses)
    return Equations(
        positions=positions,
        velocities=ca.mtimes(jacobian, rates),
        jacobian=jacobian,
        mass_matrix=mass_matrix,
        weight=weight,
        bias=bias,
        tip_x=tip_x,
        tip_z=tip_z,
        tip_jacobian=ca.jacobian(ca.vertcat(tip_x, tip_z), q),
        kinetic=0.5 * ca.mtimes([rates.T, mass_matrix, rates]),
        potential=potential,
        payload_energy=payload_energy,
        angles={body.name: poses[body.name].angle for body in mechanism.bodies},
    )


def _now(spot: Spot, poses: dict[str, Pose]) -> tuple[Real, Real]:
    return poses[spot.body].at(spot.x, spot.z)


def _turning(pose: Pose, q: Vector) -> Matrix:
    """Derivative of a body's angle by the coordinates: cos d(sin) - sin d(cos)."""
    cosine: Scalar = ca.SX(pose.cosine)
    sine: Scalar = ca.SX(pose.sine)
    return cosine * ca.jacobian(sine, q) - sine * ca.jacobian(cosine, q)


def _along(expression: Vector, q: Vector, rates: Vector) -> Vector:
    """How an expression changes over time because the coordinates do."""
    return ca.jtimes(expression, q, rates)


def solve_symmetric(matrix: Matrix, right: Vector) -> Vector:
    """Solution of a positive definite system, written out by elimination without pivoting.

    Example:
        >>> solve_symmetric(ca.SX([[2.0, 1.0], [1.0, 1.0]]), ca.SX([4.0, 3.0]))
        SX([1, 2])
    """
    n = right.numel()
    rows = [[matrix[i, j] for j in range(n)] for i in range(n)]
    b = [right[i] for i in range(n)]
    for k in range(n):
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            for j in range(k + 1, n):
                rows[i][j] -= factor * rows[k][j]
            b[i] -= factor * b[k]
    found: list[Scalar] = [right[0]] * n
    for i in range(n - 1, -1, -1):
        found[i] = (b[i] - sum(rows[i][j] * found[j] for j in range(i + 1, n))) / rows[i][i]
    return ca.vertcat(*found)


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
