"""A cylinder that is steered by hand: a velocity in place of a target, with the same limits."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.control.decision import Sample
from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, negated


@dataclass(frozen=True)
class Steering:
    """State: the velocity until now."""

    velocity: Scalar = leaf("m/s")


def steered(state: Steering, now: Sample, when: Flag) -> tuple[Steering, Flag, Scalar]:
    """The velocity that is asked for, within the limits.

    Without a position that may be relied on the rod goes as slowly as in homing, and the places of the stops are
    unknown.

    Args:
        state: before the sample.
        now: the sample.
        when: whether the cylinder is steered.

    Returns:
        The state, whether the rod goes, and the motor speed for that [rad/s].
    """
    by, load, none = now.by, now.sensed.load, now.reliance.none
    share = ca.if_else(none, by.tuning.homing_share, ca.if_else(now.reliance.full, 1.0, by.tuning.slowed))
    fastest = ca.fmin(share * by.limits.speed, by.reachable_velocity(load))
    wanted, position = now.inputs.steering, now.sensed.position
    velocity = by.steered_velocity(state.velocity, wanted, position, fastest, negated(none))
    direction = ca.if_else(velocity > 0.0, 1.0, -1.0)
    margin = by.force_margin(direction, load)
    velocity = ca.if_else(margin == 0.0, 0.0, velocity)
    speed = by.driving_speed(margin * abs(velocity), direction, load)
    return Steering(ca.if_else(when, velocity, state.velocity)), velocity != 0.0, speed
