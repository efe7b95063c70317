"""A drive as declared, as a graph: what commands and model had lately, and what is on its way to the reports."""

from __future__ import annotations

import math
from typing import Any

from ramsight.control.watch import Allowed
from ramsight.duty.drive_response import DriveResponse, between, delayed, followed
from ramsight.plant.either import least, most


class DeclaredGraph:
    """What `ramsight.control.watch.DriveWatch` knows of the declared drive.

    Args:
        response: how the drive is declared to follow.
        period: of the samples [s].
        may: what that allows it.

    Attributes:
        initial: its states and their values at power-up.
        pending: angle that was commanded and is in no report yet [rad].
        underway: mean speeds of the samples within the declared lag, the newest first [rad/s], and their shares [s].
    """

    def __init__(self, response: DriveResponse, period: float, may: Allowed) -> None:
        self._response, self._period, self._may = response, period, may
        # A drive that follows at once has as its model's speeds the commands.
        self._follows = math.isfinite(response.bandwidth) or math.isfinite(response.acceleration)
        self._command, count = between(response.command_delay, period)
        self._report, reports = between(response.report_delay, period)
        names = [f"asked_{k}" for k in range(may.kept)]
        if self._follows:
            names += [f"model_{k}" for k in range(may.kept)] + ["model_slope"]
        if response.lag > 0.0:
            names += [f"held_{k}" for k in range(count)] + ["reporting", "reporting_slope"]
            names += [f"reporting_{k}" for k in range(reports)] + ["pending"]
            names += [f"underway_{k}" for k in range(len(may.times))]
        self.initial = dict.fromkeys(names, 0.0)
        self.pending: Any = 0.0
        self.underway: tuple[tuple[Any, float], ...] = ()
        self._speeds: list[Any] = []
        self._asked: list[Any] = []

    def advance(self, s: dict[str, Any], commanded: Any) -> None:
        """The declared drive's next sample: states of `s` become the next ones.

        Args:
            s: the states.
            commanded: the speed that was asked for [rad/s].
        """
        before = s["asked_0"]
        self._asked = _pushed(s, "asked", commanded)
        self._speeds = self._asked
        if self._follows:
            now = s["model_0"], s["model_slope"]
            speed, s["model_slope"] = followed(self._response, self._period, commanded, before, now)
            self._speeds = _pushed(s, "model", speed)
        if self._response.lag > 0.0:
            self._reports(s, commanded, before)

    def _reports(self, s: dict[str, Any], commanded: Any, before: Any) -> None:
        """What of the commands is in a report by now."""
        shown = delayed(_oldest_first(s, "reporting_"), self._report)
        delayed_before = delayed(_oldest_first(s, "held_"), self._command)
        _pushed(s, "held", commanded)
        asked = delayed(_oldest_first(s, "held_"), self._command)
        now = s["reporting"], s["reporting_slope"]
        s["reporting"], s["reporting_slope"] = followed(self._response, self._period, asked, delayed_before, now)
        _pushed(s, "reporting", s["reporting"])
        shows = delayed(_oldest_first(s, "reporting_"), self._report)
        s["pending"] = s["pending"] + 0.5 * (before + commanded - shown - shows) * self._period
        underway = _pushed(s, "underway", 0.5 * (before + commanded))
        self.pending, self.underway = s["pending"], tuple(zip(underway, self._may.times, strict=True))

    def spread(self, late: int) -> tuple[Any, Any]:
        """Least and greatest of what commands and model had in so many samples [rad/s]."""
        low = high = self._asked[0]
        for speed in (*self._asked[1 : late + 1], *self._speeds[: late + 1]):
            low, high = least(low, speed), most(high, speed)
        return low, high

    def had(self, late: int) -> tuple[Any, Any]:
        """What model and commands had so many samples ago [rad/s]."""
        return self._speeds[late], self._asked[late]


def _oldest_first(s: dict[str, Any], prefix: str) -> list[Any]:
    count = sum(name.startswith(prefix) and name.removeprefix(prefix).isdigit() for name in s)
    return [s[f"{prefix}{k}"] for k in reversed(range(count))]


def _pushed(s: dict[str, Any], name: str, value: Any) -> list[Any]:
    """Values that are kept, the newest first, with a new one in the place of the oldest."""
    kept = [value, *reversed(_oldest_first(s, f"{name}_")[1:])]
    s |= {f"{name}_{k}": one for k, one in enumerate(kept)}
    return kept
