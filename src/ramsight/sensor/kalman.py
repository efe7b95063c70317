"""The self-calibrating sensor, for any circuit: a sample's way through its stages.

    raw sample
      magnets        torque of warm magnets                        (where declared)
      intake         impossible inputs replaced or passed over
      torque zero    learned at rest, taken off                    (where declared)
      drive checks   speed against counter, torque against power   (where declared)
      leakage, load  the circuit's balance under a load that the torque corrects
      contact        whether the piston stands on something
      predict        filters of machine and ends, under several hypotheses
      measure        torque, contact, reference or angle teach them
      report         position, uncertainty, status

Each stage is a function (state, inputs, model) -> (state, outputs) over frozen dataclasses; nothing is overwritten.
`KalmanState` is what is kept from sample to sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.engine.typed_state import inlined, leaf, passed_over, symbols
from ramsight.errors import DescriptionError
from ramsight.expression import Flag, Scalar, any_of, negated, scalar, within
from ramsight.plant.balance import FACTORS
from ramsight.plant.linkage.lever import Lever
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.bank import Bank
from ramsight.sensor.belief.bank_state import BankState, StartOfPosition
from ramsight.sensor.belief.position_reading import LinkState
from ramsight.sensor.belief.update import ContactEvidence, Predicted, Prediction, Updated, UpdateState, measure, predict
from ramsight.sensor.checks.drive_check import DriveChecks, DriveState, check_drive
from ramsight.sensor.checks.inertia_check import InertiaState, check_inertia, shaft_inertia
from ramsight.sensor.checks.pressure_check import PressureCheckState, check_pressures
from ramsight.sensor.circuit.leakage import LeakageState, leakage_law
from ramsight.sensor.circuit.load import LoadState, Piston, observe_load, shifted
from ramsight.sensor.circuit.load_release import Release, UnheldState, release_load
from ramsight.sensor.circuit.relief import Relief, relief_probability, relief_tolerance
from ramsight.sensor.contacts.contact import look_for_contact
from ramsight.sensor.contacts.contact_state import ContactState, Estimated, moved
from ramsight.sensor.inputs.intake import Intake, IntakeState, check_inputs
from ramsight.sensor.inputs.oil_heat import CaseParameters, CaseState, WarmingState, heat_case, warming_rate, with_case
from ramsight.sensor.inputs.sample import LINK_ANGLE, MOTOR_TEMPERATURE, Raw, Sample, declared_inputs
from ramsight.sensor.inputs.torque import MagnetState, TorqueZeroState, correct_torque, correct_zero, gain_with_magnets
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import FACTOR_OF, Quantity
from ramsight.sensor.report.report import Aside, Outcome, ReportState, report
from ramsight.sensor.thresholds import LOAD_KNOWN_SHARE
from ramsight.sensor.virtual_sensor import Report, Section, VirtualSensor, close


@dataclass(frozen=True, kw_only=True)
class KalmanState:
    """What the sensor keeps from sample to sample; a part that a machine does not have is None."""

    position: Scalar = leaf("m", None, exact="sum")  # nominal, of the likeliest hypothesis [m]
    position_known: Flag = leaf("1")  # whether a reference has ever been accepted
    position_variance: Scalar = leaf("m2", variance=True)  # over all hypotheses [m2]
    referenced_since_power_up: Flag = leaf("1")  # whether a reference has come since it was started, or resumed
    magnets: MagnetState | None  # of the motor
    intake: IntakeState  # the last sample that counted
    torque_zero: TorqueZeroState | None  # of the reported torque
    case: CaseState | None  # of the pumps, as a heat store
    drive: DriveState | None  # reports that are held against each other
    inertia: InertiaState | None  # torque against the shaft's acceleration
    pressures: PressureCheckState | None  # torque against measured pressures
    leakage: LeakageState = field(default_factory=LeakageState)  # the slow temperature
    warming: WarmingState = field(default_factory=WarmingState)  # the smoothed thermometer
    load: LoadState  # the simulated circuit
    unheld: UnheldState  # the circuit when the piston was last not held
    contact: ContactState  # what the piston does
    bank: BankState = inlined()  # hypotheses of machine and ends
    link: LinkState | None  # the link's angle
    update: UpdateState  # what is uncertain until a reference
    report: ReportState = field(default_factory=ReportState)  # what is shown

    @classmethod
    def initial(cls, model: MachineModel, measured: tuple[str, ...]) -> KalmanState:
        """Before the first sample."""
        assumed, stroke = model.assumed, float(model.unit.cylinder.stroke)
        load = LoadState.initial(model)
        linked = LINK_ANGLE in measured
        return cls(
            position=scalar(0.5 * stroke),
            magnets=MagnetState() if MOTOR_TEMPERATURE in measured else None,
            intake=IntakeState.initial(model.balance.model.commands, measured),
            torque_zero=TorqueZeroState.initial(assumed.drive.zero),
            case=None if model.unit.heat is None else CaseState(),
            drive=DriveState.initial(assumed),
            inertia=InertiaState.initial(assumed),
            pressures=PressureCheckState.initial(assumed),
            load=load,
            unheld=UnheldState.initial(load),
            contact=ContactState(),
            bank=BankState.initial(assumed, stroke, with_link=linked, kinds=model.kinds),
            link=LinkState() if linked else None,
            update=UpdateState.initial(assumed, measured),
        )


def kalman(unit: HydraulicUnit, assumptions: Assumptions | None = None, kinds: Sequence[Kind] = KINDS) -> VirtualSensor:
    """The self-calibrating sensor of a unit.

    Args:
        unit: the unit's parts, as its data sheet has them, whatever its circuit.
        assumptions: of drive, thermometer, machine and stops; by default what the unit declares.
        kinds: of the hypotheses that it weighs, the first and the last of `Kind` among them; fewer take fewer
            operations.

    Returns:
        A sensor with position, standard deviation, velocity, load and status, and beside them the chambers' pressures
        and the factors. It needs no position at the start: it reports *not referenced* until it finds one.
    """
    return Pipe.of(unit, assumptions, kinds).passage().sensor()


@dataclass(frozen=True)
class Passage:
    """A sample's way through the stages."""

    pipe: Pipe  # the stages
    initial: KalmanState  # state before the first sample
    # before, after: state before and after this one
    before: KalmanState
    after: KalmanState
    at: Prediction  # the balance's step
    predicted: Predicted  # the hypotheses before any measurement
    came_to: Scalar  # nominal position before any measurement [m]
    updated: Updated  # what is known after it
    outcome: Outcome  # the position after it
    aside: Aside  # what is said of the sample whatever the hypotheses say
    said: Report  # what is reported
    sections: Sequence[Section]  # what each stage leads to

    def sensor(self) -> VirtualSensor:
        """The compiled recursion of all stages."""
        table, raw = self.pipe.model.table, self.pipe.raw
        return close("kalman", table, raw, self.initial, self.before, self.after, self.said, self.sections)


