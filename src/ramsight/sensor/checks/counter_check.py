"""The motor's speed against the counter of its shaft, and which of them is used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Scalar, all_of, any_of, count, flag, negated, scalar
from ramsight.sensor.checks.diagnosis import DiagnosisState, Pair, diagnose
from ramsight.sensor.checks.disagreement import Disagreement, Sums, compared, leaky_sum, sure
from ramsight.sensor.inputs.sample import SHAFT_ANGLE, CounterState, Sample
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    JUMPS_MOST,
    LIMIT_SHARE,
    MEASURABLE_LIMIT,
    MEMORY_TIME,
    MIXED_FRICTION_SPEED,
    SHORTEST_STEP,
    TURNED_LEAST,
)


@dataclass(frozen=True, kw_only=True)
class CounterCheckState:
    """Speed and counter."""

    jumps: Scalar = leaf("1")  # of the counter lately
    counted: Scalar = leaf("rad")  # angle by the counter lately [rad]
    reported: Scalar = leaf("rad")  # angle by the reported speed lately [rad]
    difference: Sums = field(default_factory=Sums)  # of both
    speed_was_wrong: Flag = leaf("1")  # whether the reported speed was at the last sample
    used_speed: Scalar = leaf("rad/s")  # that was used then [rad/s]
    uncertain: Flag = leaf("1")  # whether the counter that was used may have been wrong then
    diagnosis: DiagnosisState = field(default_factory=DiagnosisState)  # of the reported speed


@dataclass(frozen=True)
class Counting:
    """The counter at a sample."""

    jumps: Scalar  # of it lately
    wild: Flag  # whether it jumps again and again, and so counts nothing
    speed: Scalar  # mean over the sample by it [rad/s]
    counted: Scalar  # angle by it lately [rad]
    reported: Scalar  # angle by the reported speed lately [rad]

    @property
    def ratio(self) -> Scalar:
        """Reported speed over the counter's, lately."""
        return ca.if_else(self.counted > TURNED_LEAST, self.reported / ca.fmax(self.counted, TURNED_LEAST), 1.0)


@dataclass(frozen=True)
class CounterCheck:
    """What speed and counter show of each other."""

    speed: Scalar  # of the shaft, mean over the sample, by the counter where there is one [rad/s]
    speed_wrong: Flag  # whether the reported speed is wrong
    counter_wrong: Flag  # whether the counter is
    undecided: Flag  # whether one of them is, and which is unknown
    grows: Scalar  # by how much the position's standard deviation grows [m]
    more: Mapping[str, tuple[Scalar, str]]  # outputs with their units

    @classmethod
    def none(cls, speed: Scalar) -> CounterCheck:
        """Without a counter."""
        return cls(speed, flag(False), flag(False), flag(False), scalar(0.0), {})


def read_counter(state: CounterCheckState, sample: Sample, model: MachineModel) -> Counting:
    """The counter at a sample of a machine that declares one."""
    angle, before = sample.measured[SHAFT_ANGLE], _before(sample)
    h = sample.elapsed
    turned = (angle - before.angle) / ca.fmax(h, SHORTEST_STEP)
    goes_on = all_of(all_of(ca.fabs(angle) < MEASURABLE_LIMIT, before.begun), h > 0.0)
    # A counter that overflows or is reset jumps once; one that jumps again and again counts nothing.
    jumped = all_of(goes_on, ca.fabs(turned) > LIMIT_SHARE * model.max_speed)
    jumps = ca.exp(-h / MEMORY_TIME) * state.jumps + count(jumped)
    speed = ca.if_else(all_of(goes_on, negated(jumped)), turned, sample.mean_speed)
    return Counting(
        jumps=jumps,
        wild=jumps > JUMPS_MOST,
        speed=speed,
        counted=leaky_sum(state.counted, ca.fabs(speed), h),
        reported=leaky_sum(state.reported, ca.fabs(sample.mean_speed), h),
    )


