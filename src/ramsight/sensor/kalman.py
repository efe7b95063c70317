"""The self-calibrating sensor, for any circuit.

    checked inputs -> load observer -> contacts -> hypotheses of machine and ends -> status

The circuit's own equations say how the piston moves under a load that the torque corrects (`load`). A filter around
them carries what is not known of the machine and where its stops are, under several hypotheses (`hypotheses`); end
stops that the sensor finds by itself (`contact`), switches and positions given by hand correct it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from ramsight.errors import DescriptionError
from ramsight.plant.balance import FACTORS, Balance, balance
from ramsight.plant.limits import Limits, limits_of
from ramsight.plant.linkage.lever import Lever
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.case_heat import CaseHeat
from ramsight.sensor.contact import Believed, Contact, ContactWatch
from ramsight.sensor.drive_check import DriveChecks, check_drive, declared_checks
from ramsight.sensor.filling import unfilled
from ramsight.sensor.hypotheses import Hypotheses, Measured
from ramsight.sensor.hypothesis import COMPLIANCE, LEAK, LOW
from ramsight.sensor.inertia_check import check_inertia
from ramsight.sensor.intake import Intake, take_in
from ramsight.sensor.judgement import Relief, judge
from ramsight.sensor.leaking import Leaking
from ramsight.sensor.letting_go import SOFT
from ramsight.sensor.link_angle import LinkAngle
from ramsight.sensor.load import LoadObserver, LoadStep
from ramsight.sensor.magnets import correct_torque, declared_temperature
from ramsight.sensor.mixture import CERTAIN
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
_BOUNCES = 0.5  # of the way that a piston may have gone by, or the pump drawn from the tank, standard deviation over it
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
    parts = _parts(unit, assumptions or unit.assumptions)
    stepped = _step(parts)
    met = _meet(parts, stepped)
    return _report(parts, stepped, met, _update(parts, stepped, met))


@dataclass(frozen=True)
class _Parts:
    """What the sensor consists of, with the sample checked.

    Attributes:
        unit: the unit.
        assumed: what is assumed of it.
        graph: of the sensor.
        circuit: the unit's balance.
        limits: of the unit.
        intake: what of the sample can be.
        case: the pumps' cases as a heat store, where the unit's heat is described.
        checks: what the drive's reports say of each other.
        observer: of the load.
        leaking: how leakage follows temperature and pressure.
        watch: for contacts.
        link: the link's angle, where it is measured.
        bank: the hypotheses of machine and ends.
        referenced: whether the position was known before the sample.
        viscosity: of the oil, over its temperature [m2/s].
    """

    unit: HydraulicUnit
    assumed: Assumptions
    graph: SensorGraph
    circuit: Balance
    limits: Limits
    intake: Intake
    case: CaseHeat | None
    checks: DriveChecks
    observer: LoadObserver
    leaking: Leaking
    watch: ContactWatch
    link: LinkAngle | None
    bank: Hypotheses
    referenced: Any
    viscosity: Callable[[Any], Any]

    def symbol(self, name: str) -> Any:
        """A parameter of the sensor."""
        return self.graph.parameters.symbol(name)

    def of_circuit(self, name: str) -> Any:
        """A parameter of the circuit."""
        return self.symbol(f"circuit.{name}")

    @property
    def thinner(self) -> Any:
        """Viscosity at 40 degC over that of the oil [1]."""
        return self.viscosity(T40) / self.viscosity(self.graph.pump_temperature)


@dataclass(frozen=True)
class _Stepped:
    """The balance's step.

    Attributes:
        step: what the load observer says.
        checks: of the drive's reports, pressures among them.
        around: factors, lag and exponent that the step was made with.
        travel_by, torque_by: derivatives of travel and torque with respect to those.
        warming: of the oil [K/s].
    """

    step: LoadStep
    checks: DriveChecks
    around: list[Any]
    travel_by: list[Any]
    torque_by: list[Any]
    warming: Any


@dataclass(frozen=True)
class _Met:
    """What the piston may have met.

    Attributes:
        contact: that was found.
        nominal: position after the step, without it [m].
        relief: what passed a relief valve until this sample.
        usual: change of a load at rest that is usual [N].
    """

    contact: Contact
    nominal: Any
    relief: Relief
    usual: Any


@dataclass(frozen=True)
class _Updated:
    """What is known after the sample.

    Attributes:
        position: [m].
        known: whether it is.
        measured: what a reference or a contact did.
        after: factors, lag and exponent.
        variance: of the position, over all hypotheses [m2].
        pending: how uncertain it is by oil that may have passed a relief valve, until a contact tells [m].
        relief: what passed a relief valve.
        disputed: whether a reference was refused.
        fault_passed: whether inputs have contradicted each other since the last reference.
    """

    position: Any
    known: Any
    measured: Measured
    after: list[Any]
    variance: Any
    pending: Any
    relief: Relief
    disputed: Any
    fault_passed: Any


def _parts(unit: HydraulicUnit, assumed: Assumptions) -> _Parts:
    """The sensor's graph up to the checked sample, and what the stages behind it work with."""
    limits, circuit, lever = limits_of(unit), balance(unit), _lever(unit, assumed)
    graph = _graph(unit, assumed, circuit, lever)
    assumed = correct_torque(graph, assumed)
    intake = take_in(graph, unit, limits)
    let_in = graph.motor_speed, graph.motor_torque, graph.oil_temperature
    graph.section("Input check: what of the sample can be, and what stands in for the rest", intake, let_in)
    first = ca.logic_not(graph.held("started"))
    referenced, variance = graph.state(IS_REFERENCED), graph.state(VARIANCE)
    observer = LoadObserver(graph, circuit, limits, assumed)
    symbol = graph.parameters.symbol
    viscosity = circuit.oil_of(lambda name: symbol(f"circuit.{name}")).viscosity
    case = None if unit.heat is None else CaseHeat(graph, unit.heat)
    checks = check_drive(graph, assumed, limits, viscosity(T40) / viscosity(graph.pump_temperature))
    checks = check_inertia(graph, checks, assumed, limits, float(unit.drive.inertia))
    leaking = Leaking(graph, viscosity, first, observer.expected / symbol("relief_torque"))
    watch = ContactWatch(graph, float(unit.lift_sign), assumed.stops, resists=unit.cylinder.passive)
    link = None if lever is None else LinkAngle(graph, lever, assumed)
    bank = Hypotheses(
        graph,
        float(unit.cylinder.stroke),
        assumed,
        known=referenced,
        first=first,
        start_variance=variance,
        with_link=link is not None,
    )
    return _Parts(
        unit=unit,
        assumed=assumed,
        graph=graph,
        circuit=circuit,
        limits=limits,
        intake=intake,
        case=case,
        checks=checks,
        observer=observer,
        leaking=leaking,
        watch=watch,
        link=link,
        bank=bank,
        referenced=referenced,
        viscosity=viscosity,
    )


