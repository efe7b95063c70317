"""What follows from a unit at steady state: areas, ratios, travel per revolution, pressure and torque at a load."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ramsight.errors import DescriptionError
from ramsight.expression import Real
from ramsight.plant.limits import pump_reliefs
from ramsight.plant.oil import ATMOSPHERE
from ramsight.plant.pump import Pump
from ramsight.plant.unit import HydraulicUnit, opposite, pumped_into, side_nodes

_ROUNDS = 60  # of the fixed point between velocity and viscous friction, which contracts a thousandfold a round


@dataclass(frozen=True)
class Derived:
    """What follows from a unit's description. All in SI."""

    area_a: float  # piston area, all cylinders [m2]
    area_b: float  # annulus area on the rod side, all cylinders [m2]
    area_ratio: float  # area_b over area_a [1]
    geared_displacement_a: float  # volume that the pumps move into side A per motor radian [m3/rad]
    geared_displacement_b: float  # volume that they move out of side B per motor radian [m3/rad]
    geared_flow_ratio: float  # geared_displacement_b over geared_displacement_a [1]
    mismatch: float  # geared_flow_ratio over area_ratio, less one [1]; positive if pump B moves too much oil
    travel_a: float  # travel per motor radian that side A's flow gives without leakage [m/rad]
    travel_b: float  # the same of side B's [m/rad]
    relief_pressure: float  # at which the load's side is relieved, absolute [Pa]; infinite without a relief valve
    load_at_relief: float  # load that the relief pressure balances, tank pressure on the other side [N]
    load_at_relief_after_friction: float  # that, less the breakaway friction [N]


@dataclass(frozen=True)
class OperatingPoint:
    """Steady lifting and lowering of one load at one motor speed. All in SI; torques signed as the motor's."""

    pressure_lift: float  # pressure of the load-holding chamber while lifting [Pa]
    pressure_lower: float  # the same while lowering [Pa]
    torque_lift: float  # motor torque while lifting [N m]
    torque_lower: float  # motor torque while lowering [N m]; of lifting's sign while the load drives the motor
    travel_lift: float  # travel per motor radian while lifting, a magnitude [m/rad]
    travel_lower: float  # the same while lowering [m/rad]


def derive(unit: HydraulicUnit) -> Derived:
    """Work out what follows from a unit's parts.

    Args:
        unit: the unit.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.ddh import build_ddh
        >>> boom = derive(build_ddh("boom", machine.load_machine("mining-loader").unit("boom")))
        >>> round(boom.area_ratio, 3), round(boom.geared_flow_ratio, 3)
        (0.609, 0.613)
    """
    cylinder, (held, other) = unit.cylinder, _areas(unit)
    area_a, area_b = cylinder.area_a, cylinder.area_b
    geared_a, geared_b = pumped_into(unit, "a"), -pumped_into(unit, "b")
    nodes = side_nodes(unit, unit.held)
    reliefs = [valve.setting for valve in pump_reliefs(unit) if valve.inlet in nodes]
    relief = min(reliefs, default=math.inf) + unit.tank_pressure
    at_relief = relief * held - unit.tank_pressure * other - unit.lift_sign * ATMOSPHERE * (area_a - area_b)
    pressed = (cylinder.pressure_friction or 0.0) * at_relief
    return Derived(
        area_a=area_a,
        area_b=area_b,
        area_ratio=area_b / area_a,
        geared_displacement_a=geared_a,
        geared_displacement_b=geared_b,
        geared_flow_ratio=geared_b / geared_a,
        mismatch=geared_b / geared_a / (area_b / area_a) - 1.0,
        travel_a=geared_a / area_a,
        travel_b=geared_b / area_b,
        relief_pressure=relief,
        load_at_relief=at_relief,
        load_at_relief_after_friction=at_relief - cylinder.breakaway_friction - pressed,
    )


def _areas(unit: HydraulicUnit) -> tuple[float, float]:
    """Piston area of the side that holds the load, and of the other one [m2]."""
    return unit.cylinder.area(unit.held), unit.cylinder.area(opposite(unit.held))


