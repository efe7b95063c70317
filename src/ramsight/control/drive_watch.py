"""Whether a drive follows its commands: what it reports against what the declared drive would report.

The declared drive follows the same commands in a model. Its speed may come at any time up to the declared delays, so
a report has to lie between the least and the greatest of what commands and model had in that time, plus and minus the
declared deviation and noise. A servo yields to a load that changes: by (T - z)/k_p, where z, its integral, is the
torque T behind a low pass of k_p/k_i, so that its own torque shows by how much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from statistics import NormalDist

import casadi as ca

from ramsight.control import repeats as speed_repeats
from ramsight.control import thresholds
from ramsight.control.declared_drive import DeclaredDrive, followed_by, standing
from ramsight.control.repeats import SpeedRepeats, repeats_in_a_row, runs, runs_of, upper_share
from ramsight.duty.drive_response import DriveResponse
from ramsight.engine.typed_state import chosen, leaf
from ramsight.expression import Condition, Flag, Real, Scalar, all_of, any_of, count, flag, negated, scalar
from ramsight.plant.drive import ServoDrive
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit


class Verdict(Enum):
    """What a drive does with its commands; the text is the control's reason."""

    OBEYS = ""
    SLOW = "the drive follows more slowly than declared"
    AT_LIMIT = "the drive is at its torque limit"
    STALLED = "the drive is stalled at its torque limit"
    DISOBEYS = "the motor does not turn as commanded"
    STUCK = "the reported motor speed is stuck"
    TORQUE_STUCK = "the reported motor torque is stuck"
    SILENT = "no report of the drive arrives"

    @property
    def stops(self) -> bool:
        """Whether a cylinder may not go on with such a drive."""
        return self not in {Verdict.OBEYS, Verdict.SLOW, Verdict.AT_LIMIT}


