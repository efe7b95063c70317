"""Input check: impossible values are replaced, unusable samples passed over, and both are named.

A sample without a usable speed or time leaves every state as it is, and the next good sample counts the time from the
last good one. Without a usable torque the last one is used. A torque that steps while the motor turns is confirmed by
the next sample before it is used: one wrong value would press oil over the relief valve of the simulated circuit, or
empty a chamber, and the simulated piston would not return. No fault changes the circuit's volume balance by more than
the elapsed time allows.

A period that changes while the motor turns is a clock that runs wrong, or another sender. If twice as many samples come
in a second by their clock, then either the drive sends twice as often, or its clock runs at half its speed and the
piston moves twice as far. The samples alone do not tell which, and the position becomes as uncertain as both are apart.
A period that stays is the new one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Flag, Real, Scalar, all_of, any_of, count, flag, negated, scalar
from ramsight.sensor.inputs.sample import (
    SHAFT_ANGLE,
    CounterState,
    Raw,
    Sample,
    commanded,
    first_commands,
    kept_commands,
    way_of,
)
from ramsight.sensor.inputs.thermometer import ThermometerState, read_thermometer
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.thresholds import (
    ALARM_EVIDENCE,
    BETWEEN_STD,
    BLIND_PRESSURE_SHARE,
    BRIDGED_GAP,
    GAP_PERIOD,
    HABIT_GAIN,
    HABIT_LEAST,
    HALF,
    LATE_IN_ORDER,
    LIKELY_STDS,
    LIMIT_SHARE,
    LONGEST_GAP,
    MEMORY_TIME,
    MIXED_FRICTION_SPEED,
    MOTOR_TURNS,
    NUMBER_LIMIT,
    RATE_LEARNT,
    RATE_LEARNT_MOST,
    RATE_MEMORY,
    REPEATS_LEARNT,
    RUNNING_SHARE,
    SAMPLE,
    SHORTEST_PERIOD,
    SHORTEST_STEP,
    SURE_STDS,
    TORQUE_STEP_SHARE,
    UNSEEN_SPEED_SHARE,
    USUAL_PERIOD,
)


@dataclass(frozen=True, kw_only=True)
class RateState:
    """How often samples come."""

    period: Scalar = leaf("s", always=True)  # between two samples while the motor turns [s]
    last: Scalar = leaf("s", always=True)  # the last one [s]
    # variance: of it, by the differences of successive ones, which another rate does not change [s2]
    variance: Scalar = leaf("s2", always=True)
    # learnt: samples that period and variance are the mean of, fewer with each that contradicts it
    learnt: Scalar = leaf("1", always=True)
    # apart: by how much the last samples were further apart than it says, all together [s]
    apart: Scalar = leaf("s", always=True)
    odd: Flag = leaf("1")  # whether that was too much at the last sample that counted


def check_rate(
    state: RateState, tick: Scalar, *, there: Flag, counts: Flag, speed: Scalar
) -> tuple[RateState, Flag, Scalar]:
    """What is known of the rate after a sample, whether it is another one, and a time that may have passed unseen [s].

    Args:
        tick: since the last sample of all, negative if this one is older [s].
        speed: of the motor [rad/s].
    """
    near = all_of(there, ca.fabs(tick) <= GAP_PERIOD)
    known = state.learnt >= RATE_LEARNT
    # What jitter adds up to, and a mean of so many samples is off by.
    counts_as = 0.5 * RATE_MEMORY + RATE_MEMORY**2 / ca.fmax(state.learnt, 1.0)
    spread = SURE_STDS * ca.sqrt(state.variance * counts_as)
    early, late = 2.0 * SAMPLE + state.period + spread, GAP_PERIOD + spread
    # Lost samples are usual. What is nearer to one period than to two counts for as much late as it does early.
    counts_for = ca.if_else(tick < 1.5 * state.period, late / early, 1.0)
    faded = (1.0 - 1.0 / RATE_MEMORY) * state.apart
    apart = ca.if_else(all_of(near, known), faded + counts_for * (tick - state.period), 0.0)
    share = ca.fabs(apart) / late
    odd = all_of(known, any_of(share > 1.0, all_of(state.odd, share > HALF)))
    unknown_for = ca.fmax(ca.fabs(apart) - ca.if_else(state.odd, late, 0.0), 0.0) / counts_for
    learns = all_of(near, ca.fabs(speed) > MOTOR_TURNS)
    differs = ca.if_else(state.learnt > 0.0, tick - state.last, 0.0)
    more = ca.fmin(state.learnt + 1.0, RATE_LEARNT_MOST)
    fewer = ca.if_else(state.learnt > RATE_LEARNT, state.learnt - 1.0, 0.0)
    after = RateState(
        period=state.period + ca.if_else(all_of(learns, negated(odd)), (tick - state.period) / more, 0.0),
        last=ca.if_else(learns, tick, state.last),
        variance=state.variance + ca.if_else(learns, (0.5 * differs**2 - state.variance) / more, 0.0),
        learnt=ca.if_else(learns, ca.if_else(odd, fewer, more), state.learnt),
        apart=ca.if_else(all_of(odd, counts), ca.fmax(ca.fmin(apart, late), -late), apart),
        odd=odd,
    )
    return after, odd, ca.if_else(odd, unknown_for, 0.0)


@dataclass(frozen=True, kw_only=True)
class TorqueState:
    """The torque of the last sample, and how often it changes."""

    value: Scalar = leaf("N m")  # that was used [N m]
    habit: Scalar = leaf("1")  # share of samples in which it changes
    repeats: Scalar = leaf("1")  # samples in a row in which it did not, while the motor turned
    waits: Flag = leaf("1")  # whether a step waits to be confirmed


@dataclass(frozen=True, kw_only=True)
class IntakeState:
    """The last sample that counted, and what is known of each input."""

    started: Flag = leaf("1")  # whether a sample counted
    time: Scalar = leaf("s", exact="time")  # of it [s]
    motor_speed: Scalar = leaf("rad/s")  # that was used [rad/s]
    torque: TorqueState = field(default_factory=TorqueState)  # of the motor
    thermometer: ThermometerState = field(default_factory=ThermometerState)  # of the oil
    commands: Mapping[str, Scalar] = leaf("1", None)  # of the commanded parts
    counter: CounterState | None = None  # of the shaft, where it is declared
    clock: Scalar = leaf("s", always=True, exact="time")  # time of the last sample of all [s]
    clocked: Flag = leaf("1", always=True)  # whether there was one
    # behind: samples in a row, in their order, that came before the last one that counted
    behind: Scalar = leaf("1", always=True)
    rate: RateState = field(default_factory=RateState)  # how often samples come

    @classmethod
    def initial(cls, commands: Sequence[str], measured: Sequence[str]) -> IntakeState:
        """Before the first sample."""
        counter = CounterState() if SHAFT_ANGLE in measured else None
        return cls(commands=first_commands(commands), counter=counter)


@dataclass(frozen=True)
class Intake:
    """What is wrong with a sample, and by how much the position has become less certain."""

    usable: Flag  # whether the sample counts at all
    passed_over: Flag  # whether every state stays as it is
    missing: Flag  # speed, torque or time is missing
    replaced: Flag  # the speed is missing, and the shaft's counter takes its place
    overspeed: Flag  # the speed is impossible
    overtorque: Flag  # the torque is impossible
    stuck: Flag  # the torque stands still
    frozen: Flag  # time does not advance
    gap: Flag  # samples are missing before this one, or come at another rate
    temperature_bad: Flag  # the temperature is missing or impossible
    passed: Scalar  # time since the last sample by the clock, 0 if it does not advance [s]
    drift: Scalar  # by how much the position's standard deviation grows [m]
    unseen: Scalar  # how far the piston may have moved since the last sample that counted [m]


@dataclass(frozen=True)
class _Clock:
    """The time of a sample."""

    number: Flag  # whether there is one
    raw: Scalar  # since the last sample that counted [s]
    back: Flag  # whether the clock was set back
    forward: Flag  # whether it advances, or this is the first sample
    jump: Flag  # whether the gap is too long to be integrated over
    counted: Flag  # whether the time since the last sample counts
    behind: Scalar  # samples in a row, in their order, that came before the last one that counted
    caught_up: Flag  # whether it has come again to where it was set back from


def check_inputs(state: IntakeState, raw: Raw, model: MachineModel) -> tuple[IntakeState, Sample, Intake]:
    """The sample with checked inputs, and what is wrong with it."""
    clock = _clock(state, raw)
    reported, replaced = _reported_speed(state, raw, clock, model)
    speed_ok = _inside(reported, LIMIT_SHARE * model.max_speed)
    usable = all_of(clock.number, speed_ok, any_of(clock.forward, clock.back))
    elapsed = ca.if_else(all_of(usable, clock.counted), clock.raw, 0.0)
    tick, stands = _ticks(state, raw, clock)
    passed = ca.fmax(tick, 0.0)
    # A sample that follows the last one too closely adds nothing.
    too_close = all_of(clock.counted, clock.raw < SHORTEST_PERIOD, negated(raw.referenced))
    passed_over = any_of(negated(usable), too_close)
    timed = all_of(clock.number, state.clocked, negated(clock.back))
    rate, odd, unknown_for = check_rate(state.rate, tick, there=timed, counts=negated(passed_over), speed=reported)
    torque_state, torque_ok, stuck = _torque(state, raw, reported, model)
    works = ca.if_else(ca.fabs(reported) > MIXED_FRICTION_SPEED, elapsed, 0.0)
    thermometer, temperature = read_thermometer(state.thermometer, raw.oil_temperature, elapsed, works)
    no_number = negated(all_of(_inside(reported, NUMBER_LIMIT), _inside(raw.motor_torque, NUMBER_LIMIT)))
    speed = ca.if_else(speed_ok, reported, state.motor_speed)
    last_speed = ca.if_else(clock.counted, state.motor_speed, speed)
    commands = commanded(raw.commands, state.commands)
    sample = Sample(
        started=state.started,
        elapsed=elapsed,
        motor_speed=speed,
        last_speed=last_speed,
        mean_speed=0.5 * (last_speed + speed),
        motor_torque=torque_state.value,
        last_torque=state.torque.value,
        oil_temperature=temperature.used,
        temperature_variance=temperature.variance,
        reference=raw.reference,
        referenced=raw.referenced,
        commands=commands,
        way=way_of(list(commands.values())),
        last_way=way_of(list(state.commands.values())),
        measured=raw.measured,
        counter=state.counter,
    )
    after = IntakeState(
        started=flag(True),
        time=raw.time,
        motor_speed=speed,
        torque=torque_state,
        thermometer=thermometer,
        commands=kept_commands(commands),
        counter=_counted(state.counter, raw),
        clock=ca.if_else(clock.number, raw.time, state.clock),
        clocked=any_of(state.clocked, clock.number),
        behind=clock.behind,
        rate=rate,
    )
    blind_velocity = BLIND_PRESSURE_SHARE * model.leak_velocity
    blind = ca.if_else(any_of(stuck, negated(torque_ok)), blind_velocity * elapsed, 0.0)
    drift, unseen = _unseen_angles(state, speed, elapsed, clock, passed, model)
    drift += 0.5 * (ca.fabs(last_speed) + ca.fabs(speed)) * unknown_for
    found = Intake(
        usable=usable,
        passed_over=passed_over,
        missing=any_of(negated(clock.number), no_number),
        replaced=replaced,
        overspeed=negated(speed_ok),
        overtorque=negated(torque_ok),
        stuck=stuck,
        frozen=all_of(state.started, any_of(clock.raw <= 0.0, stands)),
        gap=all_of(state.started, any_of(clock.raw > GAP_PERIOD, clock.back, clock.caught_up, odd)),
        temperature_bad=negated(temperature.good),
        passed=passed,
        drift=ca.if_else(usable, model.travel_per_radian * drift + blind, 0.0),
        unseen=ca.if_else(usable, 0.0, model.travel_per_radian * unseen),
    )
    return after, sample, found


def _inside(value: Scalar, limit: Real) -> Flag:
    """Whether a value is a number and within limits; a comparison with not-a-number is false."""
    return all_of(value > -limit, value < limit)


def _clock(state: IntakeState, raw: Raw) -> _Clock:
    """The sample's time against that of the last one that counted."""
    number = _inside(raw.time, NUMBER_LIMIT)
    since = ca.if_else(number, raw.time - state.time, 0.0)
    # A bus may bring a sample late; more of them in their order are those of a clock that was set.
    late = all_of(all_of(state.started, number), all_of(since <= 0.0, raw.time > state.clock))
    behind = ca.if_else(late, state.behind + 1.0, 0.0)
    back = all_of(state.started, any_of(since < -MEMORY_TIME, behind > LATE_IN_ORDER))
    forward = any_of(negated(state.started), since > 0.0)
    jump = any_of(since > BRIDGED_GAP, back)
    counted = all_of(state.started, negated(any_of(jump, since <= 0.0)))
    caught_up = all_of(forward, state.behind > 0.0)
    return _Clock(number, since, back, forward, jump, counted, ca.if_else(back, 0.0, behind), caught_up)


