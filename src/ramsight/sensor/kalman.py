"""The self-calibrating sensor, for any circuit.

    checked inputs -> load observer -> contacts -> hypotheses of machine and ends -> status

The circuit's own equations say how the piston moves under a load that the torque corrects (`load`). A filter around
them carries what is not known of the machine and where its stops are, under several hypotheses (`hypotheses`); end
stops that the sensor finds by itself (`contact`), switches and positions given by hand correct it.
"""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca

from ramsight.errors import DescriptionError
from ramsight.plant.balance import FACTORS, Balance, balance
from ramsight.plant.limits import limits_of
from ramsight.plant.linkage.lever import Lever
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.contact import Believed, Contact, ContactWatch
from ramsight.sensor.drive_check import DriveChecks, check_drive, declared_checks
from ramsight.sensor.filling import unfilled
from ramsight.sensor.hypotheses import CERTAIN, COMPLIANCE, LEAK, Hypotheses, Measured
from ramsight.sensor.inertia_check import check_inertia
from ramsight.sensor.intake import Intake, take_in
from ramsight.sensor.judgement import Relief, judge
from ramsight.sensor.leaking import Leaking
from ramsight.sensor.link_angle import LinkAngle
from ramsight.sensor.load import LoadObserver, LoadStep
from ramsight.sensor.magnets import correct_torque, declared_temperature
from ramsight.sensor.mode import Mode, is_in
from ramsight.sensor.pressure_check import check_pressures
from ramsight.sensor.pressures import measured_pressures
from ramsight.sensor.pumping import one_sided
from ramsight.sensor.relief import held_back, passed_share, passing
from ramsight.sensor.resting import creep, unseen_load
from ramsight.sensor.virtual_sensor import (
    BOUND,
    IS_REFERENCED,
    LINK_ANGLE,
    REFERENCED_NOW,
    VARIANCE,
    SensorGraph,
    VirtualSensor,
)
from ramsight.sensor.warming import warming_of

_VELOCITY_SMOOTHING = 0.1  # s
_FASTEST = 1.1  # share of the velocity at the highest motor speed that no correction exceeds
_BLIND = 0.02  # share of a load that the torque shows, below which it tells of leakage
_TURNING = 1.0  # rad/s
_CORRELATED = 0.2  # s; for which errors of the torque stay what they are
_MODEL = 0.1  # share of a torque by which a closed volume's equation may err
_SETTLED = 0.5  # s
_STEADY = 0.02  # change of the torque over what leakage makes of it; a pump against a closed valve has settled
_FRICTION = 0.02  # of a torque, by the pumps' hydromechanical efficiency
_NOT_HELD = 0.5  # of what a piston may have gone while it was thought to be held, standard deviation over it
_WENT = 0.01  # share of the stroke, the motor turning one way, after which relief pressure is something that it met
_UNSEEN_FLOW = 0.1  # share of the pump's flow that may move the piston although it seems to stand at relief pressure


