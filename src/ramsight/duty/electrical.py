"""What a drive reports beside speed and torque: a counter of its shaft, and the power of its DC link."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.stepped import Value, stepped
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

_OTHER = 0x64637670  # apart from the drive's noise of the same seed


_POWER = 0x706F7772  # apart from the noise of the torque of the same seed


@dataclass(frozen=True)
class ShaftReport:
    """The counter of a shaft's position.

    Args:
        step: of the counter [rad]; 4096 increments a turn by default.
        first: what it shows at the beginning [rad].
    """

    step: float = 2.0 * math.pi / 4096
    first: float = 0.0

    def reported(self, time: Array, speed: Array) -> Array:
        """Angles [rad] at times [s], of speeds [rad/s], shape (samples,).

        Between samples the speed is taken to be linear, as the duties of a simulation are.

        Example:
            >>> ShaftReport(step=0.0).reported(np.array([0.0, 0.5, 1.0]), np.array([0.0, 2.0, 2.0])).tolist()
            [0.0, 0.5, 1.5]
        """
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
        angle = self.first + turned
        return stepped(angle, self.step)


@dataclass(frozen=True)
class PowerReport:
    """Power that a drive takes from its DC link.

        P = torque speed + P0 + c torque^2 + s abs(speed)

    Args:
        standby: P0 [W].
        copper: c [W/(N m)2].
        iron: s [W s/rad].
        gain: of the reading [1].
        noise: standard deviation [W].
        step: [W].
        seed: of the noise; the same seed gives the same power.
    """

    standby: float = 50.0
    copper: float = 0.0
    iron: float = 0.0
    gain: float = 1.0
    noise: float = 0.0
    step: float = 1.0
    seed: int = 0

    def reported(self, speed: Array, torque: Array) -> Array:
        """Power [W] of true speeds [rad/s] and torques [N m], shape (samples,).

        Example:
            >>> PowerReport(standby=50.0, copper=0.1, iron=0.2).reported(np.array([100.0]), np.array([20.0])).tolist()
            [2110.0]
        """
        noise = np.random.default_rng([self.seed, _POWER]).standard_normal(len(speed))
        return self.sample(speed, torque, noise)

    def sample(self, speed: Value, torque: Value, noise: Value) -> Value:
        """Power [W] of a true speed [rad/s] and torque [N m], with noise of standard deviation 1, or of many."""
        power = torque * speed + self.standby + self.copper * torque**2 + self.iron * abs(speed)
        return stepped(self.gain * power + self.noise * noise, self.step)


def declared_shaft(unit: HydraulicUnit) -> ShaftReport | None:
    """The counter that a unit declares; None if it declares none."""
    std = unit.assumptions.shaft.std
    return ShaftReport(step=math.sqrt(12.0) * std) if std > 0.0 else None


def declared_power(unit: HydraulicUnit, seed: int) -> PowerReport | None:
    """The power that a unit declares, gain and losses drawn from what is declared; None if it declares none.

    Args:
        unit: the unit.
        seed: of gain, losses and noise; the same seed gives the same drive.
    """
    assumed = unit.assumptions.power
    if assumed.std == 0.0:
        return None
    random, limits = np.random.default_rng([seed, _OTHER]), limits_of(unit)
    losses = max(0.0, 1.0 + assumed.losses * float(random.standard_normal()))
    return PowerReport(
        standby=losses * assumed.standby,
        copper=losses * assumed.copper * limits.max_speed / limits.torque,
        iron=losses * assumed.iron * limits.torque,
        gain=1.0 + assumed.gain * float(random.standard_normal()),
        noise=assumed.std * limits.torque * limits.max_speed,
        seed=seed,
    )
