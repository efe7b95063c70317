"""The oil's thermometer: which temperature is used, and how little is known of it where none is reported.

A report counts within the temperatures at which there is oil. One that has stepped further than oil can is used once it
has stayed there for as long as it was good before. Oil at work warms up or cools down; a report that stands still for
longer than that takes to show in the report's own step is that of a thermometer which is stuck. While there is no
report that counts and changes, the oil's temperature is that of a random walk: its variance grows by `UNKNOWN_WARMING`
squared times the time.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, negated
from ramsight.plant.oil import T40
from ramsight.sensor.thresholds import (
    LAG_MOST,
    OIL_TIME_CONSTANT,
    TEMPERATURE_HIGHEST,
    TEMPERATURE_LOWEST,
    TEMPERATURE_STEP,
    THERMOMETER_STANDS,
    THERMOMETER_STEP,
    UNKNOWN_WARMING,
)


@dataclass(frozen=True, kw_only=True)
class ThermometerState:
    """What is kept of the reported temperatures."""

    filtered: Scalar = leaf("K")  # [K]; 0 while none is known
    step_for: Scalar = leaf("s")  # how long a step has lasted [s]
    good_for: Scalar = leaf("s")  # how long the reported temperature was good before [s]
    reported: Scalar = leaf("K")  # the last one that is possible [K]; 0 before any
    least_change: Scalar = leaf("K")  # of it so far [K]; 0 before any
    stands_for: Scalar = leaf("s")  # work since it changed [s]


@dataclass(frozen=True)
class OilTemperature:
    """The oil's temperature at a sample."""

    used: Scalar  # [K]
    good: Flag  # whether the reported one is
    variance: Scalar  # that it gains since the sample before [K2]


def read_thermometer(
    state: ThermometerState, reported: Scalar, elapsed: Scalar, works: Scalar
) -> tuple[ThermometerState, OilTemperature]:
    """The oil's temperature at a sample.

    Args:
        reported: [K].
        elapsed: since the last sample that counted [s].
        works: how long of this the motor turned [s].
    """
    filtered = state.filtered
    possible = all_of(reported > TEMPERATURE_LOWEST, reported < TEMPERATURE_HIGHEST)
    patience = ca.fmax(2.0 * OIL_TIME_CONSTANT, ca.fmin(state.good_for, LAG_MOST))
    accepted = state.step_for > patience
    known = all_of(filtered > TEMPERATURE_LOWEST, negated(accepted))
    step = all_of(possible, all_of(known, ca.fabs(reported - filtered) > TEMPERATURE_STEP))
    good = all_of(possible, negated(step))
    share = ca.if_else(known, elapsed / (OIL_TIME_CONSTANT + elapsed), 1.0)
    held = ca.if_else(known, filtered, T40)
    used = ca.if_else(good, held + share * (reported - held), held)
    least_change, stands_for = _standing(state, reported, possible, works)
    after = ThermometerState(
        filtered=ca.if_else(any_of(known, good), used, 0.0),
        step_for=ca.if_else(step, state.step_for + elapsed, 0.0),
        good_for=ca.if_else(step, state.good_for, ca.if_else(known, state.good_for + elapsed, 0.0)),
        reported=ca.if_else(possible, reported, state.reported),
        least_change=least_change,
        stands_for=stands_for,
    )
    stuck = stands_for > THERMOMETER_STANDS * ca.fmax(least_change, THERMOMETER_STEP)
    variance = ca.if_else(any_of(stuck, negated(good)), UNKNOWN_WARMING**2 * elapsed, 0.0)
    return after, OilTemperature(used, good, variance)


def _standing(state: ThermometerState, reported: Scalar, possible: Flag, works: Scalar) -> tuple[Scalar, Scalar]:
    """The least change of the report so far [K], and how long the machine has worked since it changed [s]."""
    change = ca.fabs(reported - state.reported)
    changes = all_of(all_of(possible, state.reported > TEMPERATURE_LOWEST), change > 0.0)
    least = any_of(state.least_change <= 0.0, change < state.least_change)
    return (
        ca.if_else(all_of(changes, least), change, state.least_change),
        ca.if_else(changes, 0.0, state.stands_for + works),
    )