def kalman(unit: HydraulicUnit, assumptions: Assumptions | None = None) -> VirtualSensor:
    """The self-calibrating sensor of a unit.

    Args:
        unit: the unit's parts, as its data sheet has them, whatever its circuit.
        assumptions: what it assumes of drive, thermometer, machine and stops; by default what the unit declares.

    Returns:
        A sensor with position, standard deviation, velocity, load and status, and beside them the chambers' pressures
        and the factors. It need not be told where the piston is: it says so until it knows.
    """
    assumed = assumptions or unit.assumptions
    limits, circuit = limits_of(unit), balance(unit)
    lever = _lever(unit, assumed)
    angles = () if lever is None else (LINK_ANGLE,)
    further = (*measured_pressures(assumed), *angles, *declared_checks(assumed), *declared_temperature(assumed))
    graph = SensorGraph(circuit.model.commands, further)
    stroke = float(unit.cylinder.stroke)
    graph.initially("position", 0.5 * stroke)
    graph.parameters.add("stop_stiffness", float(unit.cylinder.stop_stiffness))
    assumed = correct_torque(graph, assumed)
    intake = take_in(graph, unit, limits)
    let_in = graph.motor_speed, graph.motor_torque, graph.oil_temperature
    graph.section("Input check: what of the sample can be, and what stands in for the rest", intake, let_in)
    first = ca.logic_not(graph.held("started"))
    referenced, variance = graph.state(IS_REFERENCED), graph.state(VARIANCE)
    observer = LoadObserver(graph, circuit, limits, assumed)
    symbol = graph.parameters.symbol
    viscosity = circuit.oil_of(lambda name: symbol(f"circuit.{name}")).viscosity
    thinner = viscosity(T40) / viscosity(graph.oil_temperature)
    checks = check_drive(graph, assumed, limits, thinner)
    checks = check_inertia(graph, checks, assumed, limits, float(unit.drive.inertia))
    leaking = Leaking(graph, viscosity, first, observer.expected / symbol("relief_torque"))
    watch = ContactWatch(graph, float(unit.lift_sign), assumed.stops, resists=unit.cylinder.passive)
    link = None if lever is None else LinkAngle(graph, lever, assumed)
    bank = Hypotheses(
        graph, stroke, assumed, known=referenced, first=first, start_variance=variance, with_link=link is not None
    )

    warming = warming_of(graph)
    around = bank.means()
    learned = (around[0], *around[3:])
    step = observer.step([leaking.factor(*learned), around[1], around[2]], watch.held, watch.leaves, warming)
    checks = check_pressures(graph, checks, step, assumed, limits, thinner)
    travel_by, torque_by = (leaking.derivatives(by, *learned) for by in (step.travel_by, step.torque_by))

    title = "Balance: a step of the circuit's equations under the load that the torque corrects, and its derivatives"
    graph.section(title, step, travel_by, torque_by)
    nominal = watch.before_it(graph.position + step.travel)
    setting = assumed.machine.relief
    doubt = passing(circuit, step.z, lambda name: symbol(f"circuit.{name}"), graph.extending_speed, setting)
    stiffness, usual = symbol("stop_stiffness"), assumed.machine.unseen_load * symbol("relief_load")
    believed = Believed(
        position=nominal,
        stroke=symbol("stroke"),
        std=ca.sqrt(bank.variance()),
        known=referenced,
        relief=doubt,
        held_back=held_back(doubt, setting),
        compliance=bank.factor_std(COMPLIANCE),
        unseen=usual,
        stiffness=stiffness,
    )
    contact = watch.look(step, believed, travel_by)
    grown = graph.state("passed_relief")
    graph.section("Contacts: whether the piston stands on something, and where", contact, doubt)
    passed, pending = _relief(graph, bank, step, Relief(doubt, grown), contact)
    load = step.load / symbol("relief_load")
    creeps = creep(graph, unit, load, viscosity(graph.oil_temperature), warming, assumed.machine)
    rests = is_in(contact.mode, (Mode.RESTING_ON_VALVE,))
    drawn = unfilled(circuit, step.z, lambda n: symbol(f"circuit.{n}"), graph.motor_speed, assumed.machine.filling)
    starves = drawn * ca.fabs(graph.extending_angle * symbol("travel_per_radian"))
    grows = intake.drift + passed + ca.if_else(rests, creeps, 0.0) + checks.grows + starves
    grows = grows + _NOT_HELD * ca.fabs(contact.went)
    _predict(graph, bank, step, travel_by, around, grows, leaking, assumed)
    bank.confine(ca.if_else(contact.touched, contact.place, nominal), doubt > 0.0, grown + passed)
    if one_sided(circuit):  # the pump draws from the tank when its load rests on something else
        lifts = ca.logic_and(ca.logic_not(contact.held), graph.extending_speed * unit.lift_sign > _TURNING)
        leaves = ca.if_else(lifts, float(unit.lift_sign), 0.0)
        bank.turned(ca.if_else(contact.touched, contact.place, nominal), leaves)
    observer.release(contact.released, step.carried)
    _torque(graph, bank, step, contact, torque_by, around, checks, doubt)
    measured = _measure(graph, bank, step, contact, nominal, assumed, link, referenced, checks, around)
    # A stop gives way; what it gives back once the piston is let go is travel.
    back = ca.if_else(contact.released, contact.given_way, 0.0)
    begins = ca.if_else(contact.touched, contact.place, nominal + back)
    position = begins + measured.moved
    watch.close(contact, position, measured.moved)
    after = bank.means()
    observer.shift([new - old for new, old in zip(after[:3], around[:3], strict=True)])
    known = ca.fmax(referenced, measured.taken)
    grown_1 = ca.if_else(measured.taken, 0.0, grown + passed)
    graph.becomes("passed_relief", grown_1)
    disputed = graph.state("disputed")
    disputed_1 = ca.if_else(measured.taken, 0.0, ca.fmax(disputed, ca.logic_and(measured.refused, graph.referenced)))
    graph.becomes("disputed", disputed_1)
    fault_passed = _fault_passed(graph, checks, measured)
    graph.becomes(IS_REFERENCED, known)
    total = bank.variance()
    graph.becomes(VARIANCE, ca.fmax(total, 0.0))
    # What only resists moves nothing at rest, however it changes.
    unmoved = 1.0 if unit.cylinder.passive else contact.held
    furthest = ca.fmax(symbol("relief_load") - step.load, step.load + symbol("relief_pull"))
    unseen = unseen_load(graph, step, unmoved, usual, furthest)
    # How much of what the oil carries the stop carries is not known while it is held.
    into = ca.if_else(contact.held, step.carried / stiffness, 0.0)
    gives = step.give * checks.torque_off / symbol("travel_per_radian")
    others = into**2 + step.noise_travel**2 + gives**2
    seen = unseen.std**2 + others
    std = ca.sqrt(bank.band() ** 2 + seen) + pending
    settled = graph.said
    code = judge(
        graph,
        intake,
        step,
        contact,
        Relief(doubt, grown_1),
        limits,
        std=std,
        overall=ca.sqrt(ca.fmax(total, 0.0) + seen) + pending,
        position=position,
        stroke=symbol("stroke"),
        disputed=disputed_1,
        known=known,
        checks=checks,
        fault_passed=fault_passed,
    )
    factors = [(after[k], bank.factor_std(k + LEAK)) for k in range(len(FACTORS))]
    title = "Update: the filters of what is not known of machine and ends, by torque, contact or reference"
    graph.section(title, settled, bank.close(), position)
    bound = ca.sqrt(bank.bound() ** 2 + unseen.most**2 + CERTAIN**2 * others) + CERTAIN * pending
    since = ca.fmax(graph.state(REFERENCED_NOW), measured.taken)
    graph.becomes(REFERENCED_NOW, since)
    more = {BOUND: (bound, "m"), REFERENCED_NOW: (since, "1"), **checks.more}
    return _report(graph, step, intake, position, std, code, factors, measured.taken, contact, circuit, more)


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


