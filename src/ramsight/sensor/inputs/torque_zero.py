"""The zero of a reported torque, learned where the motor carries nothing.

A drive that makes its torque of a current which it measures has that sensor's zero in it, and the zero wanders from
day to day. Where that is declared (`assumptions.drive.zero`), reported = true + b with a random walk of b. A motor that
stands without current reports b alone: a measurement of b (Kalman, one state), with the variance

    R = noise^2 + t^2

where t is the torque that the pressures of the balance would take: friction may hold it, or the motor. A motor that
stands and carries something reports more than b can be. So a sample counts if

    |motor speed| < 10 rpm for half a second,   |reported - b| < 3 sqrt(P + noise^2)

with the variance P of b. What is used further on is reported - b, with P as a further variance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Scalar, all_of, scalar
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import MOTOR_TURNS, USUAL_STDS, VALVE_SETTLED


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
