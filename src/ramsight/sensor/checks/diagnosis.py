"""Which fault a report has that contradicts another one: hypotheses beside each other, weighed by their likelihoods.

While two reports y and x of one level contradict each other (`disagreement`), and x is assumed to be right, y may be

    gain     y = g x,      g ~ N(1, 0.5^2)
    offset   y = x + b,    b ~ N(0, (m/3)^2)
    sign     y = -g x,     g ~ N(1, s_g^2), as two reports without a fault
    stuck    y = c,        c ~ N(0, m^2)
    other    y anywhere between -m and m

each with the noise that is declared, m being the greatest level. What is not known of a hypothesis has a normal prior,
so that its evidence has a closed form (linear regression, Bishop 2006, equation 3.86): of e = theta u with the
prior's variance s^2 and sums S weighted by 1/sigma^2

    ln p = -max(S_ee - S_eu^2 / (S_uu + 1/s^2), n + 2 sqrt(2 n)) / 2 - ln(1 + s^2 S_uu) / 2,

of a gain above 1 the first with 1/g^2, because the noise may be that of x. The declared noise is an upper bound: a
better fit of n samples is no evidence. A few sums since the contradiction began suffice. Samples closer together
than the delays are not new. The five are equally likely before; their probabilities afterwards are outputs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import casadi as ca

from ramsight.engine.typed_state import chosen, leaf, leaves, mapped
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, flag, negated
from ramsight.sensor.inputs.sample import Sample, lasted
from ramsight.sensor.thresholds import LIKELY_STDS, MEMORY_TIME, SHORTEST_STEP, TINY, USUAL_STDS

KINDS = ("gain", "offset", "sign", "stuck", "other")
"""The hypotheses, in the order of their probabilities."""


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Weighted sums since a contradiction began."""

    # yy, xy, xx, y, x, one: of the products, of the reports and of 1, over the noise's variance
    yy: Scalar = leaf("1")
    xy: Scalar = leaf("1")
    xx: Scalar = leaf("1")
    y: Scalar = leaf("1")
    x: Scalar = leaf("1")
    one: Scalar = leaf("1")
    count: Scalar = leaf("1")  # how many samples are new evidence
    anywhere: Scalar = leaf("1")  # of the logarithm of a uniform density over the noise's

    def swapped(self) -> Evidence:
        """With the other report assumed to be right."""
        return Evidence(
            yy=self.xx,
            xy=self.xy,
            xx=self.yy,
            y=self.x,
            x=self.y,
            one=self.one,
            count=self.count,
            anywhere=self.anywhere,
        )


SUMS = tuple(one.name for one in fields(Evidence))


def gathered(before: Evidence, y: Scalar, x: Scalar, std: Scalar, count: Real, most: Real) -> Evidence:
    """The sums with one more sample.

    Args:
        count: how far the sample is new evidence [1]; 0 for none.

    Example:
        >>> found = gathered(Evidence(), ca.DM(13.0), ca.DM(10.0), ca.DM(0.1), 1.0, 400.0)
        >>> round(float(found.xy)), round(float(found.one))
        (13000, 100)
    """
    w = count / std**2
    even = -ca.log(2.0 * most / (math.sqrt(2.0 * math.pi) * std))
    return Evidence(
        yy=before.yy + w * y * y,
        xy=before.xy + w * x * y,
        xx=before.xx + w * x * x,
        y=before.y + w * y,
        x=before.x + w * x,
        one=before.one + w,
        count=before.count + count,
        anywhere=before.anywhere + count * even,
    )


