"""A drive between a control and a plant: what it makes of commands, and what arrives of what it reports."""

from __future__ import annotations

import numpy as np

from ramsight.duty.drive_report import DriveReport
from ramsight.duty.drive_response import Delay, DriveResponse, Follower
from ramsight.duty.live import LiveReport, Reported


class LiveDrive:
    """A drive, a sample at a time.

    Args:
        response: how it follows its commands.
        period: of the samples [s].
        how: rounding and noise of its reports, and by how much they are off; its seed decides which samples are
            lost, too.
        stream: of drives with the same seed, which one.

    Example:
        >>> drive = LiveDrive(DriveResponse(command_delay=0.02, report_delay=0.02), 0.02, DriveReport(torque_noise=0.0))
        >>> [drive.follow(100.0) for _ in range(3)]
        [0.0, 100.0, 100.0]
        >>> [drive.report(0.02 * k, speed, 0.0, 313.15).motor_speed > 0.0 for k, speed in enumerate((0.0, 50.0, 100.0))]
        [False, False, True]
    """

    def __init__(self, response: DriveResponse, period: float, how: DriveReport, stream: int = 0) -> None:
        self.response = response
        self._follower = Follower(response, period)
        self._period, self._command, self._began = period, 0.0, False
        self._late: tuple[Delay, Delay] | None = None
        self._report = LiveReport(how, stream)
        self._arriving = np.random.default_rng([how.seed, stream, 1])

    def follow(self, command: float) -> float:
        """What the motor is to turn at the next sample [rad/s]; a command that is lost leaves the last one."""
        if self._arrives():
            self._command = command
        return self._follower.step(self._command)

    def report(self, time: float, motor_speed: float, motor_torque: float, oil_temperature: float) -> Reported | None:
        """What arrives at a time, if anything; all in SI.

        Args:
            time: of the sample [s].
            motor_speed: true [rad/s].
            motor_torque: true [N m].
            oil_temperature: true [K].
        """
        if self._late is None:
            delay = self.response.report_delay
            self._late = Delay(delay, self._period, motor_speed), Delay(delay, self._period, motor_torque)
        speed, torque = self._late[0].step(motor_speed), self._late[1].step(motor_torque)
        said = self._report.sample(time, speed, torque, oil_temperature)
        arrives, self._began = self._arrives() or not self._began, True
        return said if arrives else None

    def _arrives(self) -> bool:
        lost = self.response.lost
        return lost == 0.0 or float(self._arriving.random()) >= lost