def _ticks(state: IntakeState, raw: Raw, now: _Clock) -> tuple[Scalar, Flag]:
    """Time since the last sample of all, negative where the clock goes back [s], and whether the clock stands.

    Against the last sample of all: one that came too soon is passed over, and the clock may stand from there on.
    """
    both = all_of(now.number, state.clocked)
    tick = ca.if_else(both, raw.time - state.clock, 0.0)
    return tick, all_of(both, tick <= 0.0)


def _counted(counter: CounterState | None, raw: Raw) -> CounterState | None:
    """The shaft's counter after a sample, where it is declared."""
    if counter is None:
        return None
    angle = raw.measured[SHAFT_ANGLE]
    there = ca.fabs(angle) < NUMBER_LIMIT
    return CounterState(angle=ca.if_else(there, angle, counter.angle), begun=there)


def _reported_speed(state: IntakeState, raw: Raw, clock: _Clock, model: MachineModel) -> tuple[Scalar, Flag]:
    """The motor's speed [rad/s], by the shaft's counter where none is reported; and whether that is so."""
    if state.counter is None:
        return raw.motor_speed, flag(False)
    by_counter = (raw.measured[SHAFT_ANGLE] - state.counter.angle) / ca.fmax(clock.raw, SHORTEST_STEP)
    known = all_of(all_of(state.counter.begun, clock.counted), _inside(by_counter, model.max_speed))
    replaced = all_of(known, negated(_inside(raw.motor_speed, NUMBER_LIMIT)))
    return ca.if_else(replaced, by_counter, raw.motor_speed), replaced


