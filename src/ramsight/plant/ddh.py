"""The direct driven hydraulic unit: one motor, a pump on each side of the cylinder, and the valves around them.

Each side s of the cylinder is tank - pump - manifold - safety valve - line - hose - chamber, with a relief and an
anti-cavitation valve between manifold and tank. The safety valve on the load-holding side opens only when the motor
lowers; the other one is held open.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.machine.description import Unit
from ramsight.machine.parts import Pump as PumpDescription
from ramsight.plant.circuit import TANK, CircuitModel, Part, join
from ramsight.plant.cylinder import ATMOSPHERE, Cylinder
from ramsight.plant.drive import IdealDrive
from ramsight.plant.hose import Hose, Volume
from ramsight.plant.oil import T40, T100, Oil, walther_constants
from ramsight.plant.pump import Pump
from ramsight.plant.valve import CheckValve, ReliefValve, SafetyValve

_STOP_DEFORMATION = 1e-3  # m, deformation at which a stop's damping is given
_THRESHOLD = 0.01  # friction is fully developed at this share of the nominal speed, [G]


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


@dataclass(frozen=True)
class DdhUnit:
    """The unit's parts and what is common to them.

    Attributes:
        name: of the unit.
        lift_sign: +1 if extension lifts the load, -1 if retraction does.
        tank_pressure: absolute [Pa].
        held: the commanded safety valve's side, "a" or "b".
    """

    name: str
    oil: Oil
    tank_pressure: float
    drive: IdealDrive
    cylinder: Cylinder
    a: Side
    b: Side
    lift_sign: float

    @property
    def held(self) -> str:
        """The side that holds the load."""
        return "a" if self.lift_sign > 0.0 else "b"

    def parts(self) -> tuple[Part, ...]:
        """All parts."""
        return (self.drive, self.cylinder, *self.a.parts(), *self.b.parts())

    @property
    def travel_per_radian(self) -> float:
        """Ideal travel per motor angle on the load-holding side [m/rad]."""
        side, area = (self.a, self.cylinder.area_a) if self.held == "a" else (self.b, self.cylinder.area_b)
        return float(side.pump.geared_displacement / area)


def _pump(spec: PumpDescription, side: str) -> Pump:
    manifold = f"manifold_{side}"
    inlet, outlet = (TANK, manifold) if side == "a" else (manifold, TANK)
    return Pump(
        name=f"pump_{side}",
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
    )


def build(name: str, unit: Unit) -> DdhUnit:
    """The parts of a described unit."""
    points = (T40, unit.oil.viscosity_40c, T100, unit.oil.viscosity_100c)
    oil = Oil(*walther_constants(*points), density=unit.oil.density, bulk_modulus=unit.oil.bulk_modulus)
    lift_sign = float(unit.lift_sign)
    relief, anticavitation, safety = unit.relief_valve, unit.anticavitation_valve, unit.safety_valve

    def side(name: str, spec: PumpDescription) -> Side:
        manifold, line, chamber = f"manifold_{name}", f"line_{name}", f"chamber_{name}"
        return Side(
            pump=_pump(spec, name),
            manifold=Volume(manifold, manifold, unit.manifold.volume),
            relief=ReliefValve(
                f"relief_{name}", manifold, TANK, relief.setting, relief.rated_flow / relief.override_pressure
            ),
            anticavitation=CheckValve(
                f"anticavitation_{name}",
                TANK,
                manifold,
                anticavitation.cracking_pressure,
                anticavitation.flow_coefficient,
            ),
            safety=SafetyValve(
                f"safety_{name}",
                manifold,
                line,
                safety.flow_coefficient,
                -lift_sign * safety.opening_speed,
                commanded=name == unit.load_side,
            ),
            hose=Hose(
                f"hose_{name}",
                line,
                chamber,
                unit.hose.volume,
                unit.hose.length,
                unit.hose.diameter,
                unit.hose.effective_bulk_modulus,
            ),
        )

    c = unit.cylinder
    cylinder = Cylinder(
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
        stribeck_velocity=c.stribeck_velocity,
        stop_stiffness=c.number * c.end_stop_stiffness,
        stop_damping=c.end_stop_damping / (c.end_stop_stiffness * _STOP_DEFORMATION),
        load_sign=lift_sign,
    )
    return DdhUnit(
        name=name,
        oil=oil,
        tank_pressure=unit.tank.pressure,
        drive=IdealDrive("drive", unit.drive.moment_of_inertia),
        cylinder=cylinder,
        a=side("a", unit.pump_a),
        b=side("b", unit.pump_b),
        lift_sign=lift_sign,
    )


def circuit(unit: DdhUnit, *, audited: bool = False) -> CircuitModel:
    """The unit as an equation."""
    return join(unit.name, unit.oil, unit.tank_pressure, unit.parts(), audited=audited)


def initial_state(unit: DdhUnit, model: CircuitModel, position: float, load: float) -> NDArray[np.float64]:
    """States of the unit at rest at a position [m] under a load [N]: the held chamber carries it, the rest is at tank.

    Friction is not strained; a negative load is carried by the other chamber.
    """
    c = unit.cylinder
    state = np.zeros(len(model.ode.states))
    pressure = dict.fromkeys(model.nodes, unit.tank_pressure)
    force = unit.lift_sign * load + ATMOSPHERE * (c.area_a - c.area_b)
    on_a, on_b = c.area_a * unit.tank_pressure, c.area_b * unit.tank_pressure
    if force > on_a - on_b:
        side, value = "a", (force + on_b) / c.area_a
    else:
        side, value = "b", (on_a - force) / c.area_b
    pressure[f"line_{side}"] = pressure[f"chamber_{side}"] = value
    for node, level in pressure.items():
        state[model.ode.state_index(f"pressure_{node}")] = level
    state[model.ode.state_index("position")] = position
    return state
