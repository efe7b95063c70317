"""What is unknown of the machine, under several hypotheses of where its stops are.

Each hypothesis has its own position, factors (`ramsight.plant.balance.FACTORS`), lag of the thermometer and places of
the two ends, with their covariance (a Kalman filter around the load observer's step). They differ in their priors of
the ends and of the start (`hypothesis.Kind`):

    described   both ends are where the description has them
    leaks       so they are, and the pumps leak much more or less than described, or by another law of pressure
    low, top    the end of the stroke is met somewhere else at the retracted, at the extended end
    wrong       the position is unknown; both ends are where the description has them

A contact or a reference is a measurement of each of them, weighed by its likelihood; under each it may also be an
obstacle (or a switch that is wrong), which is then not used. An end met again and again where it is not expected makes
hypotheses of undeclared ends likely and moves no position; references that agree with each other make *wrong* likely,
and the position is found again. The position that is shown is that of the likeliest, its deviation that of all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.expression import Flag, Real, Scalar, all_of, any_of, count, flag, holds, negated, scalar
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.bank_state import ENDS, BankState, StartOfPosition, stepping
from ramsight.sensor.closed_volume import LEARNED, SHARED, Event, weight_of
from ramsight.sensor.contact_state import Hold
from ramsight.sensor.hypothesis import Hypothesis, Kind, choose
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.measurement import (
    Measured,
    Measurement,
    TorqueEvidence,
    log_likelihood,
    normalised,
    reweighed,
    weighed,
)
from ramsight.sensor.mixture import Mixture, flag_of_likeliest, leads, of_likeliest
from ramsight.sensor.pressing import odds_of_obstacle
from ramsight.sensor.quantity import Quantity, Row
from ramsight.sensor.thresholds import (
    BAND_STEP,
    BEYOND_END,
    BEYOND_END_LEAST,
    CERTAIN,
    CONTACTS_ALIKE,
    EVENT_GATE,
    EVENT_SHARE_LEAST,
    INNOVATION_GAIN,
    INNOVATION_MOST,
    LOG_WEIGHT_LEAST,
    OUTSIDE,
    OVERSHOOT_STD_SHARE,
    ROOM_LEAST,
    ROOM_STEP,
    UNREACHABLE,
)


@dataclass(frozen=True)
class Bank:
    """The hypotheses within a sample: a value, of which each operation makes a new one.

    Attributes:
        state: as it is now.
        together: all hypotheses, weighed.
        model: of the machine.
        position: nominal, before the sample [m].
        elapsed: since the last sample [s].
    """

    state: BankState
    together: Mixture
    model: MachineModel
    position: Scalar
    elapsed: Scalar

    @classmethod
    def begin(
        cls,
        state: BankState,
        model: MachineModel,
        position: Scalar,
        elapsed: Scalar,
        start: StartOfPosition,
    ) -> Bank:
        """At the beginning of a sample; at the first one the position is as uncertain as the start.

        Args:
            state: before it.
            model: of the machine.
            position: nominal, before it [m].
            elapsed: since the last one [s].
            start: what is known of the position at the first sample.
        """
        unknown2, stops = (0.5 * model.stroke) ** 2, model.assumed.stops
        entered = all_of(start.first, start.known, start.entered)
        wrong2 = ca.if_else(entered, start.variance + (stops.elsewhere * model.stroke) ** 2, unknown2)
        begun = []
        for kind, h in zip(model.kinds, state.hypotheses, strict=True):
            least = wrong2 if kind == Kind.WRONG else ca.if_else(start.known, start.variance, unknown2)
            at_first = ca.if_else(start.first, least, 0.0)
            if kind == Kind.WRONG:
                h = h.with_weight(ca.if_else(entered, math.log(stops.entered), h.weight))
            begun.append(h.with_covariance(h.covariance.at_least(Quantity.POSITION, at_first)))
        state = replace(state, hypotheses=tuple(begun), entered=any_of(entered, state.entered))
        together = Mixture.of(begun, cls._assumed(state, model))
        return cls(state, together, model, position, elapsed)

    @staticmethod
    def _assumed(state: BankState, model: MachineModel) -> Scalar:
        """Prior probability of *wrong* where that is an assumption and no finding."""
        return ca.if_else(state.entered, 0.0, model.assumed.stops.wrong)

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """All of them, in the order of `Kind`."""
        return self.state.hypotheses

    def _with(self, hypotheses: Sequence[Hypothesis]) -> Bank:
        """With other hypotheses and the same probabilities."""
        state = replace(self.state, hypotheses=tuple(hypotheses))
        return replace(self, state=state, together=self.together.moved(hypotheses))

    @property
    def _unknown(self) -> Scalar:
        """Standard deviation of a position that is unknown [m]."""
        return 0.5 * self.model.stroke

    @property
    def _with_link(self) -> bool:
        return Quantity.ANGLE_OFFSET in self.hypotheses[0].mean

    def means(self) -> dict[Quantity, Scalar]:
        """Of what a step is made with, over all hypotheses."""
        return {one: self.together.mean(one) for one in stepping(self.model.assumed)}

    def probabilities(self) -> dict[str, Scalar]:
        """Of each hypothesis, by its name."""
        return {kind.text: p for kind, p in zip(self.model.kinds, self.together.probabilities, strict=True)}

    def predicted(
        self,
        travel: Scalar,
        travel_by: Row,
        around: Mapping[Quantity, Scalar],
        noise: Real,
        grows: Real,
        leak: Real,
    ) -> Bank:
        """After the load observer's step: the filters' time update.

        Args:
            travel: of the piston [m].
            travel_by: its derivatives with respect to what the step was made with.
            around: the values that it was made with.
            noise: variance that the position gains beside the way's [m2].
            grows: by which the position's standard deviation grows as a whole [m].
            leak: standard deviation that the leakage gains beside its walk [1].
        """
        assumed, dt = self.model.assumed, self.elapsed
        machine = assumed.machine
        adapt = 1.0 + ca.fmax(self.state.innovations, 0.0)
        gains: dict[Quantity, Real] = {
            Quantity.POSITION: machine.walk**2 * ca.fabs(travel) + noise,
            Quantity.LEAKAGE: machine.leak_walk**2 * dt * adapt + leak**2,
            Quantity.DISPLACEMENT: machine.displacement_walk**2 * dt,
            Quantity.COMPLIANCE: machine.compliance_walk**2 * dt,
        }
        if self._with_link:
            gains[Quantity.ANGLE_OFFSET] = assumed.link_angle.drift**2 * dt
        return self._with(
            [
                h.shifted(h.along(travel_by, around)).with_covariance(
                    h.covariance.predicted(travel_by, gains).grown(grows, given=ENDS)
                )
                for h in self.hypotheses
            ]
        )

    def roamed(self, travel: Scalar) -> Bank:
        """After the piston moved: a way within the cylinder leaves few places where an unknown position may be.

        Of the places of a stroke S that are as likely as each other, a way of R leaves the share 1 - R/S.

        Args:
            travel: of the piston [m].
        """
        state, stroke, wrong = self.state, self.model.stroke, self.hypotheses[-1]
        below, above = ca.fmax(state.below + travel, 0.0), ca.fmax(state.above - travel, 0.0)
        surely = ca.fmax(below + above - TWO_SIDED_95 * self.together.std({Quantity.POSITION: 1.0}), 0.0)
        room = ca.fmax(1.0 - surely / stroke, ROOM_LEAST)
        less = room < state.room - ROOM_STEP
        unknown = wrong.position_variance > (0.5 * self._unknown) ** 2
        bank = self._wrong_weighed(all_of(less, unknown), ca.log(room / state.room))
        room = ca.if_else(less, room, state.room)
        return replace(bank, state=replace(bank.state, below=below, above=above, room=room))

    def shifted(self, by: Real) -> Bank:
        """With a position that is another than the way gives, under each hypothesis, by so much [m]."""
        return self._with([h.shifted(by) for h in self.hypotheses])

    def confined(self, nominal: Scalar, passes: Flag, passed: Real) -> Bank:
        """With no hypothesis in which oil that may pass a relief valve took the piston far beyond the cylinder's ends.

        A little is left, for how far it seems to be beyond an end is what a contact tells of the machine.

        Args:
            nominal: position after the step [m].
            passes: whether oil may pass.
            passed: standard deviation of the position by what may have passed since a reference [m].
        """
        stroke, found = self.model.stroke, []
        for h in self.hypotheses:
            far, position = self._far(h, passed), nominal + h.mean[Quantity.POSITION]
            back = ca.fmax(-far - position, 0.0) - ca.fmax(position - stroke - far, 0.0)
            found.append(h.shifted(ca.if_else(passes, back, 0.0)))
        return self._with(found)

    def turned_back(self, nominal: Scalar, way: Scalar) -> Bank:
        """With no hypothesis in which a piston is beyond an end that it leaves without having been pressed on it.

        Oil that was drawn from the tank, or air in it, explains how far it seemed to be, by an unknown amount; half of
        it is added to the standard deviation.

        Args:
            nominal: position after the step [m].
            way: in which the motor moves it away from such an end, +1 for extension; 0 if it does not.
        """
        stroke, found = self.model.stroke, []
        for h in self.hypotheses:
            position = nominal + h.mean[Quantity.POSITION]
            beyond = ca.if_else(way > 0.0, -position, ca.if_else(way < 0.0, position - stroke, 0.0))
            back = ca.if_else(beyond > h.position_std + BEYOND_END_LEAST * stroke, beyond, 0.0)
            covariance = h.covariance.grown(OVERSHOOT_STD_SHARE * back, given=ENDS)
            found.append(h.shifted(way * back).with_covariance(covariance))
        return self._with(found)

    def room(self, way: Scalar, passed: Real) -> Scalar:
        """How far the piston may still move [m]; oil that is delivered beyond moves nothing.

        Args:
            way: in which it moves, the sign of its velocity.
            passed: standard deviation of the position by what may have passed a relief valve [m].
        """
        ahead = ca.if_else(way > 0.0, self.model.stroke - self.position, self.position)
        return ca.fmax(ahead + self.together.likeliest(lambda h: self._far(h, passed)), 0.0)

    def _far(self, h: Hypothesis, passed: Real) -> Scalar:
        """How far beyond an end a piston may seem to be [m]; what passed a relief valve took it nowhere."""
        return BEYOND_END * ca.fmax(h.position_std - passed, 0.0) + BEYOND_END_LEAST * self.model.stroke

    def floored(self, leak: float) -> Bank:
        """With a leakage that is never better known than this standard deviation [1]."""
        return self._with(
            [h.with_covariance(h.covariance.at_least(Quantity.LEAKAGE, leak**2)) for h in self.hypotheses]
        )

    def taught(self, torque: TorqueEvidence) -> Bank:
        """After a torque that tells leakage or compliance; all else is considered.

        One that a hypothesis holds for impossible teaches it nothing: a machine does not change so much, but an input
        that is wrong looks as if it did.
        """
        found = []
        for h in self.hypotheses:
            missing = torque.innovation - h.along(torque.row, torque.around)
            fits = missing**2 < CERTAIN**2 * (h.covariance.variance(torque.row) + torque.variance)
            use = {
                Quantity.LEAKAGE: all_of(torque.leakage, fits),
                Quantity.COMPLIANCE: all_of(torque.compliance, fits),
            }
            variance = torque.variance * torque.inflation
            found.append(h.corrected(*h.covariance.considered(torque.row, missing, variance, use)))
        return self._kept_unless(any_of(torque.leakage, torque.compliance), found, self.hypotheses)

    def left(self, hold: Hold, noise: Scalar) -> Bank:
        """After a piston has left what held it: how it did tells an end from an obstacle.

        Args:
            hold: of the piston.
            noise: standard deviation of the torque [N m].
        """
        was = self.state.by_obstacle
        tells = all_of(was, any_of(hold.went_on, hold.went_back))
        bank = self._wrong_weighed(tells, odds_of_obstacle(hold.press, noise, hold.went_on))
        return replace(bank, state=replace(bank.state, by_obstacle=all_of(was, negated(hold.released))))

    def _wrong_weighed(self, tells: Flag, odds: Scalar) -> Bank:
        """With *wrong* likelier by so much, logarithm of the odds, where something tells it."""
        return self._weighed(tells, [odds if kind == Kind.WRONG else 0.0 for kind in self.model.kinds])

    def _weighed(self, tells: Flag, likelihoods: Sequence[Real]) -> Bank:
        """With each hypothesis likelier by so much, logarithms, where something tells it."""
        changed = normalised([h.with_weight(h.weight + by) for h, by in zip(self.hypotheses, likelihoods, strict=True)])
        after = tuple(
            old.with_weight(ca.if_else(tells, new.weight, old.weight))
            for new, old in zip(changed, self.hypotheses, strict=True)
        )
        state = replace(self.state, hypotheses=after)
        return replace(self, state=state, together=self.together.reweighed(after, tells, changed))

    def learned(self, event: Event, around: Mapping[Quantity, Scalar]) -> Bank:
        """After a stop or a start of the motor: leakage, compliance and what such events share; all else is considered.

        An event that one hypothesis expects and another one does not makes the first likelier.

        Args:
            event: that has ended.
            around: the values that its torques were expected with.
        """
        found, weights, around = [], [], {**around, **dict.fromkeys(SHARED, scalar(0.0))}
        for h in self.hypotheses:
            missing, known = event.innovation - h.along(event.row, around), h.covariance.variance(event.row)
            fits = missing**2 < EVENT_GATE**2 * (known + event.variance)
            # What all events have in common is not learned, however many there are.
            new = ca.fmax(1.0 - event.common**2 / known, EVENT_SHARE_LEAST)
            corrected = (Quantity.POSITION, *LEARNED, *SHARED)
            found.append(
                h.corrected(*h.covariance.updated(event.row, missing, event.variance / new, fits, only=corrected))
            )
            weights.append(weight_of(event, missing, known))
        bank = self._kept_unless(event.ends, found, self.hypotheses)
        return bank._weighed(event.ends, weights)

    def _kept_unless(self, condition: Flag, then: Sequence[Hypothesis], kept: Sequence[Hypothesis]) -> Bank:
        """All as it was unless a condition holds: what leads away from it is a branch that few samples take."""
        return self._with([choose(condition, new, old) for new, old in zip(then, kept, strict=True)])

    def measured(self, m: Measurement) -> tuple[Bank, Measured]:
        """After a contact, a reference or an angle."""
        use, row = m.use, m.row(with_link=self._with_link)
        chance = ca.log(m.obstacle / self.model.stroke)  # of its density, were it anywhere in the stroke
        kept = normalised(self.hypotheses)
        restarted, lost_before = self._restarted(kept, m, row, chance)
        each = [weighed(h, m, row, chance, self.model) for h in restarted]
        hypotheses = normalised(reweighed(each, self._counts(m)))
        fits = flag_of_likeliest(hypotheses, [one.fits for one in each])
        normal = of_likeliest(hypotheses, [one.normal for one in each])
        newest = ca.fmin(normal, INNOVATION_MOST)
        innovations = self.state.innovations + INNOVATION_GAIN * (newest - 1.0 - self.state.innovations)
        unset = flag(False)  # without a measurement
        accepted = self._if_used(use, fits, unset)
        # A reference is never an obstacle.
        obstacle = ca.if_else(any_of(m.low, m.top), chance, UNREACHABLE)
        odds = [obstacle - one.likelihood for one in (each[0], each[-1])]
        found = leads(hypotheses, len(hypotheses) - 1)
        by_low = self._placed(self.state.by_low, all_of(m.low, each[-1].fits), lost_before)
        by_top = self._placed(self.state.by_top, all_of(m.top, each[-1].fits), lost_before)
        renewed, restarts, by_obstacle, lost = self._renewed(hypotheses, found, fits, kept, odds, (by_low, by_top))
        unplaced, begins_again = self._if_used(use, lost, unset), self._if_used(use, restarts, unset)
        together = self.together.reweighed(renewed, use, renewed)
        after = [choose(use, new, old) for new, old in zip(renewed, kept, strict=True)]
        moved = of_likeliest(after, [h.mean[Quantity.POSITION] for h in after])
        centred = tuple(h.shifted(-moved) for h in after)
        state = BankState(
            hypotheses=centred,
            innovations=ca.if_else(use, ca.if_else(fits, innovations, self.state.innovations), self.state.innovations),
            band_width=self._widened(ca.sqrt(newest), fits, use),
            entered=all_of(self.state.entered, negated(begins_again)),
            by_obstacle=self._if_used(use, by_obstacle, self.state.by_obstacle),
            below=ca.if_else(unplaced, 0.0, self.state.below),
            above=ca.if_else(unplaced, 0.0, self.state.above),
            room=ca.if_else(unplaced, 1.0, self.state.room),
            met_low=self.state.met_low + count(all_of(use, accepted, m.low)),
            met_top=self.state.met_top + count(all_of(use, accepted, m.top)),
            by_low=self._if_used(use, all_of(by_low, negated(restarts)), self.state.by_low),
            by_top=self._if_used(use, all_of(by_top, negated(restarts)), self.state.by_top),
        )
        together = replace(together.moved(centred), wrong=self._assumed(state, self.model))
        bank = replace(self, state=state, together=together)
        stages = (kept, [one.hypothesis for one in each])
        return bank, Measured(accepted, all_of(use, negated(accepted)), moved, stages)

    def _counts(self, m: Measurement) -> Scalar:
        """How much a contact counts as evidence, after n with the same end: 1 / (1 + n r)^2 of an independent one.

        n measurements whose errors are correlated by r are worth n / (1 + (n - 1) r) independent ones, 1/r at most. The
        derivative by n at n + 1 is (1 - r) / (1 + n r)^2; without 1 - r the first contact counts in full.
        """
        before = ca.if_else(m.low, self.state.met_low, ca.if_else(m.top, self.state.met_top, 0.0))
        return 1.0 / (1.0 + CONTACTS_ALIKE * before) ** 2

    @staticmethod
    def _placed(before: Flag, now: Flag, lost: Flag) -> Flag:
        """Whether *wrong* has its position from an end after a measurement."""
        return any_of(now, all_of(before, negated(lost)))

    @staticmethod
    def _if_used(use: Flag, after: Flag, before: Flag) -> Flag:
        """What a flag is after a measurement, and as before where there is none.

        Not a conjunction, which asks for both: what a measurement alone needs is worked out in its samples alone.
        """
        return holds(ca.if_else(use, count(after), count(before)))

    def _ends_elsewhere(
        self, first: Hypothesis, kept: Sequence[Hypothesis], by_low: Flag, by_top: Flag
    ) -> dict[int, Hypothesis]:
        """Hypotheses of ends that are elsewhere, by their place, around the position that *wrong* has found.

        *Wrong* takes both ends for described. Each may be elsewhere, as likely as at first or as contacts left it, and
        where the position is that of contacts with this end alone it is off by as much. Contacts with both that agree
        with the stroke leave neither elsewhere.

        Args:
            first: what *wrong* has become.
            kept: all hypotheses before the measurement.
            by_low: whether *wrong* has its position from contacts with the retracted end.
            by_top: whether it has it from contacts with the extended end.
        """
        stops, both = self.model.assumed.stops, all_of(by_low, by_top)
        prior = math.log(stops.undeclared / (1.0 - 2.0 * stops.undeclared))
        ends = {Kind.LOW: (Quantity.LOW, by_low), Kind.TOP: (Quantity.TOP, by_top)}
        found = {}
        for k, kind in enumerate(self.model.kinds):
            if kind in ends:
                end, by_it = ends[kind]
                odds = ca.if_else(both, LOG_WEIGHT_LEAST, ca.fmin(prior, kept[k].weight - kept[0].weight))
                tied = first.covariance.tied(end, stops.elsewhere * self.model.stroke, count(by_it))
                found[k] = replace(first, covariance=tied, weight=first.weight + odds)
        return found

    def _restarted(
        self, hypotheses: Sequence[Hypothesis], m: Measurement, row: Row, chance: Scalar
    ) -> tuple[list[Hypothesis], Flag]:
        """With *wrong* restarted where that explains a measurement better than its own estimate, or an obstacle.

        Since the last reference the position may have become wrong at any time. What *wrong* took for an end before
        that may have been an obstacle; it does not keep the position from being found again.
        """
        first, wrong, own = hypotheses[0], hypotheses[-1], m.variance + m.arrived
        innovation = m.place - m.nominal
        missing2, variance = (innovation - wrong.mean[Quantity.POSITION]) ** 2, wrong.covariance.variance(row) + own
        before = wrong.weight + ca.fmax(log_likelihood(missing2, variance), chance)
        stops = self.model.assumed.stops
        prior = ca.if_else(self.state.entered, math.log(stops.entered), math.log(stops.wrong))
        again = prior + log_likelihood((innovation - first.mean[Quantity.POSITION]) ** 2, self._unknown**2 + own)
        lost = again > before
        return [*hypotheses[:-1], choose(lost, self._unknown_position(first, prior), wrong)], lost

    def _unknown_position(self, of: Hypothesis, weight: Real) -> Hypothesis:
        """A hypothesis that knows the machine as another one does, but not the position, nor whether it leaks more."""
        leak = self.model.assumed.machine.leak
        covariance = of.covariance.independent(Quantity.POSITION, self._unknown).at_least(Quantity.LEAKAGE, leak**2)
        return Hypothesis(mean=of.mean, covariance=covariance, weight=scalar(0.0) + weight)

    def _widened(self, size: Scalar, fits: Flag, use: Flag) -> Scalar:
        """How wide the band has to be by references: adaptive conformal inference.

        One outside the band widens it by a step, one inside narrows it by as much as makes five of a hundred outside,
        but never below the filter's own. So a model's error of an unexpected kind widens the band as well.

        Args:
            size: of the innovation over its standard deviation [1].
            fits: whether the measurement is accepted, if there is one.
            use: whether there is one; alone, for it leads into the branch of samples with a measurement.

        Source: Gibbs and Candès (2021), Adaptive conformal inference under distribution shift, equation (2), in the
        logarithm of the width.
        """
        width = self.state.band_width
        outside = size > TWO_SIDED_95 * width
        wider = width * ca.if_else(outside, math.exp(BAND_STEP * (1.0 - OUTSIDE)), math.exp(-BAND_STEP * OUTSIDE))
        return ca.if_else(use, ca.if_else(fits, ca.fmax(wider, 1.0), width), width)

    def _renewed(
        self,
        hypotheses: Sequence[Hypothesis],
        found: Flag,
        accepted: Flag,
        kept: Sequence[Hypothesis],
        obstacle_odds: Sequence[Scalar],
        placed: tuple[Flag, Flag],
    ) -> tuple[list[Hypothesis], Flag, Flag, Flag]:
        """After a reference: what was *wrong* and is likeliest becomes the first; *wrong* restarts.

        A machine that surely *leaks* otherwise becomes the first as well: its leakage is known by then, as any other's.
        Where the reference may well have been an obstacle, *wrong* is that: the position goes on as it was before it.

        Args:
            hypotheses: after it.
            found: whether *wrong* is likeliest.
            accepted: whether the likeliest hypothesis used it.
            kept: the hypotheses before it.
            obstacle_odds: logarithm of the odds, by the first and by *wrong*, that it was an obstacle.
            placed: whether *wrong* has its position from contacts with the retracted and with the extended end.

        Returns:
            The hypotheses, whether *wrong* restarts, whether that is by an obstacle, and whether it has lost its place.
        """
        before = kept[0]
        described, *between, wrong = hypotheses
        first = described
        if Kind.LEAKS in self.model.kinds:
            place = self.model.kinds.index(Kind.LEAKS)
            leaks = hypotheses[place]
            surely = all_of(leads(hypotheses, place), described.weight < math.log(OUTSIDE))
            known_leak = all_of(accepted, surely)
            first = choose(known_leak, leaks, described)
            between[place - 1] = leaks.with_weight(ca.if_else(known_leak, LOG_WEIGHT_LEAST, leaks.weight))
        first = choose(found, wrong, first)
        for place, other in self._ends_elsewhere(first, kept, *placed).items():
            between[place - 1] = choose(found, other, between[place - 1])
        prior = math.log(self.model.assumed.stops.wrong)
        # What became wrong since is likelier by now than what was wrong before.
        was_known = before.position_variance < (0.5 * self._unknown) ** 2
        restarts = any_of(found, all_of(accepted, any_of(wrong.weight < prior, negated(was_known))))
        odds = ca.if_else(found, obstacle_odds[1], obstacle_odds[0])
        perhaps = all_of(restarts, odds < 0.0, odds > math.log(OUTSIDE))
        # A position that was unknown before an obstacle is unknown after it.
        weight = first.weight + odds
        unknown = self._unknown_position(first, ca.if_else(perhaps, ca.fmax(weight, prior), prior))
        goes_on = all_of(perhaps, was_known, negated(found))
        again = choose(goes_on, before.with_weight(weight), unknown)
        after = [first, *between, choose(restarts, again, wrong)]
        return after, restarts, perhaps, all_of(restarts, negated(goes_on))

    def variance(self) -> Scalar:
        """Of the position over all hypotheses, about the nominal one [m2] (`Mixture.variance`)."""
        return self.together.variance()

    def band(self, others: Scalar) -> tuple[Scalar, Scalar]:
        """How far below and above the position the truth is in 95 of 100 cases [m], by references (`Mixture.band`)."""
        return self.together.band(self.state.band_width, others)

    def beyond(self, limit: Scalar, others: Scalar) -> Scalar:
        """Probability that the error of the position is larger than a limit [m] (`Mixture.beyond`)."""
        return self.together.beyond(limit, self.state.band_width, others)

    def bound(self, others: Scalar) -> Scalar:
        """The error that no more than `RISK` of the samples exceed [m], by references (`Mixture.bound`)."""
        return self.together.bound(self.state.band_width, others)

    def factor_std(self, quantity: Quantity) -> Scalar:
        """Standard deviation of a factor under the likeliest hypothesis [1]."""
        return self.together.std({quantity: 1.0})

    def std(self, row: Row) -> Scalar:
        """Standard deviation, under the likeliest, of something with these derivatives."""
        return self.together.std(row)

    def limited(self) -> Bank:
        """With a position that is within the stroke, however uncertain it has become."""
        stroke = self.model.stroke
        return self._with([h.with_covariance(h.covariance.limited(stroke, Quantity.POSITION)) for h in self.hypotheses])

    def closed(self) -> BankState:
        """The state after the sample."""
        found = self.limited().hypotheses
        closed = tuple(h.with_covariance(h.covariance.closed()) for h in found)
        return replace(self.state, hypotheses=closed)
