"""The filters of machine and ends within a sample: what makes them less certain, and what they are taught.

Oil over a relief valve, creeping valves and starving pumps make the position less certain; torques, contacts,
references and angles teach the hypotheses (`hypotheses`).
"""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca

from ramsight.sensor.contact import Contact
from ramsight.sensor.drive_check import DriveChecks
from ramsight.sensor.filling import unfilled
from ramsight.sensor.hypotheses import Measured
from ramsight.sensor.hypothesis import COMPLIANCE, LEAK
from ramsight.sensor.judgement import Relief
from ramsight.sensor.letting_go import SOFT
from ramsight.sensor.load import LoadStep
from ramsight.sensor.mode import Mode, is_in
from ramsight.sensor.pumping import one_sided
from ramsight.sensor.relief import passed_share
from ramsight.sensor.resting import creep
from ramsight.sensor.stages import Met, Parts, Stepped, Updated
from ramsight.sensor.virtual_sensor import IS_REFERENCED, VARIANCE, SensorGraph

_BLIND = 0.02  # share of a load that the torque shows, below which it tells of leakage
_TURNING = 1.0  # rad/s
_CORRELATED = 0.2  # s; for which errors of the torque stay what they are
_MODEL = 0.1  # share of a torque by which a closed volume's equation may err
_SETTLED = 0.5  # s
_STEADY = 0.02  # change of the torque over what leakage makes of it; a pump against a closed valve has settled
_FRICTION = 0.02  # of a torque, by the pumps' hydromechanical efficiency
_NOT_HELD = 0.5  # of what a piston may have gone while it was thought to be held, standard deviation over it
_BOUNCES = 0.5  # of the way that a piston may have gone by, or the pump drawn from the tank, standard deviation over it
_WENT = 0.01  # share of the stroke, the motor turning one way, after which relief pressure is something that it met
_UNSEEN_FLOW = 0.1  # share of the pump's flow that may move the piston although it seems to stand at relief pressure


def update(parts: Parts, stepped: Stepped, met: Met) -> Updated:
    """The filters of machine and ends: what makes them less certain, and what torque, contact or reference teach."""
    graph, bank, contact, around = parts.graph, parts.bank, met.contact, stepped.around
    passed, pending = _relief(parts, stepped.step, met)
    _predict(parts, stepped, _grows(parts, stepped, contact, passed))
    began = ca.if_else(contact.touched, contact.place, met.nominal)
    bank.confine(began, met.relief.doubt > 0.0, met.relief.grown + passed)
    if one_sided(parts.circuit):  # the pump draws from the tank when its load rests on something else
        sign = float(parts.unit.lift_sign)
        lifts = ca.logic_and(ca.logic_not(contact.held), graph.extending_speed * sign > _TURNING)
        bank.turned(began, ca.if_else(lifts, sign, 0.0))
    came = parts.observer.release(contact.released, contact.held, contact.shown, stepped.step.give)
    _torque(parts, stepped, met)
    measured = _measure(parts, stepped, met)
    # A stop gives way; what it gives back once the piston is let go is travel.
    back = ca.if_else(contact.released, contact.given_way, 0.0) + came
    stands = ca.logic_and(contact.touched, ca.logic_not(contact.went_on))
    position = ca.if_else(stands, contact.place, met.nominal + back) + measured.moved
    parts.watch.close(contact, position, measured.moved)
    after = bank.means()
    parts.observer.shift([new - old for new, old in zip(after[:3], around[:3], strict=True)])
    known = ca.fmax(parts.referenced, measured.taken)
    grown = ca.if_else(measured.taken, 0.0, met.relief.grown + passed)
    graph.becomes("passed_relief", grown)
    before = graph.state("disputed")
    refused = ca.logic_and(measured.refused, graph.referenced)
    disputed = ca.if_else(measured.taken, 0.0, ca.fmax(before, refused))
    graph.becomes("disputed", disputed)
    fault_passed = _fault_passed(graph, stepped.checks, measured)
    graph.becomes(IS_REFERENCED, known)
    total = bank.variance()
    graph.becomes(VARIANCE, ca.fmax(total, 0.0))
    relief = Relief(met.relief.doubt, grown)
    return Updated(position, known, measured, after, total, pending, relief, disputed, fault_passed)