def likelihoods(sums: Evidence, most: Real, gain: Real = 0.0) -> tuple[Scalar, ...]:
    """Natural logarithms of the evidence of `KINDS`, but for a common term.

    Args:
        gain: by which the two reports may differ without a fault, standard deviation [1].
    """
    s = sums
    apart, together = s.yy - 2.0 * s.xy + s.xx, s.yy + 2.0 * s.xy + s.xx
    usual = s.count + USUAL_STDS * ca.sqrt(2.0 * s.count)

    def normal(ee: Scalar, eu: Scalar, uu: Scalar, prior: Real, scale: Real = 1.0) -> Scalar:
        left = ca.fmax((ee - eu**2 / (uu + 1.0 / prior**2)) / scale, usual)
        return -0.5 * left - 0.5 * ca.log(1.0 + prior**2 * uu)

    # The noise may be the other report's: a gain multiplies it as well.
    times = ca.fmax(gain_of(s) ** 2, 1.0)
    return (
        normal(apart, s.xy - s.xx, s.xx, 1.0 / USUAL_STDS, times),
        normal(apart, s.y - s.x, s.one, 1.0 / LIKELY_STDS * most),
        normal(together, s.xy + s.xx, s.xx, ca.fmax(gain, TINY)),
        normal(s.yy, s.y, s.one, most),
        s.anywhere,
    )


def probabilities(sums: Evidence, most: Real, gain: Real = 0.0) -> tuple[Scalar, ...]:
    """Of `KINDS`, arguments as `likelihoods`; their sum is 1.

    Example:
        >>> sums = Evidence()
        >>> for x in (50.0, 100.0, -20.0, 10.0):
        ...     sums = gathered(sums, ca.DM(1.3 * x), ca.DM(x), ca.DM(0.5), 1.0, 400.0)
        >>> [round(float(p), 3) for p in probabilities(sums, 400.0)]
        [1.0, 0.0, 0.0, 0.0, 0.0]
    """
    logs = likelihoods(sums, most, gain)
    largest = logs[0]
    for one in logs[1:]:
        largest = ca.fmax(largest, one)
    raw = [ca.exp(one - largest) for one in logs]
    total = sum(raw)
    return tuple(one / total for one in raw)


def gain_of(sums: Evidence) -> Scalar:
    """The gain that explains the samples best [1]; 1 before there are any."""
    return (sums.xy + TINY) / (sums.xx + TINY)


def offset_of(sums: Evidence) -> Scalar:
    """The offset that explains them best [unit of the level]."""
    return (sums.y - sums.x) / (sums.one + TINY)


@dataclass(frozen=True)
class Pair:
    """Two reports of one level, as a sensor's step has them."""

    name: str  # of the report that may be wrong, ``"speed"``; outputs begin with it
    unit: str  # of the level
    # reported, other: both
    reported: Scalar
    other: Scalar
    std: Scalar  # of the noise between them at this sample
    delay: float  # by which they may be apart in time [s]
    there: Flag  # whether both show something
    most: Real  # the greatest level
    least: Real  # level from which on reports that agree show that no fault is left
    gain: float = 0.0  # by which they may differ without a fault, standard deviation [1]


@dataclass(frozen=True, kw_only=True)
class DiagnosisState:
    """A contradiction that is diagnosed."""

    evidence: Evidence = field(default_factory=Evidence)  # sums of samples that count
    # waiting: sums of samples that wait until a later one contradicts as well
    waiting: Evidence = field(default_factory=Evidence)
    diagnosed: Flag = leaf("1")  # whether the contradiction was there at the last sample
    level: Scalar = leaf("unit")  # of the other report at it
    agreed_for: Scalar = leaf("s")  # how long both have agreed as they moved [s]
    over: Flag = leaf("1")  # whether the fault is over though the contradiction is still shown
    other_wrong: Flag = leaf("1")  # whether the other report is known to be wrong


