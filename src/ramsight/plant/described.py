"""From the description of a part to the part: values of the data sheet become those of the equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ramsight.machine import parts as description
from ramsight.machine.description import Unit
from ramsight.machine.parts import Heat
from ramsight.machine.pump_description import read_efficiencies
from ramsight.plant.cylinder import Cylinder
from ramsight.plant.drive import Drive, IdealDrive, ServoDrive, Supply
from ramsight.plant.hose import Hose
from ramsight.plant.oil import T40, T100, Oil, walther_constants
from ramsight.plant.pump import Pump
from ramsight.plant.valve import CLOSED_POINT, CheckValve, ReliefValve, SafetyValve

if TYPE_CHECKING:
    from ramsight.plant.heat import HeatStores
    from ramsight.plant.loss_table import LossTable

_STOP_DEFORMATION = 1e-3  # m, deformation at which a stop's damping is stated
_THRESHOLD = 0.01  # friction is fully developed at this share of the nominal speed, [G]
_NEEDLE_POINT = 100e5  # Pa, where the flow of a cushion's needle valve is stated
_SEAL_POINT = 46e-6 / 100e5  # m2/s over Pa, where the seals' leakage is stated


def closed_leak(flow: float) -> float | None:
    """Leakage of a closed valve over pressure, times viscosity [m3/s/Pa m2/s], from the described flow [m3/s]."""
    return flow * CLOSED_POINT or None


def oil(spec: description.Oil) -> Oil:
    """The oil of a description."""
    return Oil(
        *walther_constants(T40, spec.viscosity_40c, T100, spec.viscosity_100c),
        density=spec.density,
        bulk_modulus=spec.bulk_modulus,
        expansion=spec.thermal_expansion or None,
        air=spec.free_air or None,
        polytropic=spec.air_exponent if spec.free_air else None,
        pressure_viscosity=spec.pressure_viscosity or None,
        name=spec.model or "oil",
        temperatures=(spec.min_temperature, spec.max_temperature),
    )


def heat(spec: Heat | None) -> HeatStores | None:
    """The heat stores of a description, if it has any."""
    if spec is None:
        return None
    from ramsight.plant.heat import HeatStores

    return HeatStores(**dict(spec))


def drive(spec: description.Drive) -> Drive:
    """The drive of a description."""
    supply = Supply(spec.drive_efficiency, spec.battery_efficiency)
    if spec.control == "ideal":
        return IdealDrive("drive", spec.moment_of_inertia, supply)
    return ServoDrive(
        "drive", spec.moment_of_inertia, spec.proportional_gain, spec.integral_gain, spec.max_torque, supply
    )


def cylinder(unit: Unit) -> Cylinder:
    """The cylinders of a described unit with the mass that they move."""
    c = unit.cylinder
    cushioned = c.cushion_length_a > 0.0 or c.cushion_length_b > 0.0
    return Cylinder(
        name="cylinder",
        node_a="chamber_a",
        node_b="chamber_b",
        area_a=c.area_a,
        area_b=c.area_b,
        stroke=c.stroke,
        dead_volume_a=c.dead_volume_a,
        dead_volume_b=c.dead_volume_b,
        mass=unit.load.mass,
        coulomb_friction=c.number * c.coulomb_friction,
        breakaway_friction=c.number * c.breakaway_friction,
        viscous_friction=c.number * c.viscous_friction,
        pressure_friction=c.pressure_friction or None,
        stribeck_velocity=c.stribeck_velocity,
        stop_stiffness=c.number * c.end_stop_stiffness,
        stop_damping=c.end_stop_damping / (c.end_stop_stiffness * _STOP_DEFORMATION),
        load_sign=float(unit.lift_sign),
        passive=unit.load.kind == "passive",
        cushion_length_a=c.cushion_length_a or None,
        cushion_length_b=c.cushion_length_b or None,
        cushion_area_a=c.cushion_area_a if c.cushion_length_a else None,
        cushion_area_b=c.cushion_area_b if c.cushion_length_b else None,
        cushion_conductance=c.number * c.cushion_flow / _NEEDLE_POINT**0.5 if cushioned else None,
        seal_leak=c.number * c.seal_leakage * _SEAL_POINT or None,
    )


def pump(spec: description.Pump, name: str, inlet: str, outlet: str, bulk_modulus: float) -> Pump:
    """The pump of a description between two nodes; the oil's modulus [Pa] states what of its losses is compression."""
    return Pump(
        name=name,
        inlet=inlet,
        outlet=outlet,
        displacement=spec.displacement_per_rad,
        belt=spec.belt,
        volumetric_efficiency=spec.volumetric_efficiency,
        hydromechanical_efficiency=spec.hydromechanical_efficiency,
        nominal_speed=spec.nominal_speed,
        nominal_pressure=spec.nominal_pressure,
        nominal_viscosity=spec.nominal_viscosity,
        nominal_density=spec.nominal_density,
        no_load_torque=spec.total_no_load_torque,
        threshold_speed=_THRESHOLD * spec.nominal_speed,
        orifice_leak=spec.orifice_conductance or None,
        drag=spec.viscous_drag * spec.blocks or None,
        hydrodynamic_drag=spec.hydrodynamic_drag * spec.blocks or None,
        belt_loss=1.0 - spec.belt_efficiency or None,
        belt_creep=spec.belt_creep or None,
        filling=spec.filling_conductance or None,
        table=_table(spec, bulk_modulus),
        compressed=None if spec.compression == "none" else spec.compressed(spec.nominal_pressure, bulk_modulus),
    )


