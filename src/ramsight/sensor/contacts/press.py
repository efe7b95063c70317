"""A press: what a piston that is held shows of what holds it, from its first sample to how it was left.

On an end the pressure rises at the rate of oil and structure until the relief valve opens, and the motor turns on at
the valve's setting while the piston stands. A load that rises, soil and stones seldom reach the setting, and none holds
it for long: with t the time at the setting,

    ln odds(end : no end) = ln(1/p) + t/T + ln N(x; end, s^2) S      p = 2 %, T = 0.1 s

p is the share of presses without an end that reach the setting, T how fast these pass. The last term is the place: how
much likelier the piston is at the end than anywhere in the stroke S; it is nothing where no position is known. The
press is *decided* once the odds of no end are below what is stated for false contacts. One that is released before is a
measurement as well, if it reached the setting where an end is likelier than anywhere else: the odds of no end that the
press has left are then in the density of something else (`chance_of_none`).

While the motor pushes, the torque rises by what the oil is compressed. On an end the rise is the one expected; what
stops a piston anywhere else gives way, and the torque stays behind.

    missing ~ N(0, noise^2 + rise^2 (s_C^2 + s_M^2))    on an end; s_C of the compliance, s_M of the model
    missing ~ U(0, rise), convolved with the noise        on an obstacle: anything between rigid and yielding

How the contact ends tells as much. A piston leaves an end by going back; through a load that only rose it goes on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, negated
from ramsight.sensor.circuit.load_step import LoadStep
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    END_HELD_TIME,
    FALSE_CONTACT,
    NO_END_HOLDS,
    OUTSIDE,
    TINY,
    USUAL_STDS,
    VOLUME_MODEL_STD,
)


@dataclass(frozen=True, kw_only=True)
class PressState:
    """The press of a piston that is held."""

    at_setting: Scalar = leaf("s")  # how long the motor has pushed at the relief valve's setting [s]
    decided: Flag = leaf("1")  # whether it is known to be on an end
    # rise: largest rise of the torque that the compliance from before makes one expect while the motor pushed [N m]
    rise: Scalar = leaf("N m")
    missing: Scalar = leaf("N m")  # what the reported torque stayed behind it then [N m]
    compliance: Scalar = leaf("1", 1.0)  # factor before the piston was held [1]
    compliance_std: Scalar = leaf("1")  # standard deviation of it then [1]


@dataclass(frozen=True)
class Pushed:
    """The motor pushing against what holds the piston, at a sample."""

    held: Flag  # whether the piston is held
    pushing: Flag  # whether the motor pushes
    at_setting: Flag  # whether the torque is that of the relief valve's setting
    rise: Scalar  # change of the expected torque since it does [N m]
    missing: Scalar  # what the reported torque stays behind [N m]
    elapsed: Scalar  # since the last sample [s]
    compliance: Scalar  # factor of the compliance that it is expected with [1]
    compliance_std: Scalar  # standard deviation of it [1]
    place: Scalar  # logarithm of how much likelier the piston is at the end than anywhere in the stroke


def at_setting(step: LoadStep, missing: Scalar, relief: Real, tolerance: Real) -> Flag:
    """Whether the torque is that of a relief valve's setting.

    Args:
        missing: what the reported torque stays behind the expected one [N m].
        relief: how likely oil passes a valve at the expected one, 0 to 1.
        tolerance: share of a pressure by which a valve may hold it lower than described [1].
    """
    noise = USUAL_STDS * step.torque.noise
    return all_of(relief > 0.0, missing < tolerance * ca.fabs(step.torque.expected) + noise)


def likelier_at_end(position: Scalar, std: Real, direction: Scalar, model: MachineModel) -> Scalar:
    """Logarithm of how much likelier a piston is at the end ahead than anywhere in the stroke.

    Args:
        position: [m].
        std: standard deviation of it [m].
        direction: in which it is stopped, +1 for extension.
    """
    stops = model.assumed.stops
    end = ca.if_else(direction > 0.0, model.stroke - stops.extended, stops.retracted)
    variance = std**2 + (stops.contact * model.stroke) ** 2
    density = 0.5 * ca.log(model.stroke**2 / (2.0 * math.pi * variance)) - 0.5 * (position - end) ** 2 / variance
    return ca.fmax(density, math.log(OUTSIDE))


def odds_of_end(held: Scalar, place: Real) -> Scalar:
    """Logarithm of the odds of an end.

    Args:
        held: how long the motor has pushed at the relief valve's setting [s].
    """
    return ca.if_else(held > 0.0, place - math.log(NO_END_HOLDS) + held / END_HELD_TIME, 0.0)


def chance_of_none(press: PressState) -> Scalar:
    """Odds of no end by the press alone: how likely a contact that it shows is of a load, soil or stones."""
    return ca.if_else(press.at_setting > 0.0, ca.exp(-odds_of_end(press.at_setting, 0.0)), 0.0)


def follow_press(state: PressState, now: Pushed) -> tuple[PressState, Flag]:
    """One sample, and whether the press is decided at it.

    What the contact itself has taught of the compliance does not count: a soft obstacle teaches a soft oil.
    """
    held = now.held
    before = ca.if_else(held, state.compliance, now.compliance)
    rise = now.rise * now.compliance / before
    missing = now.missing + rise - now.rise
    stronger = all_of(now.pushing, rise > state.rise)
    lasts = state.at_setting + ca.if_else(all_of(now.pushing, now.at_setting), now.elapsed, 0.0)
    surely = all_of(now.pushing, odds_of_end(lasts, now.place) > -math.log(FALSE_CONTACT))
    released = all_of(negated(now.pushing), lasts > 0.0, now.place > 0.0)
    decides = all_of(held, any_of(surely, released))
    after = PressState(
        at_setting=ca.if_else(held, lasts, 0.0),
        decided=all_of(held, any_of(state.decided, decides)),
        rise=ca.if_else(held, ca.if_else(stronger, rise, state.rise), 0.0),
        missing=ca.if_else(held, ca.if_else(stronger, missing, state.missing), 0.0),
        compliance=before,
        compliance_std=ca.if_else(held, state.compliance_std, now.compliance_std),
    )
    return after, decides


def odds_of_obstacle(press: PressState, noise: Scalar, went_on: Flag) -> Scalar:
    """By how much a contact that is over makes an obstacle likelier than an end, logarithm of the odds.

    Args:
        noise: standard deviation of the torque [N m].
    """
    model2 = (press.compliance_std / press.compliance) ** 2 + VOLUME_MODEL_STD**2
    variance = noise**2 + press.rise**2 * model2 + TINY**2
    usual = ca.exp(-0.5 * press.missing**2 / variance) / ca.sqrt(2.0 * math.pi * variance)
    # Of an end that is taken for none the torque is whatever it is of an obstacle.
    other = 1.0 / ca.sqrt(press.rise**2 + 2.0 * math.pi * variance)
    on, back = other / (OUTSIDE * (usual + other)), OUTSIDE * other / (usual + OUTSIDE * other)
    return ca.log(ca.if_else(went_on, on, back))