def diagnose(
    state: DiagnosisState,
    sample: Sample,
    pair: Pair,
    alarm: Flag,
    own: Flag | None = None,
    other: Flag | None = None,
) -> tuple[DiagnosisState, Mapping[str, tuple[Scalar, str]]]:
    """Weigh the hypotheses while two reports contradict each other.

    Args:
        other: whether it is known that the other one is; then probabilities, gain and offset are its, until the alarm
            is over or the opposite is known.

    Returns:
        The state after the sample, and outputs with their units: a probability of each of `KINDS`, 0 while nothing is
        contradicted or known of it; gain and offset.
    """
    followed = _followed(state, sample, pair, alarm)
    sums = _counted(state, followed.contradicts)
    other_wrong = any_of(
        flag(False) if other is None else other,
        all_of(negated(flag(False) if own is None else own), state.other_wrong),
    )
    seen = chosen(other_wrong, sums.swapped(), sums)
    chances, shown = probabilities(seen, pair.most, pair.gain), all_of(alarm, seen.count > 0.0)
    more: dict[str, tuple[Scalar, str]] = {}
    for kind, chance in zip(KINDS, chances, strict=True):
        more[f"{pair.name}_{kind}_probability"] = ca.if_else(shown, chance, 0.0), "1"
    more[f"{pair.name}_gain"] = ca.if_else(shown, gain_of(seen), 1.0), "1"
    more[f"{pair.name}_offset"] = ca.if_else(shown, offset_of(seen), 0.0), pair.unit
    none = Evidence()
    after = DiagnosisState(
        evidence=chosen(alarm, sums, none),
        waiting=chosen(alarm, followed.waiting, none),
        diagnosed=alarm,
        level=pair.other,
        agreed_for=ca.if_else(alarm, followed.agreed_for, 0.0),
        over=all_of(alarm, followed.over),
        other_wrong=all_of(alarm, other_wrong),
    )
    return after, more


@dataclass(frozen=True)
class _Followed:
    """What a sample adds: whether it contradicts, the sums that wait, and whether the fault is over."""

    contradicts: Flag
    waiting: Evidence
    agreed_for: Scalar
    over: Flag


def _followed(state: DiagnosisState, sample: Sample, pair: Pair, alarm: Flag) -> _Followed:
    """The sample as evidence; the sums begin with the alarm.

    A sample waits until a later one contradicts as well: those that agree when the fault is over never count, nor does
    the mean over a sample in which it ended.
    """
    h = ca.fmax(sample.elapsed, SHORTEST_STEP)
    # Two reports that are late to each other differ by the change of the level meanwhile.
    late = pair.delay * ca.fabs(pair.other - state.level) / h
    std = ca.sqrt(pair.std**2 + ca.if_else(state.diagnosed, late**2, 0.0))
    agrees = ca.fabs(pair.reported - pair.other) < LIKELY_STDS * std
    agreed_for, over = _is_over(state, sample, pair, agrees)
    counts = all_of(all_of(alarm, pair.there), negated(over))
    count = ca.if_else(counts, h / ca.fmax(h, 2.0 * pair.delay), 0.0)
    contradicts = all_of(counts, negated(agrees))
    left = chosen(contradicts, Evidence(), state.waiting)
    waiting = gathered(left, pair.reported, pair.other, std, count, pair.most)
    return _Followed(contradicts, waiting, agreed_for, over)


def _counted(state: DiagnosisState, contradicts: Flag) -> Evidence:
    """The sums that count, with those that waited where the sample contradicts."""
    waiting = iter(leaves(state.waiting))
    return mapped(state.evidence, lambda one: one.value + ca.if_else(contradicts, next(waiting).value, 0.0))


def _is_over(state: DiagnosisState, sample: Sample, pair: Pair, agrees: Flag) -> tuple[Scalar, Flag]:
    """For how long both have agreed as they moved [s], and whether the fault is over by that."""
    moves = all_of(pair.there, ca.fabs(pair.other) > pair.least)
    lasts = ca.if_else(agrees, state.agreed_for + ca.if_else(moves, sample.elapsed, 0.0), 0.0)
    return lasts, any_of(state.over, lasted(lasts, MEMORY_TIME))
