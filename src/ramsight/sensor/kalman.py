"""The self-calibrating sensor, for any circuit.

    checked inputs -> load observer -> contacts -> hypotheses of machine and ends -> status

The circuit's own equations say how the piston moves under a load that the torque corrects (`load`). A filter around
them carries what is not known of the machine and where its stops are, under several hypotheses (`hypotheses`); end
stops that the sensor finds by itself (`contact`), switches and positions given by hand correct it.
"""

from __future__ import annotations

import casadi as ca

from ramsight.errors import DescriptionError
from ramsight.plant.balance import Balance, balance
from ramsight.plant.limits import limits_of
from ramsight.plant.linkage.lever import Lever
from ramsight.plant.oil import T40
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.case_heat import CaseHeat
from ramsight.sensor.contact import Believed, ContactWatch
from ramsight.sensor.drive_check import check_drive, declared_checks
from ramsight.sensor.hypotheses import Hypotheses
from ramsight.sensor.hypothesis import COMPLIANCE
from ramsight.sensor.inertia_check import check_inertia
from ramsight.sensor.intake import take_in
from ramsight.sensor.judgement import Relief
from ramsight.sensor.leaking import Leaking
from ramsight.sensor.link_angle import LinkAngle
from ramsight.sensor.load import LoadObserver
from ramsight.sensor.magnets import correct_torque, declared_temperature
from ramsight.sensor.pressure_check import check_pressures
from ramsight.sensor.pressures import measured_pressures
from ramsight.sensor.relief import held_back, passing
from ramsight.sensor.reporting import report
from ramsight.sensor.stages import Met, Parts, Stepped
from ramsight.sensor.updating import update
from ramsight.sensor.virtual_sensor import IS_REFERENCED, LINK_ANGLE, VARIANCE, SensorGraph, VirtualSensor
from ramsight.sensor.warming import warming_of


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
    return report(parts, stepped, met, update(parts, stepped, met))


def _parts(unit: HydraulicUnit, assumed: Assumptions) -> Parts:
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
    return Parts(
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


def _step(parts: Parts) -> Stepped:
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
    return Stepped(step, checks, around, travel_by, torque_by, warming)


def _meet(parts: Parts, stepped: Stepped) -> Met:
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
    return Met(contact, nominal, Relief(doubt, grown), usual)


def _lever(unit: HydraulicUnit, assumed: Assumptions) -> Lever | None:
    """What a declared sensor of the link's angle says of the position."""
    if assumed.link_angle.std == 0.0:
        return None
    if unit.lever is None:
        text = "needs a mechanism in which the cylinder turns a body, pinned to it and to what the body hangs on"
        raise DescriptionError(text, key=f"units.{unit.name}.assumptions.link_angle.std", value=assumed.link_angle.std)
    return unit.lever
