"""What a drive reports beside speed, torque and temperature, sample by sample: all that its unit declares.

The same signals as `drive_report.further_report`, for a machine that runs.
"""

from __future__ import annotations

import math

import numpy as np

from ramsight.duty.drive_report import declared_report
from ramsight.duty.electrical import PowerReport
from ramsight.duty.link_report import LinkReport
from ramsight.logs.channels import DC_POWER, LINK_ANGLE, MOTOR_TEMPERATURE, PRESSURE_A, PRESSURE_B, SHAFT_ANGLE
from ramsight.plant.unit import HydraulicUnit


class LiveFurther:
    """Further signals of one unit.

    Args:
        unit: the unit; it declares which there are.
        period: of the samples [s].
        seed: of noise, and of what sensors are off by.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.machine.assumptions import AssumedMotorTemperature
        >>> from ramsight.plant.build import build
        >>> ram = machine.load("press").unit("ram")
        >>> known = ram.assumptions.model_copy(update={"motor_temperature": AssumedMotorTemperature(std=0.01)})
        >>> further = LiveFurther(build("ram", ram.model_copy(update={"assumptions": known})), 0.02)
        >>> further.sample(0.1, 100.0, 20.0, (1e7, 1e5), warmer=40.0)
        {'motor_temperature': 338.0}
    """

    def __init__(self, unit: HydraulicUnit, period: float, seed: int = 0) -> None:
        how = declared_report(unit, seed)
        self._how, self._period = how, period
        self._random = np.random.default_rng([seed, len(unit.name)])
        self._link = None if how.link is None else _LiveLink(how.link, period, self._random)
        self._turned = 0.0
        self._speed: float | None = None
        self._shown: tuple[float, float] | None = None

    def sample(
        self, position: float, speed: float, torque: float, pressures: tuple[float, float], warmer: float = 0.0
    ) -> dict[str, float]:
        """What is reported of one sample, in SI.

        Args:
            position: of the piston [m].
            speed: of the motor [rad/s].
            torque: of the motor [N m].
            pressures: of the chambers [Pa].
            warmer: magnets than for what the drive knows its torque constant [K].

        Returns:
            By the signals' names.
        """
        how, found = self._how, {}
        self._turned += 0.5 * (speed + (speed if self._speed is None else self._speed)) * self._period
        self._speed = speed
        if self._link is not None:
            found[LINK_ANGLE.name] = self._link.sample(position)
        if how.shaft is not None:
            found[SHAFT_ANGLE.name] = _stepped(how.shaft.first + self._turned, how.shaft.step)
        if how.power is not None:
            found[DC_POWER.name] = self._power(how.power, speed, torque)
        if how.warm_at is not None:
            found[MOTOR_TEMPERATURE.name] = float(round(how.warm_at + warmer))
        if how.pressure_noise is not None:
            shown = self._lagging(pressures)
            noise = how.pressure_noise * self._random.standard_normal(2)
            found |= {PRESSURE_A.name: shown[0] + float(noise[0]), PRESSURE_B.name: shown[1] + float(noise[1])}
        return found

    def _power(self, how: PowerReport, speed: float, torque: float) -> float:
        power = torque * speed + how.standby + how.copper * torque**2 + how.iron * abs(speed)
        return _stepped(how.gain * power + how.noise * float(self._random.standard_normal()), how.step)

    def _lagging(self, pressures: tuple[float, float]) -> tuple[float, float]:
        share = 1.0 - math.exp(-self._period / self._how.pressure_lag) if self._how.pressure_lag > 0.0 else 1.0
        a, b = self._shown or pressures
        self._shown = a + share * (pressures[0] - a), b + share * (pressures[1] - b)
        return self._shown


class _LiveLink:
    """A sensor of the moved body's angle, as `LinkReport.reported` has it."""

    def __init__(self, how: LinkReport, period: float, random: np.random.Generator) -> None:
        self._how, self._random = how, random
        self._share = 1.0 - math.exp(-period / how.lag) if how.lag > 0.0 else 1.0
        self._kept = math.exp(-period / how.correlation)
        self._shaken = how.noise * float(random.standard_normal())
        self._shown: float | None = None

    def sample(self, position: float) -> float:
        angle = float(self._how.lever.angle(position))
        self._shown = angle if self._shown is None else self._shown + self._share * (angle - self._shown)
        noise = self._how.noise * math.sqrt(1.0 - self._kept**2) * float(self._random.standard_normal())
        self._shaken = self._kept * self._shaken + noise
        return _stepped(self._shown + self._shaken + self._how.offset, self._how.step)


def _stepped(value: float, step: float) -> float:
    return round(value / step) * step if step > 0.0 else value
