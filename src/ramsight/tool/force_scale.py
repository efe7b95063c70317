"""What is known of a machine as scales: a gain and an offset of the force, and how both differ up and down.

    F = (1 + a + d e) F_m + o + d f

F_m is the sensor's load, d is +1 where it lifts and -1 where it lowers. a is the torque's gain, e the pumps' losses, o
the offset of the torque and the weight of what the drawing leaves out, f the cylinder's friction. Each known mass is
one equation of these four. They are normal, so that a known mass is one step of recursive least squares.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.tool.weighing_limits import BODIES_STD, DRIFT_STD, FRICTION_STD, LOSSES_STD, OFFSET_STD

TERMS = ("gain", "gain_by_direction", "offset", "offset_by_direction")
UNITS = ("1", "1", "N", "N")


@dataclass(frozen=True, eq=False)
class Scale:
    """The four terms with their covariance."""

    value: Array  # of the terms [1, 1, N, N]
    covariance: Array  # of them, shape (4, 4)
    masses: int = 0  # known masses that it was learned from

    @property
    def std(self) -> Array:
        """Standard deviations of the terms."""
        return np.sqrt(np.diag(self.covariance))

    def mass(self, plain: float, row: Array) -> tuple[float, float]:
        """A mass by the described machine, corrected, with the deviation that the terms leave it [kg]."""
        return plain + float(row @ self.value), math.sqrt(max(float(row @ self.covariance @ row), 0.0))

    def learned(self, plain: float, row: Array, known: float, std: float) -> Scale:
        """The scale after a mass that is known.

        Args:
            plain: mass by the described machine [kg].
            row: its change by each term [kg, kg, kg/N, kg/N].
            known: the mass [kg].
            std: deviation of a weighing by itself, and of the known mass [kg].

        Example:
            >>> before = Scale(np.zeros(4), np.diag([1e-3, 1e-4, 1e4, 1e3]))
            >>> row = np.array([5000.0, 5000.0, 0.025, 0.025])
            >>> after = before.learned(3900.0, row, 4000.0, 10.0)
            >>> round(after.mass(3900.0, row)[0]), bool((after.std < before.std).all()), after.masses
            (4000, True, 1)
        """
        gain = self.covariance @ row / (float(row @ self.covariance @ row) + std**2)
        left = np.eye(len(row)) - np.outer(gain, row)
        covariance = left @ self.covariance @ left.T + np.outer(gain, gain) * std**2
        value = self.value + gain * (known - self.mass(plain, row)[0])
        return Scale(value, covariance, self.masses + 1)


def described_scale(unit: HydraulicUnit, weight: float) -> Scale:
    """What a description says of a unit as scales.

    Args:
        weight: force of its rods without payload [N].
    """
    assumed = unit.assumptions
    gain = math.hypot(assumed.drive.torque_gain, assumed.machine.displacement, DRIFT_STD)
    offset = math.hypot(OFFSET_STD * limits_of(unit).load, BODIES_STD * weight)
    friction = FRICTION_STD * unit.cylinder.coulomb_friction
    return Scale(np.zeros(len(TERMS)), np.diag(np.square([gain, LOSSES_STD, offset, friction])))