def _graph(unit: HydraulicUnit, assumed: Assumptions, circuit: Balance, lever: Lever | None) -> SensorGraph:
    """A graph with its inputs and the parameters that all stages use."""
    angles = () if lever is None else (LINK_ANGLE,)
    further = (*measured_pressures(assumed), *angles, *declared_checks(assumed), *declared_temperature(assumed))
    graph = SensorGraph(circuit.model.commands, further)
    graph.initially("position", 0.5 * float(unit.cylinder.stroke))
    graph.parameters.add("stop_stiffness", float(unit.cylinder.stop_stiffness))
    return graph


def _step(parts: _Parts) -> _Stepped:
    """The balance of the sample, and how it depends on what is not known of the machine."""
    graph, leaking = parts.graph, parts.leaking
    warming = warming_of(graph)
    around = parts.bank.means()
    learned = (around[0], *around[3:])
    factors = [leaking.factor(*learned), around[1], around[2]]
    step = parts.observer.step(factors, parts.watch.held, parts.watch.leaves, warming)
    if parts.case is not None:
        parts.case.after(step.pump_heat, parts.intake.passed)
    checks = check_pressures(graph, parts.checks, step, parts.assumed, parts.limits, parts.thinner)
    travel_by, torque_by = (leaking.derivatives(by, *learned) for by in (step.travel_by, step.torque_by))
    title = "Balance: a step of the circuit's equations under the load that the torque corrects, and its derivatives"
    graph.section(title, step, travel_by, torque_by)
    return _Stepped(step, checks, around, travel_by, torque_by, warming)