def _lever(unit: HydraulicUnit, assumed: Assumptions) -> Lever | None:
    """What a declared sensor of the link's angle says of the position."""
    if assumed.link_angle.std == 0.0:
        return None
    if unit.lever is None:
        text = "needs a mechanism in which the cylinder turns a body, pinned to it and to what the body hangs on"
        raise DescriptionError(text, key=f"units.{unit.name}.assumptions.link_angle.std", value=assumed.link_angle.std)
    return unit.lever


def _relief(graph: SensorGraph, bank: Hypotheses, step: LoadStep, relief: Relief, contact: Contact) -> tuple[Any, Any]:
    """By how much oil over a relief valve makes the position less certain [m]: for good, and as long as it may be.

    What passed moved nothing, and the position goes back by what is expected of it. A piston that seems to stand may be
    on a stop, where all of the pump's oil passes the valve and none is missing.
    """
    pumped = graph.extending_angle * graph.parameters.symbol("travel_per_radian")
    way = ca.sign(pumped)
    moved = ca.fmax(step.travel * way, _UNSEEN_FLOW * ca.fabs(pumped))
    moved = ca.fmin(moved, bank.room(way, relief.grown))
    doubt = relief.doubt
    missing, std = passed_share(doubt)
    still = ca.logic_or(contact.held, contact.touched)
    # A piston that leaves a stop against oil that is still under pressure there is near relief, and goes all the same;
    # one that went freely first has met something.
    went = graph.state("went_freely")
    goes_back = graph.extending_speed * graph.last_extending_speed <= 0.0
    turns_back = ca.logic_or(goes_back, still)
    freely = ca.if_else(doubt > 0.0, went, went + ca.fabs(step.travel))
    graph.becomes("went_freely", ca.if_else(turns_back, 0.0, freely))
    met = went > _WENT * graph.parameters.symbol("stroke")
    missing, std = ca.if_else(met, missing, 0.0), ca.if_else(met, std, doubt)

    def waits(name: str, newest: Any) -> tuple[Any, Any]:
        before = graph.state(name)
        all_of_it = before + newest
        counts = ca.if_else(ca.logic_or(still, contact.stands), 0.0, all_of_it)
        graph.becomes(name, ca.if_else(still, 0.0, all_of_it - counts))
        return counts, ca.if_else(still, 0.0, all_of_it - counts)

    passed, pending = waits("relief_waits", std * moved)
    back, _ = waits("relief_flow_waits", way * missing * moved)
    bank.shift(-back)
    return passed, pending


