"""How often a report that is alive repeats by chance, so that one that is stuck can be distinguished from it.

A value that is rounded to steps and has noise is now and then the same as the one before. Of a steady value the noise
falls into the step k with the probability p_k, and n repeats in a row, n + 1 equal reports, with

    P(n) = sum over k of p_k^(n + 1),    p_k = Phi((k + 1/2) s) - Phi((k - 1/2) s),    s = step/noise,

where Phi is the normal distribution; a value in the middle of a step repeats most often. (The square of the
probability of one repeat is less than that of two: what repeated is likely to lie well within its step.) A value that
moves repeats less often.

A speed is looked at while its command is steady or trembles (`look`). The declared noise has to be confirmed. How often
one repeat is followed by another is learned from runs that ended, apart for commands that are steady and that tremble
within the noise of reports. Until as many samples were seen as a speed without noise would need for `SURE_RUNS` alarms,
no run is an alarm; and where more repeats follow than the noise explains, their share counts in its place. A run that
is too long for the declared noise and ends all the same refutes the declaration: from then on no run is an alarm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from statistics import NormalDist

import casadi as ca

from ramsight.control import thresholds as limit
from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, count, negated


def runs(share: float, period: float) -> int:
    """Samples in a row, of which each occurs by chance with this share, that are rarer than `FALSE_ALARM_RATE`.

    Args:
        share: probability of one sample [1].
        period: of the samples [s].

    Example:
        >>> runs(0.0, 0.02), runs(0.05, 0.02), runs(0.2, 0.02)
        (1, 7, 12)
    """
    if share <= 0.0:
        return 1
    return max(math.ceil(math.log(limit.FALSE_ALARM_RATE * period) / math.log(share)), 1)


def runs_of(share: Real, period: float) -> Scalar:
    """As `runs`, of a share above 0 and below 1 that is an expression."""
    return ca.fmax(ca.ceil(math.log(limit.FALSE_ALARM_RATE * period) / ca.log(share)), 1.0)


def upper_share(met: Real, samples: Real) -> Real:
    """Upper 95 % bound of a rare event's share [1], by how often it was met in so many samples; 1 before any.

    Example:
        >>> upper_share(0.0, 0.0), round(upper_share(27.0, 300.0), 3)
        (1.0, 0.099)
    """
    return (met + limit.PRIOR_REPEATS) / (samples + limit.PRIOR_REPEATS)


def repeats(count: int, noise: float, step: float, off: float = 0.0) -> float:
    """Probability that a steady value is reported as often again as it was just now [1].

    Args:
        off: by which the value is off the middle of a step, in the same unit.

    Example:
        >>> [round(repeats(1, noise, 1.0), 3) for noise in (0.5, 1.0, 2.0)]
        [0.516, 0.271, 0.14]
        >>> round(repeats(2, 1.0, 1.0), 3)
        0.085
    """
    normal, reach = NormalDist(off, noise), math.ceil(limit.TAIL_SIGMAS * noise / step) + 1
    edges = [normal.cdf((k - 0.5) * step) for k in range(-reach, reach + 2)]
    return sum((after - before) ** (count + 1) for before, after in pairwise(edges))


def repeats_in_a_row(noise: float, step: float, period: float) -> float:
    """Repeats of a steady value that are rarer than `FALSE_ALARM_RATE`, wherever it lies in a step.

    Args:
        noise: standard deviation before it is rounded; 0: there is none, and it may repeat for ever.
        step: to which it is rounded, in the same unit; 0: it never repeats.
        period: of the samples [s].

    Returns:
        A whole number, or infinity.

    Example:
        >>> [repeats_in_a_row(noise, 1.0, 0.02) for noise in (0.0, 1.0, 2.0, 10.0)]
        [inf, 19, 11, 6]
    """
    if step <= 0.0:
        return 1
    if noise <= 0.0:
        return math.inf
    likeliest = 2.0 * NormalDist().cdf(0.5 * step / noise) - 1.0
    if likeliest >= 1.0 or math.log(limit.FALSE_ALARM_RATE * period) / math.log(likeliest) > limit.NEVER_SAMPLES:
        return math.inf
    count = max(math.floor(runs(likeliest, period) / 2) - 1, 1)
    while repeats(count, noise, step) > limit.FALSE_ALARM_RATE * period:
        count += 1
    return count


Pair = tuple[Flag, Flag]
"""Whether the command is steady, and whether it trembles; neither where it moves."""


@dataclass(frozen=True)
class Run:
    """Samples of the run that has not ended, for one kind of command: all, repeats, repeats after another."""

    samples: Scalar = leaf("1")
    repeats: Scalar = leaf("1")
    followed: Scalar = leaf("1")


@dataclass(frozen=True)
class Learned:
    """Of runs that ended, for one kind of command: samples, repeats that had a successor, and that repeated again."""

    samples: Scalar = leaf("1")
    seen: Scalar = leaf("1")
    met: Scalar = leaf("1")


@dataclass(frozen=True)
class Current:
    """The run that has not ended."""

    runs: tuple[Run, Run]  # for commands that are steady and that tremble
    speed: Scalar = leaf("rad/s", limit.NO_REPORT)  # that repeats
    alarm: Flag = leaf("1")  # whether the run is too long
    repeated: Flag = leaf("1")  # whether the last sample was a repeat that counts


@dataclass(frozen=True)
class SpeedRepeats:
    """State of the check."""

    current: Current  # the run that has not ended
    learned: tuple[Learned, Learned]  # for commands that are steady and that tremble
    confirmed: Flag = leaf("1", 1.0)  # whether no run has refuted the declared noise


def no_run() -> Current:
    """Before a run."""
    return Current((Run(), Run()))


def nothing_learned() -> SpeedRepeats:
    """The state at power-up."""
    return SpeedRepeats(no_run(), (Learned(), Learned()))


def reset(state: SpeedRepeats, when: Flag) -> SpeedRepeats:
    """Count again, and learn nothing of the current run."""
    return replace(state, current=chosen(when, no_run(), state.current))


def look(
    state: SpeedRepeats, when: Flag, speed: Scalar, command: Pair, enough: float, period: float
) -> tuple[SpeedRepeats, Flag]:
    """The state after a report, and whether it is one too many of a run.

    Args:
        speed: reported [rad/s].
        period: of the samples [s].
    """
    same = all_of(when, speed == state.current.speed)
    ends = all_of(when, negated(speed == state.current.speed))
    state = _learn(state, all_of(ends, negated(state.current.alarm)), command, enough)
    before = chosen(ends, replace(no_run(), speed=speed), state.current)
    counted = [all_of(same, kind) for kind in command]
    runs = tuple(
        Run(
            run.samples + count(all_of(when, kind)),
            run.repeats + count(counts),
            run.followed + count(all_of(counts, before.repeated)),
        )
        for run, kind, counts in zip(before.runs, command, counted, strict=True)
    )
    found = [
        all_of(counts, state.confirmed, _too_long(run, learned, enough, period))
        for run, learned, counts in zip(runs, state.learned, counted, strict=True)
    ]
    alarm = any_of(before.alarm, *found)
    repeated = any_of(before.repeated, all_of(same, any_of(*command)))
    current = Current((runs[0], runs[1]), before.speed, alarm, repeated)
    return replace(state, current=current), all_of(when, alarm)


def _too_long(run: Run, learned: Learned, enough: float, period: float) -> Flag:
    """Whether a run is too long by the declared noise, and by what was seen: log(rate) / log(share) repeats."""
    share = upper_share(learned.met, learned.seen)
    sure = all_of(run.repeats >= enough, learned.samples >= limit.SURE_RUNS * enough)
    return all_of(sure, share < 1.0, run.repeats >= runs_of(share, period))


def _learn(state: SpeedRepeats, when: Flag, command: Pair, enough: float) -> SpeedRepeats:
    """From a run that a new value ended, if it was no alarm."""
    current = state.current
    short = all_of(*(run.repeats < enough for run in current.runs))
    more = [
        Learned(
            learned.samples + run.samples,
            learned.seen + run.followed + count(all_of(current.repeated, kind)),
            learned.met + run.followed,
        )
        for learned, run, kind in zip(state.learned, current.runs, command, strict=True)
    ]
    taught = SpeedRepeats(current, (more[0], more[1]), all_of(state.confirmed, short))
    learned = chosen(when, (taught.learned, taught.confirmed), (state.learned, state.confirmed))
    return SpeedRepeats(current, *learned)
