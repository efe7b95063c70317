"""One side of a unit in a sensor's eyes: what its pump delivers, what torque its pressure costs, what it can store."""

from __future__ import annotations

from typing import Any, Self

import casadi as ca

from ramsight.plant.cylinder import Cylinder
from ramsight.plant.ddh import DdhUnit, Side
from ramsight.plant.hose import Hose
from ramsight.plant.pump import friction_coefficient
from ramsight.plant.unit import opposite
from ramsight.plant.valve import orifice_flow


class Chamber:
    """One side of the unit as a sensor sees it, in numbers or in symbols.

    Args:
        side: its parts.
        area: piston area on this side [m2].
        dead_volume: chamber volume at zero stroke of this side [m3].
        flow_sign: +1 if positive motor speed pumps into it, else -1.
        oil: the oil.
    """

    def __init__(self, side: Side, area: Any, dead_volume: Any, flow_sign: float, oil: Any) -> None:
        self.side, self.area, self.dead_volume = side, area, dead_volume
        self.flow_sign, self.oil = flow_sign, oil
        self.belt = side.pump.belt

    @classmethod
    def of(cls, side: Side, name: str, cylinder: Cylinder, oil: Any) -> Self:
        """The chamber of side "a" or "b"."""
        return cls(side, cylinder.area(name), cylinder.dead_volume(name), 1.0 if name == "a" else -1.0, oil)

    @classmethod
    def pair(cls, unit: DdhUnit) -> tuple[Self, Self]:
        """The load-holding side and the other one, in numbers."""
        held, other = (
            cls.of(getattr(unit, name), name, unit.cylinder, unit.oil) for name in (unit.held, opposite(unit.held))
        )
        return held, other

    def delivered(self, angle: Any) -> Any:
        """Oil that the pump moves into this side while the motor turns by an angle [m3]."""
        return self.flow_sign * self.side.pump.displacement * self.belt * angle

    def torque_per_pressure(self, direction: Any) -> Any:
        """Motor torque per gauge pressure, friction included [N m/Pa]; eqs 4, 7, 8."""
        pump = self.side.pump
        friction = friction_coefficient(pump.displacement, pump.hydromechanical_efficiency)
        return self.belt * (self.flow_sign * pump.displacement + direction * friction)

    def leak_per_pressure(self, pressure: Any, viscosity: Any) -> Any:
        """Leakage over the pressure that drives it, near a pressure [Pa], with this viscosity [m2/s]; [m3/s/Pa]."""
        pump = self.side.pump
        laminar = pump.leak_coefficient(viscosity, self.oil.density)
        if pump.orifice_leak is None:
            return laminar
        near = ca.fmax(ca.fabs(pressure), 1.0)
        return laminar + orifice_flow(pump.orifice_leak, near) / near

    def direction(self, motor_speed: Any) -> Any:
        """How far friction has developed, -1 ... 1; eq. 7."""
        return ca.tanh(4.0 * self.belt * motor_speed / self.side.pump.threshold_speed)

    @property
    def manifold_capacity(self) -> Any:
        """Of the manifold [m3/Pa]."""
        return self.side.manifold.volume / self.oil.bulk_modulus

    def capacity(self, travel: Any) -> Any:
        """Of hose and chamber [m3/Pa] with the piston `travel` [m] away from this side's end."""
        hose: Hose = self.side.hose
        return hose.volume / hose.bulk_modulus + (self.dead_volume + self.area * travel) / self.oil.bulk_modulus
