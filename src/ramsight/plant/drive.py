"""The electric drive that turns the pumps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ramsight.plant.circuit import Circuit


@dataclass(frozen=True)
class IdealDrive:
    """A motor that follows its speed command exactly and gives the torque that this takes.

    Args:
        name: of the part.
        inertia: of rotor, belt and pumps at the motor shaft [kg m2].
    """

    name: str
    inertia: float

    def connect(self, circuit: Circuit) -> None:
        """Add the rotor's share of the torque and its energy."""
        circuit.shaft_torque(self.inertia * circuit.motor_acceleration)
        circuit.stored("rotor", 0.5 * self.inertia * circuit.motor_speed * circuit.motor_speed)
