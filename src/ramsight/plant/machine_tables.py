"""What follows from a machine's description: tables of figures, and what an engineer would look at twice."""

from __future__ import annotations

import math
from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.text import Text

from ramsight.errors import DescriptionError
from ramsight.machine.base import walk
from ramsight.machine.description import Machine, Unit
from ramsight.machine.tables import table_of
from ramsight.plant.accumulator import Accumulator, oil_volume
from ramsight.plant.build import build
from ramsight.plant.circuit import TANK
from ramsight.plant.directional import DirectionalValve, metered
from ramsight.plant.limits import pump_reliefs
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.steady import Derived, derive, torque_at_load
from ramsight.plant.unit import HydraulicUnit, opposite, pumped_into
from ramsight.plant.valve import ReliefValve
from ramsight.units import RPM, format_si

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
        *_load_cautions(described, unit, values),
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


def _load_cautions(described: Unit, unit: HydraulicUnit, values: Derived) -> Iterator[str]:
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


_SPEED, _TEMPERATURE = 50 * math.pi, 313.15  # 1500 rpm and 40 °C


def machine_summary(machine: Machine, only: str | None = None) -> RenderableType:
    """Tables of what follows from a description, a unit at a time.

    Raises:
        UnknownNameError: there is no such unit.
        DescriptionError: the reservoir of a closed circuit is too small, or its precharge too high.
    """
    names = [only] if only is not None else list(machine.units)
    parts: list[RenderableType] = [Text(machine.title or machine.name, style="bold")]
    for name in names:
        unit = machine.unit(name)
        built = build(unit, name)
        check_reservoir(built, machine.origin or None)
        parts += [Text(), _facts(unit, built)]
        if unit.load.loads:
            parts += [Text(), _loads(unit, built)]
        parts += [Text(f"look twice: {sentence}", style="yellow") for sentence in cautions(unit, built)]
    return Group(*parts)


def unit_figures(machine: Machine, name: str) -> dict[str, object]:
    """The figures of a unit in the tables, in SI: what follows from its parts, its loads, and what to look at twice."""
    unit = machine.unit(name)
    built = build(unit, name)
    return {
        "load_side": unit.load_side,
        "derived": derive(built),
        "loads": {
            load: {"force": force, "point": torque_at_load(built, force, _TEMPERATURE, _SPEED)}
            for load, force in unit.load.loads.items()
        },
        "look_twice": cautions(unit, built),
    }


def _facts(unit: Unit, built: HydraulicUnit) -> Group:
    found = derive(built)
    side = unit.load_side.upper()
    title = f"unit {built.name}: lifts by {unit.load_direction}ing, side {side} holds the load"
    table = table_of(("", ""))
    pumped = (_per_rev(found.geared_displacement_a, 1e6), _per_rev(found.geared_displacement_b, 1e6))
    travel = (_per_rev(found.travel_a, 1e3), _per_rev(found.travel_b, 1e3))
    flow = f"{found.geared_flow_ratio:.3f}, {found.mismatch:+.1%} off the area ratio"
    two_sided = found.geared_displacement_b > 0.0
    table.add_row("areas A, B", f"{found.area_a * 1e6:.0f}, {found.area_b * 1e6:.0f} mm2")
    table.add_row("area ratio B/A", f"{found.area_ratio:.3f}")
    if two_sided:
        table.add_row("geared flow ratio B/A", flow)
        table.add_row("pumped per motor rev A, B", f"{pumped[0]:.2f}, {pumped[1]:.2f} cm3")
        table.add_row("travel without leakage A, B", f"{travel[0]:.3f}, {travel[1]:.3f} mm per motor rev")
    else:
        table.add_row("pumped per motor rev", f"{pumped[0]:.2f} cm3")
        table.add_row("travel without leakage", f"{travel[0]:.3f} mm per motor rev")
    table.add_row("load at relief pressure", f"{found.load_at_relief / 1e3:.1f} kN")
    table.add_row("  less breakaway friction", f"{found.load_at_relief_after_friction / 1e3:.1f} kN")
    for assumed in walk(unit.assumptions, "assumptions."):
        if assumed.given:
            table.add_row(assumed.path, assumed.shown)
    return Group(Text(title, style="bold"), table)


