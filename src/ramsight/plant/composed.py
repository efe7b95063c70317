"""A unit whose circuit its description gives: parts between nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from ramsight.errors import DescriptionError
from ramsight.machine import placed
from ramsight.machine.base import Part as Described
from ramsight.machine.description import Composed
from ramsight.plant import described
from ramsight.plant.accumulator import Accumulator
from ramsight.plant.circuit import Part
from ramsight.plant.directional import DirectionalValve
from ramsight.plant.hose import Volume
from ramsight.plant.load_sensing import LoadSensingPump, MeteringValve
from ramsight.plant.pilot_check import PilotCheckValve
from ramsight.plant.unit import HydraulicUnit, pumped_into
from ramsight.plant.valve import Orifice


@dataclass(frozen=True, kw_only=True)
class ComposedUnit(HydraulicUnit):
    """A unit as a list of parts: all but drive and cylinder are `extra`."""

    def parts(self) -> tuple[Part, ...]:
        """All parts."""
        return (self.drive, self.cylinder, *self.extra)

    def mapped(self, change: Callable[[Any], Any]) -> ComposedUnit:  # as in `HydraulicUnit`
        """The unit with every further part replaced by what `change` makes of it."""
        return replace(self, extra=tuple(change(part) for part in self.extra))


def build_composed(name: str, unit: Composed) -> ComposedUnit:
    """The parts of a described unit.

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
        extra=tuple(_part(key, part, unit) for key, part in unit.parts.items()),
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
            return _load_sensing_pump(spec, name, unit.oil.bulk_modulus)
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
            return _directional_valve(spec, name)
        case placed.PlacedAccumulator():
            return Accumulator(name, spec.node, spec.gas_volume, spec.precharge, spec.gas_exponent)
    raise TypeError(f"no part is made of {type(spec).__name__}")


def _load_sensing_pump(spec: placed.PlacedLoadSensingPump, name: str, bulk_modulus: float) -> LoadSensingPump:
    """The load-sensing pump of a description, with the losses of a pump at full displacement."""
    at_full_stroke = described.pump(spec, name, spec.inlet, spec.outlet, bulk_modulus)
    return LoadSensingPump(
        **vars(at_full_stroke),
        load_line=spec.load_line,
        margin=spec.margin,
        cut_off=spec.cut_off,
        band=spec.band,
        swivel_time=spec.swivel_time,
    )


def _directional_valve(spec: placed.PlacedDirectional, name: str) -> DirectionalValve:
    """The directional valve of a description, or the metering one."""
    values = (
        *(spec.pump_port, spec.tank_port, spec.port_a, spec.port_b),
        spec.flow_coefficient,
        spec.overlap,
        spec.switching_time or None,
        described.closed_leak(spec.closed_leakage),
    )
    if isinstance(spec, placed.PlacedMetering):
        return MeteringValve(name, *values, load_line=spec.load_line, sensing=spec.sensing_coefficient)
    return DirectionalValve(name, *values)
