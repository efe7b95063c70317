"""The filters of machine and ends within a sample: what makes them less certain, and what teaches them.

Oil over a relief valve, creeping valves and starving pumps make the position less certain; torques, contacts,
references and angles teach the hypotheses (`bank`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, count, flag, negated, scalar
from ramsight.plant.linkage.lever import Lever
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.bank import Bank
from ramsight.sensor.belief.closed_volume import EventState, follow_event
from ramsight.sensor.belief.measurement import BY_PLACE, Measurement
from ramsight.sensor.belief.position_reading import LinkState, read_angle, read_position
from ramsight.sensor.belief.renewal import Measured
from ramsight.sensor.checks.drive_check import DriveChecks
from ramsight.sensor.circuit.leakage import Leakage, creep, unfilled_std
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.circuit.relief import Relief, blown, passed_share
from ramsight.sensor.contacts.contact_state import Contact
from ramsight.sensor.contacts.mode import Mode, is_in
from ramsight.sensor.contacts.press import chance_of_none
from ramsight.sensor.inputs.intake import Intake
from ramsight.sensor.inputs.sample import DC_POWER, PRESSURES, READINGS, SHAFT_ANGLE, Sample, lasted
from ramsight.sensor.machine_model import MachineModel, one_sided
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import (
    BETWEEN_STD,
    BLIND_SHARE,
    CERTAIN,
    EFFICIENCY_STD,
    MOTOR_TURNS,
    NUMBER_LIMIT,
    SHORTEST_STEP,
    SMOOTHING_TIME,
    TORQUE_ERROR_TIME,
    TORQUE_MODEL_STD,
    UNSEEN_FLOW_SHARE,
    USUAL_STDS,
    VALVE_SETTLED,
    WAY_LEAST,
)


@dataclass(frozen=True, kw_only=True)
class UpdateState:
    """What is uncertain until a reference or a contact."""

    # passed_relief: standard deviation of the position by oil that may have passed a relief valve [m]
    passed_relief: Scalar = leaf("m")
    # waiting_std: part of it that counts once it is known that the piston did not stand on a stop [m]
    waiting_std: Scalar = leaf("m")
    waiting_shift: Scalar = leaf("m")  # expected travel of that oil, extension positive [m]
    free_travel: Scalar = leaf("m")  # way in one direction below relief pressure [m]
    closed_for: Scalar = leaf("s")  # how long a closed valve has kept the load from the pump [s]
    disputed: Flag = leaf("1")  # whether a reference was rejected and none has been accepted since
    # contradicted: by kind, whether inputs have contradicted each other since the last reference
    contradicted: Mapping[str, Flag] = leaf("1", None)
    since: Mapping[str, Scalar] = leaf("s", None)  # by input, time since its last reading that was used [s]
    event: EventState  # a stop or a start of the motor against a closed valve

    @classmethod
    def initial(cls, assumptions: Assumptions, measured: tuple[str, ...]) -> UpdateState:
        """Before the first sample."""
        kinds = {
            "speed": SHAFT_ANGLE in measured,
            "torque": DC_POWER in measured or PRESSURES[0] in measured,
            "sign": assumptions.inertia.std > 0.0,
        }
        contradicted = {kind: flag(False) for kind, declared in kinds.items() if declared}
        since = {name: scalar(NUMBER_LIMIT) for name in READINGS if name in measured}
        return cls(contradicted=contradicted, since=since, event=EventState.initial())


@dataclass(frozen=True)
class Prediction:
    """The balance's step within a sample."""

    sample: Sample  # with the speed that is used
    intake: Intake  # what is wrong with it
    checks: DriveChecks  # of the drive's reports, pressures among them
    step: LoadStep  # of the load observer
    leakage: Leakage  # its law at this sample
    linearised_at: Mapping[Quantity, Scalar]  # the quantities that the step was made with
    # travel_by, torque_by: derivatives of travel and torque with respect to that
    travel_by: Mapping[Quantity, Scalar]
    torque_by: Mapping[Quantity, Scalar]
    warming: Scalar  # of the oil [K/s]
    position: Scalar  # nominal, before the sample [m]
    known: Flag  # whether a position was known before it
    known_load: Flag  # whether the load has been observed once


