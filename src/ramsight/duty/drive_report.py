"""What a drive reports of a run: sampled, in steps, with noise, and nothing but speed, torque and temperature."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ramsight.logs.channels import is_command

if TYPE_CHECKING:
    import xarray

_RPM = 2.0 * math.pi / 60.0


@dataclass(frozen=True)
class DriveReport:
    """How a drive rounds, how noisy it is, and by how much it is off.

    Args:
        speed_step: [rad/s]; default 1 rpm.
        torque_step: [N m]; default 1/16 N m.
        torque_noise: standard deviation [N m].
        temperature_step: [K].
        temperature_noise: standard deviation [K].
        torque_gain: reported torque over the true one [1].
        temperature_offset: reported temperature less the true one [K].
        seed: of the noise; the same seed gives the same log.
    """

    speed_step: float = _RPM
    torque_step: float = 1.0 / 16.0
    torque_noise: float = 0.5
    temperature_step: float = 0.1
    temperature_noise: float = 0.2
    torque_gain: float = 1.0
    temperature_offset: float = 0.0
    seed: int = 0

    def of(
        self, speed: NDArray[np.float64], torque: NDArray[np.float64], temperature: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Reported motor speed [rad/s], torque [N m] and oil temperature [K] of true ones, each (samples,)."""
        random = np.random.default_rng(self.seed)
        torque = self.torque_gain * torque + self.torque_noise * random.standard_normal(len(torque))
        temperature = temperature + self.temperature_offset
        temperature = temperature + self.temperature_noise * random.standard_normal(len(temperature))
        return (
            _rounded(speed, self.speed_step),
            _rounded(torque, self.torque_step),
            _rounded(temperature - 273.15, self.temperature_step) + 273.15,
        )


def _rounded(values: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    return np.round(values / step) * step if step > 0.0 else values


def report(run: xarray.Dataset, how: DriveReport | None = None) -> xarray.Dataset:
    """The drive log of a simulated run.

    Args:
        run: a Dataset as `simulate` returns it.
        how: rounding and noise; by default that of a usual CANopen drive.

    Returns:
        A Dataset over the same `time` with motor_speed, motor_torque and oil_temperature, and the commands to the
        circuit's parts, if there are any.
    """
    how = how or DriveReport()
    names = ("motor_speed", "motor_torque", "oil_temperature")
    reported = how.of(*(run[name].values for name in names))
    commands = [name for name in run if is_command(str(name))]
    log = run[[*names, *commands]].copy(deep=True)
    for name, values in zip(names, reported, strict=True):
        log[name].values[:] = values
    log.attrs = {"format": 1, "kind": "drive log"}
    return log
