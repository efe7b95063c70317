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

STANDING = 0.06  # rad/s; below half a step of 1 rpm the motor counts as standing
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
        emptying: standing time after which the held manifold has leaked empty [s].
        listening: time constant with which the other side's pressure then follows the torque [s].
        deafness: pressure by which it has to differ before that is believed [Pa].
        standstill: time without turning after which no flow is counted [s].
    """

    smoothing: float = 0.1
    yielding: float = 0.02
    settling: float = 0.015
    first_look: float = 0.3
    flow_smoothing: float = 0.04
    flow_share: float = 0.3
    flow_margin: float = 0.1
    emptying: float = 0.3
    listening: float = 0.2
    deafness: float = 4e5
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
        by_position, by_leak, by_displacement, by_compliance: derivative of `step` with respect to the position and to
            each factor, the pressures being what the torque says [1, m, m, m].
        travel: distance of the piston from the held side's end before the sample [m].
        cylinder: the cylinder's symbols.
        held, other: the side that holds the load, and the other one.
        held_pressure, other_pressure: of the chambers [Pa].
        manifold_pressure: on the held side, straight from the torque [Pa].
        apparent_pressure: what that would be if the other side were at tank pressure [Pa].
        behind: by how much the manifold's pressure, less the valve's drop, is ahead of `held_pressure` [Pa].
        capacity, other_capacity: of the held chamber and its hose; of all of the other side [m3/Pa].
        leakage, other_leakage: of the pumps per pressure, without the factor [m3/s/Pa].
        open: whether the safety valve lets the torque see the held chamber.
        known: whether the load has been seen since the start.
        highest_pressure: in either manifold, without the torque's noise [Pa].
        load: [N], positive against lifting.
        turning: whether the motor turns or has turned just now.
    """

    step: Any
    by_position: Any
    by_leak: Any
    by_displacement: Any
    by_compliance: Any
    travel: Any
    cylinder: Cylinder
    held: Chamber
    other: Chamber
    held_pressure: Any
    other_pressure: Any
    manifold_pressure: Any
    apparent_pressure: Any
    behind: Any
    capacity: Any
    other_capacity: Any
    leakage: Any
    other_leakage: Any
    open: Any
    known: Any
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
        if pump.orifice_leak is not None:
            parts["pump"] = replace(parts["pump"], orifice_leak=pump.orifice_leak * factors.leak)
        parts["hose"] = replace(hose, bulk_modulus=hose.bulk_modulus / factors.compliance)
        return Chamber.of(Side(**parts), name, cylinder, oil)

    return chamber(unit.held), chamber(opposite(unit.held))


@dataclass(frozen=True)
class _Movement:
    """What follows from the other side's pressure, all of it linear in that: pressures [Pa], oil [m3]."""

    manifold: Any
    leaked: Any
    filled: Any
    through: Any
    load: Any
    rise: Any
    moved: Any