def _meet(parts: _Parts, stepped: _Stepped) -> _Met:
    """Whether the piston stands on something."""
    graph, bank, step = parts.graph, parts.bank, stepped.step
    nominal = parts.watch.before_it(graph.position + step.travel)
    setting = parts.assumed.machine.relief
    doubt = passing(parts.circuit, step.z, parts.of_circuit, graph.extending_speed, setting)
    stiffness = parts.symbol("stop_stiffness")
    usual = parts.assumed.machine.unseen_load * parts.symbol("relief_load")
    believed = Believed(
        position=nominal,
        stroke=parts.symbol("stroke"),
        std=ca.sqrt(bank.variance()),
        known=parts.referenced,
        relief=doubt,
        held_back=held_back(doubt, setting),
        compliance=bank.factor_std(COMPLIANCE),
        unseen=usual,
        stiffness=stiffness,
    )
    contact = parts.watch.look(step, believed, stepped.travel_by)
    grown = graph.state("passed_relief")
    graph.section("Contacts: whether the piston stands on something, and where", contact, doubt)
    return _Met(contact, nominal, Relief(doubt, grown), usual)


def _update(parts: _Parts, stepped: _Stepped, met: _Met) -> _Updated:
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
    return _Updated(position, known, measured, after, total, pending, relief, disputed, fault_passed)


def _grows(parts: _Parts, stepped: _Stepped, contact: Contact, passed: Any) -> Any:
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


def _lever(unit: HydraulicUnit, assumed: Assumptions) -> Lever | None:
    """What a declared sensor of the link's angle says of the position."""
    if assumed.link_angle.std == 0.0:
        return None
    if unit.lever is None:
        text = "needs a mechanism in which the cylinder turns a body, pinned to it and to what the body hangs on"
        raise DescriptionError(text, key=f"units.{unit.name}.assumptions.link_angle.std", value=assumed.link_angle.std)
    return unit.lever


def _relief(parts: _Parts, step: LoadStep, met: _Met) -> tuple[Any, Any]:
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


def _predict(parts: _Parts, stepped: _Stepped, grows: Any) -> None:
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


def _torque(parts: _Parts, stepped: _Stepped, met: _Met) -> None:
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


def _measure(parts: _Parts, stepped: _Stepped, met: _Met) -> Measured:
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