def _grows(parts: Parts, stepped: Stepped, contact: Contact, passed: Any) -> Any:
    """By how much the position is less certain after the sample, beside what the filter knows of the machine [m].

    Args:
        parts: of the sensor.
        stepped: the balance's step.
        contact: that was found.
        passed: by oil over a relief valve [m].
    """
    graph, step, machine = parts.graph, stepped.step, parts.assumed.machine
    load = step.load / parts.symbol("relief_load")
    viscosity = parts.viscosity(graph.oil_temperature)
    creeps = creep(graph, parts.unit, load, viscosity, stepped.warming, machine)
    rests = is_in(contact.mode, (Mode.RESTING_ON_VALVE,))
    drawn = unfilled(parts.circuit, step.z, parts.of_circuit, graph.motor_speed, machine.filling)
    starves = drawn * ca.fabs(graph.extending_angle * parts.symbol("travel_per_radian"))
    grows = parts.intake.drift + passed + ca.if_else(rests, creeps, 0.0) + stepped.checks.grows + starves
    # A mass that bounces leaves the oil for a moment, and the pump draws from the tank: as good as all of it, or none.
    bounces = _BOUNCES * step.may_be_empty * ca.fabs(step.travel)
    return grows + _NOT_HELD * ca.fabs(contact.went) + bounces


def _fault_passed(graph: SensorGraph, checks: DriveChecks, measured: Measured) -> Any:
    """Whether inputs have contradicted each other since the last reference: by how much it was wrong nobody knows.

    Where speed and counter were apart and it turns out which of them was right, that is known.
    """
    if not checks.declared:
        return 0.0
    decided = ca.logic_or(checks.speed_wrong, checks.counter_wrong)
    since = []
    found = (
        ("speed", checks.undecided, decided),
        ("torque", checks.torque_wrong, 0.0),
        ("sign", checks.sign_wrong, 0.0),
    )
    for name, now, over in found:
        if isinstance(now, float):
            continue  # never, on this machine
        before = graph.state(f"{name}_contradicted")
        after = ca.if_else(now, 1.0, ca.if_else(ca.logic_or(measured.taken, over), 0.0, before))
        graph.becomes(f"{name}_contradicted", after)
        since.append(after)
    return functools.reduce(ca.logic_or, since)


def _relief(parts: Parts, step: LoadStep, met: Met) -> tuple[Any, Any]:
    """By how much oil over a relief valve makes the position less certain [m]: for good, and as long as it may be.

    What passed moved nothing, and the position goes back by what is expected of it. A piston that seems to stand may be
    on a stop, where all of the pump's oil passes the valve and none is missing.
    """
    graph, contact, doubt = parts.graph, met.contact, met.relief.doubt
    pumped = graph.extending_angle * parts.symbol("travel_per_radian")
    way = ca.sign(pumped)
    moved = ca.fmax(step.travel * way, _UNSEEN_FLOW * ca.fabs(pumped))
    moved = ca.fmin(moved, parts.bank.room(way, met.relief.grown))
    missing, std = passed_share(doubt)
    still = ca.logic_or(contact.held, contact.touched)
    # A piston that leaves a stop against oil that is still under pressure there is near relief, and goes all the same;
    # one that went freely first has met something.
    went = graph.state("went_freely")
    goes_back = graph.extending_speed * graph.last_extending_speed <= 0.0
    turns_back = ca.logic_or(goes_back, still)
    freely = ca.if_else(doubt > 0.0, went, went + ca.fabs(step.travel))
    graph.becomes("went_freely", ca.if_else(turns_back, 0.0, freely))
    met_it = went > _WENT * parts.symbol("stroke")
    missing, std = ca.if_else(met_it, missing, 0.0), ca.if_else(met_it, std, doubt)

    def waits(name: str, newest: Any) -> tuple[Any, Any]:
        before = graph.state(name)
        all_of_it = before + newest
        counts = ca.if_else(ca.logic_or(still, contact.stands), 0.0, all_of_it)
        graph.becomes(name, ca.if_else(still, 0.0, all_of_it - counts))
        return counts, ca.if_else(still, 0.0, all_of_it - counts)

    passed, pending = waits("relief_waits", std * moved)
    back, _ = waits("relief_flow_waits", way * missing * moved)
    parts.bank.shift(-back)
    return passed, pending


def _predict(parts: Parts, stepped: Stepped, grows: Any) -> None:
    """Go with the step: the filter's time update.

    Args:
        parts: of the sensor.
        stepped: the balance's step.
        grows: by which the position is less certain besides [m].
    """
    step, travel_by, leaking = stepped.step, stepped.travel_by, parts.leaking
    drive, dt = parts.assumed.drive, parts.graph.elapsed
    share = parts.assumed.machine.leak_by_viscosity * ca.fabs(leaking.change)
    leak = share * ca.sqrt(dt / leaking.slow)
    # An error of the torque that lasts for a while leaks like an error of the leakage that lasts for a while.
    wrong = drive.torque_gain**2 * travel_by[0] ** 2 * 2.0 * drive.correlation / ca.fmax(dt, 1e-3)
    # At rest friction hides a part of the load, and so a part of what leaks where the pump holds it.
    share = ca.fmin(step.friction / parts.symbol("travel_per_radian"), step.load_std) / ca.fabs(step.load)
    hidden = ca.fabs(step.free_travel) * ca.if_else(step.friction > 0.0, ca.fmin(share, 1.0), 0.0)
    parts.bank.predict(step.travel, travel_by, stepped.around, wrong, grows + hidden, leak)
    parts.bank.floor(drive.torque_gain)


