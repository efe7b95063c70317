"""Two reports of one thing: by how much they are apart lately, and by how much they may be without a fault.

What should be equal is summed up over the last second or so, and so is what may keep it apart:

    d' = d e^(-h/T) + (a - b) h,      |d| <= k sqrt(Q + S^2) + delay |y - mean y|

with Q the variance of noise and of what a sample does not see, S the sum of standard deviations that stay what they are
(gains, losses), and y the level that both follow. Of two reports of y that are `delay` apart the sums differ by
(delay)(y - mean y), whatever y does, for both are linear in y.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from statistics import NormalDist
from typing import Any

import casadi as ca

from ramsight.sensor.virtual_sensor import SensorGraph

MEMORY = 1.0  # s; T: a speed that is off by 0.1 % of 2000 rpm is 0.2 rad off by then, which is seen
FALSE_ALARMS = 1.0 / (1000.0 * 3600.0)  # 1/s; one in a thousand hours
_OVER = 0.5  # share of the bound below which an alarm is over


@dataclass(frozen=True)
class Apart:
    """How far two reports are apart.

    Attributes:
        by: the sum of their difference [unit of the level times s].
        allowed: what it may be.
        late: how much of that is by delays.
        alarm: whether it is more, and since then has not become half of it.
        onset: whether it is so for the first time.
    """

    by: Any
    allowed: Any
    late: Any
    alarm: Any
    onset: Any


@dataclass(frozen=True)
class Sums:
    """What is kept of two reports from sample to sample; all are 0 before the first.

    Attributes:
        apart: sum of their difference [unit of the level times s].
        mean: of the level lately.
        variance: of the sum, by noise.
        lasts: standard deviation of the sum, by what lasts.
        level: at the last sample.
        alarm: whether there was one.
    """

    apart: Any
    mean: Any
    variance: Any
    lasts: Any
    level: Any
    alarm: Any


KEPT = tuple(one.name for one in fields(Sums))
"""Names of what is kept."""


def sure(memory: float) -> float:
    """How many standard deviations a sum over such a time [s] leaves by chance once in 1000 h.

    Example:
        >>> round(sure(1.0), 2), round(sure(60.0), 2)
        (5.14, 4.31)
    """
    return -NormalDist().inv_cdf(0.5 * FALSE_ALARMS * memory)  # sums are independent about every memory


def summed(
    before: Sums,
    difference: Any,
    *,
    started: Any,
    elapsed: Any,
    level: Any,
    delay: Any,
    lasting: Any,
    noise: Any = 0.0,
    memory: float = MEMORY,
) -> tuple[Sums, Apart]:
    """The sums after a sample, and what they say.

    Args:
        before: the sums.
        difference: of the reports at this sample, 0 where one is missing.
        started: whether there was a sample before.
        elapsed: since then [s].
        level: that both follow, by one of them.
        delay: by which they may be apart in time [s].
        lasting: standard deviation of the difference that lasts [unit of the level].
        noise: standard deviation of it that is new with each sample.
        memory: over which is summed up, T [s].
    """
    h = elapsed
    kept = ca.exp(-h / memory)
    by = kept * before.apart + difference * h
    mean = ca.if_else(started, level + kept * (before.mean - level), level)
    # Between two samples nobody knows when the level changed.
    unseen = ca.if_else(h > 0.0, 0.5 * h * (level - before.level), 0.0)
    variance = kept**2 * before.variance + unseen**2 + (noise * h) ** 2
    lasts = kept * before.lasts + lasting * h
    late = delay * ca.fabs(level - mean)
    allowed = sure(memory) * ca.sqrt(variance + lasts**2) + late
    alarm = ca.fabs(by) > ca.if_else(before.alarm, _OVER * allowed, allowed)
    onset = ca.logic_and(alarm, ca.logic_not(before.alarm))
    return Sums(by, mean, variance, lasts, level, alarm), Apart(by, allowed, late, alarm, onset)


def apart(
    graph: SensorGraph,
    name: str,
    difference: Any,
    *,
    level: Any,
    delay: float,
    lasting: Any,
    noise: Any = 0.0,
) -> Apart:
    """Follow two reports of one level in a sensor's step, as `summed` does.

    Args:
        graph: gains states.
        name: of the pair; its states begin with it.
        difference: of the reports at this sample, 0 where one is missing.
        level: that both follow, by one of them.
        delay: by which they may be apart in time [s].
        lasting: standard deviation of the difference that lasts [unit of the level].
        noise: standard deviation of it that is new with each sample.
    """
    before = Sums(*(graph.state(f"{name}_{what}") for what in KEPT))
    after, found = summed(
        before, difference, started=graph.held("started"), elapsed=graph.elapsed,
        level=level, delay=delay, lasting=lasting, noise=noise,
    )  # fmt: skip
    for what in KEPT:
        graph.becomes(f"{name}_{what}", getattr(after, what))
    return found


def lately(graph: SensorGraph, name: str, rate: Any) -> Any:
    """A rate summed up over the same time [its unit times s]."""
    before = graph.state(name)
    now = ca.exp(-graph.elapsed / MEMORY) * before + rate * graph.elapsed
    graph.becomes(name, now)
    return now