def _torque(state: IntakeState, raw: Raw, speed: Scalar, model: MachineModel) -> tuple[TorqueState, Flag, Flag]:
    """The torque that is used, whether the reported one is possible, and whether it stands still."""
    torque, last = raw.motor_torque, state.torque
    possible = all_of(_inside(torque, LIMIT_SHARE * model.largest_torque), negated(_pulls(raw, speed, model)))
    changed = torque != last.value
    turning = ca.fabs(speed) > MIXED_FRICTION_SPEED
    learnt = last.habit + HABIT_GAIN * (count(changed) - last.habit)
    habit = ca.if_else(last.repeats > REPEATS_LEARNT, last.habit, learnt)
    repeats = ca.if_else(all_of(turning, negated(changed)), last.repeats + 1.0, 0.0)
    stuck = all_of(habit > HABIT_LEAST, repeats * habit > ALARM_EVIDENCE)
    running = all_of(ca.fabs(state.motor_speed) > RUNNING_SHARE * model.max_speed, state.motor_speed * speed > 0.0)
    steps = ca.fabs(torque - last.value) > TORQUE_STEP_SHARE * model.relief_torque
    waits = all_of(all_of(state.started, negated(last.waits)), all_of(running, steps))
    used = ca.if_else(all_of(possible, negated(waits)), torque, last.value)
    return TorqueState(value=used, habit=habit, repeats=repeats, waits=waits), possible, stuck


