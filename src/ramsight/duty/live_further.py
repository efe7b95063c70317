"""What a drive reports beside speed, torque and temperature, sample by sample: all that its unit declares.

The same signals as `drive_report.further_report`, for a machine that runs.
"""

from __future__ import annotations

import math

import numpy as np

from ramsight.duty.drive_report import declared_report
from ramsight.duty.lagging import stepped
from ramsight.duty.reading_report import LiveLink, LiveReading
from ramsight.logs.channels import DC_POWER, LINK_ANGLE, MOTOR_TEMPERATURE, PRESSURE_A, PRESSURE_B, SHAFT_ANGLE
from ramsight.plant.unit import HydraulicUnit


class LiveFurther:
    """Further signals of one unit.

    Args:
        period: of the samples [s].

    Example:
        >>> from ramsight import machine
        >>> from ramsight.machine.assumption_description import AssumedMotorTemperature
        >>> from ramsight.plant.build import build
        >>> ram = machine.load_machine("press").unit("ram")
        >>> known = ram.assumptions.model_copy(update={"motor_temperature": AssumedMotorTemperature(std=0.01)})
        >>> further = LiveFurther(build(ram.model_copy(update={"assumptions": known}), "ram"), 0.02)
        >>> further.sample(0.1, 100.0, 20.0, (1e7, 1e5), warmer=40.0)
        {'motor_temperature': 338.0}
    """

    def __init__(self, unit: HydraulicUnit, period: float, seed: int = 0) -> None:
        how = declared_report(unit, seed)
        self._how, self._period = how, period
        self._random = np.random.default_rng([seed, len(unit.name)])
        self._link = None if how.link is None else LiveLink(how.link, self._random)
        self._readings = {one.name: LiveReading(sensor) for one, sensor in how.readings.items()}
        self._time = self._turned = 0.0
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
        self._speed, self._time = speed, self._time + self._period
        if how.link is not None and self._link is not None:
            found[LINK_ANGLE.name] = self._link.sample(self._period, float(how.link.lever.angle(position)))
        if how.shaft is not None:
            found[SHAFT_ANGLE.name] = stepped(how.shaft.first + self._turned, how.shaft.step)
        if how.power is not None:
            found[DC_POWER.name] = how.power.sample(speed, torque, float(self._random.standard_normal()))
        if how.warm_at is not None:
            found[MOTOR_TEMPERATURE.name] = float(round(how.warm_at + warmer))
        if how.pressure_noise is not None:
            shown = self._lagging(pressures)
            noise = how.pressure_noise * self._random.standard_normal(2)
            found |= {PRESSURE_A.name: shown[0] + float(noise[0]), PRESSURE_B.name: shown[1] + float(noise[1])}
        return found | {name: sensor.sample(self._time, position) for name, sensor in self._readings.items()}

    def _lagging(self, pressures: tuple[float, float]) -> tuple[float, float]:
        share = 1.0 - math.exp(-self._period / self._how.pressure_lag) if self._how.pressure_lag > 0.0 else 1.0
        a, b = self._shown or pressures
        self._shown = a + share * (pressures[0] - a), b + share * (pressures[1] - b)
        return self._shown
