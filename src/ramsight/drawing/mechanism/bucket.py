"""A bucket's shell, for the eye: curved floor, back, cheek and tooth from three pins of a mechanism.

No equation knows it. What is drawn of the payload has the size of its volume.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ramsight.arrays import Array

DENSITY, WIDTH = 1900.0, 2.2  # kg/m3 of broken rock, m of the bucket, [G]: what makes a heap of a mass
_HIGH = 0.9  # of the top edge over the floor, over the floor's length; a bucket is about as deep as it is high
_STEPS = 9  # corners of each curve


@dataclass(frozen=True)
class Bucket:
    """A bucket in one pose; points are [x, z] in m."""

    outline: Array  # of cheek, floor, back and tooth, closed, shape (corners, 2)
    inside: Array  # from the lip along floor and back to the top edge, shape (corners, 2)

    @property
    def struck(self) -> float:
        """Area between inside and the line from lip to top edge [m2]."""
        return _area(self.inside)


def bucket(pivot: ArrayLike, rod: ArrayLike, lip: ArrayLike) -> Bucket:
    """A bucket whose floor leads from its pivot to its lip, its top edge above, on the side of the cylinder's pin.

    Args:
        pivot: pin on the boom, [x, z] in m.

    Example:
        >>> shell = bucket([0.0, 0.0], [0.0, 0.6], [1.5, 0.0])
        >>> bool((shell.outline[:, 0].max() == 1.5) and 0.5 < shell.struck < 1.5)
        True
    """
    here, top_pin, front = (np.asarray(place, dtype=np.float64) for place in (pivot, rod, lip))
    length = float(np.linalg.norm(front - here))
    along = (front - here) / length
    up = np.array([-along[1], along[0]])
    up = up if float(up @ (top_pin - here)) > 0.0 else -up
    inside, outline = _profile(float(along @ (top_pin - here)) / length, float(up @ (top_pin - here)) / length)
    return Bucket(*(here + length * (line[:, :1] * along + line[:, 1:] * up) for line in (outline, inside)))


def _profile(x: float, z: float) -> tuple[Array, Array]:
    """Inside and outline of a bucket whose floor has length 1, its cylinder's pin at a place over it."""
    top = max(x, 0.0) + 0.22, max(_HIGH, z + 0.12)
    inside = (
        _curve((0.94, 0.03), (0.45, -0.03), (0.24, 0.06)),
        _curve((0.13, 0.14), (0.02, 0.5), (top[0], top[1] - 0.03)),
    )
    ears = (-0.045, 0.0), (-0.03, 0.05), (x - 0.05, z - 0.03), (x - 0.02, z + 0.05), (top[0] - 0.05, top[1] + 0.03), top
    outline = (
        np.array([(1.0, 0.0), (0.9, -0.035)]),
        _curve((0.8, -0.04), (0.3, -0.1), (0.02, -0.05)),
        np.array(ears),
        _curve((top[0], top[1] - 0.08), (0.42, 0.26), (0.82, 0.09)),
    )
    return np.concatenate(inside), np.concatenate(outline)


def _curve(begin: ArrayLike, by: ArrayLike, end: ArrayLike) -> Array:
    """Corners of a quadratic Bézier curve."""
    share = np.linspace(0.0, 1.0, _STEPS)[:, None]
    first, middle, last = (np.asarray(place, dtype=np.float64) for place in (begin, by, end))
    return np.asarray((1.0 - share) ** 2 * first + 2.0 * share * (1.0 - share) * middle + share**2 * last)


def _area(outline: Array) -> float:
    """Area of a polygon [m2]."""
    x, z = outline.T
    return 0.5 * abs(float(x @ np.roll(z, -1) - z @ np.roll(x, -1)))