@dataclass(frozen=True)
class ContactEvidence:
    """What the piston may have met."""

    contact: Contact  # that was found
    nominal: Scalar  # position after the step, without it [m]
    relief: Relief  # what passed a relief valve until this sample


@dataclass(frozen=True)
class Updated:
    """What is known after the sample."""

    bank: Bank  # the hypotheses
    measured: Measured  # what a measurement did
    pending: Scalar  # standard deviation by oil that may have passed a relief valve, until a contact decides [m]
    relief: Relief  # what passed a relief valve
    fault_passed: Flag  # whether inputs have contradicted each other since the last reference
    is_update: Flag  # whether anything was measured


@dataclass(frozen=True)
class Predicted:
    """The filters after the step, before any measurement."""

    free: Bank  # as the step leaves them
    bank: Bank  # the same within the cylinder
    flow: ReliefFlow  # oil over a relief valve


def predict(state: UpdateState, bank: Bank, at: Prediction, met: ContactEvidence, model: MachineModel) -> Predicted:
    """The filters after the step, before any measurement."""
    flow = relief_flow(state, bank, at, met, model)
    moved = bank.gone_back(flow.back)
    predicted = _time_update(moved, at, _grows(at, met.contact, flow.passed, model), model)
    contact = met.contact
    began = ca.if_else(contact.place.found, contact.place.position, met.nominal)
    passed = met.relief.passed_std + flow.passed
    confined = predicted.confined(began, met.relief.probability > 0.0, passed)
    speed = at.sample.extending_speed
    free = all_of(negated(contact.hold.held), ca.fabs(speed) > MOTOR_TURNS)
    if one_sided(model.balance):  # the pump draws from the tank when its load rests on something else
        free = all_of(free, speed * model.lift > 0.0)
    return Predicted(predicted, confined.turned_back(began, ca.if_else(free, ca.sign(speed), 0.0)), flow)


def measure(
    state: UpdateState,
    link: LinkState | None,
    predicted: Predicted,
    at: Prediction,
    met: ContactEvidence,
    lever: Lever | None,
    model: MachineModel,
) -> tuple[UpdateState, LinkState | None, Updated]:
    """What torque, contact, reference, angle and readings teach the filters, one after the other."""
    bank, flow = predicted.bank, predicted.flow
    closed_for, torque = _torque_evidence(state, at, met, model)
    event, shown = follow_event(
        state.event, at.sample, at.step, at.torque_by, _shut_in(at, met), at.linearised_at, model
    )
    bank, _ = bank.update(torque)
    bank, _ = bank.update(shown)
    bank = bank.left(met.contact.hold, at.step.torque.noise)
    place = _place(at, met, model)
    after, measured = bank.placed(place.measurement, place.low, place.top)
    if link is not None and lever is not None:
        known = any_of(at.known, measured.accepted)
        link, angle = read_angle(link, at.sample, at.step, place.stands + measured.moved, known, lever, model)
        after, placed = after.placed(angle)
        measured = measured.followed(placed)
    since, refused = {}, flag(False)
    for name, before in state.since.items():
        stands, assumed = place.stands + measured.moved, getattr(model.assumed, READINGS[name])
        since[name], reading = read_position(name, before, at.sample, at.step, stands, model.stroke, assumed)
        after, read = after.placed(reading, is_reading=True)
        refused = any_of(refused, read.rejected)
        measured = measured.followed(read)
    passed = ca.if_else(measured.accepted, 0.0, met.relief.passed_std + flow.passed)
    rejected = any_of(all_of(measured.rejected, at.sample.referenced), refused)
    contradicted = _contradicted(state, at.checks, measured)
    new = UpdateState(
        passed_relief=passed,
        waiting_std=flow.waiting_std,
        waiting_shift=flow.waiting_shift,
        free_travel=flow.free_travel,
        closed_for=closed_for,
        disputed=all_of(negated(measured.accepted), any_of(state.disputed, rejected)),
        contradicted=contradicted,
        since=since,
        event=event,
    )
    fault_passed = any_of(flag(False), *contradicted.values()) if contradicted else flag(False)
    is_update = any_of(torque.use, shown.use, measured.accepted, measured.rejected)
    relief = Relief(met.relief.probability, passed)
    return new, link, Updated(after, measured, flow.pending, relief, fault_passed, is_update)


