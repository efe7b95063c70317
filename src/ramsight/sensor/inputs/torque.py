"""A reported torque corrected: by the motor's temperature, and by its zero, learned where the motor carries nothing.

A drive that makes its torque of a current which it measures has that sensor's zero in it, and the zero wanders from
day to day. Where that is declared (`assumptions.drive.zero`), reported = true + b with a random walk of b. A motor that
stands without current reports b alone: a measurement of b (Kalman, one state), with the variance

    R = noise^2 + t^2

where t is the torque that the pressures of the balance would take: friction may hold it, or the motor. A motor that
stands and carries something reports more than b can be. So a sample counts if

    |motor speed| < 10 rpm for half a second,   |reported - b| < 3 sqrt(P + noise^2)

with the variance P of b. What is used further on is reported - b, with P as a further variance.

Magnets lose remanence as they warm up, and the torque of a current with it: a drive that takes its torque constant for
one temperature reports too much above it. Where the temperature is declared,

    torque = reported torque (1 - c (theta - theta_0))

What is left of the gain's error, of that loss and of magnets that are not as warm as the sensor, is declared too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Scalar, all_of, scalar
from ramsight.machine.assumption_description import AssumedMotorTemperature
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.inputs.sample import MOTOR_TEMPERATURE, Raw, Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    KELVIN,
    MAGNETS_HOTTEST,
    MOTOR_TURNS,
    TEMPERATURE_LOWEST,
    USUAL_STDS,
    VALVE_SETTLED,
)


@dataclass(frozen=True, kw_only=True)
class MagnetState:
    """The magnets."""

    warmer: Scalar = leaf("K")  # than the temperature that the torque constant is for [K]


def gain_with_magnets(assumptions: Assumptions) -> Assumptions:
    """What is assumed with what a corrected torque may still be wrong by in its gain."""
    gain = math.hypot(assumptions.drive.torque_gain, assumptions.motor_temperature.std)
    drive = assumptions.drive.model_copy(update={"torque_gain": gain})
    return assumptions.model_copy(update={"drive": drive})


def correct_torque(state: MagnetState, raw: Raw, assumed: AssumedMotorTemperature) -> tuple[MagnetState, Raw]:
    """The sample with the corrected torque.

    A temperature that is missing or impossible is the last one; before the first one the torque is as reported.
    """
    reported = raw.measured[MOTOR_TEMPERATURE]
    possible = all_of(reported > TEMPERATURE_LOWEST, reported < MAGNETS_HOTTEST)
    warmer = ca.if_else(possible, reported - assumed.reference, state.warmer)
    used = ca.if_else(ca.fabs(warmer - state.warmer) >= KELVIN, warmer, state.warmer)
    torque = raw.motor_torque * (1.0 - assumed.loss * used)
    return MagnetState(warmer=used), replace(raw, motor_torque=torque)


@dataclass(frozen=True, kw_only=True)
class TorqueZeroState:
    """The zero."""

    zero: Scalar = leaf("N m")  # of the reported torque [N m]
    variance: Scalar = leaf("N2 m2", variance=True)  # of it [N2 m2]
    stood: Scalar = leaf("s")  # how long the motor has stood [s]

    @classmethod
    def initial(cls, std: float) -> TorqueZeroState | None:
        """Before the first sample; None where no zero is declared.

        Args:
            std: of the zero at power-up [N m].
        """
        return cls(variance=scalar(std**2)) if std > 0.0 else None


def correct_zero(
    state: TorqueZeroState, sample: Sample, expected: Scalar, model: MachineModel
) -> tuple[TorqueZeroState, Sample]:
    """What is known of the zero after a sample, and the sample without it.

    Args:
        expected: torque by the balance at the last sample [N m].
    """
    drive, noise = model.assumed.drive, model.torque_std**2
    stands = ca.fabs(sample.motor_speed) < MOTOR_TURNS
    stood = ca.if_else(stands, ca.fmin(state.stood + sample.elapsed, 2.0 * VALVE_SETTLED), 0.0)
    predicted = ca.fmin(state.variance + drive.zero_walk**2 * sample.elapsed, drive.zero**2)
    missed = sample.motor_torque - state.zero
    counts = all_of(stood > VALVE_SETTLED, missed**2 < USUAL_STDS**2 * (predicted + noise))
    gain = ca.if_else(counts, predicted / (predicted + noise + expected**2), 0.0)
    zero = state.zero + gain * missed
    after = TorqueZeroState(zero=zero, variance=(1.0 - gain) * predicted, stood=stood)
    corrected = replace(
        sample,
        motor_torque=sample.motor_torque - zero,
        last_torque=sample.last_torque - state.zero,
        offset_variance=after.variance,
    )
    return after, corrected
