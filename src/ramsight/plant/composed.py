"""A unit whose circuit its description gives: parts between nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from ramsight.errors import DescriptionError
from ramsight.machine import placed
from ramsight.machine.assumption_description import Assumptions
from ramsight.machine.base import Part as Described
from ramsight.machine.description import Composed
from ramsight.machine.requirement_description import Requirement
from ramsight.plant import described
from ramsight.plant.accumulator import Accumulator
from ramsight.plant.circuit import Part
from ramsight.plant.cylinder import Cylinder
from ramsight.plant.drive import Drive
from ramsight.plant.heat import HeatStores
from ramsight.plant.hose import Volume
from ramsight.plant.linkage.lever import Lever
from ramsight.plant.oil import Oil
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.unit import pumped_into
from ramsight.plant.valve import Orifice


@dataclass(frozen=True)
class ComposedUnit:
    """A unit as a list of parts.

    Attributes:
        name: of the unit.
        oil: in it.
        tank_pressure: absolute; of a closed circuit, the pressure that it is charged to at rest [Pa].
        drive, cylinder: of the unit.
        lift_sign: +1 if extension lifts the load, -1 if retraction does.
        max_speed: highest motor speed [rad/s].
        others: all further parts; add your own with `dataclasses.replace`.
        assumptions: what a sensor assumes of it; no law uses them.
        lever: what the angle of the body that the cylinder turns says of its position; None where it says nothing.
        heat: what the heat of its losses is kept in; None where that is not described.
        requirement: what its position has to achieve; None where that is not described.
    """

    name: str
    oil: Oil
    tank_pressure: float
    drive: Drive
    cylinder: Cylinder
    lift_sign: float
    max_speed: float
    others: tuple[Part, ...]
    # Not in the text: tables made from simulated runs are kept by it, and know no assumptions.
    assumptions: Assumptions = field(default=Assumptions(), repr=False)
    lever: Lever | None = field(default=None, repr=False)
    heat: HeatStores | None = field(default=None, repr=False)
    requirement: Requirement | None = field(default=None, repr=False)

    def __str__(self) -> str:
        from ramsight.plant.built_html import built_line

        return built_line(self)

    def _repr_html_(self) -> str:
        from ramsight.plant.built_html import built_html

        return built_html(self)

    def mapped(self, change: Callable[[Any], Any]) -> ComposedUnit:  # as in `HydraulicUnit`
        """The unit with every further part replaced by what `change` makes of it."""
        return replace(self, others=tuple(change(part) for part in self.others))

    @property
    def held(self) -> str:
        """The side that holds the load."""
        return "a" if self.lift_sign > 0.0 else "b"

    @property
    def travel_per_radian(self) -> float:
        """Ideal travel per motor angle on the load-holding side [m/rad]."""
        return float(abs(pumped_into(self, self.held)) / self.cylinder.area(self.held))

    def parts(self) -> tuple[Part, ...]:
        """All parts."""
        return (self.drive, self.cylinder, *self.others)


def build_composed(name: str, unit: Composed) -> ComposedUnit:
    """The parts of a described unit.

    Args:
        name: of the unit.
        unit: its description.

    Raises:
        DescriptionError: no pump moves oil to the side that holds the load.
    """
    built = ComposedUnit(
        name=name,
        oil=described.oil(unit.oil),
        tank_pressure=unit.tank.pressure,
        drive=described.drive(unit.drive),
        cylinder=described.cylinder(unit),
        lift_sign=float(unit.lift_sign),
        max_speed=unit.drive.max_speed,
        assumptions=unit.assumptions,
        heat=described.heat(unit.heat),
        others=tuple(_part(key, part, unit) for key, part in unit.parts.items()),
    )
    if not pumped_into(built, built.held) * unit.lift_sign > 0.0:
        raise DescriptionError(
            f"positive motor speed has to {'fill' if built.held == 'a' else 'empty'} chamber_{built.held}; turn the "
            "pumps round (inlet and outlet), or join them to it by hoses, orifices or safety valves",
            key=f"units.{name}.parts",
        )
    return built


def _part(name: str, spec: Described, unit: Composed) -> Part:
    """The part of a description."""
    match spec:
        case placed.PlacedLoadSensingPump():
            return described.load_sensing_pump(spec, name, unit.oil.bulk_modulus)
        case placed.PlacedPump():
            return described.pump(spec, name, spec.inlet, spec.outlet, unit.oil.bulk_modulus)
        case placed.PlacedRelief():
            return described.relief_valve(spec, name, spec.inlet, spec.outlet)
        case placed.PlacedCheck():
            return described.check_valve(spec, name, spec.inlet, spec.outlet)
        case placed.PlacedPilotCheck():
            return PilotCheckValve(
                name,
                spec.inlet,
                spec.outlet,
                spec.pilot,
                spec.cracking_pressure,
                spec.flow_coefficient,
                spec.pilot_ratio,
                described.closed_leak(spec.closed_leakage),
            )
        case placed.PlacedSafety():
            return described.safety_valve(
                spec, name, spec.inlet, spec.outlet, float(unit.lift_sign), spec.opens == "lowering"
            )
        case placed.PlacedHose():
            return described.hose(spec, name, spec.inlet, spec.outlet)
        case placed.PlacedVolume():
            return Volume(name, spec.node, spec.volume)
        case placed.PlacedOrifice():
            return Orifice(name, spec.inlet, spec.outlet, spec.flow_coefficient)
        case placed.PlacedDirectional():
            return described.directional_valve(spec, name)
        case placed.PlacedAccumulator():
            return Accumulator(name, spec.node, spec.gas_volume, spec.precharge, spec.gas_exponent)
    raise TypeError(f"no part is made of {type(spec).__name__}")