@dataclass(frozen=True)
class Pipe:
    """The stages of a machine's sensor."""

    model: MachineModel  # of the machine
    lever: Lever | None  # position over the link's angle, where that is measured
    raw: Raw  # the sample
    measured: tuple[str, ...]  # further inputs

    @classmethod
    def of(cls, unit: HydraulicUnit, assumptions: Assumptions | None = None, kinds: Sequence[Kind] = KINDS) -> Pipe:
        """Of a unit.

        Args:
            assumptions: of drive, thermometer, machine and stops; by default what the unit declares.
        """
        assumed = assumptions or unit.assumptions
        lever = _lever(unit, assumed)
        if MOTOR_TEMPERATURE in declared_inputs(assumed):
            assumed = gain_with_magnets(assumed)
        model = replace(MachineModel.of(unit, assumed), kinds=tuple(kinds))
        measured = declared_inputs(assumed)
        return cls(model, lever, Raw.symbols(model.balance.model.commands, measured), measured)

    def passage(self) -> Passage:
        """A sample's way through all stages."""
        model, initial = self.model, KalmanState.initial(self.model, self.measured)
        state = symbols(initial)
        magnets, raw = self._magnets(state)
        intake_state, sample, intake = check_inputs(state.intake, raw, model)
        title = "Input check: what of the sample is possible, and what stands in for the rest"
        sections = [Section(title, (intake, sample.motor_speed, sample.motor_torque, sample.oil_temperature))]
        torque_zero, sample = self._zero(state, sample)
        state_1 = replace(state, magnets=magnets, intake=intake_state, torque_zero=torque_zero)
        at, state_2 = self._step(state, state_1, sample, intake)
        title = (
            "Balance: a step of the circuit's equations under the load that the torque corrects, and its derivatives"
        )
        sections.append(Section(title, (at.step, at.travel_by, at.torque_by)))
        bank = self._bank(state, at.sample)
        met, state_3 = self._meet(state, state_2, bank, at)
        title = "Contacts: whether the piston stands on something, and where"
        sections.append(Section(title, (met.contact, met.relief.probability)))
        predicted = predict(state.update, bank, at, met, model)
        came_to, state_4 = self._release(state, state_3, at, met)
        updated, outcome, state_5 = self._update(state, state_4, predicted, at, met, came_to)
        title = "Update: the filters of what is unknown of machine and ends, by torque, contact or reference"
        sections.append(Section(title, state_5, updated.measured.stages))
        report_state, said, aside = report(state.report, at, met, updated, outcome, model)
        after = passed_over(intake.passed_over, state, replace(state_5, report=report_state))
        return Passage(
            pipe=self,
            initial=initial,
            before=state,
            after=after,
            at=at,
            predicted=predicted,
            came_to=came_to,
            updated=updated,
            outcome=outcome,
            aside=aside,
            said=said,
            sections=sections,
        )

    def _magnets(self, state: KalmanState) -> tuple[MagnetState | None, Raw]:
        """The sample with the torque of warm magnets, where that is declared."""
        if state.magnets is None:
            return None, self.raw
        return correct_torque(state.magnets, self.raw, self.model.assumed.motor_temperature)

    def _zero(self, state: KalmanState, sample: Sample) -> tuple[TorqueZeroState | None, Sample]:
        """The sample without the zero of its torque, where that is declared."""
        if state.torque_zero is None:
            return None, sample
        return correct_zero(state.torque_zero, sample, state.load.expected_torque, self.model)

    def _checks(
        self, state: KalmanState, after: KalmanState, sample: Sample
    ) -> tuple[KalmanState, Sample, DriveChecks]:
        """The sample with the speed that is used, and what the drive's reports show of each other."""
        model = self.model
        drive, used, checks = check_drive(state.drive, sample, model)
        inertia = None
        if state.inertia is not None:
            shaft = shaft_inertia(model.table, float(model.unit.drive.inertia))
            inertia, checks = check_inertia(state.inertia, used, checks, shaft, model)
        return replace(after, drive=drive, inertia=inertia), used, checks

    def _step(
        self, state: KalmanState, after: KalmanState, sample: Sample, intake: Intake
    ) -> tuple[Prediction, KalmanState]:
        """The balance of the sample, and how it depends on what is unknown of the machine."""
        model = self.model
        after, sample, checks = self._checks(state, after, with_case(sample, state.case))
        leakage_state, leakage = leakage_law(state.leakage, sample, state.load.expected_torque, model)
        warming_state, warming = warming_rate(state.warming, sample)
        point = self._bank(state, sample).means()
        held, leaves = state.contact.held, state.contact.leaves
        piston = Piston(state.position, held, leaves)
        load, step = observe_load(state.load, sample, piston, leakage.factors(point), warming, model)
        case = None
        if state.case is not None and step.pump_heat is not None and model.unit.heat is not None:
            cases = CaseParameters.of(model.table, model.unit.heat)
            case = heat_case(state.case, sample, step.pump_heat, intake.passed, cases)
        pressures = None
        if state.pressures is not None and step.over_pressures is not None:
            pressures, checks = check_pressures(state.pressures, sample, checks, *step.over_pressures, model)
        travel_by, torque_by = (
            leakage.derivatives(dict(zip(FACTORS, by, strict=True)), point) for by in (step.travel_by, step.torque_by)
        )
        stepped = Prediction(
            sample=sample,
            intake=intake,
            checks=checks,
            step=step,
            leakage=leakage,
            linearised_at=point,
            travel_by=travel_by,
            torque_by=torque_by,
            warming=warming,
            position=state.position,
            known=state.position_known,
            known_load=state.load.first_variance < (LOAD_KNOWN_SHARE * model.limits.load) ** 2,
        )
        after = replace(after, leakage=leakage_state, warming=warming_state, load=load, case=case, pressures=pressures)
        return stepped, after

    def _bank(self, state: KalmanState, sample: Sample) -> Bank:
        """The hypotheses at the beginning of a sample."""
        entered = state.referenced_since_power_up
        start = StartOfPosition(negated(sample.started), state.position_known, entered, state.position_variance)
        return Bank.begin(state.bank, self.model, state.position, sample.elapsed, start)

    def _meet(
        self, state: KalmanState, after: KalmanState, bank: Bank, at: Prediction
    ) -> tuple[ContactEvidence, KalmanState]:
        """Whether the piston stands on something."""
        model, machine = self.model, self.model.assumed.machine
        nominal = state.position + at.step.motion.travel
        probability = relief_probability(at.step.z, at.sample.extending_speed, model)
        estimated = Estimated(
            position=nominal,
            std=ca.sqrt(bank.variance()),
            known=state.position_known,
            relief=probability,
            relief_tolerance=relief_tolerance(probability, machine.relief),
            compliance=at.linearised_at[Quantity.COMPLIANCE],
            compliance_std=bank.factor_std(Quantity.COMPLIANCE),
            load_change_std=machine.unseen_load * model.relief_load,
        )
        contact_state, contact = look_for_contact(state.contact, at.sample, at.step, estimated, model)
        met = ContactEvidence(contact, nominal, Relief(probability, state.update.passed_relief))
        return met, replace(after, contact=contact_state)

    def _release(
        self, state: KalmanState, after: KalmanState, at: Prediction, met: ContactEvidence
    ) -> tuple[Scalar, KalmanState]:
        """The nominal position before any measurement [m]; a stop gives way, and what it gives back is travel."""
        hold, place = met.contact.hold, met.contact.place
        release = Release(hold.released, hold.held, hold.shown)
        before = within(state.position, 0.0, float(self.model.unit.cylinder.stroke))
        unheld, load, came = release_load(state.unheld, after.load, before, release, at.step.motion.give, self.model)
        back = ca.if_else(hold.released, hold.give_back, 0.0) + came
        came_to = ca.if_else(place.found, place.position, met.nominal + back)
        return came_to, replace(after, unheld=unheld, load=load)

    def _update(
        self,
        state: KalmanState,
        after: KalmanState,
        predicted: Predicted,
        at: Prediction,
        met: ContactEvidence,
        came_to: Scalar,
    ) -> tuple[Updated, Outcome, KalmanState]:
        """The filters, the position, and the circuit's pressures after the sample."""
        model = self.model
        update, link, updated = measure(state.update, state.link, predicted, at, met, self.lever, model)
        nominal = came_to + updated.measured.moved
        means = updated.bank.means()
        changes = {name: means[one] - at.linearised_at[one] for name, one in FACTOR_OF.items()}
        kept = within(nominal, -model.stroke, 2.0 * model.stroke)
        accepted = updated.measured.accepted
        outcome = Outcome(
            nominal=nominal,
            kept=kept,
            known=any_of(state.position_known, accepted),
            referenced_now=any_of(state.referenced_since_power_up, accepted),
            disputed=update.disputed,
        )
        after = replace(
            after,
            position=kept,
            position_known=outcome.known,
            position_variance=ca.fmax(updated.bank.variance(), 0.0),
            referenced_since_power_up=outcome.referenced_now,
            load=shifted(after.load, changes),
            contact=moved(after.contact, met.contact, nominal, updated.measured.moved),
            bank=updated.bank.rewound(met.nominal - came_to).closed(),
            link=link,
            update=update,
        )
        return updated, outcome, after


def _lever(unit: HydraulicUnit, assumed: Assumptions) -> Lever | None:
    """Position over the link's angle, where a sensor for it is declared."""
    if assumed.link_angle.std == 0.0:
        return None
    if unit.lever is None:
        text = "needs a mechanism in which the cylinder turns a body, pinned to it and to what the body hangs on"
        raise DescriptionError(text, key=f"units.{unit.name}.assumptions.link_angle.std", value=assumed.link_angle.std)
    return unit.lever
