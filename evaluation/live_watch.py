"""The watch over a drive by itself, over reports of a simulated one, a sample at a time, without a control."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ramsight.control.drive_watch import Declaration, Report, Verdict, WatchState, look, reset, unwatched
from ramsight.duty.drive_response import DriveResponse
from ramsight.duty.live import Reported
from ramsight.engine.recursion import Live, recursion_of
from ramsight.engine.typed_state import leaf, symbols
from ramsight.expression import Flag, Real, Scalar, count
from ramsight.plant.unit import HydraulicUnit


@dataclass(frozen=True)
class _Inputs:
    """Report, command until now, and whether the watch begins again."""

    arrived: Flag = leaf("1")
    speed: Scalar = leaf("rad/s")
    torque: Scalar = leaf("N*m")
    command: Scalar = leaf("rad/s")
    begins: Flag = leaf("1")


class DriveWatch:
    """Looks at a drive.

    Args:
        unit: whose drive it is, as its data sheet has it.
        response: how the drive is declared to follow.
        period: of the samples [s].

    Attributes:
        pending: angle that was commanded and is in no report yet [rad].
        declared: what the drive may do.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.build import build
        >>> boom = build(machine.load_machine("mining-loader").unit("boom"), "boom")
        >>> watch = DriveWatch(boom, DriveResponse(), 0.02)
        >>> for k in range(8):
        ...     watch.command(50.0)
        ...     verdict = watch.look(Reported(0.02 * k, 0.0, 20.0 + k, 313.15))
        >>> verdict
        <Verdict.STUCK: 'the reported motor speed is stuck'>
    """

    def __init__(self, unit: HydraulicUnit, response: DriveResponse, period: float) -> None:
        self.declared, self.pending = Declaration.of(unit, response, period), 0.0
        initial = unwatched(self.declared)

        def stage(state: WatchState, now: _Inputs) -> tuple[WatchState, Sequence[Real]]:
            report = Report(now.arrived, now.speed, now.torque)
            new, found = look(reset(state, now.begins), self.declared, report, now.command)
            return new, (*(count(found.verdicts[one]) for one in _WRONG), found.pending)

        names = (*(one.name.lower() for one in _WRONG), "pending")
        self._live = Live(recursion_of(initial, symbols(_Inputs()), names, stage), initial)
        self._command, self._begins = 0.0, False

    def begin(self) -> None:
        """Count again, as after an order."""
        self._begins = True

    def command(self, speed: float) -> None:
        """The drive is asked for a speed at the next sample [rad/s]."""
        self._command = speed

    def look(self, reported: Reported) -> Verdict:
        """The verdict on a report; a value that is no number is the sensor's to judge."""
        return self._stepped(1.0, reported.motor_speed, reported.motor_torque)

    def missed(self) -> Verdict:
        """The same at a sample whose report has not arrived."""
        return self._stepped(0.0, math.nan, math.nan)

    @property
    def state(self) -> dict[str, float]:
        """All that the watch knows, by name."""
        return self._live.state

    def _stepped(self, *report: float) -> Verdict:
        *found, self.pending = self._live.step((*report, self._command, float(self._begins)))
        self._begins = False
        return next((one for one, holds in zip(_WRONG, found, strict=True) if holds), Verdict.OBEYS)


_WRONG = tuple(one for one in Verdict if one is not Verdict.OBEYS)
