"""What follows from a machine's description, as tables for a terminal."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.text import Text

from ramsight.errors import DescriptionError
from ramsight.machine.base import walk
from ramsight.machine.description import Machine, Unit
from ramsight.machine.tables import table_of
from ramsight.plant.accumulator import Accumulator, oil_volume
from ramsight.plant.build import build
from ramsight.plant.cautions import cautions
from ramsight.plant.circuit import TANK
from ramsight.plant.steady import derive, torque_at_load
from ramsight.plant.unit import HydraulicUnit
from ramsight.units import format_si

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