def _shut_in(at: Prediction, met: ContactEvidence) -> Flag:
    """Whether what the torque shows may be that of the oil between the pump and a closed valve."""
    step, relief = at.step, met.relief.probability
    other = any_of(met.contact.hold.held, relief > 0.0, step.load.empty, at.sample.referenced)
    return at.checks.unless_contradicted(all_of(negated(other), at.known_load))


def _grows(at: Prediction, contact: Contact, passed: Scalar, model: MachineModel) -> Scalar:
    """By how much the position is less certain after the sample, beside what the filter knows of the machine [m].

    Args:
        passed: by oil over a relief valve [m].
    """
    sample, step = at.sample, at.step
    creeps = creep(sample, at.position, step.load.value / model.relief_load, at.warming, model)
    rests = is_in(contact.mode, (Mode.RESTING_ON_VALVE,))
    drawn = unfilled_std(step.z, sample.motor_speed, model)
    starves = drawn * ca.fabs(sample.extending_angle * model.travel_per_radian)
    grows = at.intake.drift + passed + ca.if_else(rests, creeps, 0.0) + at.checks.grows + starves
    # A reported speed that is no measured one is wrong by about the same share for long.
    slips = model.assumed.drive.slip * ca.fabs(sample.extending_angle * model.travel_per_radian)
    # While a bouncing load unloads the chamber, the pump may draw from the tank: the flow is then all or none.
    bounces = BETWEEN_STD * step.load.empty_share * ca.fabs(step.motion.travel)
    return grows + BETWEEN_STD * ca.fabs(contact.hold.went) + bounces + step.motion.flies + slips


def _contradicted(state: UpdateState, checks: DriveChecks, measured: Measured) -> dict[str, Flag]:
    """By kind, whether inputs have contradicted each other since the last reference: how wrong it was is unknown.

    Where speed and counter were apart and it turns out which of them was right, that is known.
    """
    decided = any_of(checks.speed_wrong, checks.counter_wrong)
    found = {
        "speed": (checks.undecided, decided),
        "torque": (checks.torque_wrong, flag(False)),
        "sign": (checks.sign_wrong, flag(False)),
    }
    after = {}
    for kind, before in state.contradicted.items():
        now, over = found[kind]
        stays = all_of(negated(any_of(measured.accepted, over)), before)
        after[kind] = any_of(now, stays)
    return after


@dataclass(frozen=True)
class ReliefFlow:
    """Oil over a relief valve at a sample."""

    passed: Scalar  # by which it makes the position less certain for good [m]
    pending: Scalar  # by which it does as long as it may have passed [m]
    back: Scalar  # travel by which the position goes back, extension positive [m]
    # waiting_std, waiting_shift, free_travel: of the state after the sample [m]
    waiting_std: Scalar
    waiting_shift: Scalar
    free_travel: Scalar


