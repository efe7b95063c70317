"""The books of the oil: what the pumps deliver, less what leaks and what is compressed, moves the piston.

    A dx = (D w - K dp) dt - C_manifold dp - C_chamber dp_chamber

on the side that holds the load, with dp from the torque. The torque carries both manifolds' pressures; the other
side's follows from its own balance, which shares the piston with the first. While the safety valve is closed the
held chamber keeps its oil: its pressure moves only with the force balance, and the torque tells nothing of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from ramsight.plant.cylinder import ATMOSPHERE, Cylinder
from ramsight.plant.ddh import DdhUnit, Side
from ramsight.plant.unit import opposite
from ramsight.sensor.chamber import Chamber
from ramsight.sensor.virtual_sensor import SensorGraph

_STANDING = 0.06  # rad/s; below half a step of 1 rpm the motor counts as standing
_LOWEST = 1e5  # Pa; leakage margin of an unloaded unit


@dataclass(frozen=True)
class Tuning:
    """How the sensor listens to a noisy torque. None of it depends on the machine.

    Args:
        smoothing: time constant with which the held chamber's pressure follows the torque [s].
        yielding: time in which the mass follows oil that fills the chamber, while the valve opens [s].
        settling: how long the valve must have been open before the torque is taken for the chamber's pressure [s].
        first_look: time over which the chamber's unknown first pressure is found, without counting compression [s].
        flow_smoothing: time constant of the flow that tells whether the check has opened [s].
        flow_share: share of the pump's net flow that must pass it before it counts as open [1].
        flow_margin: net flow below which it counts as closed, as a share of the leakage [1].
        standstill: time without turning after which no flow is counted [s].
    """

    smoothing: float = 0.1
    yielding: float = 0.02
    settling: float = 0.015
    first_look: float = 0.3
    flow_smoothing: float = 0.04
    flow_share: float = 0.3
    flow_margin: float = 0.1
    standstill: float = 0.5


@dataclass(frozen=True)
class Factors:
    """How a machine differs from its data sheet, as numbers or symbols.

    Args:
        leak: leakage of both pumps over the data sheet's [1].
        displacement: of both pumps [1].
        compliance: of oil and hoses, the reciprocal of stiffness [1].
    """

    leak: Any = 1.0
    displacement: Any = 1.0
    compliance: Any = 1.0


@dataclass(frozen=True)
class Books:
    """What the books say after a sample; pressures are above tank.

    Attributes:
        step: movement of the piston since the last sample [m].
        travel: distance of the piston from the held side's end before the sample [m].
        cylinder: the cylinder's symbols.
        held: the side that holds the load.
        held_pressure, other_pressure: of the chambers [Pa].
        highest_pressure: in either manifold, without the torque's noise [Pa].
        load: [N], positive against lifting.
        turning: whether the motor turns or has turned just now.
    """

    step: Any
    travel: Any
    cylinder: Cylinder
    held: Chamber
    held_pressure: Any
    other_pressure: Any
    highest_pressure: Any
    load: Any
    turning: Any


def _sides(
    graph: SensorGraph, unit: DdhUnit, factors: Factors, cylinder: Cylinder, oil: Any
) -> tuple[Chamber, Chamber]:
    """The held and the other side in symbols, with their deviations from the data sheet."""

    def chamber(name: str) -> Chamber:
        side: Side = getattr(unit, name)
        parts = {
            field: graph.parameters.symbolic(f"{field}_{name}", getattr(side, field))
            for field in ("pump", "manifold", "relief", "anticavitation", "safety", "hose")
        }
        pump, hose = parts["pump"], parts["hose"]
        # Eq. 10 makes leakage proportional to displacement; the factors are meant to be independent.
        leak = pump.leak_factor * factors.leak / factors.displacement
        parts["pump"] = replace(pump, displacement=pump.displacement * factors.displacement, leak_factor=leak)
        parts["hose"] = replace(hose, bulk_modulus=hose.bulk_modulus / factors.compliance)
        return Chamber.of(Side(**parts), name, cylinder, oil)

    return chamber(unit.held), chamber(opposite(unit.held))


def keep_books(graph: SensorGraph, unit: DdhUnit, tuning: Tuning, factors: Factors) -> Books:
    """Write the bookkeeping of one sample into a sensor's graph.

    Args:
        graph: the sensor's graph; gains the books' states.
        unit: the unit's parts, as its data sheet has them.
        tuning: how the torque is listened to.
        factors: how the machine differs from its data sheet.
    """
    add = graph.parameters.symbolic
    oil, drive, cylinder = add("oil", unit.oil), add("drive", unit.drive), add("cylinder", unit.cylinder)
    tank_pressure = graph.parameters.add("tank.pressure", unit.tank_pressure)
    oil = replace(oil, bulk_modulus=oil.bulk_modulus / factors.compliance)
    held, other = _sides(graph, unit, factors, cylinder, oil)
    out = unit.lift_sign  # the piston moves this way when oil enters the held side
    w, dt = graph.motor_speed, graph.elapsed
    viscosity = oil.viscosity(graph.oil_temperature)
    leak_held, leak_other = (c.side.pump.leak_coefficient(viscosity, oil.density) for c in (held, other))

    # States before the sample; pressures are above tank.
    x = graph.position
    manifold_0, other_0 = graph.state("manifold_pressure"), graph.state("other_pressure")
    load_0, motion_0, known = (
        graph.state("load_pressure"),
        graph.state("motion_pressure"),
        graph.state("load_known"),
    )
    open_, open_for = graph.state("valve_open"), graph.state("valve_open_for")
    standing_for, flow_0 = graph.state("standing_for", 1e3), graph.state("valve_flow")
    waiting_0 = graph.state("waiting_oil")

    # Hydraulic torque: without the rotor's and the no-load friction's share.
    acceleration = (w - graph.last_speed) / ca.fmax(dt, 1e-6)
    torque = graph.motor_torque - drive.inertia * acceleration
    for c in (held, other):
        torque -= c.belt * c.side.pump.no_load_torque * c.direction(w)
    slope_held, slope_other = (c.torque_per_pressure(c.direction(w)) for c in (held, other))

    travel = x if out > 0.0 else cylinder.stroke - x
    capacity_held = held.capacity(travel)
    capacity_other = other.capacity(cylinder.stroke - travel) + other.manifold_capacity
    ratio = other.area / held.area
    standing = ca.fabs(w) < _STANDING
    turning = ca.if_else(ca.logic_and(standing, standing_for > tuning.standstill), 0.0, 1.0)
    lifts = ca.sign(out * w)
    drop = lifts * (held.delivered(w) / held.side.safety.conductance) ** 2
    other_drop = lifts * (other.delivered(w) / other.side.safety.conductance) ** 2
    follow = open_ * dt / (tuning.smoothing + dt)
    # Oil that passes a valve which is only just opening fills the chamber before the mass begins to move.
    release = ca.if_else(open_ > 0.5, 1.0, dt / (tuning.yielding + dt))

    # Force balance of the moving piston: chamber = load + motion + ratio * other, motion from mass, friction and the
    # drop across the other side's valve.
    lifting_speed = (held.delivered(w) - leak_held * load_0) / held.area
    inertia = cylinder.mass * held.delivered(acceleration) / held.area
    motion_1 = open_ * ((inertia + cylinder.friction(lifting_speed)) / held.area + ratio * other_drop)

    def movement(other_1: Any) -> tuple[Any, Any, Any, Any]:
        """Manifold pressure, oil through the valve, load pressure, oil that moves the piston; linear in `other_1`."""
        manifold_1 = (torque - slope_other * other_1) / slope_held
        leaked = leak_held * 0.5 * (manifold_0 + manifold_1) * dt
        through = held.delivered(graph.angle) - leaked - held.manifold_capacity * (manifold_1 - manifold_0)
        load_1 = load_0 + follow * (manifold_1 - drop - motion_1 - ratio * other_1 - load_0)
        rise = known * (load_1 - load_0) + motion_1 - motion_0 + ratio * (other_1 - other_0)
        return manifold_1, through, load_1, release * (waiting_0 + turning * through) - capacity_held * rise

    def drawn(other_1: Any) -> Any:
        """Oil that the other side would have to draw from the tank [m3], linear in its pressure."""
        moved = movement(other_1)[-1]
        leaked = leak_other * 0.5 * (other_0 + other_1) * dt
        return capacity_other * (other_1 - other_0) - other.delivered(graph.angle) + leaked - ratio * moved

    at_tank, at_more = drawn(0.0), drawn(_LOWEST)
    other_1 = at_tank * _LOWEST / (at_tank - at_more)
    other_1 = ca.fmin(ca.fmax(other_1, -other.side.anticavitation.cracking_pressure), other.side.relief.setting)
    manifold_1, through, load_1, moved = movement(other_1)
    # The first look at the load is believed at once: what the chamber held before is not compression.
    looking = ca.logic_and(ca.logic_and(known < 0.5, open_ > 0.5), open_for < 1.5 * tuning.settling)
    load_1 = ca.if_else(looking, manifold_1 - drop - motion_1 - ratio * other_1, load_1)
    chamber_1 = load_1 + motion_1 + ratio * other_1
    step = out * moved / held.area

    # Is the safety valve open for the next sample?
    lowering = held.side.safety.opening_speed * w > held.side.safety.opening_speed**2
    flow_1 = flow_0 + dt / (tuning.flow_smoothing + dt) * (through / ca.fmax(dt, 1e-6) - flow_0)
    pumped = held.delivered(w)
    margin = tuning.flow_margin * leak_held
    net = pumped - leak_held * ca.fmax(manifold_1, 0.0)
    opens = ca.logic_and(net > margin * ca.fmax(manifold_1, _LOWEST), flow_1 > tuning.flow_share * net)
    stays = pumped - leak_held * chamber_1 > margin * ca.fmax(chamber_1, _LOWEST)
    passes = flow_1 > 0.5 * tuning.flow_share * net  # a chamber whose pressure is not known yet cannot tell
    stays = ca.logic_and(stays, ca.logic_or(known > 0.5, passes))
    lifting = ca.if_else(open_ > 0.5, stays, opens)
    wanted = ca.logic_or(lowering, lifting)
    open_for_1 = ca.if_else(wanted, open_for + dt, 0.0)

    graph.becomes("manifold_pressure", manifold_1)
    graph.becomes("other_pressure", other_1)
    graph.becomes("load_pressure", load_1)
    graph.becomes("motion_pressure", motion_1)
    graph.becomes("load_known", ca.fmax(known, ca.logic_and(open_ > 0.5, open_for > tuning.first_look)))
    graph.becomes("valve_open", ca.logic_and(wanted, open_for_1 > tuning.settling))
    graph.becomes("valve_open_for", open_for_1)
    graph.becomes("standing_for", ca.if_else(standing, standing_for + dt, 0.0))
    graph.becomes("valve_flow", flow_1)
    graph.becomes("waiting_oil", (1.0 - release) * (waiting_0 + turning * through))

    rod = out * (tank_pressure - ATMOSPHERE) * (cylinder.area_a - cylinder.area_b)
    return Books(
        step=step,
        travel=travel,
        cylinder=cylinder,
        held=held,
        held_pressure=chamber_1,
        other_pressure=other_1,
        highest_pressure=ca.fmax(chamber_1 + ca.fmax(drop, 0.0), other_1),
        load=held.area * chamber_1 - other.area * other_1 + rod,
        turning=turning,
    )