def _torque(parts: Parts, stepped: Stepped, met: Met) -> None:
    """What a torque tells of the machine where it tells nothing of the load.

    While the piston is held the pressures rise as the oil gives way, where none of it may pass a relief valve; while a
    closed valve keeps the load from the pump, all that the pump delivers is leakage.
    """
    graph, contact, relief = parts.graph, met.contact, met.relief.doubt
    step, torque_by, checks = stepped.step, stepped.torque_by, stepped.checks
    inflation = _CORRELATED / ca.fmax(graph.elapsed, 1e-3)
    # Oil that gives back more than any such machine's is that of a piston that goes already.
    usual = ca.fabs(stepped.around[COMPLIANCE - LEAK] - 1.0) < SOFT * parts.assumed.machine.compliance
    closed = ca.logic_or(contact.pushing, ca.logic_and(contact.draws, usual))
    compressed = ca.logic_and(closed, ca.logic_not(ca.logic_or(step.empty, relief > 0.0)))
    pushes = ca.logic_and(compressed, ca.fabs(torque_by[2]) > step.noise)
    turns = ca.logic_and(ca.fabs(graph.motor_speed) > _TURNING, ca.logic_not(contact.held))
    steady = ca.fabs(step.change) < _STEADY * ca.fabs(torque_by[0])
    valve, closed_for = ca.logic_and(ca.logic_and(turns, step.seen < _BLIND), steady), graph.state("closed_for")
    closed_for_1 = ca.if_else(valve, closed_for + graph.elapsed, 0.0)
    graph.becomes("closed_for", closed_for_1)
    blind = closed_for_1 > _SETTLED
    model = (_MODEL * torque_by[2]) ** 2 + ca.if_else(blind, (_FRICTION * graph.motor_torque) ** 2, 0.0)
    variance = step.noise**2 + model
    blind, pushes = checks.unless_contradicted(blind), checks.unless_contradicted(pushes)
    parts.bank.torque(torque_by, stepped.around, step.surprise, variance, inflation, leak=blind, compliance=pushes)


def _measure(parts: Parts, stepped: Stepped, met: Met) -> Measured:
    """References, contacts and angles, one a sample: a reference goes before a contact, and that before an angle.

    What a torque shows while the drive's power contradicts it is no contact.
    """
    graph, step, contact = parts.graph, stepped.step, met.contact
    stroke, stops = parts.symbol("stroke"), parts.assumed.stops
    given = graph.referenced
    anew = stepped.checks.unless_contradicted(contact.anew)
    by_contact = ca.logic_and(anew, ca.logic_not(given))
    top = contact.at_top
    # The torque may be late: the oil seems to be compressed a little after it is.
    late = ca.fabs(step.free_travel) * ca.fmax(0.5 * parts.assumed.drive.delay / ca.fmax(graph.elapsed, 1e-3), 0.5)
    given_way = (step.carried / parts.symbol("stop_stiffness")) ** 2
    own = (stops.contact * stroke) ** 2 + given_way
    arrived = ca.if_else(by_contact, late**2 + contact.doubt**2, 0.0)
    place = ca.if_else(given, graph.reference, ca.if_else(top, stroke, 0.0))
    variance = ca.if_else(given, stops.reference**2, own)
    use, by_offset = ca.logic_or(given, anew), 0.0
    elsewhere = ca.logic_not(by_contact)
    if parts.link is not None:
        angle = parts.link.look(step, parts.referenced, use)
        place, variance = ca.if_else(angle.use, angle.place, place), ca.if_else(angle.use, angle.variance, variance)
        use, by_offset = ca.logic_or(use, angle.use), ca.if_else(angle.use, angle.by_offset, 0.0)
    return parts.bank.measure(
        place,
        ca.if_else(elsewhere, met.nominal, contact.place),
        ca.logic_and(by_contact, ca.logic_not(top)),
        ca.logic_and(by_contact, top),
        variance,
        arrived,
        ca.if_else(elsewhere, stops.lies, stops.obstacle),
        use,
        by_offset,
        ([ca.if_else(elsewhere, 0.0, by) for by in contact.place_by], stepped.around),
        ca.logic_and(contact.went_on, ca.logic_not(elsewhere)),
    )
