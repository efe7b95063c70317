"""What the self-calibrating sensor reports of a sample: position, uncertainty, status, and what it has learned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, count, negated, within
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.belief.bank import Bank
from ramsight.sensor.belief.update import ContactEvidence, Prediction, Updated
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.circuit.unseen_load import UnseenLoad, UnseenLoadState, load_std, unseen_load
from ramsight.sensor.contacts.contact_state import Contact
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import FACTOR_OF, Quantity
from ramsight.sensor.report.stated import Beside, stated
from ramsight.sensor.report.status_rules import (
    OF_POSITION,
    PlausibilityState,
    PositionEstimate,
    conditions_of,
    first_of,
    implausible_torque,
)
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import FASTEST_SHARE, NOISE_AVERAGED, TINY
from ramsight.sensor.virtual_sensor import BOUND, HIGHEST, LOAD_AGE, LOAD_STD, LOWEST, REFERENCED_NOW, Outputs, Report


@dataclass(frozen=True, kw_only=True)
class ReportState:
    """What is reported."""

    position: Scalar = leaf("m", always=True, exact="sum")  # that is shown [m]
    velocity: Scalar = leaf("m/s")  # smoothed [m/s]
    unseen: UnseenLoadState = field(default_factory=UnseenLoadState)  # changes of the load at rest
    plausibility: PlausibilityState = field(default_factory=PlausibilityState)  # of the torque


@dataclass(frozen=True)
class Outcome:
    """The position after a sample."""

    nominal: Scalar  # [m], perhaps outside the stroke
    kept: Scalar  # within a stroke's length around the stroke [m]
    known: Flag  # whether it has ever been known
    referenced_now: Flag  # whether a reference has come since power-up
    disputed: Flag  # whether a reference was rejected and none has been accepted since


@dataclass(frozen=True)
class Aside:
    """What is said of a sample whatever the hypotheses say."""

    beside: Beside  # what else is uncertain of the position
    status: Scalar  # of the sample, without what is said of the position's certainty
    beneath: Scalar  # the same without *near the relief valve's pressure*, which may hide something


def report(
    state: ReportState, at: Prediction, met: ContactEvidence, updated: Updated, outcome: Outcome, model: MachineModel
) -> tuple[ReportState, Report, Aside]:
    """The sensor's outputs, and what they say beside what the hypotheses do."""
    sample, step, contact, bank = at.sample, at.step, met.contact, updated.bank
    usual = model.assumed.machine.unseen_load * model.relief_load
    unseen_state, unseen = _unseen(state.unseen, sample, step, contact, usual, model)
    shown, offset = _shown(state, at, updated, outcome, model)
    beside = Beside(_others(at, contact, model) + updated.pending**2, unseen, offset)
    integrity = model.assumed.integrity
    limit, due = integrity.limit * model.stroke, integrity.due * model.stroke
    said = stated(bank.limited().together, bank.state.band_width, bank.reach, beside, limit, due)
    plausibility, implausible = implausible_torque(state.plausibility, sample, step, negated(contact.hold.held), model)
    position = PositionEstimate(outcome.nominal, said, outcome.known)
    conditions = conditions_of(at, updated, outcome.disputed, position, implausible, model)
    velocity = _velocity(state, sample, step, contact)
    more: Outputs = {
        **model.balance.chambers(step.z),
        LOWEST: (within(shown - said.below - TWO_SIDED_95 * offset, 0.0, model.stroke), "m"),
        HIGHEST: (within(shown + said.above + TWO_SIDED_95 * offset, 0.0, model.stroke), "m"),
        BOUND: (ca.fmin(said.bound + offset, model.stroke), "m"),
        REFERENCED_NOW: (count(outcome.referenced_now), "1"),
        LOAD_STD: (load_std(unseen_state, step, usual, model), "N"),
        LOAD_AGE: (unseen_state.hidden_for, "s"),
        **at.checks.more,
        **_learned(at, bank),
        "mode": (contact.mode, "1"),
    }
    after = ReportState(position=shown, velocity=velocity, unseen=unseen_state, plausibility=plausibility)
    found = Report(shown, said.std + offset, velocity, step.load.value, first_of(conditions), more, outcome.known)
    status = first_of(conditions, without=OF_POSITION)
    return after, found, Aside(beside, status, first_of(conditions, without=OF_POSITION | {Status.NEAR_RELIEF}))


