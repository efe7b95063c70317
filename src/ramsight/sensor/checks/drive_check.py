"""What a drive reports held against itself: speed against the shaft's counter, torque and speed against its power.

A sensor counts how far the shaft has turned, and nothing in torque and temperature shows that it turned otherwise. The
drive's counter of the shaft does; and power is torque times speed plus losses:

    sum (speed - d angle/dt) h ~ 0,      sum (power - torque speed - losses) h ~ 0

each within what noise, delays and declared uncertainties allow (`disagreement`). Where both are declared, the power
also shows whether speed or counter is wrong: the one with which torque and power agree is right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.expression import Flag, Scalar, all_of, any_of, flag, negated, scalar
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.checks.counter_check import CounterCheck, CounterCheckState, Counting, judge_counter, read_counter
from ramsight.sensor.checks.diagnosis import diagnose
from ramsight.sensor.checks.disagreement import Disagreement, Sums, growth_from_onset
from ramsight.sensor.checks.power_check import PowerReading, PowerState
from ramsight.sensor.inputs.sample import DC_POWER, SHAFT_ANGLE, Sample, declared_inputs
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import MEASURABLE_LIMIT

Outputs = Mapping[str, tuple[Scalar, str]]
"""Expressions by the names of outputs, with their units."""


@dataclass(frozen=True, kw_only=True)
class DriveState:
    """Reports that are held against each other."""

    counter: CounterCheckState | None = None  # the shaft's, where it is declared
    power: PowerState | None = None  # of the DC link, where it is declared

    @classmethod
    def initial(cls, assumptions: Assumptions) -> DriveState | None:
        """Before the first sample; None where neither counter nor power is declared."""
        declared = declared_inputs(assumptions)
        if not declared:
            return None
        both = SHAFT_ANGLE in declared
        return cls(
            counter=CounterCheckState() if both else None,
            power=PowerState.initial(assumptions, with_counter=both) if DC_POWER in declared else None,
        )


@dataclass(frozen=True)
class DriveChecks:
    """What contradictions within the drive's report show."""

    # speed_wrong: the speed contradicts counter and power; the counter has been used
    speed_wrong: Flag = field(default_factory=lambda: flag(False))
    # counter_wrong: the counter contradicts speed and power; the speed has been used
    counter_wrong: Flag = field(default_factory=lambda: flag(False))
    # undecided: speed and counter contradict each other, and which is right is unknown
    undecided: Flag = field(default_factory=lambda: flag(False))
    torque_wrong: Flag = field(default_factory=lambda: flag(False))  # torque and power contradict each other
    # sign_wrong: the sign of torque or speed contradicts the shaft's inertia
    sign_wrong: Flag = field(default_factory=lambda: flag(False))
    # grows: by how much the position's standard deviation grows as a whole for it [m]
    grows: Scalar = field(default_factory=lambda: scalar(0.0))
    # torque_off: how much the torque may be off while it is contradicted [N m], else 0
    torque_off: Scalar = field(default_factory=lambda: scalar(0.0))
    more: Outputs = field(default_factory=dict)  # outputs with their units
    declared: bool = False  # whether anything is held against anything

    @property
    def contradicted(self) -> Flag:
        """Whether an input may be wrong that the sensor needs."""
        return any_of(any_of(self.undecided, self.torque_wrong), self.sign_wrong)

    def unless_contradicted(self, condition: Flag) -> Flag:
        """A condition, where no input contradicts another."""
        return all_of(condition, negated(self.contradicted)) if self.declared else condition


def check_drive(
    state: DriveState | None, sample: Sample, model: MachineModel
) -> tuple[DriveState | None, Sample, DriveChecks]:
    """The sample with the counter's speed in the place of the reported one, unless the counter is wrong; the checks.

    Args:
        state: before the sample; None where neither counter nor power is declared.
    """
    if state is None:
        return None, sample, DriveChecks()
    counting = None if state.counter is None else read_counter(state.counter, sample, model)
    power = None if state.power is None else _powers(state.power, sample, counting, model)
    used, counter, counter_state = sample, CounterCheck.none(sample.mean_speed), None
    if state.counter is not None and counting is not None:
        by_power = None if power is None else (power.reported.alarm, power.counted.alarm)
        counter_state, used, counter = judge_counter(state.counter, sample, counting, by_power, model)
    checks = DriveChecks(
        speed_wrong=counter.speed_wrong,
        counter_wrong=counter.counter_wrong,
        undecided=counter.undecided,
        grows=counter.grows,
        more=counter.more,
        declared=True,
    )
    if power is None:
        return DriveState(counter=counter_state), used, checks
    power_state, checks = _check_torque(power, used, counter, checks, model)
    return DriveState(counter=counter_state, power=power_state), used, checks


@dataclass(frozen=True)
class _Powers:
    """The power against the torque, at the reported speed and at the counter's."""

    reading: PowerReading  # of the power
    reported_sums: Sums  # at the reported speed, after the sample
    reported: Disagreement  # what they show
    counted_sums: Sums | None  # at the counter's speed, where there is one
    counted: Disagreement  # what they show; without a counter as at the reported speed


def _powers(state: PowerState, sample: Sample, counting: Counting | None, model: MachineModel) -> _Powers:
    reading = PowerReading.of(state, sample, model)
    sums, reported = reading.against(state.by_reported, sample.mean_speed, sample.motor_speed)
    if counting is None or state.by_counter is None:
        return _Powers(reading, sums, reported, None, reported)
    counted_sums, counted = reading.against(state.by_counter, counting.speed, counting.speed)
    return _Powers(reading, sums, reported, counted_sums, counted)


def _check_torque(
    power: _Powers, sample: Sample, counter: CounterCheck, checks: DriveChecks, model: MachineModel
) -> tuple[PowerState, DriveChecks]:
    """Whether the torque is wrong by the power, and the power's state after the sample."""
    reading, state = power.reading, power.reading.state
    off, covariance = reading.learned(counter.speed, power.counted)
    # While speed and counter are disputed the power shows which of them is right, and nothing of the torque.
    alarm = ca.if_else(counter.counter_wrong, power.reported.alarm, power.counted.alarm)
    wrong = all_of(alarm, negated(counter.undecided))
    by = ca.if_else(counter.counter_wrong, power.reported.by, power.counted.by)
    torque_off = reading.torque_off(by)
    rate = wrong_leakage(torque_off, sample, model)
    onset, grows = growth_from_onset(state.torque_onset, wrong, rate, sample.elapsed)
    diagnosis, more = diagnose(state.diagnosis, sample, reading.pair(counter.speed, covariance), wrong)
    reported = reading.reported
    there = ca.fabs(reported) < MEASURABLE_LIMIT
    after = PowerState(
        last=ca.if_else(there, reported, state.last),
        begun=there,
        turned=reading.turned,
        by_reported=power.reported_sums,
        by_counter=power.counted_sums,
        off=off,
        covariance=covariance,
        torque_onset=onset,
        diagnosis=diagnosis,
    )
    found = replace(
        checks,
        torque_wrong=wrong,
        grows=checks.grows + grows,
        torque_off=ca.if_else(wrong, torque_off, 0.0),
        more={**checks.more, "torque_missing": (reading.signed(by), "N m"), **more},
    )
    return after, found


def wrong_leakage(torque_off: Scalar, sample: Sample, model: MachineModel) -> Scalar:
    """Velocity by which leakage is wrong under a torque that is off by so much [N m], in [m/s]."""
    return model.leak_velocity * model.thinner(sample.pump_temperature) * torque_off / model.relief_torque
