"""A mechanism in numbers, pose by pose: positions, coordinates, angles, tip, and the forces that hold it."""

from __future__ import annotations

from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from ramsight.arrays import Array
from ramsight.plant.linkage.dynamics import equations
from ramsight.plant.linkage.mechanism import Mechanism
from ramsight.plant.linkage.members import Linked, Spot, Turning


def positions(mechanism: Mechanism, joints: ArrayLike) -> Array:
    """Cylinder positions at joint coordinates.

    Args:
        joints: coordinates of the free joints [rad or m], shape (..., joints).

    Returns:
        Positions [m], shape (..., cylinders).
    """
    return _each(_functions(mechanism)["positions"], joints)


def joints(mechanism: Mechanism, positions: ArrayLike) -> Array:
    """Joint coordinates at cylinder positions, in closed form; NaN where the mechanism cannot be assembled.

    Joints that no cylinder moves are at 0.

    Args:
        positions: of the cylinders [m], shape (..., cylinders).

    Returns:
        Coordinates of the free joints [rad or m], shape (..., joints).

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linkage import build_mechanism, joints
        >>> boom, bucket = joints(build_mechanism(machine.load_machine("mining-loader").linkage), [0.7, 0.25])
        >>> f"{np.degrees(boom):.1f}, {np.degrees(boom + bucket):.1f} deg"
        '38.4, -0.0 deg'
    """
    return _each(_functions(mechanism)["joints"], positions)


def angles(mechanism: Mechanism, joints: ArrayLike) -> dict[str, Array]:
    """By how much each body is turned [rad], by name, shape (...); arguments as `positions`."""
    found = _each(_functions(mechanism)["angles"], joints)
    return {body.name: found[..., k] for k, body in enumerate(mechanism.bodies)}


def tip(mechanism: Mechanism, joints: ArrayLike) -> Array:
    """The tip, forward and up [m], shape (..., 2); arguments as `positions`."""
    return _each(_functions(mechanism)["tip"], joints)


def potential(mechanism: Mechanism, joints: ArrayLike, payload: float = 0.0) -> Array:
    """Potential energy [J] with a payload [kg], shape (...); 0 at z = 0 of the drawing; arguments as `positions`."""
    return _each(_functions(mechanism)["potential"], joints, [payload])[..., 0]


def holding_forces(
    mechanism: Mechanism, joints: ArrayLike, payload: float = 0.0, tip_force: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """Forces of the cylinders that hold the mechanism at rest, by virtual work.

    Args:
        joints: coordinates of the free joints [rad or m], shape (..., joints).
        payload: [kg].
        tip_force: on the tip, forward and up [N].

    Returns:
        Forces [N], positive where they press the rods out, shape (..., cylinders). Joints that no cylinder moves are
        taken to be held by something else.
    """
    return _each(_functions(mechanism)["forces"], joints, [payload, *tip_force])


def points(mechanism: Mechanism, joints: ArrayLike) -> dict[str, list[tuple[str, Array]]]:
    """Where the pins of each body are, for drawings.

    Args:
        joints: coordinates of the free joints [rad or m], shape (joints,).

    Returns:
        By body, "frame" among them: what each point is ("pivot", "link", "tip", "base of boom", "centre of mass",
        ...) and where it is, [x, z] in m.
    """
    poses = mechanism.poses([float(q) for q in np.asarray(joints)])
    found: dict[str, list[tuple[str, Array]]] = {name: [] for name in poses}
    for body, what, x, z in _pins(mechanism):
        found[body].append((what, np.array([float(value) for value in poses[body].at(x, z)])))
    return found


def _pins(mechanism: Mechanism) -> list[tuple[str, str, float, float]]:
    rows = []
    for body in mechanism.bodies:
        if isinstance(body, Turning):
            rows += [(name, "pivot", body.pivot_x, body.pivot_z) for name in (body.parent, body.name)]
        if isinstance(body, Linked):
            rows += [
                (body.name, f"link of {body.name}", body.pin_x, body.pin_z),
                (body.far, f"link of {body.name}", body.far_x, body.far_z),
            ]
        rows.append((body.name, "centre of mass", body.centre_x, body.centre_z))
    for strut in mechanism.struts:
        rows.append((strut.base, f"base of {strut.name}", strut.base_x, strut.base_z))
        rows.append((strut.rod, f"rod of {strut.name}", strut.rod_x, strut.rod_z))
    spots: list[Spot] = [spot for spot in (mechanism.tip, mechanism.load) if spot is not None]
    return rows + [(spot.body, spot.name, spot.x, spot.z) for spot in spots]


def _each(function: ca.Function, values: ArrayLike, others: ArrayLike = ()) -> Array:
    table = np.asarray(values, dtype=np.float64)
    flat = table.reshape(-1, table.shape[-1])
    arguments = [flat.T] if function.n_in() == 1 else [flat.T, np.tile(np.asarray(others)[:, None], len(flat))]
    return np.asarray(function(*arguments).full().T.reshape(*table.shape[:-1], -1))


@lru_cache(maxsize=32)
def _functions(mechanism: Mechanism) -> dict[str, ca.Function]:
    q = ca.SX.sym("q", len(mechanism.joints))
    rates, payload = ca.SX(q.numel(), 1), ca.SX.sym("payload")
    tip_force = ca.SX.sym("tip_force", 2)
    x = ca.SX.sym("x", len(mechanism.struts))
    found = equations(mechanism, q, rates, payload)
    held = found.weight - ca.mtimes(found.tip_jacobian.T, tip_force)
    moved = [mechanism.joints.index(strut.joint) for strut in mechanism.struts]
    forces = ca.solve(found.jacobian[:, moved].T, held[moved])
    others = ca.vertcat(payload, tip_force)
    return {
        "positions": ca.Function("positions", [q], [found.positions]),
        "joints": ca.Function("joints", [x], [ca.vertcat(*mechanism.solved(ca.vertsplit(x)))]),
        "angles": ca.Function("angles", [q], [ca.vertcat(*found.angles.values())]),
        "tip": ca.Function("tip", [q], [ca.vertcat(found.tip_x, found.tip_z)]),
        "potential": ca.Function("potential", [q, payload], [found.potential]),
        "forces": ca.Function("forces", [q, others], [forces]),
    }