def _unseen(
    state: UnseenLoadState, sample: Sample, step: LoadStep, contact: Contact, usual: Scalar, model: MachineModel
) -> tuple[UnseenLoadState, UnseenLoad]:
    """What an unobserved change of the load may have done to the position."""
    load = step.load.value
    furthest = ca.fmax(model.relief_load - load, load + model.relief_pull)
    # A load that only resists moves nothing at rest, however it changes.
    unmoved = True if model.passive else contact.hold.held
    return unseen_load(state, sample, step, unmoved, usual, furthest)


def _others(at: Prediction, contact: Contact, model: MachineModel) -> Scalar:
    """Variance of the position by what no state follows [m2]: stops, noise, torques that are contradicted."""
    step, hold = at.step, contact.hold
    # What the stop carries is unknown while the piston is held: some of the oil's force, or of that before.
    into = ca.if_else(hold.held, step.load.carried / model.stop_stiffness, 0.0)
    into = ca.fmax(ca.fabs(into), ca.if_else(hold.held, ca.fabs(hold.give_back), 0.0))
    gives = step.motion.give * at.checks.torque_off / model.travel_per_radian
    return into**2 + hold.travel_std**2 + step.motion.noise**2 + gives**2


def _learned(at: Prediction, bank: Bank) -> Mapping[str, tuple[Scalar, str]]:
    """Factors with their standard deviations, and the hypotheses' probabilities."""
    means = bank.means()
    more: dict[str, tuple[Scalar, str]] = {}
    for name, quantity in FACTOR_OF.items():
        more[f"{name}_factor"] = means[quantity], "1"
        more[f"{name}_factor_std"] = bank.factor_std(quantity), "1"
    more["leak_exponent"] = means[Quantity.EXPONENT], "1"
    more["leak_exponent_std"] = bank.factor_std(Quantity.EXPONENT), "1"
    if Quantity.WARMER in means:  # what leaks by the reported temperature, be it the oil's or not
        leak, by = at.leakage.at_reported(means[Quantity.LEAKAGE], means[Quantity.WARMER])
        more |= {"leak_factor": (leak, "1"), "leak_factor_std": (bank.std(by), "1")}
    return more | {f"{name}_probability": (chance, "1") for name, chance in bank.probabilities().items()}


def _shown(
    state: ReportState, at: Prediction, updated: Updated, outcome: Outcome, model: MachineModel
) -> tuple[Scalar, Scalar]:
    """The position that is shown, and how far it may be from the estimate [m].

    Nothing but a reference moves it faster than the piston can move.
    """
    intake, started = at.intake, at.sample.started
    reach = FASTEST_SHARE * model.travel_per_radian * model.max_speed * intake.passed
    wanted = within(ca.if_else(intake.usable, outcome.kept, at.position), 0.0, model.stroke)
    jumps = all_of(any_of(updated.measured.accepted, negated(started)), intake.usable)
    followed = ca.fmin(ca.fmax(wanted, state.position - reach), state.position + reach)
    shown = ca.if_else(jumps, wanted, ca.if_else(started, followed, wanted))
    return shown, intake.unseen + ca.fabs(wanted - shown)


def _velocity(state: ReportState, sample: Sample, step: LoadStep, contact: Contact) -> Scalar:
    """The piston's velocity, smoothed [m/s]."""
    dt = sample.elapsed
    moving = ca.if_else(contact.hold.held, 0.0, step.motion.travel / ca.fmax(dt, TINY))
    return state.velocity + dt / (NOISE_AVERAGED + dt) * (moving - state.velocity)
