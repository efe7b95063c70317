"""Cylinder and body as a triangle: what the body's angle says of the piston's position."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ramsight.machine import linkage as description
from ramsight.plant.linkage import members


@dataclass(frozen=True)
class Lever:
    """A body that a cylinder turns about a pin; the cylinder's other end is pinned to what the body hangs on.

    Position and angle belong to each other by the law of cosines, (l0 + x)^2 = a^2 + b^2 - 2 a b cos(drawn - angle).
    """

    arm: float  # a, from the body's pin to the cylinder's pin on the body [m]
    base: float  # b, from the body's pin to the cylinder's other pin [m]
    drawn: float  # angle from the one to the other in the drawing, in which the body's angle is 0 [rad]
    retracted_length: float  # l0, of the cylinder from pin to pin [m]

    def position(self, angle: Any) -> Any:  # a number, an array or an expression
        """Of the piston [m], at an angle of the body [rad]; numbers, arrays and CasADi symbols alike."""
        return self._length(angle) - self.retracted_length

    def slope(self, angle: Any) -> Any:  # as in `position`
        """How the position follows the angle [m/rad]."""
        return -self.arm * self.base * ca.sin(self.drawn - angle) / self._length(angle)

    def angle(self, position: Any) -> Any:  # a number or an array, and the same comes back
        """Of the body [rad], at positions of the piston [m]; NaN where the triangle does not close.

        Example:
            >>> from ramsight import machine
            >>> boom = lever(machine.load_machine("mining-loader").linkage, "boom")
            >>> float(round(boom.position(boom.angle(0.3)), 9))
            0.3
        """
        length = self.retracted_length + np.asarray(position, dtype=np.float64)
        with np.errstate(invalid="ignore"):
            between = np.arccos((self.arm**2 + self.base**2 - length**2) / (2.0 * self.arm * self.base))
        return self.drawn - math.copysign(1.0, self.drawn) * between

    def _length(self, angle: Any) -> Any:  # as in `position`
        return ca.sqrt(self.arm**2 + self.base**2 - 2.0 * self.arm * self.base * ca.cos(self.drawn - angle))


def lever(spec: description.Linkage | None, cylinder: str) -> Lever | None:
    """The lever that a unit's cylinder turns.

    Args:
        spec: the mechanism; None for a machine without.

    Returns:
        None where the angle of the body that it moves does not follow from its position alone: it slides, or the
        cylinder's other end is on something that moves by itself.
    """
    if spec is None or cylinder not in spec.cylinders:
        return None
    moved = members.strut(spec, cylinder)
    body, (here, there, other) = spec.bodies[moved.joint], moved.pins
    if not isinstance(body, description.TurningBody) or other != body.parent:
        return None
    near = here[0] - body.pivot.x, here[1] - body.pivot.z
    far = there[0] - body.pivot.x, there[1] - body.pivot.z
    drawn = math.atan2(near[0] * far[1] - near[1] * far[0], near[0] * far[0] + near[1] * far[1])
    return Lever(math.hypot(*near), math.hypot(*far), drawn, moved.retracted_length)
