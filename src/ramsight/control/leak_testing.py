"""A leak test: a steady speed against the closed valve, at which the pump's pressure stays below the load's."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.control.activity import Event
from ramsight.control.decision import Sample, Wish
from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of


@dataclass(frozen=True)
class LeakTest:
    """State of a leak test: its motor speed, and the time since it began."""

    speed: Scalar = leaf("rad/s")
    time: Scalar = leaf("s")


def leak_tested(state: LeakTest, now: Sample, when: Flag, begins: Flag) -> tuple[LeakTest, Wish]:
    """Turn until the time is over.

    Args:
        state: before the sample.
        now: the sample.
        when: whether there is a leak test.
        begins: whether this is its first sample, whose load gives the speed.
    """
    by, first = now.by, all_of(when, begins)
    share = by.unit.lift_sign * by.tuning.leak_test_share(by.unit)
    speed = ca.if_else(first, share * by.leakage(now.sensed.load), state.speed)
    time = ca.if_else(when, ca.if_else(first, 0.0, state.time) + by.period, state.time)
    over = all_of(when, time > by.tuning.leak_test_time)
    return LeakTest(speed, time), Wish(ca.if_else(over, 0.0, speed), {Event.OVER: over})
