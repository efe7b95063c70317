"""The rate of the samples: a period that changes while the motor turns is a clock that runs wrong, or another sender.

If twice as many samples come in a second by their clock, then either the drive sends twice as often, or its clock runs
at half its speed and the piston moves twice as far. The samples alone do not tell which, and the position becomes as
uncertain as both are apart. A period that stays is the new one.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, negated
from ramsight.sensor.thresholds import (
    GAP_PERIOD,
    HALF,
    MOTOR_TURNS,
    RATE_LEARNT,
    RATE_LEARNT_MOST,
    RATE_MEMORY,
    SAMPLE,
    SURE_STDS,
)


@dataclass(frozen=True, kw_only=True)
class RateState:
    """How often samples come."""

    period: Scalar = leaf("s", always=True)  # between two samples while the motor turns [s]
    last: Scalar = leaf("s", always=True)  # the last one [s]
    # variance: of it, by the differences of successive ones, which another rate does not change [s2]
    variance: Scalar = leaf("s2", always=True)
    # learnt: samples that period and variance are the mean of, fewer with each that contradicts it
    learnt: Scalar = leaf("1", always=True)
    # apart: by how much the last samples were further apart than it says, all together [s]
    apart: Scalar = leaf("s", always=True)
    odd: Flag = leaf("1")  # whether that was too much at the last sample that counted


def check_rate(
    state: RateState, tick: Scalar, *, there: Flag, counts: Flag, speed: Scalar
) -> tuple[RateState, Flag, Scalar]:
    """What is known of the rate after a sample, whether it is another one, and a time that may have passed unseen [s].

    Args:
        tick: since the last sample of all, negative if this one is older [s].
        speed: of the motor [rad/s].
    """
    near = all_of(there, ca.fabs(tick) <= GAP_PERIOD)
    known = state.learnt >= RATE_LEARNT
    # What jitter adds up to, and a mean of so many samples is off by.
    counts_as = 0.5 * RATE_MEMORY + RATE_MEMORY**2 / ca.fmax(state.learnt, 1.0)
    spread = SURE_STDS * ca.sqrt(state.variance * counts_as)
    early, late = 2.0 * SAMPLE + state.period + spread, GAP_PERIOD + spread
    # Lost samples are usual. What is nearer to one period than to two counts for as much late as it does early.
    counts_for = ca.if_else(tick < 1.5 * state.period, late / early, 1.0)
    faded = (1.0 - 1.0 / RATE_MEMORY) * state.apart
    apart = ca.if_else(all_of(near, known), faded + counts_for * (tick - state.period), 0.0)
    share = ca.fabs(apart) / late
    odd = all_of(known, any_of(share > 1.0, all_of(state.odd, share > HALF)))
    unknown_for = ca.fmax(ca.fabs(apart) - ca.if_else(state.odd, late, 0.0), 0.0) / counts_for
    learns = all_of(near, ca.fabs(speed) > MOTOR_TURNS)
    differs = ca.if_else(state.learnt > 0.0, tick - state.last, 0.0)
    more = ca.fmin(state.learnt + 1.0, RATE_LEARNT_MOST)
    fewer = ca.if_else(state.learnt > RATE_LEARNT, state.learnt - 1.0, 0.0)
    after = RateState(
        period=state.period + ca.if_else(all_of(learns, negated(odd)), (tick - state.period) / more, 0.0),
        last=ca.if_else(learns, tick, state.last),
        variance=state.variance + ca.if_else(learns, (0.5 * differs**2 - state.variance) / more, 0.0),
        learnt=ca.if_else(learns, ca.if_else(odd, fewer, more), state.learnt),
        apart=ca.if_else(all_of(odd, counts), ca.fmax(ca.fmin(apart, late), -late), apart),
        odd=odd,
    )
    return after, odd, ca.if_else(odd, unknown_for, 0.0)
