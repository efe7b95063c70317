"""The direct driven hydraulic unit: one motor, a pump on each side of the cylinder, and the valves around them.

Each side s of the cylinder is tank - pump - manifold - safety valve - line - hose - chamber, with a relief and an
anti-cavitation valve between manifold and tank. The safety valve on the load-holding side opens only when the motor
lowers; the other one is held open.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

from ramsight.errors import DescriptionError
from ramsight.machine.description import DirectDriven, Unit
from ramsight.machine.parts import Pump as PumpDescription
from ramsight.plant import described
from ramsight.plant.circuit import TANK, Part
from ramsight.plant.hose import Hose, Volume
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import CheckValve, ReliefValve, SafetyValve


@dataclass(frozen=True)
class Side:
    """The parts of one side of the unit."""

    pump: Pump
    manifold: Volume
    relief: ReliefValve
    anticavitation: CheckValve
    safety: SafetyValve
    hose: Hose

    def parts(self) -> tuple[Part, ...]:
        """All of them."""
        return (self.pump, self.manifold, self.relief, self.anticavitation, self.safety, self.hose)


@dataclass(frozen=True, kw_only=True)
class DdhUnit(HydraulicUnit):
    """The unit's parts on both sides of the cylinder, and what is common to them."""

    a: Side
    b: Side

    def parts(self) -> tuple[Part, ...]:
        """All parts."""
        return (self.drive, self.cylinder, *self.a.parts(), *self.b.parts(), *self.extra)

    def mapped(self, change: Callable[[Any], Any]) -> DdhUnit:  # as in `HydraulicUnit`
        """The unit with every part of its sides, and every further one, replaced by what `change` makes of it."""
        a, b = (Side(**{f.name: change(getattr(s, f.name)) for f in fields(s)}) for s in (self.a, self.b))
        return replace(self, a=a, b=b, extra=tuple(change(part) for part in self.extra))

    @property
    def held_side(self) -> Side:
        """The parts of that side."""
        return self.a if self.held == "a" else self.b

    @property
    def max_velocity(self) -> float:
        """Velocity of the piston at the highest motor speed, without leakage [m/s]."""
        return self.max_speed * self.travel_per_radian


def build_ddh(name: str, unit: Unit) -> DdhUnit:
    """The parts of a described unit.

    Args:
        unit: its description, of the circuit "ddh".

    Raises:
        DescriptionError: the unit has another circuit.
    """
    if not isinstance(unit, DirectDriven):
        raise DescriptionError(
            "this needs a direct-driven unit", key=f"units.{name}.circuit", value=unit.circuit, allowed="ddh"
        )
    lift_sign = float(unit.lift_sign)
    return DdhUnit(
        name=name,
        oil=described.oil(unit.oil),
        tank_pressure=unit.tank.pressure,
        drive=described.drive(unit.drive),
        cylinder=described.cylinder(unit),
        a=_side("a", unit, unit.pump_a),
        b=_side("b", unit, unit.pump_b),
        lift_sign=lift_sign,
        max_speed=unit.drive.max_speed,
        extra=_port_reliefs(unit),
        assumptions=unit.assumptions,
        heat=described.heat(unit.heat),
    )


def _port_reliefs(unit: DirectDriven) -> tuple[Part, ...]:
    """Relief valves of both chambers, where the machine has them."""
    spec = unit.port_relief_valve
    if spec is None:
        return ()
    return tuple(described.relief_valve(spec, f"port_relief_{side}", f"chamber_{side}", TANK) for side in "ab")


def _side(name: str, unit: DirectDriven, pump: PumpDescription) -> Side:
    manifold, line, chamber = f"manifold_{name}", f"line_{name}", f"chamber_{name}"
    inlet, outlet = (TANK, manifold) if name == "a" else (manifold, TANK)
    return Side(
        pump=described.pump(pump, f"pump_{name}", inlet, outlet, unit.oil.bulk_modulus),
        manifold=Volume(manifold, manifold, unit.manifold.volume),
        relief=described.relief_valve(unit.relief_valve, f"relief_{name}", manifold, TANK),
        anticavitation=described.check_valve(unit.anticavitation_valve, f"anticavitation_{name}", TANK, manifold),
        safety=described.safety_valve(
            unit.safety_valve, f"safety_{name}", manifold, line, float(unit.lift_sign), name == unit.load_side
        ),
        hose=described.hose(unit.hose, f"hose_{name}", line, chamber),
    )