def _predict(
    graph: SensorGraph,
    bank: Hypotheses,
    step: LoadStep,
    travel_by: list[Any],
    around: list[Any],
    grows: Any,
    leaking: Leaking,
    assumed: Assumptions,
) -> None:
    """Go with the step: the filter's time update."""
    share = assumed.machine.leak_by_viscosity * ca.fabs(leaking.change)
    leak = share * ca.sqrt(graph.elapsed / leaking.slow)
    drive, dt = assumed.drive, graph.elapsed
    # An error of the torque that lasts for a while leaks like an error of the leakage that lasts for a while.
    wrong = drive.torque_gain**2 * travel_by[0] ** 2 * 2.0 * drive.correlation / ca.fmax(dt, 1e-3)
    # At rest friction hides a part of the load, and so a part of what leaks where the pump holds it.
    share = ca.fmin(step.friction / graph.parameters.symbol("travel_per_radian"), step.load_std) / ca.fabs(step.load)
    hidden = ca.fabs(step.free_travel) * ca.if_else(step.friction > 0.0, ca.fmin(share, 1.0), 0.0)
    bank.predict(step.travel, travel_by, around, wrong, grows + hidden, leak)
    bank.floor(assumed.drive.torque_gain)


def _torque(
    graph: SensorGraph,
    bank: Hypotheses,
    step: LoadStep,
    contact: Contact,
    torque_by: list[Any],
    around: list[Any],
    checks: DriveChecks,
    relief: Any,
) -> None:
    """What a torque tells of the machine where it tells nothing of the load.

    While the piston is held the pressures rise as the oil gives way, where none of it may pass a relief valve; while a
    closed valve keeps the load from the pump, all that the pump delivers is leakage.
    """
    inflation = _CORRELATED / ca.fmax(graph.elapsed, 1e-3)
    compressed = ca.logic_and(contact.pushing, ca.logic_not(ca.logic_or(step.empty, relief > 0.0)))
    pushes = ca.logic_and(compressed, ca.fabs(torque_by[2]) > step.noise)
    turns = ca.logic_and(ca.fabs(graph.motor_speed) > _TURNING, ca.logic_not(contact.held))
    steady = ca.fabs(step.change) < _STEADY * ca.fabs(torque_by[0])
    closed, closed_for = ca.logic_and(ca.logic_and(turns, step.seen < _BLIND), steady), graph.state("closed_for")
    closed_for_1 = ca.if_else(closed, closed_for + graph.elapsed, 0.0)
    graph.becomes("closed_for", closed_for_1)
    blind = closed_for_1 > _SETTLED
    model = (_MODEL * torque_by[2]) ** 2 + ca.if_else(blind, (_FRICTION * graph.motor_torque) ** 2, 0.0)
    variance = (step.noise**2 + model) * inflation
    blind, pushes = checks.unless_contradicted(blind), checks.unless_contradicted(pushes)
    bank.torque(torque_by, around, step.surprise, variance, leak=blind, compliance=pushes)


