"""The torque against the shaft's acceleration: a wrong sign shows whenever the motor speeds up or slows down.

What a load, a pump or a valve asks of the motor is unknown, but none of it follows the acceleration from one tenth of a
second to the next, and the inertia of motor and pumps does: where the acceleration steps, the torque steps by J times
that, up where it goes up. Both pass the same band-pass filter,

    y = F tau,      x = F J d omega/dt,      y ~ x,  and y ~ -x where the sign of either report is wrong

and the likelihoods of both are compared as long as the motor turns one way (at standstill friction steps, too): a
cumulative sum of -2 x y / s^2 that never falls below 0 (Page, 1954). A gain cannot be seen: what oil and moved mass
add to y is up to a third of x, and J itself is known no better.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of, within
from ramsight.plant.symbols import Parameters
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.checks.drive_check import DriveChecks
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    ALARM_EVIDENCE,
    GAP_PERIOD,
    HALF,
    INERTIA_MODEL_STD,
    MIXED_FRICTION_SPEED,
    SAMPLE,
    SHORTEST_STEP,
    USUAL_STDS,
)


@dataclass(frozen=True, kw_only=True)
class BandState:
    """A band-pass filter: the difference of two low-pass filters [N m]."""

    fast: Scalar = leaf("N m")
    slow: Scalar = leaf("N m")


@dataclass(frozen=True, kw_only=True)
class InertiaState:
    """Torque and acceleration."""

    ramp: Flag = leaf("1")  # whether the motor turned one way at the last sample
    expected: BandState = field(default_factory=BandState)  # filter of the torque that the acceleration asks for
    reported: BandState = field(default_factory=BandState)  # filter of the reported torque
    evidence: Scalar = leaf("1")  # cumulative sum of log-likelihood ratios
    alarm: Flag = leaf("1")  # whether it showed a wrong sign

    @classmethod
    def initial(cls, assumptions: Assumptions) -> InertiaState | None:
        """Before the first sample; None where the inertia is not declared."""
        return cls() if assumptions.inertia.std > 0.0 else None


def shaft_inertia(table: Parameters, inertia: float) -> Scalar:
    """Inertia of motor, belt and pumps at the motor shaft [kg m2], as a parameter."""
    found: Scalar = table.add("inertia", inertia)
    return found


def check_inertia(
    state: InertiaState, sample: Sample, checks: DriveChecks, inertia: Scalar, model: MachineModel
) -> tuple[InertiaState, DriveChecks]:
    """The checks with what ramps show of the signs.

    Args:
        inertia: at the motor shaft [kg m2].
    """
    h = ca.fmax(sample.elapsed, SHORTEST_STEP)
    ramp = _turns_one_way(sample)
    turns = all_of(state.ramp, ramp)
    asked = inertia * (sample.motor_speed - sample.last_speed) / h
    expected, x = _band(state.expected, asked, turns, h)
    reported, y = _band(state.reported, 0.5 * (sample.motor_torque + sample.last_torque), turns, h)
    noise = model.torque_std
    variance = noise**2 + (model.assumed.inertia.std**2 + INERTIA_MODEL_STD**2) * x**2
    shows = all_of(ca.fabs(x) > noise, ca.fabs(y) < USUAL_STDS * ca.fabs(x) + noise)
    ratio = within(-2.0 * x * y / variance, -ALARM_EVIDENCE / 3.0, ALARM_EVIDENCE / 3.0)
    # So that a corrected sign is cleared in as many steps as it took.
    most = (1.0 + HALF) * ALARM_EVIDENCE
    grown = within(state.evidence + ratio * sample.elapsed / GAP_PERIOD, 0.0, most)
    evidence = ca.if_else(all_of(turns, shows), grown, state.evidence)
    alarm = evidence > ca.if_else(state.alarm, HALF * ALARM_EVIDENCE, ALARM_EVIDENCE)
    after = InertiaState(ramp=ramp, expected=expected, reported=reported, evidence=evidence, alarm=alarm)
    more = {**checks.more, "sign_reversed": (evidence / ALARM_EVIDENCE, "1")}
    return after, replace(checks, sign_wrong=alarm, more=more, declared=True)


def _turns_one_way(sample: Sample) -> Flag:
    """Whether the motor turned one way during the sample, fast enough for steady friction."""
    w, last = sample.motor_speed, sample.last_speed
    one_way = all_of(ca.fmin(ca.fabs(w), ca.fabs(last)) > MIXED_FRICTION_SPEED, w * last > 0.0)
    follows = all_of(sample.elapsed > 0.0, sample.elapsed < GAP_PERIOD)
    return all_of(one_way, follows)


def _band(state: BandState, value: Scalar, turns: Flag, h: Scalar) -> tuple[BandState, Scalar]:
    """A value through the band-pass filter; it starts where the motor begins to turn."""
    fast, slow = (
        ca.if_else(turns, value + (before - value) * ca.exp(-h / constant), value)
        for before, constant in ((state.fast, 2.0 * SAMPLE), (state.slow, GAP_PERIOD))
    )
    return BandState(fast=fast, slow=slow), fast - slow
