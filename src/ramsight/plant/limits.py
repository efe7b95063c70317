"""What a machine's own data state of the largest pressure, torque and load."""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.plant.oil import T40
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit
from ramsight.plant.valve import ReliefValve

_UNLIMITED = 350e5  # Pa; the usual highest pressure of mobile hydraulics, for a circuit without a relief valve


@dataclass(frozen=True)
class Limits:
    """Limits of a unit."""

    pressure: float  # highest setting of its relief valves [Pa]
    load: float  # that this pressure carries on the held side [N]
    pull: float  # that it holds on the other side, against a load that pulls [N]
    torque: float  # of the motor at this pressure on the side that asks for more [N m]
    side_torque: float  # the same with the pumps' friction, all of it on the pump that asks for most [N m]
    largest_torque: float  # that both sides together could ask for [N m]
    leak_velocity: float  # with which leakage moves the piston at this pressure and 40 degC [m/s]
    max_speed: float  # of the motor [rad/s]


def pump_reliefs(unit: HydraulicUnit) -> tuple[ReliefValve, ...]:
    """Relief valves that limit what the pumps press; those of a cylinder's ports open beyond what pumps can do."""
    reliefs = tuple(part for part in unit.parts() if isinstance(part, ReliefValve))
    pressed = {node for part in unit.parts() if isinstance(part, Pump) for node in (part.inlet, part.outlet)}
    return tuple(valve for valve in reliefs if valve.inlet in pressed) or reliefs


def limits_of(unit: HydraulicUnit) -> Limits:
    """The limits of a unit, from its parts."""
    parts = unit.parts()
    pressure = max((valve.setting for valve in pump_reliefs(unit)), default=_UNLIMITED)
    area = float(unit.cylinder.area(unit.held))
    pumps = [part for part in parts if isinstance(part, Pump)]
    viscosity, density = float(unit.oil.viscosity(T40)), float(unit.oil.density_at(T40))
    leak = sum(abs(float(p.leakage(0.0, pressure, viscosity, density))) for p in pumps)
    needed = [abs(float(p.shaft_torque(p.nominal_speed, pressure, viscosity))) for p in pumps]
    return Limits(
        pressure=float(pressure),
        load=float(pressure) * area,
        pull=float(pressure) * float(unit.cylinder.area("b" if unit.held == "a" else "a")),
        torque=float(unit.travel_per_radian) * float(pressure) * area,
        side_torque=max(needed),
        largest_torque=sum(needed),
        leak_velocity=leak / area,
        max_speed=float(unit.max_speed),
    )