def keep_books(
    graph: SensorGraph,
    unit: DdhUnit,
    tuning: Tuning,
    factors: Factors,
    seated: Any = 0.0,
    pressed: Any = 0.0,
    from_stop: Any = 0.0,
    leak_doubt: Any = 0.0,
) -> Books:
    """Write the bookkeeping of one sample into a sensor's graph.

    Args:
        graph: the sensor's graph; gains the books' states.
        unit: the unit's parts, as its data sheet has them.
        tuning: how the torque is listened to.
        factors: how the machine differs from its data sheet.
        seated: whether the piston rests on the stop of the lowered end, which then carries the load.
        pressed: whether it is pressed against the stop of the lifted end; the valve then keeps the highest pressure.
        from_stop: whether it rests on a stop, or has just begun to leave it.
        leak_doubt: share by which the leakage may be more than believed; what the pump delivers within it may as well
            leak, and opens no valve.
    """
    add = graph.parameters.symbolic
    oil, drive, cylinder = add("oil", unit.oil), add("drive", unit.drive), add("cylinder", unit.cylinder)
    tank_pressure = graph.parameters.add("tank.pressure", unit.tank_pressure)
    oil = replace(oil, bulk_modulus=oil.bulk_modulus / factors.compliance)
    held, other = _sides(graph, unit, factors, cylinder, oil)
    out = unit.lift_sign  # the piston moves this way when oil enters the held side
    w, dt = graph.motor_speed, graph.elapsed
    viscosity = oil.viscosity(graph.oil_temperature)

    # States before the sample; pressures are above tank.
    x = graph.position
    manifold_0, other_0 = graph.state("manifold_pressure"), graph.state("other_pressure")
    leak_held = held.leak_per_pressure(manifold_0, viscosity)
    leak_other = other.leak_per_pressure(other_0, viscosity)
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
    standing = ca.fabs(w) < STANDING
    turning = ca.if_else(ca.logic_and(standing, standing_for > tuning.standstill), 0.0, 1.0)
    lifts = ca.sign(out * w)
    flows = ca.logic_not(pressed)
    drop = flows * lifts * (held.delivered(w) / held.side.safety.conductance) ** 2
    other_drop = lifts * (other.delivered(w) / other.side.safety.conductance) ** 2
    follow = open_ * dt / (tuning.smoothing + dt)
    # Oil that passes a valve which is only just opening fills the chamber before the mass begins to move.
    release = ca.if_else(open_ > 0.5, 1.0, dt / (tuning.yielding + dt))

    # Force balance of the moving piston: chamber = load + motion + ratio * other, motion from mass, friction and the
    # drop across the other side's valve.
    lifting_speed = (held.delivered(w) - leak_held * load_0) / held.area
    inertia = cylinder.mass * held.delivered(acceleration) / held.area
    motion_1 = flows * open_ * ((inertia + cylinder.friction(lifting_speed)) / held.area + ratio * other_drop)

    pumped = held.delivered(graph.angle)

    def movement(other_1: Any) -> _Movement:
        manifold_1 = (torque - slope_other * other_1) / slope_held
        leaked = leak_held * 0.5 * (manifold_0 + manifold_1) * dt
        filled = held.manifold_capacity * (manifold_1 - manifold_0)
        load_1 = load_0 + follow * (manifold_1 - drop - motion_1 - ratio * other_1 - load_0)
        rise = known * (load_1 - load_0) + motion_1 - motion_0 + ratio * (other_1 - other_0)
        through = pumped - leaked - filled
        moved = release * (waiting_0 + turning * through) - capacity_held * rise
        return _Movement(manifold_1, leaked, filled, through, load_1, rise, moved)

    # A load that changed at rest moved the rod then; what the other side had to take of it, it has taken.
    looks_anew = ca.logic_and(open_ > 0.5, open_for < tuning.first_look)
    at_rest = capacity_held * known * ca.logic_and(looks_anew, ca.logic_not(from_stop))

    def drawn(other_1: Any) -> Any:
        """Oil that the other side would have to draw from the tank [m3], linear in its pressure."""
        found = movement(other_1)
        moved = found.moved + at_rest * (found.load - load_0)
        leaked = leak_other * 0.5 * (other_0 + other_1) * dt
        return capacity_other * (other_1 - other_0) - other.delivered(graph.angle) + leaked - ratio * moved

    at_tank, at_more = drawn(0.0), drawn(_LOWEST)
    other_1 = at_tank * _LOWEST / (at_tank - at_more)
    lowest, highest = -other.side.anticavitation.cracking_pressure, other.side.relief.setting
    other_1 = ca.fmin(ca.fmax(other_1, lowest), highest)
    other_1 = ca.if_else(seated, ca.fmin(ca.fmax(torque / slope_other, 0.0), highest), other_1)
    found = movement(other_1)
    manifold_1 = ca.if_else(seated, 0.0, found.manifold)
    load_1 = ca.if_else(pressed, ca.fmax(found.load, load_0 + motion_0), found.load)
    # At rest the held manifold leaks empty, and the torque is the other side's alone. If that rises beyond its noise
    # and what the balance says, the load has fallen and the rod risen, by as much as compresses the one side and
    # relaxes the other. If it falls faster, the other side leaks more than believed, and the load is what it was.
    rests = ca.logic_and(ca.logic_and(standing_for > tuning.emptying, open_ < 0.5), ca.logic_not(seated))
    unheard = graph.state("unheard_pressure")
    heard = unheard + dt / (tuning.listening + dt) * (torque / slope_other - other_1 - unheard)
    believed = heard - ca.fmin(ca.fmax(heard, -tuning.deafness), tuning.deafness)
    graph.becomes("unheard_pressure", ca.if_else(rests, heard - believed, 0.0))
    surprise = ca.fmin(ca.fmax(other_1 + ca.if_else(rests, believed, 0.0), lowest), highest) - other_1
    risen, fallen = ca.fmax(surprise, 0.0), ca.fmin(surprise, 0.0)
    relaxed = ca.if_else(pressed, 0.0, held.area / other.area * capacity_other * risen)  # oil that the held side gives
    given = relaxed - ca.if_else(pressed, 0.0, capacity_held * ratio * fallen)
    other_1 += surprise
    load_1 -= relaxed / capacity_held + ratio * risen
    # The first look at the load is believed at once: what the chamber held before is not compression.
    looking = ca.logic_and(ca.logic_and(known < 0.5, open_ > 0.5), open_for < 1.5 * tuning.settling)
    load_1 = ca.if_else(looking, manifold_1 - drop - motion_1 - ratio * other_1, load_1)
    load_1 = ca.if_else(seated, -motion_1 - ratio * other_1, load_1)
    chamber_1 = load_1 + motion_1 + ratio * other_1
    moves = ca.if_else(seated, 0.0, out / held.area)
    step = moves * (found.moved + given)

    # Is the safety valve open for the next sample?
    lowering = held.side.safety.opening_speed * w > held.side.safety.opening_speed**2
    flow_1 = flow_0 + dt / (tuning.flow_smoothing + dt) * (found.through / ca.fmax(dt, 1e-6) - flow_0)
    delivery = held.delivered(w)
    margin = tuning.flow_margin * leak_held
    net = delivery - leak_held * ca.fmax(manifold_1, 0.0)
    opening = ca.fmax(margin, leak_doubt * leak_held)
    opens = ca.logic_and(net > opening * ca.fmax(manifold_1, _LOWEST), flow_1 > tuning.flow_share * net)
    staying = ca.if_else(known > 0.5, margin, opening)
    stays = delivery - leak_held * chamber_1 > staying * ca.fmax(chamber_1, _LOWEST)
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
    graph.becomes("waiting_oil", (1.0 - release) * (waiting_0 + turning * found.through))

    rod = out * (tank_pressure - ATMOSPHERE) * (cylinder.area_a - cylinder.area_b)
    compressed = turning * found.filled + capacity_held * found.rise - given
    return Books(
        step=step,
        by_position=-ca.if_else(seated, 0.0, found.rise / oil.bulk_modulus),
        by_leak=-moves * turning * found.leaked / factors.leak,
        by_displacement=moves * turning * pumped / factors.displacement,
        by_compliance=-moves * compressed / factors.compliance,
        travel=travel,
        cylinder=cylinder,
        held=held,
        other=other,
        held_pressure=chamber_1,
        other_pressure=other_1,
        manifold_pressure=manifold_1,
        apparent_pressure=torque / slope_held,
        behind=manifold_1 - drop - chamber_1,
        capacity=capacity_held,
        other_capacity=capacity_other,
        leakage=leak_held / factors.leak,
        other_leakage=leak_other / factors.leak,
        open=open_,
        known=known,
        highest_pressure=ca.fmax(chamber_1 + ca.fmax(drop, 0.0), other_1),
        load=held.area * chamber_1 - other.area * other_1 + rod,
        turning=turning,
    )