@dataclass(frozen=True)
class Declaration:
    """What a drive may do that is as declared, in samples and speeds."""

    response: DriveResponse  # how it is declared to follow
    period: float  # of the samples [s]
    late: int  # samples by which a report may be behind its command
    patience: int  # samples beyond which a late drive does not follow
    in_a_row: int  # samples in which a motor that does not follow is noticed
    departure: int  # samples of a command's mean, and in which it has left it
    missing: int  # reports that may be missing in a row
    speed: float  # by which a report may be off the declared drive's [rad/s]
    kept: int  # samples of commands that are looked at
    times: tuple[float, ...]  # of the samples within the declared lag, newest first [s]
    servo: ServoDrive | None  # the drive, if it is one whose torque shows by how much it yields
    full: float  # torque at which such a drive is at its limit [N m]
    repeats: float  # of the speed that are too many for its noise

    @classmethod
    def of(cls, unit: HydraulicUnit, response: DriveResponse, period: float) -> Declaration:
        """Of a unit's drive that is declared to follow so, at samples of a period [s]."""
        missed = runs(response.lost, period) if response.lost > 0.0 else 0
        delay, rounding = response.command_delay + response.report_delay, thresholds.ROUNDING
        late = math.ceil(delay / period - rounding) + missed
        patience = late + max(late // int(thresholds.PATIENCE_SHARE), int(thresholds.PATIENCE_SAMPLES))
        in_a_row = max(math.floor(thresholds.NOTICING_TIME / period + rounding), 1)
        chance = (thresholds.FALSE_ALARM_RATE * period) ** (1.0 / in_a_row)
        whole = math.floor(response.lag / period + rounding)
        servo = unit.drive if isinstance(unit.drive, ServoDrive) else None
        noise = thresholds.TORQUE_LIMIT_SIGMAS * unit.assumptions.drive.torque * limits_of(unit).torque
        return cls(
            response=response,
            period=period,
            late=late,
            patience=patience,
            in_a_row=in_a_row,
            departure=max(in_a_row, int(thresholds.DEPARTURE_SAMPLES)),
            missing=max(missed, in_a_row),
            speed=response.deviation + NormalDist().inv_cdf(1.0 - chance) * response.speed_noise,
            kept=max(patience, late + in_a_row) + 1,
            times=(*(period for _ in range(whole)), max(response.lag - whole * period, 0.0)),
            servo=servo,
            full=math.inf if servo is None else servo.max_torque - noise,
            repeats=repeats_in_a_row(response.speed_noise, response.speed_step, period),
        )


@dataclass(frozen=True)
class Counters:
    """Samples in a row: off the declared drive, slow, unreported, of one torque, at the limit; time in a stall."""

    off: Scalar = leaf("1")
    slow: Scalar = leaf("1")
    missing: Scalar = leaf("1")
    torque_repeats: Scalar = leaf("1")
    limited: Scalar = leaf("1")
    stalled: Scalar = leaf("s")


@dataclass(frozen=True)
class Standing:
    """A speed that is reported unchanged, and what commands did meanwhile."""

    same: Scalar = leaf("1")  # repeats until now
    gone: Scalar = leaf("1")  # samples for which model and command have left their means, to one side
    model_mean: Scalar = leaf("rad/s")  # of the model when the report began to stand
    command_mean: Scalar = leaf("rad/s")  # of the command then
    side: Scalar = leaf("1")  # on which both are, 1 or -1; 0 if on neither


@dataclass(frozen=True)
class TorqueRepeats:
    """Of torques: samples of runs that ended, and repeats among them."""

    seen: Scalar = leaf("1")
    met: Scalar = leaf("1")


@dataclass(frozen=True)
class WatchState:
    """State of the watch."""

    counters: Counters  # of what is wrong
    standing: Standing  # of the reported speed
    declared: DeclaredDrive  # the declared drive
    repeats: SpeedRepeats | None  # of the reported speed; none where its noise allows any
    torques: TorqueRepeats | None  # how often a torque repeats; none where that is declared
    integral: Scalar | None = leaf("N*m", None)  # a servo's, none of an ideal drive
    speed: Scalar = leaf("rad/s", thresholds.NO_REPORT)  # last reported
    torque: Scalar = leaf("N*m", thresholds.NO_REPORT)  # last reported


@dataclass(frozen=True)
class Report:
    """A drive's report."""

    arrived: Flag  # whether there is one
    speed: Scalar  # in it [rad/s]
    torque: Scalar  # in it [N m]


@dataclass(frozen=True)
class Found:
    """What the watch found at a sample."""

    verdicts: dict[Verdict, Flag]  # whether each verdict is that of the sample; one at most is
    pending: Scalar  # angle that was commanded and is in no report yet [rad]
    underway: tuple[Scalar, ...]  # mean speeds of the samples within the declared lag, newest first [rad/s]


def unwatched(declared: Declaration) -> WatchState:
    """The state at power-up."""
    return WatchState(
        Counters(),
        Standing(),
        standing(declared.response, declared.period, declared.kept, len(declared.times)),
        speed_repeats.nothing_learned() if math.isfinite(declared.repeats) else None,
        TorqueRepeats() if declared.response.torque_repeats is None else None,
        None if declared.servo is None else scalar(0.0),
    )


def reset(state: WatchState, when: Flag) -> WatchState:
    """Count again after an order; what was learned of reports stays."""
    return replace(
        state,
        counters=chosen(when, Counters(), state.counters),
        standing=chosen(when, Standing(), state.standing),
        repeats=None if state.repeats is None else speed_repeats.reset(state.repeats, when),
    )


def look(state: WatchState, declared: Declaration, report: Report, command: Real) -> tuple[WatchState, Found]:
    """The state after a sample, and what was found.

    Args:
        command: the speed that was asked for until now [rad/s].
    """
    drive = followed_by(state.declared, declared.response, declared.period, command)
    missing = ca.if_else(report.arrived, 0.0, state.counters.missing + 1.0)
    numbers = all_of(report.arrived, _is_number(report.speed), _is_number(report.torque))
    integral, yields = _yielding(state.integral, declared, report, numbers)
    low, high = _range(drive, declared, declared.late, yields)
    astray = any_of(report.speed < low, report.speed > high)
    still, left = _left_standing(state, drive, declared, report, numbers)
    repeats, stuck = _speed_repeats(state, drive, declared, report, numbers)
    torques, same_torque, torque_stuck = _torque_repeats(state, declared, report, numbers)
    limited, full, at_limit = _at_limit(state, declared, report, numbers, astray)
    still = chosen(full, Standing(), still) if declared.servo is not None else still
    repeats = speed_repeats.reset(repeats, full) if repeats is not None and declared.servo is not None else repeats
    stalled, stalls = _stalls(state, declared, report, numbers, at_limit)
    free = all_of(numbers, negated(at_limit))
    off, disobeys = _disobeys(state, drive, declared, report, free, astray, yields)
    obeys, slept = all_of(free, negated(disobeys)), any_of(left, stuck)
    stopped = all_of(disobeys, still.same >= float(declared.in_a_row))
    goes = all_of(obeys, negated(any_of(slept, torque_stuck)))
    slow = ca.if_else(goes, ca.if_else(astray, state.counters.slow + 1.0, 0.0), state.counters.slow)
    verdicts = {
        Verdict.SILENT: all_of(negated(report.arrived), missing > float(declared.missing)),
        Verdict.STALLED: stalls,
        Verdict.AT_LIMIT: all_of(at_limit, negated(stalls)),
        Verdict.DISOBEYS: all_of(disobeys, negated(stopped)),
        Verdict.STUCK: any_of(stopped, all_of(obeys, slept)),
        Verdict.TORQUE_STUCK: all_of(obeys, negated(slept), torque_stuck),
        Verdict.SLOW: all_of(goes, slow >= float(declared.in_a_row)),
    }
    new = WatchState(
        Counters(off, slow, missing, same_torque, limited, stalled), still, drive, repeats, torques, integral,
        ca.if_else(numbers, report.speed, state.speed), ca.if_else(numbers, report.torque, state.torque),
    )  # fmt: skip
    late = drive.reporting
    return new, Found(verdicts, scalar(0.0) if late is None else late.pending, () if late is None else late.underway)


def _is_number(value: Scalar) -> Flag:
    return abs(value) <= thresholds.LARGEST_NUMBER


def _yielding(
    integral: Scalar | None, declared: Declaration, report: Report, when: Flag
) -> tuple[Scalar | None, Scalar]:
    """A servo's integral [N m], and the speed by which it is below its reference, (T - z)/k_p [rad/s]."""
    servo = declared.servo
    if servo is None or integral is None:
        return None, scalar(0.0)
    off = report.torque - integral
    share = 1.0 - math.exp(-servo.integral_gain / servo.proportional_gain * declared.period)
    return ca.if_else(when, integral + share * off, integral), off / servo.proportional_gain


def _range(drive: DeclaredDrive, declared: Declaration, late: int, yields: Scalar) -> tuple[Scalar, Scalar]:
    """Least and greatest speed that a drive could report that is up to so many samples late [rad/s].

    It may also be quicker than declared, down to one that follows at once.
    """
    low, high = drive.spread(late)
    return low - ca.fmax(yields, 0.0) - declared.speed, high - ca.fmin(yields, 0.0) + declared.speed


def _disobeys(
    state: WatchState, drive: DeclaredDrive, declared: Declaration, report: Report, when: Flag, astray: Flag,
    yields: Scalar,
) -> tuple[Scalar, Flag]:  # fmt: skip
    """Samples in which even a drive that is much later would not report this, and whether they are too many."""
    low, high = _range(drive, declared, declared.patience, yields)
    outside = all_of(astray, negated(all_of(low <= report.speed, report.speed <= high)))
    off = ca.if_else(when, ca.if_else(outside, state.counters.off + 1.0, 0.0), state.counters.off)
    return off, all_of(when, astray, off >= float(declared.in_a_row))


def _left_standing(
    state: WatchState, drive: DeclaredDrive, declared: Declaration, report: Report, when: Flag
) -> tuple[Standing, Flag]:
    """Whether the speed stood in the reports while all that must be in them by now went elsewhere.

    Commands tremble with the sensor's noise, and a servo does not follow that: model and command have to leave, to
    one side, what they were on average when the report began to stand.
    """
    repeats = all_of(when, report.speed == state.speed)
    was = chosen(all_of(when, negated(repeats)), Standing(), state.standing)
    same = was.same + count(repeats)
    model, command = drive.speeds[declared.late], drive.commanded[declared.late]
    samples, departure = same - declared.late, float(declared.departure)
    averages = all_of(repeats, samples > 0.0, samples <= departure)
    model_mean = ca.if_else(averages, was.model_mean + model / departure, was.model_mean)
    command_mean = ca.if_else(averages, was.command_mean + command / departure, was.command_mean)
    off, far = (model - model_mean, command - command_mean), thresholds.MOVED_STEPS * declared.response.speed_step
    side = ca.if_else(ca.fmin(*off) > far, 1.0, ca.if_else(ca.fmax(*off) < -far, -1.0, 0.0))
    looks = all_of(repeats, samples > departure)
    gone = ca.if_else(looks, ca.if_else(side == was.side, was.gone + 1.0, 1.0), was.gone)
    side = ca.if_else(looks, side, was.side)
    left = all_of(repeats, side != 0.0, gone >= departure)
    return Standing(same, gone, model_mean, command_mean, side), left


def _speed_repeats(
    state: WatchState, drive: DeclaredDrive, declared: Declaration, report: Report, when: Flag
) -> tuple[SpeedRepeats | None, Flag]:
    """Whether the speed of a motor that turns repeats more often than its noise lets it."""
    if state.repeats is None:
        return None, flag(False)
    turns, response = abs(report.speed) >= thresholds.STANDSTILL_SPEED, declared.response
    low, high = drive.spread(declared.late + declared.in_a_row)
    steady = high - low < thresholds.STEADY_STEPS * response.speed_step
    trembles = all_of(negated(steady), high - low < thresholds.TREMBLE_SIGMAS * response.speed_noise)
    begun = speed_repeats.reset(state.repeats, all_of(when, negated(turns)))
    command = steady, trembles
    return speed_repeats.look(
        begun, all_of(when, turns), report.speed, command, declared.repeats, declared.period
    )  # fmt: skip


def _torque_repeats(
    state: WatchState, declared: Declaration, report: Report, when: Flag
) -> tuple[TorqueRepeats | None, Scalar, Flag]:
    """Whether a torque repeats more often than its noise lets it, while the motor turns.

    Its share of repeats is declared, or learned from runs that ended: of a coarse torque it is large.
    """
    turns, period = abs(report.speed) >= thresholds.STANDSTILL_SPEED, declared.period
    looks = all_of(when, turns, state.torque != thresholds.NO_REPORT)
    repeats, before, learned = (
        all_of(looks, report.torque == state.torque),
        state.counters.torque_repeats,
        state.torques,
    )
    same = ca.if_else(repeats, before + 1.0, ca.if_else(when, 0.0, before))
    share = declared.response.torque_repeats
    if learned is None or share is not None:
        return None, same, all_of(looks, same >= float(runs(share or 0.0, period)))
    ends = all_of(looks, negated(repeats))
    seen = learned.seen + ca.if_else(ends, 1.0 + before, 0.0)
    met = learned.met + ca.if_else(ends, before, 0.0)
    bound = upper_share(met, seen)
    return TorqueRepeats(seen, met), same, all_of(looks, bound < 1.0, same >= runs_of(bound, period))


def _at_limit(
    state: WatchState, declared: Declaration, report: Report, when: Flag, astray: Flag
) -> tuple[Scalar, Flag, Flag]:
    """Samples for which a limit is remembered, whether the torque is at it, and whether it explains the speed.

    A motor at its limit keeps its speed, whatever the command: repeats are then no sign of a stuck report.
    """
    if declared.servo is None:
        return scalar(0.0), flag(False), flag(False)
    full = all_of(when, abs(report.torque) >= declared.full)
    memory = float(declared.patience + declared.in_a_row)
    left = ca.if_else(full, memory, ca.fmax(state.counters.limited - 1.0, 0.0))
    limited = ca.if_else(when, left, state.counters.limited)
    return limited, full, all_of(when, limited > 0.0, astray)


def _stalls(
    state: WatchState, declared: Declaration, report: Report, when: Flag, at_limit: Condition
) -> tuple[Scalar, Flag]:
    """Time at the limit without a turn [s], and whether it is too long."""
    stands = abs(report.speed) < thresholds.STANDSTILL_SPEED
    longer = ca.if_else(stands, state.counters.stalled + declared.period, 0.0)
    stalled = ca.if_else(when, ca.if_else(at_limit, longer, 0.0), state.counters.stalled)
    return stalled, all_of(at_limit, stalled > thresholds.STALL_TIME)
