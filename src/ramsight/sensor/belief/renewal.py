"""Births of hypotheses: the position that is unknown, one that is found again, a machine that surely leaks otherwise.

After a measurement of the place

1. *unknown position*, where it is the likeliest, becomes the first: the position is found again. Each end may be
   elsewhere again, as likely as before, and tied to the end that the position came from.
2. a machine that surely *leaks* otherwise becomes the first as well: its leakage is known by then, as any other's.
3. *unknown position* begins again: what became wrong since is likelier by now than what was wrong before. Where the
   measurement may well have been of something else, it is that, and its position goes on as it was before.

This and the priors (`bank_state`) are the places that set a weight; all else is Bayes' rule (`mixture`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.expression import Flag, Real, Scalar, all_of, any_of, count, flag, negated, scalar
from ramsight.sensor.belief.hypothesis import Hypothesis, choose
from ramsight.sensor.belief.lineage import Births, Parent, followed
from ramsight.sensor.belief.measurement import Applied, Measurement, applied, either
from ramsight.sensor.belief.mixture import leads
from ramsight.sensor.kind import Kind
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import LOG_WEIGHT_LEAST, NUMBER_LIMIT, OUTSIDE


@dataclass(frozen=True)
class Measured:
    """What a measurement of the place did."""

    accepted: Flag  # whether the likeliest hypothesis used it
    rejected: Flag  # whether it did not
    moved: Scalar  # by how much that moved the nominal position [m]
    normal: Scalar  # its squared innovation over its variance, under the likeliest [1]
    parents: tuple[Parent, ...]  # of each hypothesis after it
    stages: tuple[Sequence[Hypothesis], ...]  # the hypotheses before it, and as it corrected each

    def followed(self, by: Measured) -> Measured:
        """What this and another one after it did."""
        return Measured(
            accepted=any_of(self.accepted, by.accepted),
            rejected=any_of(self.rejected, by.rejected),
            moved=self.moved + by.moved,
            normal=ca.fmax(self.normal, by.normal),
            parents=followed(self.parents, by.parents),
            stages=(*self.stages, *by.stages),
        )


@dataclass(frozen=True)
class Placed:
    """A measurement of the place, by what it is of."""

    # low, top: whether it is a contact with the retracted, with the extended end
    low: Flag
    top: Flag
    # by_low, by_top: whether *unknown position* has its position from contacts with that end
    by_low: Flag
    by_top: Flag
    accepted: Flag  # whether the likeliest hypothesis used it
    # is_reading: whether it is a reading, which may be of something else; a switch is none, nor is an angle
    is_reading: bool = False


@dataclass(frozen=True)
class Renewed:
    """What became of the hypotheses."""

    births: Births  # of them
    by_obstacle: Flag  # whether *unknown position* is that the measurement was of an obstacle
    lost: Flag  # whether it has lost its place


def unknown_begun(
    before: Sequence[Hypothesis], each: Sequence[Applied], m: Measurement, entered: Flag, model: MachineModel
) -> tuple[list[Applied], Flag]:
    """With *unknown position* begun again where that explains a measurement better than its estimate, or an obstacle.

    Since the last reference the position may have become wrong at any time. What *unknown position* took for an end
    before that may have been an obstacle; it does not keep the position from being found again.
    """
    stops, own = model.assumed.stops, each[-1]
    prior = ca.if_else(entered, math.log(stops.entered), math.log(stops.wrong))
    again = applied(unknown_position(before[0], prior, model), m)
    lost = prior + again.likelihood > before[-1].log_weight + ca.fmax(own.likelihood, own.otherwise)
    return [*each[:-1], either(lost, again, own)], lost


def unknown_position(of: Hypothesis, weight: Real, model: MachineModel) -> Hypothesis:
    """A hypothesis that knows the machine as another one does, but not the position, nor whether it leaks more."""
    leak = max(model.assumed.machine.leak, model.assumed.machine.other_leak)
    covariance = of.covariance.independent(Quantity.POSITION, 0.5 * model.stroke)
    covariance = covariance.at_least(Quantity.LEAKAGE, leak**2)
    return replace(of, covariance=covariance, log_weight=scalar(0.0) + weight)


def renewal(
    before: Sequence[Hypothesis],
    after: Sequence[Hypothesis],
    m: Measurement,
    each: Sequence[Applied],
    placed: Placed,
    lost_before: Flag,
    model: MachineModel,
) -> tuple[list[Hypothesis], Renewed]:
    """The hypotheses after a measurement of the place."""
    kinds, stops = model.kinds, model.assumed.stops
    described, *between, unknown = after
    found = leads(after, len(kinds) - 1)
    first, surely = described, flag(False)
    if Kind.LEAKS in kinds:
        place = kinds.index(Kind.LEAKS)
        leaks = after[place]
        surely = all_of(leads(after, place), described.log_weight < math.log(OUTSIDE), placed.accepted)
        first = choose(surely, leaks, described)
        between[place - 1] = leaks.with_log_weight(ca.if_else(surely, LOG_WEIGHT_LEAST, leaks.log_weight))
    first = choose(found, unknown, first)
    for place, other in _ends_elsewhere(first, before, placed, model).items():
        between[place - 1] = choose(found, other, between[place - 1])
    prior = math.log(stops.wrong)
    was = before[0]
    was_known = was.position_variance < (0.25 * model.stroke) ** 2
    restarts = any_of(found, all_of(placed.accepted, any_of(unknown.log_weight < prior, negated(was_known))))
    # A reference is never an obstacle; a reading may be of something else.
    met = any_of(placed.low, placed.top)
    obstacle = m.something_else(m.R)
    if not placed.is_reading:
        obstacle = ca.if_else(met, obstacle, NUMBER_LIMIT)
    odds = obstacle - ca.if_else(found, each[-1].likelihood, each[0].likelihood)
    perhaps = all_of(restarts, odds < 0.0, odds > (prior if placed.is_reading else math.log(OUTSIDE)))
    # A position that was unknown before an obstacle is unknown after it.
    weight = first.log_weight + odds
    begun = unknown_position(first, ca.if_else(perhaps, ca.fmax(weight, prior), prior), model)
    goes_on = all_of(perhaps, was_known, negated(found))
    lost = all_of(restarts, negated(goes_on))
    again = choose(goes_on, was.with_log_weight(weight), begun)
    births = Births(found, surely, restarts, goes_on, lost_before)
    return [first, *between, choose(restarts, again, unknown)], Renewed(births, all_of(perhaps, met), lost)


def _ends_elsewhere(
    first: Hypothesis, kept: Sequence[Hypothesis], placed: Placed, model: MachineModel
) -> dict[int, Hypothesis]:
    """Hypotheses of ends that are elsewhere, by their place, around the position that *unknown position* has found.

    *Unknown position* takes both ends for described. Each may be elsewhere, as likely as at first or as contacts left
    it, and where the position is that of contacts with this end alone it is off by as much. Contacts with both that
    agree with the stroke leave neither elsewhere.
    """
    stops, both = model.assumed.stops, all_of(placed.by_low, placed.by_top)
    prior = math.log(stops.undeclared / (1.0 - 2.0 * stops.undeclared))
    ends = {Kind.LOW: (Quantity.LOW, placed.by_low), Kind.TOP: (Quantity.TOP, placed.by_top)}
    found = {}
    for k, kind in enumerate(model.kinds):
        if kind in ends:
            end, by_it = ends[kind]
            odds = ca.if_else(both, LOG_WEIGHT_LEAST, ca.fmin(prior, kept[k].log_weight - kept[0].log_weight))
            tied = first.covariance.tied(end, stops.elsewhere * model.stroke, count(by_it))
            found[k] = replace(first, covariance=tied, log_weight=first.log_weight + odds)
    return found