def relief_flow(
    state: UpdateState, bank: Bank, at: Prediction, met: ContactEvidence, model: MachineModel
) -> ReliefFlow:
    """Oil over a relief valve: what passed moved nothing, and the position goes back by its expectation.

    A piston that seems to stand may be on a stop, where all of the pump's oil passes the valve and none is missing.
    """
    sample, contact, probability = at.sample, met.contact, met.relief.probability
    travel = at.step.motion.travel
    pumped = sample.extending_angle * model.travel_per_radian
    way = ca.sign(pumped)
    moved = ca.fmax(travel * way, UNSEEN_FLOW_SHARE * ca.fabs(pumped))
    moved = ca.fmin(moved, bank.room(way, met.relief.passed_std))
    missing, std = passed_share(probability)
    still = any_of(contact.hold.held, contact.place.found)
    # A piston that leaves a stop against oil that is still under pressure there is near relief, and moves all the same;
    # one that moved freely first has met something.
    turns_back = any_of(sample.extending_speed * sample.last_extending_speed <= 0.0, still)
    freely = ca.if_else(probability > 0.0, state.free_travel, state.free_travel + ca.fabs(travel))
    met_it = state.free_travel > WAY_LEAST * model.stroke
    missing, std = ca.if_else(met_it, missing, 0.0), ca.if_else(met_it, std, probability)
    may_stand = any_of(still, contact.hold.stands)

    def counted(before: Scalar, newest: Scalar) -> tuple[Scalar, Scalar]:
        """What counts of it, and what waits until a contact decides."""
        all_of_it = before + newest
        counts = ca.if_else(may_stand, 0.0, all_of_it)
        return counts, ca.if_else(still, 0.0, all_of_it - counts)

    passed, waiting_std = counted(state.waiting_std, std * moved)
    back, waiting_shift = counted(state.waiting_shift, way * missing * moved)
    by_load = blown(at.step.z, sample.extending_speed, model)
    elapsed = ca.if_else(may_stand, 0.0, sample.elapsed)
    return ReliefFlow(
        passed=passed + by_load.std * elapsed,
        pending=waiting_std,
        back=back - by_load.mean * elapsed,
        waiting_std=waiting_std,
        waiting_shift=waiting_shift,
        free_travel=ca.if_else(turns_back, 0.0, freely),
    )


def _time_update(bank: Bank, at: Prediction, grows: Scalar, model: MachineModel) -> Bank:
    """The filters' time update.

    Args:
        grows: by which the position is less certain besides [m].
    """
    step, drive, dt = at.step, model.assumed.drive, at.sample.elapsed
    share = model.assumed.machine.leak_by_viscosity * ca.fabs(at.leakage.change)
    by_temperature = at.linearised_at[Quantity.LEAKAGE] * at.leakage.per_kelvin
    leak = ca.sqrt(share**2 * dt / SMOOTHING_TIME + by_temperature**2 * at.sample.temperature_variance)
    # An error of the torque that lasts for a while leaks like an error of the leakage that lasts for a while.
    by_leak = at.travel_by[Quantity.LEAKAGE]
    offset = at.sample.offset_variance / ca.fmax(at.sample.motor_torque**2, model.torque_std**2)
    wrong = (drive.torque_gain**2 + offset) * by_leak**2 * 2.0 * drive.correlation / ca.fmax(dt, SHORTEST_STEP)
    # At rest friction hides a part of the load, and so a part of what leaks where the pump holds it.
    hidden = ca.fmin(step.torque.hidden / model.travel_per_radian, step.load.std) / ca.fabs(step.load.value)
    hidden = ca.if_else(step.torque.hidden > 0.0, ca.fmin(hidden, 1.0), 0.0)
    grows = grows + ca.fabs(step.motion.free_travel) * hidden
    predicted = bank.predicted(step.motion.travel, at.travel_by, at.linearised_at, wrong, grows, leak)
    return predicted.floored(drive.torque_gain).roamed(step.motion.travel)