def _measure(
    graph: SensorGraph,
    bank: Hypotheses,
    step: LoadStep,
    contact: Contact,
    nominal: Any,
    assumed: Assumptions,
    link: LinkAngle | None,
    known: Any,
    checks: DriveChecks,
    around: list[Any],
) -> Measured:
    """References, contacts and angles, one a sample: a reference goes before a contact, and that before an angle.

    What a torque shows while the drive's power contradicts it is no contact.
    """
    stroke, stops = graph.parameters.symbol("stroke"), assumed.stops
    given = graph.referenced
    anew = checks.unless_contradicted(contact.anew)
    by_contact = ca.logic_and(anew, ca.logic_not(given))
    top = contact.at_top
    # The torque may be late: the oil seems to be compressed a little after it is.
    late = ca.fabs(step.free_travel) * ca.fmax(0.5 * assumed.drive.delay / ca.fmax(graph.elapsed, 1e-3), 0.5)
    given_way = (step.carried / graph.parameters.symbol("stop_stiffness")) ** 2
    own = (stops.contact * stroke) ** 2 + given_way
    arrived = ca.if_else(by_contact, late**2 + contact.doubt**2, 0.0)
    place = ca.if_else(given, graph.reference, ca.if_else(top, stroke, 0.0))
    variance = ca.if_else(given, stops.reference**2, own)
    use, by_offset = ca.logic_or(given, anew), 0.0
    elsewhere = ca.logic_not(by_contact)
    if link is not None:
        angle = link.look(step, known, use)
        place, variance = ca.if_else(angle.use, angle.place, place), ca.if_else(angle.use, angle.variance, variance)
        use, by_offset = ca.logic_or(use, angle.use), ca.if_else(angle.use, angle.by_offset, 0.0)
    return bank.measure(
        place,
        ca.if_else(elsewhere, nominal, contact.place),
        ca.logic_and(by_contact, ca.logic_not(top)),
        ca.logic_and(by_contact, top),
        variance,
        arrived,
        ca.if_else(elsewhere, stops.lies, stops.obstacle),
        use,
        by_offset,
        ([ca.if_else(elsewhere, 0.0, by) for by in contact.place_by], around),
    )


def _report(
    graph: SensorGraph,
    step: LoadStep,
    intake: Intake,
    position: Any,
    std: Any,
    status: Any,
    factors: list[tuple[Any, Any]],
    taken: Any,
    contact: Contact,
    circuit: Balance,
    further: dict[str, tuple[Any, str]],
) -> VirtualSensor:
    """What the sensor says of the sample, and its graph closed."""
    stroke = graph.parameters.symbol("stroke")
    inside = ca.fmin(ca.fmax(position, -stroke), 2.0 * stroke)
    graph.becomes("position", inside)
    # Whatever is not a reference moves the position that is shown no faster than the piston can go.
    shown, started = graph.state("shown_position"), graph.held("started")
    fastest = _FASTEST * graph.parameters.symbol("travel_per_radian") * graph.parameters.symbol("max_speed")
    reach = fastest * intake.passed
    wanted = ca.fmin(ca.fmax(ca.if_else(intake.usable, inside, graph.position), 0.0), stroke)
    jumps = ca.logic_and(ca.logic_or(taken, ca.logic_not(started)), intake.usable)
    followed = ca.fmin(ca.fmax(wanted, shown - reach), shown + reach)
    shown_1 = ca.if_else(jumps, wanted, ca.if_else(started, followed, wanted))
    graph.becomes("shown_position", shown_1, always=True)

    speed, dt = graph.state("velocity"), graph.elapsed
    moving = ca.if_else(contact.held, 0.0, step.travel / ca.fmax(dt, 1e-6))
    velocity = speed + dt / (_VELOCITY_SMOOTHING + dt) * (moving - speed)
    graph.becomes("velocity", velocity)
    astray = intake.unseen + ca.fabs(wanted - shown_1)
    deviation = std + astray

    more = circuit.chambers(step.z)
    bound, unit = further[BOUND]
    more |= {**further, BOUND: (bound + astray, unit)}
    for name, (value, error) in zip(FACTORS, factors, strict=True):
        more[f"{name}_factor"] = (value, "1")
        more[f"{name}_factor_std"] = (error, "1")
    more["mode"] = (contact.mode, "1")
    return graph.sensor(
        "kalman", position=shown_1, velocity=velocity, load=step.load, std=deviation, status=status, more=more
    )
