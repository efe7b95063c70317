"""Two reports of one thing: by how much they differ lately, and by how much they may without a fault.

What should be equal is summed over the last second or so, and so is what may keep it apart:

    d' = d e^(-h/T) + (a - b) h,      |d| <= k sqrt(Q + S^2) + delay |y - mean y|

with Q the variance of noise and of what a sample does not resolve, S the sum of standard deviations that persist
(gains, losses), and y the level that both follow. Of two reports of y that are `delay` apart in time the sums differ by
(delay)(y - mean y), whatever y does, for both are linear in y.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.thresholds import FALSE_ALARM_RATE, HALF, MEMORY_TIME


@dataclass(frozen=True)
class Disagreement:
    """How far two reports are apart."""

    by: Scalar  # the sum of their difference [unit of the level times s]
    allowed: Scalar  # bound of it without a fault
    late: Scalar  # the part of that bound by delays
    alarm: Flag  # whether the bound is exceeded, and since then the sum has not fallen to half of it


@dataclass(frozen=True, kw_only=True)
class Sums:
    """What is kept of two reports from sample to sample."""

    apart: Scalar = leaf("unit s")  # sum of their difference [unit of the level times s]
    mean: Scalar = leaf("unit")  # of the level lately
    variance: Scalar = leaf("(unit s)2")  # of the sum, by noise
    lasts: Scalar = leaf("unit s")  # standard deviation of the sum, by what persists
    level: Scalar = leaf("unit")  # at the last sample
    alarm: Flag = leaf("1")  # whether there was one


def sure(memory: float) -> float:
    """Standard deviations that a sum over such a time [s] exceeds by chance once in 1000 h.

    Example:
        >>> round(sure(1.0), 2), round(sure(60.0), 2)
        (5.14, 4.31)
    """
    return -NormalDist().inv_cdf(0.5 * FALSE_ALARM_RATE * memory)  # sums are independent about every memory


def summed(
    before: Sums,
    difference: Real,
    *,
    started: Flag,
    elapsed: Scalar,
    level: Scalar,
    delay: Real,
    lasting: Real,
    noise: Real = 0.0,
    memory: float = MEMORY_TIME,
) -> tuple[Sums, Disagreement]:
    """The sums after a sample, and what they show.

    Args:
        difference: of the reports at this sample, 0 where one is missing.
        elapsed: since then [s].
        delay: by which they may be apart in time [s].
        lasting: standard deviation of the difference that persists [unit of the level].
        memory: over which is summed, T [s].
    """
    h = elapsed
    kept = ca.exp(-h / memory)
    by = kept * before.apart + difference * h
    mean = ca.if_else(started, level + kept * (before.mean - level), level)
    # When the level changed between two samples is unknown.
    unseen = ca.if_else(h > 0.0, 0.5 * h * (level - before.level), 0.0)
    variance = kept**2 * before.variance + unseen**2 + (noise * h) ** 2
    lasts = kept * before.lasts + lasting * h
    late = delay * ca.fabs(level - mean)
    allowed = sure(memory) * ca.sqrt(variance + lasts**2) + late
    alarm = ca.fabs(by) > ca.if_else(before.alarm, HALF * allowed, allowed)
    after = Sums(apart=by, mean=mean, variance=variance, lasts=lasts, level=level, alarm=alarm)
    return after, Disagreement(by, allowed, late, alarm)


def compared(
    before: Sums, sample: Sample, difference: Real, *, level: Scalar, delay: Real, lasting: Real, noise: Real = 0.0
) -> tuple[Sums, Disagreement]:
    """Two reports of a sensor's sample, summed as `summed` does.

    Args:
        difference: of the reports at this sample, 0 where one is missing.
        delay: by which they may be apart in time [s].
        lasting: standard deviation of the difference that persists [unit of the level].
    """
    return summed(
        before,
        difference,
        started=sample.started,
        elapsed=sample.elapsed,
        level=level,
        delay=delay,
        lasting=lasting,
        noise=noise,
    )


def leaky_sum(before: Scalar, rate: Real, elapsed: Scalar) -> Scalar:
    """A rate summed over the memory [its unit times s]."""
    return ca.exp(-elapsed / MEMORY_TIME) * before + rate * elapsed


@dataclass(frozen=True, kw_only=True)
class OnsetState:
    """A growth that waits for its alarm."""

    alarm: Flag = leaf("1")  # whether there was one at the last sample
    waiting: Scalar = leaf("m")  # what came together lately [m]


def growth_from_onset(state: OnsetState, alarm: Flag, rate: Scalar, elapsed: Scalar) -> tuple[OnsetState, Scalar]:
    """Growth of the position's standard deviation while an alarm lasts [m], with what came together before its onset.

    Args:
        rate: of the growth [m/s].
        elapsed: since the last sample [s].
    """
    waiting = leaky_sum(state.waiting, rate, elapsed)
    grows = ca.if_else(alarm, ca.if_else(state.alarm, rate * elapsed, waiting), 0.0)
    return OnsetState(alarm=alarm, waiting=waiting), grows
