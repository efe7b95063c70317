"""The declared drive beside the real one: the speeds it would have, and the angle that reports do not show yet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ramsight.duty.drive_response import DriveResponse, between, delayed, followed
from ramsight.engine.typed_state import leaf
from ramsight.expression import Real, Scalar, scalar


@dataclass(frozen=True)
class Model:
    """State of a drive that does not follow at once, its delays neglected."""

    speeds: tuple[Scalar, ...] = leaf("rad/s", None)  # newest first
    rate: Scalar = leaf("rad/s2")  # of the newest


@dataclass(frozen=True)
class Reporting:
    """State of a drive with all its delays; what are several, newest first."""

    held: tuple[Scalar, ...] = leaf("rad/s", None)  # commands within the delay of commands
    speeds: tuple[Scalar, ...] = leaf("rad/s", None)  # of the motor within the delay of reports
    underway: tuple[Scalar, ...] = leaf("rad/s", None)  # mean speeds of the samples within the declared lag
    rate: Scalar = leaf("rad/s2")
    pending: Scalar = leaf("rad")  # angle that was commanded and is in no report yet


@dataclass(frozen=True)
class DeclaredDrive:
    """State of the declared drive."""

    commanded: tuple[Scalar, ...] = leaf("rad/s", None)  # newest first
    model: Model | None = None  # none where the drive follows at once
    reporting: Reporting | None = None  # none where reports show commands at once

    @property
    def speeds(self) -> tuple[Scalar, ...]:
        """Speeds of the model, newest first [rad/s]."""
        return self.commanded if self.model is None else self.model.speeds

    def spread(self, late: int) -> tuple[Scalar, Scalar]:
        """Least and greatest of what commands and model had in so many samples [rad/s]."""
        low = high = self.commanded[0]
        for speed in (*self.commanded[1 : late + 1], *self.speeds[: late + 1]):
            low, high = ca.fmin(low, speed), ca.fmax(high, speed)
        return low, high


def standing(response: DriveResponse, period: float, kept: int, times: int) -> DeclaredDrive:
    """The state of a drive that stands.

    Args:
        period: of the samples [s].
    """

    def zeros(count: int) -> tuple[Scalar, ...]:
        return tuple(scalar(0.0) for _ in range(count))

    follows = math.isfinite(response.bandwidth) or math.isfinite(response.acceleration)
    commands, reports = between(response.command_delay, period)[1], between(response.report_delay, period)[1]
    return DeclaredDrive(
        zeros(kept),
        Model(zeros(kept)) if follows else None,
        Reporting(zeros(commands), zeros(reports), zeros(times)) if response.lag > 0.0 else None,
    )


def followed_by(state: DeclaredDrive, response: DriveResponse, period: float, command: Real) -> DeclaredDrive:
    """The declared drive after a sample, at whose end it is commanded a speed [rad/s], reached evenly."""
    before, new = state.commanded[0], ca.SX(command)
    model, reporting = state.model, state.reporting
    if model is not None:
        speed, rate = followed(response, period, new, before, (model.speeds[0], model.rate))
        model = Model(_shifted(model.speeds, speed), rate)
    if reporting is not None:
        reporting = _reported(reporting, response, period, before, new)
    return DeclaredDrive(_shifted(state.commanded, new), model, reporting)


def _reported(state: Reporting, response: DriveResponse, period: float, before: Scalar, new: Scalar) -> Reporting:
    """What the reports show by now, and what is pending: angles between two samples are those of their mean speed."""
    commands, reports = between(response.command_delay, period)[0], between(response.report_delay, period)[0]
    shown, asked_before = _delayed(state.speeds, reports), _delayed(state.held, commands)
    held = _shifted(state.held, new)
    now = state.speeds[0], state.rate
    speed, rate = followed(response, period, _delayed(held, commands), asked_before, now)
    speeds = _shifted(state.speeds, speed)
    pending = state.pending + 0.5 * (before + new - shown - _delayed(speeds, reports)) * period
    return Reporting(held, speeds, _shifted(state.underway, 0.5 * (before + new)), rate, pending)


def _delayed(newest_first: tuple[Scalar, ...], share: float) -> Scalar:
    late: Real = delayed(newest_first[::-1], share)
    return scalar(0.0) + late


def _shifted(newest_first: tuple[Scalar, ...], value: Scalar) -> tuple[Scalar, ...]:
    return (value, *newest_first[:-1])