def _before(sample: Sample) -> CounterState:
    if sample.counter is None:
        raise ValueError("the machine declares no counter")
    return sample.counter


def judge_counter(
    state: CounterCheckState,
    sample: Sample,
    counting: Counting,
    by_power: tuple[Flag, Flag] | None,
    model: MachineModel,
) -> tuple[CounterCheckState, Sample, CounterCheck]:
    """Whether speed and counter are apart, which of them is wrong by the power, and the sample with the right one.

    Args:
        by_power: whether the power contradicts the torque at the reported speed, and at the counter's; None without.
    """
    shaft, drive = model.assumed.shaft, model.assumed.drive
    off = sample.mean_speed - counting.speed
    sums, found = compared(
        state.difference,
        sample,
        off,
        level=sample.mean_speed,
        delay=drive.delay,
        lasting=shaft.speed / sure(MEMORY_TIME),  # what is declared is the most
        noise=shaft.std / ca.fmax(sample.elapsed, SHORTEST_STEP),
    )
    speed_wrong, counter_wrong = _which(found, counting, by_power)
    undecided = all_of(found.alarm, negated(any_of(speed_wrong, counter_wrong)))
    used = _used(state, sample, counting, counter_wrong, any_of(speed_wrong, undecided))
    uncertain = any_of(counter_wrong, undecided)
    now = ca.if_else(undecided, ca.fabs(off) * sample.elapsed, 0.0)
    turned = ca.if_else(uncertain, ca.if_else(state.uncertain, now, ca.fabs(found.by)), 0.0)
    pair = _pair(sample, counting, model)
    diagnosis, more = diagnose(state.diagnosis, sample, pair, found.alarm, speed_wrong, counter_wrong)
    after = CounterCheckState(
        jumps=counting.jumps,
        counted=counting.counted,
        reported=counting.reported,
        difference=sums,
        speed_was_wrong=any_of(speed_wrong, undecided),
        used_speed=used.motor_speed,
        uncertain=uncertain,
        diagnosis=diagnosis,
    )
    check = CounterCheck(
        speed=counting.speed,
        speed_wrong=speed_wrong,
        counter_wrong=counter_wrong,
        undecided=undecided,
        grows=turned * model.travel_per_radian,
        more={"speed_over_counter": (counting.ratio, "1"), **more},
    )
    return after, used, check


def _which(found: Disagreement, counting: Counting, by_power: tuple[Flag, Flag] | None) -> tuple[Flag, Flag]:
    """Whether the speed is wrong, and whether the counter is."""
    if by_power is None:
        return flag(False), counting.wild
    reported, counted = by_power
    speed = all_of(found.alarm, all_of(reported, negated(counted)))
    counter = all_of(found.alarm, all_of(counted, negated(reported)))
    return speed, any_of(counter, counting.wild)


def _used(
    state: CounterCheckState, sample: Sample, counting: Counting, counter_wrong: Flag, speed_wrong: Flag
) -> Sample:
    """The sample with the counter's mean speed, and its speed where the reported one may be wrong."""
    return sample.with_speed(
        ca.if_else(counter_wrong, sample.mean_speed, counting.speed),
        ca.if_else(speed_wrong, counting.speed, sample.motor_speed),
        ca.if_else(state.speed_was_wrong, state.used_speed, sample.last_speed),
    )


def _pair(sample: Sample, counting: Counting, model: MachineModel) -> Pair:
    """The reported speed and the counter's [rad/s]."""
    shaft, h = model.assumed.shaft, ca.fmax(sample.elapsed, SHORTEST_STEP)
    return Pair(
        name="speed",
        unit="rad/s",
        reported=sample.mean_speed,
        other=counting.speed,
        std=ca.sqrt((shaft.std / h) ** 2 + shaft.speed**2),
        delay=model.assumed.drive.delay,
        there=sample.elapsed > 0.0,
        most=model.max_speed,
        least=MIXED_FRICTION_SPEED,
    )