def _per_rev(per_radian: float, scale: float) -> float:
    return per_radian * 2 * math.pi * scale


def _loads(unit: Unit, built: HydraulicUnit) -> Group:
    conditions = f"{format_si(_SPEED, 'rpm', 6)}, {format_si(_TEMPERATURE, 'degC', 4)}"
    title = f"steady lift / lower at {conditions}, other side at tank pressure"
    table = table_of(("load", "kN", "chamber bar", "motor N m", "mm per motor rev"))
    for name, force in unit.load.loads.items():
        point = torque_at_load(built, force, _TEMPERATURE, _SPEED)
        table.add_row(
            Text(name),
            f"{force / 1e3:g}",
            f"{point.pressure_lift / 1e5:.1f} / {point.pressure_lower / 1e5:.1f}",
            f"{point.torque_lift:+.1f} / {point.torque_lower:+.1f}",
            f"{_per_rev(point.travel_lift, 1e3):.3f} / {_per_rev(point.travel_lower, 1e3):.3f}",
        )
    return Group(Text(title, style="bold"), table)


def check_reservoir(unit: HydraulicUnit, file: str | None = None) -> None:
    """Reject gas volumes and precharges with which oil tears, or has no room, somewhere on the stroke.

    At rest the gas has the circuit's pressure, wherever the rod is: V_0 (p_0/p_T)^(1/n) of gas, the rest is oil. Over
    the stroke the rod asks for |A_A - A_B| s of oil, or gives it back. Circuits that draw from a tank are not looked
    at, as an accumulator serves another purpose there.

    Raises:
        DescriptionError: the oil in the reservoirs is less than that volume, or the gas is; the text names key, value
            and range.
    """
    reservoirs = [part for part in unit.parts() if isinstance(part, Accumulator)]
    if not reservoirs or _draws_from_tank(unit):
        return
    cylinder, rest = unit.cylinder, unit.tank_pressure
    rod = abs(cylinder.area_a - cylinder.area_b) * cylinder.stroke
    largest = max(reservoirs, key=lambda part: part.volume)
    where = f"units.{unit.name}.parts.{largest.name}"
    if largest.precharge >= rest:
        raise DescriptionError(
            f"with a gas as strong as the circuit's pressure at rest, {rest / 1e5:g} bar, no oil is in it",
            file=file,
            key=f"{where}.precharge",
            value=f"{largest.precharge / 1e5:g} bar",
            allowed=f"less than {rest / 1e5:g} bar",
        )
    oil = sum(float(oil_volume(rest, one.volume, one.precharge, one.polytropic)) for one in reservoirs)
    gas = sum(one.volume for one in reservoirs) - oil
    if min(oil, gas) < rod:
        share = float(oil_volume(rest, 1.0, largest.precharge, largest.polytropic))
        missing = max((rod - oil) / share, (rod - gas) / (1.0 - share))
        held = f"{1e3 * oil:.3g} l of oil and {1e3 * gas:.3g} l of gas"
        enough = 1.005 * (largest.volume + missing)  # rounded to three digits below
        raise DescriptionError(
            f"at {rest / 1e5:g} bar it has {held}; over its stroke the rod takes or gives {1e3 * rod:.3g} l",
            file=file,
            key=f"{where}.gas_volume",
            value=f"{1e3 * largest.volume:g} l",
            allowed=f"at least {1e3 * enough:.3g} l at a precharge of {largest.precharge / 1e5:g} bar",
        )


def _draws_from_tank(unit: HydraulicUnit) -> bool:
    return any(value == TANK for part in unit.parts() for value in vars(part).values() if isinstance(value, str))
