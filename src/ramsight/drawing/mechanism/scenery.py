"""What stands around a machine's arm in a drawing: chassis, wheels, a heap. For the eye only; no equation knows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.drawing.mechanism.bucket import DENSITY, WIDTH

#: of the bodies, in their order
COLOURS = ("#c98a1b", "#4d7c8a", "#8a4f7d", "#5b8c5a")
GHOST = "#c8401e"  # of an estimate
ROCK = "#5b4a37"  # payload
_WHEEL, _BETWEEN = 0.36, 1.55  # of the arm's height: radius of a wheel; distance of the axles
# Corners behind the arm's pins, in shares of its height: low and flat as loaders for mines are, a cab in the middle.
_CHASSIS = (
    (0.12, 0.25), (0.12, 1.1), (-0.1, 1.22), (-0.55, 0.95), (-0.75, 0.95), (-0.8, 1.35), (-1.35, 1.35), (-1.42, 0.95),
    (-2.15, 0.9), (-2.25, 0.7), (-2.2, 0.3),
)  # fmt: skip
# Corners behind a mast's foot, in shares of the truck's height, its counterweight behind; and where the axles are.
_TRUCK = (
    (-0.15, 0.12), (-0.15, 0.5), (-0.3, 0.55), (-0.38, 0.42), (-0.75, 0.42), (-0.8, 0.55), (-1.15, 0.5), (-1.2, 0.15),
)  # fmt: skip
_TRUCK_WHEEL, _TRUCK_AXLES, _TRUCK_HIGH = 0.13, (-0.3, -1.0), 2.1  # the last in m


@dataclass(frozen=True)
class Scenery:
    """Shapes that do not move; all points are [x, z] in m, the ground is z = 0."""

    chassis: Array  # corners, shape (n, 2)
    wheels: Array  # centres, shape (2, 2)
    radius: float  # of the wheels [m]

    @property
    def outline(self) -> Array:
        """Points that hold everything, shape (n, 2)."""
        box = self.radius * np.array([[-1.0, -1.0], [1.0, 1.0]])
        return np.concatenate([self.chassis, *(wheel + box for wheel in self.wheels)])


def scenery(frame: Sequence[Array]) -> Scenery:
    """A chassis with wheels behind the pins that a mechanism has on the machine.

    Args:
        frame: these pins, [x, z] in m; the highest of them, above the ground, gives the scale.

    Example:
        >>> around = scenery([np.array([0.0, 1.6]), np.array([0.1, 1.0])])
        >>> around.wheels.shape, bool((around.wheels[:, 1] == around.radius).all())
        ((2, 2), True)
    """
    pins = np.array(frame)
    height = max(float(pins[:, 1].max()), 0.0)
    foot = np.array([float(pins[:, 0].min()), 0.0])
    radius = _WHEEL * height
    axles = [foot + np.array([-0.2 * height - k * _BETWEEN * height, radius]) for k in range(2)]
    return Scenery(foot + height * np.array(_CHASSIS), np.array(axles), radius)


def truck(frame: Sequence[Array]) -> Scenery:
    """A truck behind the foot of a mast.

    Args:
        frame: pins on the machine, [x, z] in m.

    Example:
        >>> bool(truck([np.array([0.0, 0.1])]).chassis[:, 0].max() < 0.0)
        True
    """
    x = min(float(pin[0]) for pin in frame)
    radius = _TRUCK_HIGH * _TRUCK_WHEEL
    axles = [(x + _TRUCK_HIGH * one, radius) for one in _TRUCK_AXLES]
    return Scenery(np.array([x, 0.0]) + _TRUCK_HIGH * np.array(_TRUCK), np.array(axles), radius)


def heap_radius(payload: float) -> float:
    """Radius [m] of a round heap of so much rock [kg] over the bucket's width.

    Example:
        >>> round(heap_radius(7750.0), 2)
        0.77
    """
    return math.sqrt(max(payload, 0.0) / (DENSITY * WIDTH * math.pi))