def _pulls(raw: Raw, speed: Scalar, model: MachineModel) -> Flag:
    """Whether a motor that drives one way only reports at standstill that it drives the other way.

    It cannot. A current's sensor that has lost its supply reads that.
    """
    if not raw.commands:
        return flag(False)
    least = -LIKELY_STDS * ca.sqrt(model.torque_std**2 + model.assumed.drive.zero**2)
    return all_of(ca.fabs(speed) < MOTOR_TURNS, raw.motor_torque < least)


def _unseen_angles(
    state: IntakeState, speed: Scalar, elapsed: Scalar, clock: _Clock, passed: Scalar, model: MachineModel
) -> tuple[Scalar, Scalar]:
    """Angles that the shaft may have turned unseen [rad]: in a gap before the sample; since the last that counted."""
    speeds = ca.fabs(state.motor_speed) + ca.fabs(speed)
    nudge = UNSEEN_SPEED_SHARE * model.max_speed
    gap_for = ca.if_else(state.started, ca.if_else(clock.back, scalar(BRIDGED_GAP), clock.raw), 0.0)
    not_counted = ca.if_else(clock.jump, (0.5 * speeds + nudge) * ca.fmin(gap_for, LONGEST_GAP), 0.0)
    # The trapezoid against either end: half the mean of both speeds.
    bridged = (0.5 * BETWEEN_STD * speeds + nudge) * ca.fmax(elapsed - USUAL_PERIOD, 0.0)
    # A clock that has caught up with what it was set back by: that long the shaft turned unseen.
    caught_up = ca.if_else(clock.caught_up, 0.5 * speeds * (state.behind + 1.0) * passed, 0.0)
    unseen = (ca.fabs(state.motor_speed) + nudge) * ca.fmax(clock.raw, 0.0)
    return not_counted + bridged + caught_up, unseen