def _table(spec: description.Pump, bulk_modulus: float) -> LossTable | None:
    if spec.losses != "table":
        return None
    from ramsight.plant.loss_table import LossTable

    found = read_efficiencies(spec.efficiency_table)
    shares = [spec.compressed(pressure, bulk_modulus) for pressure in found.pressure]
    leaks = tuple(
        tuple(tuple(value + share for value, share in zip(row, shares, strict=True)) for row in page)
        for page in found.volumetric
    )
    return LossTable(found.pressure, found.speed, found.viscosity, leaks, found.hydromechanical)


def relief_valve(spec: description.ReliefValve, name: str, inlet: str, outlet: str) -> ReliefValve:
    """The relief valve of a description between two nodes."""
    pilot = spec.pilot_leakage > 0.0
    return ReliefValve(
        name,
        inlet,
        outlet,
        spec.setting,
        spec.rated_flow / spec.override_pressure,
        closed_leak=closed_leak(spec.closed_leakage),
        pilot_flow=spec.pilot_leakage if pilot else None,
        pilot_opens=spec.pilot_opens if pilot else None,
        reseats=spec.reseats if spec.reseats < 1.0 else None,
    )


def check_valve(spec: description.AnticavitationValve, name: str, inlet: str, outlet: str) -> CheckValve:
    """The check valve of a description between two nodes."""
    return CheckValve(
        name, inlet, outlet, spec.cracking_pressure, spec.flow_coefficient, closed_leak(spec.closed_leakage)
    )


def safety_valve(
    spec: description.SafetyValve, name: str, pump_side: str, cylinder_side: str, lift_sign: float, commanded: bool
) -> SafetyValve:
    """The safety valve of a description; commanded means opened to lower, else held open."""
    return SafetyValve(
        name,
        pump_side,
        cylinder_side,
        spec.flow_coefficient,
        -lift_sign * spec.opening_speed,
        opening_time=(spec.opening_time or None) if commanded else None,
        commanded=commanded,
        closed_leak=closed_leak(spec.closed_leakage),
    )


def hose(spec: description.Hose, name: str, inlet: str, outlet: str) -> Hose:
    """The hose of a description between two nodes."""
    return Hose(
        name,
        inlet,
        outlet,
        spec.volume,
        spec.length,
        spec.diameter,
        spec.effective_bulk_modulus,
        turbulent=spec.regime == "turbulent",
        segments=spec.segments,
        stiffening=spec.stiffening or None,
    )
