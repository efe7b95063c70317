"""Which fault a report has that contradicts another one: hypotheses beside each other, weighed by their likelihoods.

While two reports y and x of one level contradict each other (`disagreement`), and x is taken for right, y may be

    gain     y = g x,      g ~ N(1, 0.5^2)
    offset   y = x + b,    b ~ N(0, (m/3)^2)
    sign     y = -g x,     g ~ N(1, s_g^2), as two reports without a fault
    stuck    y = c,        c ~ N(0, m^2)
    other    y anywhere between -m and m

each with the noise that is declared, m being the greatest level. What is not known of a hypothesis has a normal prior,
so that its evidence is known in closed form (linear regression, Bishop 2006, equation 3.86): of e = theta u with the
prior's variance s^2 and sums S weighted by 1/sigma^2

    ln p = -max(S_ee - S_eu^2 / (S_uu + 1/s^2), n + 2 sqrt(2 n)) / 2 - ln(1 + s^2 S_uu) / 2,

of a gain above 1 the first with 1/g^2, because the noise may be that of x. What is declared of noise is the most: that
n samples fit better is no evidence. All of it needs a few sums since the contradiction began. Samples closer together
than delays are not new. The five are as likely before; afterwards their probabilities are what is published.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

import casadi as ca

from ramsight.sensor.disagreement import MEMORY
from ramsight.sensor.virtual_sensor import SensorGraph

KINDS = ("gain", "offset", "sign", "stuck", "other")
"""The hypotheses, in the order of their probabilities."""
_GAIN = 0.5  # standard deviation of a gain about 1 [G]: from nothing to twice within two of them
_LEAST_GAIN = 1e-3  # of what two reports without a fault may differ by
_OFFSET = 1.0 / 3.0  # of an offset over the greatest level [G]: one of all of it is rare
_SCATTER = 2.0  # standard deviations of the sum of squares (chi-squared) that are usual
_AGREES = 3.0  # standard deviations of the noise within which a sample says nothing of a fault
_LEAST = 1e-9  # of a sum, so that nothing is divided by 0 before the first sample


@dataclass(frozen=True)
class Evidence:
    """Weighted sums since a contradiction began.

    Attributes:
        yy, xy, xx, y, x, one: of the products, of the reports and of 1, over the noise's variance.
        count: how many samples are new evidence.
        anywhere: of the logarithm of an even density over the noise's.
    """

    yy: Any
    xy: Any
    xx: Any
    y: Any
    x: Any
    one: Any
    count: Any
    anywhere: Any

    def turned_round(self) -> Evidence:
        """With the other report taken for right."""
        return Evidence(self.xx, self.xy, self.yy, self.x, self.y, self.one, self.count, self.anywhere)


SUMS = tuple(one.name for one in fields(Evidence))


def gathered(before: Evidence, y: Any, x: Any, std: Any, count: Any, most: Any) -> Evidence:
    """The sums with one more sample.

    Args:
        before: the sums.
        y: one report.
        x: the other one, which is taken for right.
        std: of the noise between them.
        count: how far the sample is new evidence [1]; 0 for none.
        most: the greatest level.

    Example:
        >>> none = Evidence(*(0.0 for _ in SUMS))
        >>> found = gathered(none, ca.DM(13.0), ca.DM(10.0), ca.DM(0.1), 1.0, 400.0)
        >>> round(float(found.xy)), round(float(found.one))
        (13000, 100)
    """
    w = count / std**2
    even = -ca.log(2.0 * most / (math.sqrt(2.0 * math.pi) * std))
    new = (w * y * y, w * x * y, w * x * x, w * y, w * x, w, count, count * even)
    return Evidence(*(getattr(before, name) + more for name, more in zip(SUMS, new, strict=True)))


def likelihoods(sums: Evidence, most: Any, gain: Any = 0.0) -> tuple[Any, ...]:
    """Natural logarithms of the evidence of `KINDS`, but for a common term.

    Args:
        sums: of the samples.
        most: the greatest level.
        gain: by which the two reports may differ without a fault, standard deviation [1].
    """
    s = sums
    apart, together = s.yy - 2.0 * s.xy + s.xx, s.yy + 2.0 * s.xy + s.xx

    usual = s.count + _SCATTER * ca.sqrt(2.0 * s.count)

    def normal(ee: Any, eu: Any, uu: Any, prior: Any, scale: Any = 1.0) -> Any:
        left = ca.fmax((ee - eu**2 / (uu + 1.0 / prior**2)) / scale, usual)
        return -0.5 * left - 0.5 * ca.log(1.0 + prior**2 * uu)

    # The noise may be the other report's: a gain has that of it as well.
    times = ca.fmax(gain_of(s) ** 2, 1.0)
    return (
        normal(apart, s.xy - s.xx, s.xx, _GAIN, times),
        normal(apart, s.y - s.x, s.one, _OFFSET * most),
        normal(together, s.xy + s.xx, s.xx, ca.fmax(gain, _LEAST_GAIN)),
        normal(s.yy, s.y, s.one, most),
        s.anywhere,
    )


def probabilities(sums: Evidence, most: Any, gain: Any = 0.0) -> tuple[Any, ...]:
    """Of `KINDS`, arguments as `likelihoods`; they add up to 1.

    Example:
        >>> sums = Evidence(*(0.0 for _ in SUMS))
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


