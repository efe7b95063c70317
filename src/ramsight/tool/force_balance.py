"""Force of a unit's rods as the mechanism asks for it: of its bodies, and per kilogram of payload.

M(q) q'' + c(q, q') + G(q) = J' F. Where the other cylinders do not move, the virtual work of a unit's own rods is
F dx, so F = J^-T (M q'' + c + G): a row a cylinder, linear in the payload. G is taken in the direction of gravity that
the machine's inclination leaves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np

from ramsight.arrays import Array
from ramsight.expression import Real, Scalar, Vector
from ramsight.plant.linkage import Mechanism
from ramsight.plant.linkage.dynamics import equations


@dataclass(frozen=True)
class Balance:
    """Force that the rods of a unit need, positive extends; each an array of shape (samples,)."""

    bodies: Array  # without payload, at rest [N]
    payload: Array  # per payload, at rest [N/kg]
    # bodies_moving, payload_moving: what acceleration and speed add to them [N], [N/kg]
    bodies_moving: Array
    payload_moving: Array


def balance(
    mechanism: Mechanism, unit: str, position: Array, velocity: Array, acceleration: Array, inclination: float = 0.0
) -> Balance:
    """The force balance of a mechanism in motion.

    Args:
        position: of the cylinders [m], shape (samples, cylinders).
        velocity: of the cylinders [m/s], of the same shape.
        acceleration: of the cylinders [m/s2], of the same shape.
        inclination: of the machine, its front up [rad].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linkage import build_mechanism
        >>> loader = build_mechanism(machine.load_machine("mining-loader").linkage)
        >>> still = np.zeros((1, 2))
        >>> found = balance(loader, "boom", np.array([[0.35, 0.25]]), still, still)
        >>> round(float(found.bodies[0]), -2), round(float(found.payload[0]), 1)
        (91600.0, 41.6)
    """
    tilt = np.full(len(position), inclination)
    found = forces(mechanism)(position.T, velocity.T, acceleration.T, tilt[None, :])
    row = mechanism.cylinders.index(unit)
    bodies, loaded, bodies_moving, loaded_moving = (one.full()[row] for one in found)
    return Balance(bodies, loaded - bodies, bodies_moving, loaded_moving - bodies_moving)


@lru_cache(maxsize=16)
def forces(mechanism: Mechanism) -> ca.Function:
    """Forces at rest and those that motion adds, without payload and with one kilogram."""
    x, v, a = (ca.SX.sym(name, len(mechanism.struts)) for name in "xva")
    tilt = ca.SX.sym("tilt")
    joint = ca.vertcat(*mechanism.solved(ca.vertsplit(x)))
    rate = ca.jtimes(joint, x, v)
    change = ca.jtimes(rate, x, v) + ca.jtimes(joint, x, a)
    parts = _torques(mechanism)(joint, rate, change, tilt)
    moved = [mechanism.joints.index(strut.joint) for strut in mechanism.struts]
    jacobian = ca.jacobian(ca.vertcat(*(joint[k] for k in moved)), x)  # turns of joints for ways of the cylinders
    return ca.Function(
        "balance", [x, v, a, tilt], [ca.mtimes(jacobian.T, ca.vertcat(*(part[k] for k in moved))) for part in parts]
    )


def _torques(mechanism: Mechanism) -> ca.Function:
    """Generalized forces at the joints, at rest and by motion, without payload and with one kilogram."""
    q = ca.SX.sym("q", len(mechanism.joints))
    rates, accelerations = ca.SX.sym("rates", q.numel()), ca.SX.sym("accelerations", q.numel())
    tilt = ca.SX.sym("tilt")
    still = replace(mechanism, gravity=0.0)
    found = [ca.gradient(_potential(mechanism, q, payload, tilt), q) for payload in (0.0, 1.0)]
    for payload in (0.0, 1.0):
        moving = equations(still, q, rates, ca.SX(payload))
        found.append(ca.mtimes(moving.mass_matrix, accelerations) + moving.bias)
    return ca.Function("torques", [q, rates, accelerations, tilt], found)


def _potential(mechanism: Mechanism, q: Vector, payload: float, tilt: Scalar) -> Real:
    poses = mechanism.poses(ca.vertsplit(q))
    weights = [(body.mass, poses[body.name].at(body.centre_x, body.centre_z)) for body in mechanism.bodies]
    if mechanism.load is not None:
        weights.append((payload, poses[mechanism.load.body].at(mechanism.load.x, mechanism.load.z)))
    lifted = sum((mass * (ca.cos(tilt) * z + ca.sin(tilt) * x) for mass, (x, z) in weights), start=ca.SX(0.0))
    return mechanism.gravity * lifted