def torque_at_load(
    unit: HydraulicUnit,
    load: float,
    temperature: float = 313.15,
    speed: float = 50 * math.pi,
    *,
    low_side: float | None = None,
    tank: float | None = None,
    atmosphere: float = ATMOSPHERE,
) -> OperatingPoint:
    """Pressure, motor torque and travel per revolution when a load is lifted and lowered at constant speed.

    The holding chamber balances load, friction and the other chamber. Its pump gives D w less the leakage
    K_HP dp (eqs 9, 10), and takes D dp and the friction (tau0 + K_TP `|dp|`) in the direction of rotation
    (eqs 7, 8). Line and valve losses are left out.

    Args:
        unit: the unit.
        load: force that presses against the lifting direction [N].
        temperature: oil temperature [K]; 40 °C if omitted.
        speed: magnitude of the motor speed [rad/s]; 1500 rpm if omitted.
        low_side: absolute pressure of the chamber that does not hold the load [Pa]; the tank's if omitted.
        tank: absolute pressure at the pumps' tank port [Pa]; the tank's if omitted.
        atmosphere: pressure on the rod's end [Pa].

    Raises:
        DescriptionError: the speed is not above zero.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.ddh import build_ddh
        >>> boom = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
        >>> point = torque_at_load(boom, 441e3, low_side=2e5, tank=0.0, atmosphere=0.0)
        >>> round(point.torque_lift, 1), round(point.torque_lower, 1)
        (68.0, 51.7)
    """
    if not speed > 0:
        raise DescriptionError("a steady motion needs a motor speed above zero", value=speed)
    tank = unit.tank_pressure if tank is None else tank
    low = unit.tank_pressure if low_side is None else low_side
    rod = unit.lift_sign * atmosphere * (unit.cylinder.area_a - unit.cylinder.area_b)
    lift, lower = (_steady(unit, load + rod, temperature, turn * speed, low, tank) for turn in (1.0, -1.0))
    return OperatingPoint(
        pressure_lift=lift[0],
        pressure_lower=lower[0],
        torque_lift=lift[1],
        torque_lower=lower[1],
        travel_lift=lift[2] / speed,
        travel_lower=lower[2] / speed,
    )


def _steady(
    unit: HydraulicUnit, force: float, temperature: float, lifting_speed: float, low: float, tank: float
) -> tuple[float, float, float]:
    """Return held pressure [Pa], motor torque [N m] and magnitude of the velocity [m/s] at a motor speed."""
    area, other = _areas(unit)
    held = side_nodes(unit, unit.held)
    unloaded = side_nodes(unit, opposite(unit.held))
    pumps = [part for part in unit.parts() if isinstance(part, Pump)]
    viscosity, density = unit.oil.viscosity(temperature), unit.oil.density_at(temperature)
    direction = math.copysign(1.0, lifting_speed)
    turning = unit.lift_sign * lifting_speed
    cylinder = unit.cylinder
    pressure = velocity = 0.0

    def ends(pump: Pump) -> tuple[float, float]:
        there = [pressure if node in held else low if node in unloaded else tank for node in (pump.inlet, pump.outlet)]
        return there[0], there[1]

    def rise(pump: Pump) -> float:
        inlet, outlet = ends(pump)
        return outlet - inlet

    def into_held(pump: Pump) -> float:
        speed: Real = pump.belt * turning
        leakage = pump.leakage(speed, rise(pump), viscosity, density)
        speed = pump.driven_speed(speed, pump.torque(speed, rise(pump), viscosity))
        inlet, outlet = ends(pump)
        drawn, delivered = pump.flows(
            speed, leakage, (unit.oil.specific_volume(inlet), unit.oil.specific_volume(outlet))
        )
        return float((pump.outlet in held) * delivered - (pump.inlet in held) * drawn)

    for _ in range(_ROUNDS):
        friction = direction * float(cylinder.sliding_friction(abs(velocity), pressure * area - low * other))
        pressure = (force + low * other + friction) / area
        into = sum(into_held(p) for p in pumps)
        velocity = unit.lift_sign * (1.0 if unit.held == "a" else -1.0) * into / area
    torque = sum(float(p.shaft_torque(p.belt * turning, rise(p), viscosity)) for p in pumps)
    return pressure, torque, abs(velocity)
