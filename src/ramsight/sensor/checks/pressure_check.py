"""The torque against measured pressures: what the pump needs for them.

    sum (torque - torque of the pump under the measured pressures) h ~ 0

within noise, delay, the torque's gain and the errors of pumps and pressure sensors (`disagreement`). Which of them is
wrong it does not show.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Scalar, all_of, any_of, count, negated
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.checks.disagreement import OnsetState, Sums, compared, growth_from_onset, leaky_sum
from ramsight.sensor.checks.drive_check import DriveChecks, wrong_leakage
from ramsight.sensor.circuit.pressures import measured_pressures
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import EFFICIENCY_STD, TORQUE_ERROR_TIME


@dataclass(frozen=True, kw_only=True)
class PressureCheckState:
    """Torque and pressures."""

    difference: Sums = field(default_factory=Sums)  # of the torque and what the pressures ask for
    shown: Scalar = leaf("s")  # time for which the pressures showed a torque lately [s]
    # onset: growth of the position's standard deviation while they contradict it
    onset: OnsetState = field(default_factory=OnsetState)

    @classmethod
    def initial(cls, assumptions: Assumptions) -> PressureCheckState | None:
        """Before the first sample; None where no pressures are measured."""
        return cls() if measured_pressures(assumptions) else None


def check_pressures(
    state: PressureCheckState,
    sample: Sample,
    checks: DriveChecks,
    over: Scalar,
    over_std: Scalar,
    model: MachineModel,
) -> tuple[PressureCheckState, DriveChecks]:
    """The checks with what pressures show of the torque.

    Args:
        over: reported torque beyond what the pressures ask for [N m], 0 where they show none.
        over_std: standard deviation of that by theirs [N m], 0 there.
    """
    drive = model.assumed.drive
    shown = over_std > 0.0
    gain = math.hypot(drive.torque_gain, EFFICIENCY_STD) * ca.fabs(sample.motor_torque)
    noise = model.torque_std
    sums, found = compared(
        state.difference,
        sample,
        over,
        level=sample.motor_torque,
        delay=drive.delay + model.assumed.pressure.lag,
        lasting=ca.if_else(shown, ca.sqrt(gain**2 + over_std**2 + noise**2), 0.0),
        noise=ca.sqrt(noise**2 + over_std**2),
    )
    turned = leaky_sum(state.shown, count(shown), sample.elapsed)
    by = ca.if_else(turned > TORQUE_ERROR_TIME, found.by / ca.fmax(turned, TORQUE_ERROR_TIME), 0.0)
    alarm = all_of(found.alarm, negated(checks.undecided))
    wrong = ca.fmin(ca.fabs(by), model.relief_torque)
    onset, grows = growth_from_onset(state.onset, alarm, wrong_leakage(wrong, sample, model), sample.elapsed)
    found_checks = replace(
        checks,
        torque_wrong=any_of(checks.torque_wrong, alarm),
        grows=checks.grows + grows,
        torque_off=ca.fmax(checks.torque_off, ca.if_else(alarm, wrong, 0.0)),
        more={**checks.more, "torque_over_pressures": (by, "N m")},
        declared=True,
    )
    return PressureCheckState(difference=sums, shown=turned, onset=onset), found_checks
