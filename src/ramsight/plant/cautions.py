"""What in a valid description an engineer would look at twice: parts that do not fit, sizes that hardly can be."""

from __future__ import annotations

import math
from collections.abc import Iterator

from ramsight.machine.description import Unit
from ramsight.plant.directional import DirectionalValve, metered
from ramsight.plant.limits import pump_reliefs
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.steady import Derived, derive, torque_at_load
from ramsight.plant.unit import HydraulicUnit, opposite, pumped_into
from ramsight.plant.valve import ReliefValve
from ramsight.units import RPM

_MISMATCH = 0.05  # of the flow ratio, that leakage and tank valves take up
_SLOW = 120.0  # s over the stroke with the motor at its fastest; no machine is worked with so slowly, [G]
_FAST = 1.0  # m/s; common seals and end stops are made for a half of it, [M]
_SLENDER = 60.0  # strokes over rod diameter, from which a rod sags under its own weight, [G]
_STEEL = 2.1e11  # Pa, modulus of elasticity of the rod
_IDLE = 0.05  # share of the relief pressure that the heaviest load asks for at least, [G]


def cautions(described: Unit, unit: HydraulicUnit) -> tuple[str, ...]:
    """Say what in a valid description an engineer would look at twice.

    Returns:
        One sentence each; none if nothing stands out.
    """
    values = derive(unit)
    return (
        *_flow_ratio(unit, values),
        *_pumps(described),
        *_port_reliefs(unit),
        *_motion(described, unit),
        *_rod(described),
        *_loads(described, unit, values),
    )


def _flow_ratio(unit: HydraulicUnit, values: Derived) -> Iterator[str]:
    matched = not any(isinstance(part, PilotCheckValve | DirectionalValve) for part in unit.parts())
    if matched and values.geared_displacement_b > 0.0 and abs(values.mismatch) > _MISMATCH:
        yield (
            f"the geared flow ratio {values.geared_flow_ratio:.3f} is {values.mismatch:+.1%} off the area "
            f"ratio {values.area_ratio:.3f}: one side will be starved or pressed through the relief valve"
        )


def _pumps(described: Unit) -> Iterator[str]:
    for name, pump in described.pumps.items():
        setting = max(described.relief_settings, default=0.0)
        if setting > pump.max_pressure:
            yield f"the relief valve opens at {setting / 1e5:g} bar, {name} allows {pump.max_pressure / 1e5:g} bar"
        fastest = described.drive.max_speed * pump.belt
        if fastest > pump.max_speed * (1 + 1e-9):
            yield (
                f"at the motor's highest speed {name} turns {fastest / RPM:.0f} rpm, it allows "
                f"{pump.max_speed / RPM:.0f} rpm"
            )
        if pump.min_inlet_pressure:
            fills = pump.max_speed * math.sqrt(described.tank.pressure / pump.min_inlet_pressure)
            if fastest > fills * (1 + 1e-9):
                yield (
                    f"at the motor's highest speed {name} turns {fastest / RPM:.0f} rpm, from the tank's "
                    f"{described.tank.pressure / 1e5:g} bar it fills up to {fills / RPM:.0f} rpm"
                )


def _port_reliefs(unit: HydraulicUnit) -> Iterator[str]:
    pumped = pump_reliefs(unit)
    highest = max((valve.setting for valve in pumped), default=0.0)
    for valve in unit.parts():
        if isinstance(valve, ReliefValve) and valve not in pumped and valve.setting <= highest:
            yield (
                f"the relief valve {valve.name} of the cylinder opens at {valve.setting / 1e5:g} bar, before those of "
                f"the pumps at {highest / 1e5:g} bar"
            )