def _torque_evidence(
    state: UpdateState, at: Prediction, met: ContactEvidence, model: MachineModel
) -> tuple[Scalar, Measurement]:
    """What a torque tells of the machine where it tells nothing of the load; how long a valve has been closed [s].

    While the piston is held the pressures rise as the oil gives way, where none of it may pass a relief valve; while a
    closed valve keeps the load from the pump, all that the pump delivers is leakage.
    """
    sample, step, checks, hold = at.sample, at.step, at.checks, met.contact.hold
    inflation = TORQUE_ERROR_TIME / ca.fmax(sample.elapsed, SHORTEST_STEP)
    # Oil that gives back more than any such machine's is that of a piston that moves already.
    off = ca.fabs(at.linearised_at[Quantity.COMPLIANCE] - 1.0)
    usual = off < USUAL_STDS * model.assumed.machine.compliance
    closed = all_of(hold.press.decided, any_of(hold.pushing, all_of(hold.draws, usual)))
    compressed = all_of(closed, negated(any_of(step.load.empty, met.relief.probability > 0.0)))
    by_compliance = at.torque_by[Quantity.COMPLIANCE]
    pushes = all_of(compressed, ca.fabs(by_compliance) > step.torque.noise)
    turns = all_of(ca.fabs(sample.motor_speed) > MOTOR_TURNS, negated(hold.held))
    steady = ca.fabs(step.torque.change) < BLIND_SHARE * ca.fabs(at.torque_by[Quantity.LEAKAGE])
    valve = all_of(all_of(turns, step.torque.shows < BLIND_SHARE), steady)
    closed_for = ca.if_else(valve, state.closed_for + sample.elapsed, 0.0)
    blind = lasted(closed_for, VALVE_SETTLED)
    model_error = (TORQUE_MODEL_STD * by_compliance) ** 2
    friction = ca.if_else(blind, (EFFICIENCY_STD * sample.motor_torque) ** 2, 0.0)
    # A torque that is late is that of a moment before.
    late = model.assumed.drive.delay * step.torque.change / ca.fmax(sample.elapsed, SHORTEST_STEP)
    evidence = Measurement(
        use=checks.unless_contradicted(any_of(blind, pushes)),
        innovation=step.torque.innovation,
        H=at.torque_by,
        at=at.linearised_at,
        R=(step.torque.noise**2 + (model_error + friction + late**2)) * inflation,
        gate=CERTAIN,
        teaches={Quantity.LEAKAGE: blind, Quantity.COMPLIANCE: pushes},
        power=0.0,
    )
    return closed_for, evidence


@dataclass(frozen=True)
class Place:
    """A contact or a reference: a measurement of the place, and whether it is one with an end."""

    measurement: Measurement  # of it
    # low, top: whether it is a contact with that end
    low: Flag
    top: Flag
    stands: Scalar  # nominal position without it [m]


def _place(at: Prediction, met: ContactEvidence, model: MachineModel) -> Place:
    """The sample's reference or contact: a reference goes before a contact.

    What a torque shows while the drive's power contradicts it is no contact.
    """
    sample, step, contact, stops = at.sample, at.step, met.contact.place, model.assumed.stops
    reported = sample.referenced
    evident = at.checks.unless_contradicted(contact.evidence)
    by_contact = all_of(evident, negated(reported))
    # The torque may be late: the oil seems to be compressed a little after it is.
    samples = ca.fmax(0.5 * model.assumed.drive.delay / ca.fmax(sample.elapsed, SHORTEST_STEP), BETWEEN_STD)
    late = ca.fabs(step.motion.free_travel) * samples
    given_way = (step.load.carried / model.stop_stiffness) ** 2
    own = (stops.contact * model.stroke) ** 2 + given_way
    end = ca.if_else(contact.at_top, model.stroke, 0.0)
    low, top = all_of(by_contact, negated(contact.at_top)), all_of(by_contact, contact.at_top)
    chance = ca.if_else(by_contact, stops.obstacle + chance_of_none(met.contact.hold.press), stops.lies)
    stands = ca.if_else(by_contact, contact.position, met.nominal)
    measurement = Measurement(
        use=any_of(reported, evident),
        innovation=ca.if_else(reported, sample.reference, end) - stands,
        H={Quantity.POSITION: 1.0, Quantity.LOW: -count(low), Quantity.TOP: -count(top)},
        R=ca.if_else(reported, stops.reference**2, own),
        alternative=ca.log(chance / model.stroke),
        teaches=BY_PLACE,
        arrived=ca.if_else(by_contact, late**2 + contact.std**2, 0.0),
        stands=(stands, model.stroke),
    )
    return Place(measurement, low, top, ca.if_else(contact.found, contact.position, met.nominal))