def gain_of(sums: Evidence) -> Any:
    """The gain that explains the samples best [1]; 1 before there are any."""
    return (sums.xy + _LEAST) / (sums.xx + _LEAST)


def offset_of(sums: Evidence) -> Any:
    """The offset that explains them best [unit of the level]."""
    return (sums.y - sums.x) / (sums.one + _LEAST)


@dataclass(frozen=True)
class Pair:
    """Two reports of one level, as a sensor's step has them.

    Attributes:
        name: of the report that may be wrong, ``"speed"``; states and outputs begin with it.
        unit: of the level.
        reported, other: both.
        std: of the noise between them at this sample.
        delay: by which they may be apart in time [s].
        there: whether both tell something.
        most: the greatest level.
        least: level from which on reports that agree say that no fault is left.
        gain: by which they may differ without a fault, standard deviation [1].
    """

    name: str
    unit: str
    reported: Any
    other: Any
    std: Any
    delay: float
    there: Any
    most: Any
    least: Any
    gain: Any = 0.0


def diagnose(
    graph: SensorGraph, pair: Pair, alarm: Any, own: Any = 0.0, other: Any = 0.0
) -> dict[str, tuple[Any, str]]:
    """Weigh the hypotheses while two reports contradict each other.

    Args:
        graph: of the sensor; gains states.
        pair: the reports.
        alarm: whether they contradict each other.
        own: whether it is known that the report itself is wrong.
        other: whether it is known that the other one is; then probabilities, gain and offset are its, until the alarm
            is over or the opposite is known.

    Returns:
        Outputs with their units: a probability of each of `KINDS`, 0 while nothing is contradicted or nothing is known
            of it yet; gain and offset.
    """
    sums = _followed(graph, pair, alarm)
    was = graph.state(f"{pair.name}_right")
    right = ca.if_else(other, 1.0, ca.if_else(own, 0.0, was))
    graph.becomes(f"{pair.name}_right", ca.if_else(alarm, right, 0.0))
    both = zip(vars(sums).values(), vars(sums.turned_round()).values(), strict=True)
    seen = Evidence(*(ca.if_else(right, swapped, plain) for plain, swapped in both))
    chances, says = probabilities(seen, pair.most, pair.gain), ca.logic_and(alarm, seen.count > 0.0)
    more = {}
    for kind, chance in zip(KINDS, chances, strict=True):
        more[f"{pair.name}_{kind}_probability"] = ca.if_else(says, chance, 0.0), "1"
    more[f"{pair.name}_gain"] = ca.if_else(says, gain_of(seen), 1.0), "1"
    more[f"{pair.name}_offset"] = ca.if_else(says, offset_of(seen), 0.0), pair.unit
    return more


def _followed(graph: SensorGraph, pair: Pair, alarm: Any) -> Evidence:
    """The sums in a sensor's graph: they begin with the alarm.

    A sample waits until one after it contradicts as well: those that agree when the fault is over never count, nor does
    the mean over a sample in which it ended.
    """
    was, last = graph.state(f"{pair.name}_diagnosed"), graph.state(f"{pair.name}_level")
    h = ca.fmax(graph.elapsed, 1e-3)
    # Of two reports that are late to each other a changing level is as far apart as it changes meanwhile.
    late = pair.delay * ca.fabs(pair.other - last) / h
    std = ca.sqrt(pair.std**2 + ca.if_else(was, late**2, 0.0))
    agrees = ca.fabs(pair.reported - pair.other) < _AGREES * std
    over = _is_over(graph, pair, alarm, agrees)
    counts = ca.logic_and(ca.logic_and(alarm, pair.there), ca.logic_not(over))
    count = ca.if_else(counts, h / ca.fmax(h, 2.0 * pair.delay), 0.0)
    flows = ca.logic_and(counts, ca.logic_not(agrees))
    names = [(f"{pair.name}_evidence_{what}", f"{pair.name}_waiting_{what}") for what in SUMS]
    sums, waiting = ([graph.state(name) for name in column] for column in zip(*names, strict=True))
    after = [old + ca.if_else(flows, waits, 0.0) for old, waits in zip(sums, waiting, strict=True)]
    left = Evidence(*(ca.if_else(flows, 0.0, waits) for waits in waiting))
    grown = gathered(left, pair.reported, pair.other, std, count, pair.most)
    for (name, waits), counted, more in zip(names, after, vars(grown).values(), strict=True):
        graph.becomes(name, ca.if_else(alarm, counted, 0.0))
        graph.becomes(waits, ca.if_else(alarm, more, 0.0))
    graph.becomes(f"{pair.name}_diagnosed", alarm)
    graph.becomes(f"{pair.name}_level", pair.other)
    return Evidence(*after)


def _is_over(graph: SensorGraph, pair: Pair, alarm: Any, agrees: Any) -> Any:
    """Whether the fault is over though the contradiction is still said: both have agreed for a while as they went."""
    agreed, was = graph.state(f"{pair.name}_agreed_for"), graph.state(f"{pair.name}_fault_over")
    tells = ca.logic_and(pair.there, ca.fabs(pair.other) > pair.least)
    lasts = ca.if_else(agrees, agreed + ca.if_else(tells, graph.elapsed, 0.0), 0.0)
    graph.becomes(f"{pair.name}_agreed_for", ca.if_else(alarm, lasts, 0.0))
    over = ca.logic_or(was, lasts > MEMORY)
    graph.becomes(f"{pair.name}_fault_over", ca.logic_and(alarm, over))
    return over