def _motion(described: Unit, unit: HydraulicUnit) -> Iterator[str]:
    """Whether pump and cylinder give a motion that a machine can have."""
    velocity = abs(unit.travel_per_radian) * described.drive.max_speed
    takes = described.cylinder.stroke / velocity
    if takes > _SLOW:
        yield (
            f"at the motor's highest speed the rod moves at {1e3 * velocity:.3g} mm/s and takes {takes:.3g} s over "
            f"its stroke: look at the pump's displacement, the belt, bore and stroke"
        )
    if velocity > _FAST:
        yield (
            f"at the motor's highest speed the rod moves at {velocity:.3g} m/s, more than the {_FAST:g} m/s of fast "
            "cylinders: look at the pump's displacement, the belt and the bore"
        )
    cylinder = described.cylinder
    swept = cylinder.area_a * cylinder.stroke
    for side, dead in (("a", cylinder.dead_volume_a), ("b", cylinder.dead_volume_b)):
        if dead > swept:
            yield (
                f"the dead volume of side {side.upper()}, {1e3 * dead:.3g} l, is more than the {1e3 * swept:.3g} l "
                "that the pistons sweep"
            )


def _rod(described: Unit) -> Iterator[str]:
    """Whether the rods bear what they push (Euler, both ends hinged, the stroke as length), and their own weight."""
    cylinder, pushed = described.cylinder, max(described.load.loads.values(), default=0.0)
    inertia = math.pi * cylinder.rod**4 / 64.0
    bears = cylinder.number * math.pi**2 * _STEEL * inertia / cylinder.stroke**2
    if described.load_side == "a" and pushed > bears:
        yield (
            f"a rod of {1e3 * cylinder.rod:g} mm that is {1e3 * cylinder.stroke:g} mm out buckles under "
            f"{bears / 1e3:.3g} kN, the heaviest load is {pushed / 1e3:g} kN: look at rod and stroke"
        )
    elif cylinder.stroke > _SLENDER * cylinder.rod:
        yield (
            f"the stroke is {cylinder.stroke / cylinder.rod:.0f} times the rod's diameter, and a rod of more than "
            f"{_SLENDER:g} times sags under its own weight: look at rod and stroke"
        )


def _loads(described: Unit, unit: HydraulicUnit, values: Derived) -> Iterator[str]:
    """What the declared loads ask of pressure and torque."""
    highest = 0.0
    for name, load in described.load.loads.items():
        point, words = torque_at_load(unit, load), f"load {name} ({load / 1e3:g} kN)"
        highest = max(highest, point.pressure_lift - unit.tank_pressure)
        if load > values.load_at_relief_after_friction:
            yield f"{words} is more than the relief valve lets the unit lift"
        elif (torque := abs(point.torque_lift)) > described.drive.max_torque:
            yield f"lifting {words} takes {torque:.0f} N m, the motor has {described.drive.max_torque:g} N m"
        yield from _beyond_pumps(described, words, point.pressure_lift)
        if not unit.cylinder.passive and point.pressure_lower < 0.0 and not _is_pressed_down(unit):
            yield (
                f"{words} is too light to lower: friction holds it, and chamber {unit.held.upper()} would fall to "
                f"{point.pressure_lower / 1e5:.1f} bar absolute"
            )
    relief = values.relief_pressure - unit.tank_pressure
    if described.load.loads and math.isfinite(relief) and 0.0 < highest < _IDLE * relief:
        yield (
            f"the heaviest load asks for {highest / 1e5:.2g} bar of the {relief / 1e5:g} bar that the relief valve "
            "allows: look at the bore, the number of cylinders and the loads"
        )


def _beyond_pumps(described: Unit, words: str, pressure: float) -> Iterator[str]:
    """A pump that no relief valve keeps from more than it allows; what opens too late is said once, of the valve."""
    for name, pump in described.pumps.items():
        if not described.relief_settings and pressure > pump.max_pressure:
            yield (
                f"{words} asks for {pressure / 1e5:.0f} bar, {name} allows {pump.max_pressure / 1e5:g} bar, and no "
                "relief valve is there"
            )


def _is_pressed_down(unit: HydraulicUnit) -> bool:
    """Whether pumps or a directional valve press on the side that does not hold the load."""
    valves = metered(unit.parts())
    return valves or pumped_into(unit, opposite(unit.held)) != 0.0
