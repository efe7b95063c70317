"""A point of the mechanism at the positions of the cylinders: reach, height and angle, with standard deviations.

With J the derivative of the place by the positions and S their covariance, the place has J S J'. Where the place bends
within a standard deviation of the positions, or an angle of its triangles nearly vanishes, J says too little: there the
place is sampled at the nodes of Gauss and Hermite.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.errors import UnknownNameError
from ramsight.machine.linkage import Linkage
from ramsight.plant.linkage import Mechanism
from ramsight.plant.linkage.members import Spot, spot

PLACE = ("reach", "height", "angle")
_BENDS = 0.1  # share of the place's deviation by which a straight line is off, from which on the place is sampled
_NOTHING = 1e-9  # m and rad, of rounding
_NODES = 5  # of a cylinder: exact for polynomials up to the ninth degree


def tool_point(linkage: Linkage, name: str) -> Spot:
    """The point of a name, ``tip`` or ``bucket.edge``.

    Raises:
        UnknownNameError: there is none.

    Example:
        >>> from ramsight import machine
        >>> tool_point(machine.load_machine("mining-loader").linkage, "boom.pivot")
        Spot(name='boom.pivot', body='boom', x=0.0, z=1.65)
    """
    known = linkage.spots
    if name not in known:
        raise UnknownNameError("point of the tool", name, known)
    return spot(known[name], name)


@dataclass(frozen=True)
class Place:
    """Where a point is; each an array, shape (samples,)."""

    # reach and height in the machine's frame [m], angle of the point's body against the drawing [rad]
    value: Mapping[str, Array]
    std: Mapping[str, Array]  # their standard deviations, in the same units


def place_of(
    mechanism: Mechanism, point: Spot, positions: Array, stds: Array, strokes: Array, correlation: float = 0.0
) -> Place:
    """Where a point is at positions of the cylinders.

    Args:
        positions: of the cylinders [m], shape (samples, cylinders); NaN where unknown.
        stds: their standard deviations [m], of the same shape.
        strokes: of the cylinders [m], shape (cylinders,).
        correlation: of the positions' errors, between any two cylinders [1].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linkage import build_mechanism
        >>> loader = build_mechanism(machine.load_machine("mining-loader").linkage)
        >>> found = place_of(loader, loader.tip, np.array([[0.4, 0.25]]), np.full((1, 2), 1e-3), np.array([0.7, 0.5]))
        >>> round(float(found.value["height"][0]), 2), round(float(found.std["height"][0]), 4)
        (1.65, 0.005)
    """
    at, slope = _functions(mechanism, point)
    count = positions.shape[1]
    value = at(positions.T).full().T
    jacobian = slope(positions.T).full().T.reshape(len(positions), count, len(PLACE))
    roots = stds[:, :, None] * _root(count, correlation)  # of each covariance, (samples, cylinders, cylinders)
    moves = np.einsum("nkp,nkj->njp", jacobian, roots)
    std = np.sqrt(np.sum(moves**2, axis=1))
    bent = _bends(at, positions, value, roots, moves, std)
    if bent.any():
        std[bent] = _sampled(at, positions[bent], value[bent], roots[bent], strokes)
    return Place(dict(zip(PLACE, value.T, strict=True)), dict(zip(PLACE, std.T, strict=True)))


def _root(count: int, correlation: float) -> Array:
    """Symmetric square root of the correlation matrix."""
    sizes, ways = np.linalg.eigh(np.eye(count) * (1.0 - correlation) + correlation)
    return np.asarray(ways * np.sqrt(np.maximum(sizes, 0.0)) @ ways.T)


def _bends(
    at: ca.Function, positions: Array, value: Array, roots: Array, moves: Array, std: Array
) -> NDArray[np.bool_]:
    """Samples whose place a straight line does not follow over a deviation, or which cannot be assembled there."""
    bends = np.zeros(len(value), dtype=bool)
    known = np.isfinite(value).all(axis=1) & np.isfinite(roots).all(axis=(1, 2))
    for k in range(roots.shape[2]):
        for sign in (1.0, -1.0):
            moved = at((positions + sign * roots[:, :, k]).T).full().T - value
            off = np.abs(moved - sign * moves[:, k])
            bends |= ~(off <= _BENDS * std + _NOTHING).all(axis=1)
    return np.asarray(bends & known)


def _sampled(at: ca.Function, positions: Array, value: Array, roots: Array, strokes: Array) -> Array:
    """Root mean square of the way from the place, over positions within the strokes where it can be assembled."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    squares, total = np.zeros_like(value), np.zeros_like(value)
    for choice in product(range(_NODES), repeat=positions.shape[1]):
        there = np.clip(positions + roots @ nodes[list(choice)], 0.0, strokes)
        way = at(there.T).full().T - value
        way[:, -1] = np.angle(np.exp(1j * way[:, -1]))
        weight = np.prod(weights[list(choice)]) * np.isfinite(way)
        squares += weight * np.nan_to_num(way) ** 2
        total += weight
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sqrt(squares / total))


def place_law(mechanism: Mechanism, point: Spot) -> ca.Function:
    """Positions of the cylinders [m] to reach [m], height [m] and angle [rad] of a point, as a graph."""
    return _functions(mechanism, point)[0]


@lru_cache(maxsize=16)
def _functions(mechanism: Mechanism, point: Spot) -> tuple[ca.Function, ca.Function]:
    """Place at positions, and the place's derivatives, those by the first cylinder before those by the next."""
    x = ca.SX.sym("x", len(mechanism.struts))
    pose = mechanism.poses(mechanism.solved(ca.vertsplit(x)))[point.body]
    place = ca.vertcat(*pose.at(point.x, point.z), pose.angle)
    slope = ca.vertcat(*(ca.jacobian(place, x[k]) for k in range(x.numel())))
    return ca.Function("place", [x], [place]), ca.Function("slope", [x], [slope])
