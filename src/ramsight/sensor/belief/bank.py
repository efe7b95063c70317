"""What is unknown of the machine, under several hypotheses: a bank of extended Kalman filters with static models.

Each hypothesis has its own position, factors (`ramsight.plant.balance.FACTORS`), lag of the thermometer and places of
the two ends, with their covariance. They differ in their priors of the ends and of the start (`ramsight.sensor.kind`):

    described          both ends are where the description has them
    leaks              so they are, and the pumps leak much more or less than described, or by another law of pressure
    low, top           the end of the stroke is met somewhere else at the retracted, at the extended end
    unknown position   the position is unknown; both ends are where the description has them

A measurement corrects each of them and weighs it by its likelihood (`measurement`); under each it may also be of
something else. `renewal` has the births of hypotheses, `reach` what the way of the piston says of them, `mixture` what
is said of all. The position that is shown is that of the likeliest, its deviation that of all. The whole of it is one
page of mathematics, docs/explanation/model.md.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.expression import Flag, Real, Scalar, all_of, any_of, count, flag, holds, negated
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.belief.bank_state import ENDS, BankState, StartOfPosition, stepping
from ramsight.sensor.belief.hypothesis import Hypothesis, choose
from ramsight.sensor.belief.lineage import parents, used
from ramsight.sensor.belief.measurement import Applied, Measurement, applied, tempered
from ramsight.sensor.belief.mixture import Mixture, bayes, flag_of_likeliest, of_likeliest, weighed_where
from ramsight.sensor.belief.reach import Reach
from ramsight.sensor.belief.renewal import Measured, Placed, renewal, unknown_begun
from ramsight.sensor.contacts.contact_state import Hold
from ramsight.sensor.contacts.press import odds_of_obstacle
from ramsight.sensor.kind import ANOTHER_MACHINE, Kind
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import Quantity, Row
from ramsight.sensor.thresholds import (
    BAND_STEP,
    BETWEEN_STD,
    CONTACTS_ALIKE,
    END_GIVES,
    LATEST,
    OUTSIDE,
    SURE_STDS,
    WAY_LEAST,
)


@dataclass(frozen=True)
class _Way:
    """How far below and above its place the piston has been, and what of that the hypotheses are weighed by [m]."""

    below: Scalar
    above: Scalar
    extent: Scalar


@dataclass(frozen=True)
class Bank:
    """The hypotheses within a sample: a value, of which each operation makes a new one."""

    state: BankState  # as it is now
    together: Mixture  # all hypotheses, weighed
    model: MachineModel  # of the machine
    position: Scalar  # nominal, before the sample [m]
    elapsed: Scalar  # since the last sample [s]

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
            position: nominal, before it [m].
            elapsed: since the last one [s].
        """
        state = state.begun(start, model.assumed.stops, model.stroke, model.kinds)
        together = Mixture.of(state.hypotheses, cls._assumed(state, model))
        return cls(state, together, model, position, elapsed)

    @staticmethod
    def _assumed(state: BankState, model: MachineModel) -> Scalar:
        """Prior probability of *unknown position* where that is an assumption and no finding."""
        return ca.if_else(state.entered, 0.0, model.assumed.stops.wrong)

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """All of them, in the order of `Kind`."""
        return self.state.hypotheses

    def with_hypotheses(self, hypotheses: Sequence[Hypothesis]) -> Bank:
        """With other hypotheses and the same probabilities."""
        state = replace(self.state, hypotheses=tuple(hypotheses))
        return replace(self, state=state, together=self.together.moved(hypotheses))

    @property
    def _unknown(self) -> Scalar:
        """Standard deviation of a position that is unknown [m]."""
        return 0.5 * self.model.stroke

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
        point: Mapping[Quantity, Scalar],
        noise: Real,
        grows: Real,
        leak: Real,
    ) -> Bank:
        """After the load observer's step: the filters' time update.

        Args:
            travel: of the piston [m].
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
        if Quantity.ANGLE_OFFSET in self.hypotheses[0].mean:
            gains[Quantity.ANGLE_OFFSET] = assumed.link_angle.drift**2 * dt
        return self.with_hypotheses(
            [
                h.shifted(h.along(travel_by, point)).with_covariance(
                    h.covariance.predicted(travel_by, gains).grown(grows, given=ENDS)
                )
                for h in self.hypotheses
            ]
        )

    def roamed(self, travel: Scalar) -> Bank:
        """After the piston moved: its way leaves few places where an unknown position may be (`Reach`).

        Of the places of a stroke S that are as likely as each other, a way of R leaves the share 1 - R/S.

        Args:
            travel: of the piston [m].
        """
        state, unknown = self.state, self.hypotheses[-1]
        below, above, lost_below, lost_above = (
            ca.fmax(one + way * travel, 0.0)
            for one, way in ((state.below, 1.0), (state.above, -1.0), (state.lost_below, 1.0), (state.lost_above, -1.0))
        )
        state = replace(state, below=below, above=above, lost_below=lost_below, lost_above=lost_above)
        bank = replace(self, state=state, position=self.position + travel)
        surely = ca.fmax(lost_below + lost_above - bank._slack, 0.0)
        room = ca.fmax(1.0 - surely / self.model.stroke, OUTSIDE)
        nowhere = unknown.position_variance > (0.5 * self._unknown) ** 2
        less = all_of(room < state.room - WAY_LEAST, nowhere)
        likelier = ca.log(room / state.room)
        bank = bank.weighed(less, [likelier if kind == Kind.UNKNOWN_POSITION else 0.0 for kind in self.model.kinds])
        return replace(bank, state=replace(bank.state, room=ca.if_else(less, room, state.room)))._within_reach()

    def _within_reach(self) -> Bank:
        """After the piston went further than before: what that leaves of each hypothesis weighs it (`Reach.share`)."""
        state = self.state
        extent = state.below + state.above
        # What a piston seems to have moved against an end is known once it has left it.
        step = WAY_LEAST * self.model.stroke
        more = all_of(extent - state.extent > step, ca.fmin(state.below, state.above) > step)
        std = ca.if_else(more, self.together.std({Quantity.POSITION: 1.0}), state.extent_std)
        state = replace(state, extent_std=std)
        reach = replace(self, state=state).reach
        before = reach.widened(state.above < state.below, ca.fmax(extent - state.extent, 0.0))
        shares = [ca.fmin(ca.log(reach.share(h) / before.share(h)), 0.0) for h in self.hypotheses[:-1]]
        bank = self.weighed(more, [*shares, 0.0])
        now = replace(bank.state, extent=ca.if_else(more, extent, state.extent), extent_std=std)
        return replace(bank, state=now)

    @property
    def reach(self) -> Reach:
        """Where the piston can be: as far from both ends as its way needs, but for what that is uncertain by.

        The way from there is as uncertain as the position here, or as it was there where a reference was met since; and
        ends give way.
        """
        below, above = self.state.below, self.state.above
        softness, here = END_GIVES * self.model.stroke, self.together.std({Quantity.POSITION: 1.0})
        std = ca.sqrt(ca.fmax(self.state.extent_std, here) ** 2 + softness**2)
        otherwise = [k for k, kind in enumerate(self.model.kinds) if kind in ANOTHER_MACHINE]
        return Reach(below - self.position, self.model.stroke - above - self.position, std, otherwise)

    @property
    def _slack(self) -> Scalar:
        """What a way is uncertain by, 95 % [m]."""
        return TWO_SIDED_95 * self.together.std({Quantity.POSITION: 1.0})

    def gone_back(self, by: Real) -> Bank:
        """With a position that is another than the way gives, under each hypothesis: so much of it was none [m]."""
        bank = self.with_hypotheses([h.shifted(-by) for h in self.hypotheses])
        return bank.rewound(by)

    def rewound(self, by: Real) -> Bank:
        """With a way of the piston of which so much was none [m]; it has surely not been further for that."""
        state = self.state
        below, above = (ca.fmax(way - ca.fmax(one, 0.0), 0.0) for way, one in ((state.below, by), (state.above, -by)))
        return replace(self, state=replace(state, below=below, above=above))

    def confined(self, nominal: Scalar, passes: Flag, passed: Real) -> Bank:
        """With no hypothesis in which oil that may pass a relief valve took the piston far beyond the cylinder's ends.

        Under each hypothesis its own stops count, wherever they are. A little is left, for how far it seems to be
        beyond one is what a contact tells of the machine.

        Args:
            nominal: position after the step [m].
            passed: standard deviation of the position by what may have passed since a reference [m].
        """
        stroke, gone = self.model.stroke, []
        for h in self.hypotheses:
            position = nominal + h.mean[Quantity.POSITION]
            below = self._beyond(h, Quantity.LOW, h.mean[Quantity.LOW] - position, passed)
            above = self._beyond(h, Quantity.TOP, position - stroke - h.mean[Quantity.TOP], passed)
            gone.append(ca.if_else(passes, below - above, 0.0))
        found = [h.shifted(by) for h, by in zip(self.hypotheses, gone, strict=True)]
        return self.with_hypotheses(found).rewound(-of_likeliest(self.hypotheses, gone))

    def turned_back(self, nominal: Scalar, way: Scalar) -> Bank:
        """With no hypothesis in which a piston is beyond an end that it leaves without having been pressed on it.

        Oil that was drawn from the tank, or air in it, explains how far it seemed to be, by an unknown amount; half of
        it is added to the standard deviation.

        Args:
            nominal: position after the step [m].
            way: in which the motor moves it away from such an end, +1 for extension; 0 if it does not.
        """
        stroke, found, gone = self.model.stroke, [], []
        for h in self.hypotheses:
            position = nominal + h.mean[Quantity.POSITION]
            beyond = ca.if_else(way > 0.0, -position, ca.if_else(way < 0.0, position - stroke, 0.0))
            back = ca.if_else(beyond > h.position_std + END_GIVES * stroke, beyond, 0.0)
            covariance = h.covariance.grown(BETWEEN_STD * back, given=ENDS)
            found.append(h.shifted(way * back).with_covariance(covariance))
            gone.append(way * back)
        return self.with_hypotheses(found).rewound(-of_likeliest(self.hypotheses, gone))

    def room(self, way: Scalar, passed: Real) -> Scalar:
        """How far the piston may still move [m]; oil that is delivered beyond moves nothing.

        Args:
            passed: standard deviation of the position by what may have passed a relief valve [m].
        """
        ahead = ca.if_else(way > 0.0, self.model.stroke - self.position, self.position)
        return ca.fmax(ahead + self.together.likeliest(lambda h: self._far(h.position_std, passed)), 0.0)

    def _beyond(self, h: Hypothesis, end: Quantity, over: Scalar, passed: Real) -> Scalar:
        """How far a piston that seems to be so far beyond a stop is further than what that is uncertain by [m]."""
        std = ca.sqrt(h.covariance.variance({Quantity.POSITION: 1.0, end: -1.0}))
        return ca.fmax(over - self._far(std, passed), 0.0)

    def _far(self, std: Scalar, passed: Real) -> Scalar:
        """How far beyond an end a piston may seem to be [m]; what passed a relief valve took it nowhere."""
        return SURE_STDS * ca.fmax(std - passed, 0.0) + END_GIVES * self.model.stroke

    def floored(self, leak: float) -> Bank:
        """With a leakage that is never better known than this standard deviation [1]."""
        return self.with_hypotheses(
            [h.with_covariance(h.covariance.at_least(Quantity.LEAKAGE, leak**2)) for h in self.hypotheses]
        )

    def update(self, m: Measurement) -> tuple[Bank, list[Applied]]:
        """After a measurement: every hypothesis corrected, and weighed by its likelihood."""
        each = [applied(h, m) for h in self.hypotheses]
        found = [choose(m.use, one.hypothesis, h) for one, h in zip(each, self.hypotheses, strict=True)]
        bank = self.with_hypotheses(found)
        weighs = not isinstance(m.power, float) or m.power > 0.0
        return (bank.weighed(m.use, [one.evidence for one in each]) if weighs else bank), each

    def weighed(self, use: Flag, evidence: Sequence[Real]) -> Bank:
        """With each hypothesis likelier by its evidence, a logarithm, where there is some."""
        changed = bayes(self.hypotheses, evidence)
        after = tuple(weighed_where(use, changed, self.hypotheses))
        return replace(
            self, state=replace(self.state, hypotheses=after), together=self.together.reweighed(after, use, changed)
        )

    def left(self, hold: Hold, noise: Scalar) -> Bank:
        """After a piston has left what held it: how it did tells an end from an obstacle.

        Args:
            noise: standard deviation of the torque [N m].
        """
        was = self.state.by_obstacle
        tells = all_of(was, any_of(hold.went_on, hold.went_back))
        odds = odds_of_obstacle(hold.press, noise, hold.went_on)
        bank = self.weighed(tells, [odds if kind == Kind.UNKNOWN_POSITION else 0.0 for kind in self.model.kinds])
        return replace(bank, state=replace(bank.state, by_obstacle=all_of(was, negated(hold.released))))

    def placed(
        self, m: Measurement, low: Flag | None = None, top: Flag | None = None, *, is_reading: bool = False
    ) -> tuple[Bank, Measured]:
        """After a measurement of the place: a contact with an end, a reference, an angle or a reading.

        Args:
            low: whether it is a contact at the retracted end; None never.
            top: whether it is one at the extended end; None never.
        """
        low, top = flag(False) if low is None else low, flag(False) if top is None else top
        model = self.model
        by_start = all_of(self.state.entered, negated(self.state.confirmed))
        m = replace(m, arrived=m.arrived + ca.if_else(by_start, self._start_variance, 0.0))
        each = [applied(h, m) for h in self.hypotheses]
        stages = (self.hypotheses, [one.hypothesis for one in each])
        each, lost_before = unknown_begun(self.hypotheses, each, m, self.state.entered, model)
        hypotheses = bayes([one.hypothesis for one in each], tempered(each, self._counts(low, top)))
        fits = flag_of_likeliest(hypotheses, [one.fits for one in each])
        accepted = self._if_used(m.use, fits, flag(False))
        normal = of_likeliest(hypotheses, [one.normal for one in each])
        newest = ca.fmin(normal, SURE_STDS**2)
        before = self.state.innovations
        innovations = ca.if_else(fits, before + LATEST * (newest - 1.0 - before), before)
        by_low = self._placed(self.state.by_low, all_of(low, each[-1].fits), lost_before)
        by_top = self._placed(self.state.by_top, all_of(top, each[-1].fits), lost_before)
        what = Placed(low, top, by_low, by_top, fits, is_reading)
        renewed, how = renewal(self.hypotheses, hypotheses, m, each, what, lost_before, model)
        final = [choose(m.use, new, old) for new, old in zip(renewed, self.hypotheses, strict=True)]
        moved = of_likeliest(final, [h.mean[Quantity.POSITION] for h in final])
        centred = tuple(h.shifted(-moved) for h in final)
        found, lost = (self._if_used(m.use, one, flag(False)) for one in (how.births.found, how.lost))
        way = self._way_after(m, moved, found)
        state = replace(
            self.state,
            hypotheses=centred,
            innovations=ca.if_else(m.use, innovations, before),
            band_width=self._widened(ca.sqrt(newest), fits, m.use),
            entered=all_of(self.state.entered, negated(self._if_used(m.use, how.births.restarts, flag(False)))),
            confirmed=any_of(self.state.confirmed, accepted),
            by_obstacle=self._if_used(m.use, how.by_obstacle, self.state.by_obstacle),
            below=way.below,
            above=way.above,
            extent=way.extent,
            lost_below=ca.if_else(lost, 0.0, self.state.lost_below),
            lost_above=ca.if_else(lost, 0.0, self.state.lost_above),
            room=ca.if_else(lost, 1.0, self.state.room),
            met_low=self.state.met_low + count(all_of(accepted, low)),
            met_top=self.state.met_top + count(all_of(accepted, top)),
            by_low=self._if_used(m.use, all_of(by_low, negated(how.births.restarts)), self.state.by_low),
            by_top=self._if_used(m.use, all_of(by_top, negated(how.births.restarts)), self.state.by_top),
        )
        together = self.together.reweighed(centred, m.use, renewed)
        together = replace(together, wrong=self._assumed(state, self.model))
        bank = replace(self, state=state, together=together, position=self.position + moved)
        return bank, Measured(
            accepted=accepted,
            rejected=all_of(m.use, negated(accepted)),
            moved=moved,
            normal=ca.if_else(m.use, normal, 0.0),
            parents=used(m.use, parents(model.kinds, how.births), model.kinds),
            stages=stages,
        )

    def _way_after(self, m: Measurement, moved: Scalar, found: Flag) -> _Way:
        """The way after a measurement of the place, which moved the nominal position, or has found it again.

        What is corrected may be an error of the way: the piston has surely been that much less far away. Where the
        position was unknown, the way begins there.
        """
        state, corrects = self.state, ca.if_else(m.use, moved, 0.0)
        variance = of_likeliest(self.hypotheses, [h.position_variance for h in self.hypotheses])
        begins = any_of(found, all_of(m.use, variance > (0.5 * self._unknown) ** 2))
        below = ca.if_else(begins, 0.0, ca.fmax(state.below - ca.fmax(-corrects, 0.0), 0.0))
        above = ca.if_else(begins, 0.0, ca.fmax(state.above - ca.fmax(corrects, 0.0), 0.0))
        # A place that is measured has weighed the hypotheses by its likelihood.
        seen = ca.if_else(m.use, ca.fmax(state.extent, below + above), state.extent)
        return _Way(below, above, ca.if_else(begins, 0.0, seen))

    @property
    def _start_variance(self) -> Real:
        """Variance of a start that was entered by the chance that it is wrong [m2].

        Until something tells which of both it is, what the first measurement corrects is the start's as well.
        """
        stops = self.model.assumed.stops
        return stops.entered * (stops.elsewhere * self.model.stroke) ** 2

    def _counts(self, low: Flag, top: Flag) -> Scalar:
        """How much a contact counts as evidence, after n with the same end: 1 / (1 + n r)^2 of an independent one.

        n measurements whose errors are correlated by r are worth n / (1 + (n - 1) r) independent ones, 1/r at most. The
        derivative by n at n + 1 is (1 - r) / (1 + n r)^2; without 1 - r the first contact counts in full.
        """
        before = ca.if_else(low, self.state.met_low, ca.if_else(top, self.state.met_top, 0.0))
        return 1.0 / (1.0 + CONTACTS_ALIKE * before) ** 2

    @staticmethod
    def _placed(before: Flag, now: Flag, lost: Flag) -> Flag:
        """Whether *unknown position* has its position from an end after a measurement."""
        return any_of(now, all_of(before, negated(lost)))

    @staticmethod
    def _if_used(use: Flag, after: Flag, before: Flag) -> Flag:
        """What a flag is after a measurement, and as before where there is none.

        Not a conjunction, which asks for both: what a measurement alone needs is worked out in its samples alone.
        """
        return holds(ca.if_else(use, count(after), count(before)))

    def _widened(self, size: Scalar, fits: Flag, use: Flag) -> Scalar:
        """How wide the band has to be by references: adaptive conformal inference.

        One outside the band widens it by a step, one inside narrows it by as much as makes five of a hundred outside,
        but never below the filter's own. So a model's error of an unexpected kind widens the band as well.

        Args:
            size: of the innovation over its standard deviation [1].
            use: whether there is one; alone, for it leads into the branch of samples with a measurement.

        Source: Gibbs and Candès (2021), Adaptive conformal inference under distribution shift, equation (2), in the
        logarithm of the width.
        """
        width = self.state.band_width
        outside = size > TWO_SIDED_95 * width
        wider = width * ca.if_else(outside, math.exp(BAND_STEP * (1.0 - OUTSIDE)), math.exp(-BAND_STEP * OUTSIDE))
        return ca.if_else(use, ca.if_else(fits, ca.fmax(wider, 1.0), width), width)

    def variance(self) -> Scalar:
        """Of the position over all hypotheses, about the nominal one [m2] (`Mixture.variance`)."""
        return self.together.variance(self.reach)

    def factor_std(self, quantity: Quantity) -> Scalar:
        """Standard deviation of a factor under the likeliest hypothesis [1]."""
        return self.together.std({quantity: 1.0})

    def std(self, row: Row) -> Scalar:
        """Standard deviation, under the likeliest, of something with these derivatives."""
        return self.together.std(row)

    def limited(self) -> Bank:
        """With a position that is within the stroke, however uncertain it has become."""
        stroke = self.model.stroke
        limited = [h.covariance.limited(stroke, Quantity.POSITION) for h in self.hypotheses]
        return self.with_hypotheses([h.with_covariance(c) for h, c in zip(self.hypotheses, limited, strict=True)])

    def closed(self) -> BankState:
        """The state after the sample."""
        found = self.limited().hypotheses
        closed = tuple(h.with_covariance(h.covariance.closed()) for h in found)
        return replace(self.state, hypotheses=closed)
