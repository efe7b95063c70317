"""What a piston that is pressed on something shows of it: an end gives way by the oil alone.

While the motor pushes, the torque rises by what the oil is compressed. The rod of a cylinder that stands on its end
does not move, so that the rise is the one expected; what stops a piston anywhere else gives way, and the torque stays
behind.

    missing ~ N(0, noise^2 + rise^2 (s_C^2 + s_M^2))    on an end; s_C of the compliance, s_M of the model
    missing ~ U(0, rise), convolved with the noise        on an obstacle: anything between rigid and yielding

How the contact ends tells as much. A piston leaves an end by going back; through a load that only rose it goes on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of
from ramsight.sensor.thresholds import HELD_OBSTACLE, PASSED_END, TORQUE_LEAST, VOLUME_MODEL_STD


@dataclass(frozen=True, kw_only=True)
class PressState:
    """The strongest press of a piston that is held.

    Attributes:
        rise: largest rise of the torque that the compliance from before makes one expect while the motor pushed [N m].
        missing: what the reported torque stayed behind it then [N m].
        compliance: factor before the piston was held [1].
        compliance_std: standard deviation of it then [1].
    """

    rise: Scalar = leaf("N m")
    missing: Scalar = leaf("N m")
    compliance: Scalar = leaf("1", 1.0)
    compliance_std: Scalar = leaf("1")


@dataclass(frozen=True)
class Pushed:
    """The motor pushing against what holds the piston, at a sample.

    Attributes:
        held: whether the piston is held.
        pushing: whether the motor pushes.
        rise: change of the expected torque since it does [N m].
        missing: what the reported torque stays behind [N m].
        compliance: factor of the compliance that it is expected with [1].
        compliance_std: standard deviation of it [1].
    """

    held: Flag
    pushing: Flag
    rise: Scalar
    missing: Scalar
    compliance: Scalar
    compliance_std: Scalar


def follow_press(state: PressState, now: Pushed) -> PressState:
    """One sample.

    What the contact itself has taught of the compliance does not count: a soft obstacle teaches a soft oil.
    """
    before = ca.if_else(now.held, state.compliance, now.compliance)
    rise = now.rise * now.compliance / before
    missing = now.missing + rise - now.rise
    stronger = all_of(now.pushing, rise > state.rise)
    return PressState(
        rise=ca.if_else(now.held, ca.if_else(stronger, rise, state.rise), 0.0),
        missing=ca.if_else(now.held, ca.if_else(stronger, missing, state.missing), 0.0),
        compliance=before,
        compliance_std=ca.if_else(now.held, state.compliance_std, now.compliance_std),
    )


def odds_of_obstacle(press: PressState, noise: Scalar, went_on: Flag) -> Scalar:
    """By how much a contact that is over makes an obstacle likelier than an end, logarithm of the odds.

    Args:
        press: on it.
        noise: standard deviation of the torque [N m].
        went_on: whether the piston went on through it; else it went back.
    """
    model2 = (press.compliance_std / press.compliance) ** 2 + VOLUME_MODEL_STD**2
    variance = noise**2 + press.rise**2 * model2 + TORQUE_LEAST**2
    usual = ca.exp(-0.5 * press.missing**2 / variance) / ca.sqrt(2.0 * math.pi * variance)
    # Of an end that is taken for none the torque is whatever it is of an obstacle.
    other = 1.0 / ca.sqrt(press.rise**2 + 2.0 * math.pi * variance)
    on, back = other / (PASSED_END * (usual + other)), HELD_OBSTACLE * other / (usual + PASSED_END * other)
    return ca.log(ca.if_else(went_on, on, back))