def _report(parts: _Parts, stepped: _Stepped, met: _Met, updated: _Updated) -> VirtualSensor:
    """How sure the position is, and the status; with them the graph is closed."""
    graph, bank, step, contact = parts.graph, parts.bank, stepped.step, met.contact
    # What only resists moves nothing at rest, however it changes.
    unmoved = 1.0 if parts.unit.cylinder.passive else contact.held
    furthest = ca.fmax(parts.symbol("relief_load") - step.load, step.load + parts.symbol("relief_pull"))
    unseen = unseen_load(graph, step, unmoved, met.usual, furthest)
    # What the stop carries is not known while it is held: some of what the oil does, or what it did before.
    into = ca.if_else(contact.held, step.carried / parts.symbol("stop_stiffness"), 0.0)
    into = ca.fmax(ca.fabs(into), ca.if_else(contact.held, ca.fabs(contact.given_way), 0.0))
    gives = step.give * stepped.checks.torque_off / parts.symbol("travel_per_radian")
    others = into**2 + contact.unsure**2 + step.noise_travel**2 + gives**2
    seen = unseen.std**2 + others
    std = ca.sqrt(bank.band() ** 2 + seen) + updated.pending
    settled = graph.said
    code = judge(
        graph,
        parts.intake,
        step,
        contact,
        updated.relief,
        parts.limits,
        std=std,
        overall=ca.sqrt(ca.fmax(updated.variance, 0.0) + seen) + updated.pending,
        position=updated.position,
        stroke=parts.symbol("stroke"),
        disputed=updated.disputed,
        known=updated.known,
        checks=stepped.checks,
        fault_passed=updated.fault_passed,
    )
    more: dict[str, tuple[Any, str]] = {}
    for k, name in enumerate(FACTORS):
        more[f"{name}_factor"] = updated.after[k], "1"
        more[f"{name}_factor_std"] = bank.factor_std(k + LEAK), "1"
    for warmer in updated.after[LOW - LEAK :]:  # what leaks by the reported temperature, be it the oil's or not
        leak, by = parts.leaking.at_reported(updated.after[0], warmer)
        more |= {"leak_factor": (leak, "1"), "leak_factor_std": (bank.leak_std(by), "1")}
    more |= {f"{name}_probability": (chance, "1") for name, chance in bank.probabilities().items()}
    title = "Update: the filters of what is not known of machine and ends, by torque, contact or reference"
    graph.section(title, settled, bank.close(), updated.position)
    bound = ca.sqrt(bank.bound() ** 2 + unseen.most**2 + CERTAIN**2 * others) + CERTAIN * updated.pending
    since = ca.fmax(graph.state(REFERENCED_NOW), updated.measured.taken)
    graph.becomes(REFERENCED_NOW, since)
    shown, astray = _shown(parts, updated)
    velocity = _velocity(graph, step, contact)
    first = parts.circuit.chambers(step.z)
    first |= {BOUND: (bound + astray, "m"), REFERENCED_NOW: (since, "1"), **stepped.checks.more}
    more = {**first, **more, "mode": (contact.mode, "1")}
    return graph.sensor(
        "kalman", position=shown, velocity=velocity, load=step.load, std=std + astray, status=code, more=more
    )


def _shown(parts: _Parts, updated: _Updated) -> tuple[Any, Any]:
    """The position that is shown, and how far it may be from the one that is meant [m].

    Whatever is not a reference moves it no faster than the piston can go.
    """
    graph, intake, stroke = parts.graph, parts.intake, parts.symbol("stroke")
    inside = ca.fmin(ca.fmax(updated.position, -stroke), 2.0 * stroke)
    graph.becomes("position", inside)
    shown, started = graph.state("shown_position"), graph.held("started")
    fastest = _FASTEST * parts.symbol("travel_per_radian") * parts.symbol("max_speed")
    reach = fastest * intake.passed
    wanted = ca.fmin(ca.fmax(ca.if_else(intake.usable, inside, graph.position), 0.0), stroke)
    jumps = ca.logic_and(ca.logic_or(updated.measured.taken, ca.logic_not(started)), intake.usable)
    followed = ca.fmin(ca.fmax(wanted, shown - reach), shown + reach)
    now = ca.if_else(jumps, wanted, ca.if_else(started, followed, wanted))
    graph.becomes("shown_position", now, always=True)
    return now, intake.unseen + ca.fabs(wanted - now)


def _velocity(graph: SensorGraph, step: LoadStep, contact: Contact) -> Any:
    """The piston's velocity, smoothed [m/s]."""
    speed, dt = graph.state("velocity"), graph.elapsed
    moving = ca.if_else(contact.held, 0.0, step.travel / ca.fmax(dt, 1e-6))
    velocity = speed + dt / (_VELOCITY_SMOOTHING + dt) * (moving - speed)
    graph.becomes("velocity", velocity)
    return velocity
