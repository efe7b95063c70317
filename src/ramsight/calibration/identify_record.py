"""A drive log with the measured position beside it, as arrays on one clock."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ramsight.arrays import Array, Bools, true_intervals
from ramsight.errors import RamsightError
from ramsight.signals import Dataset
from ramsight.tracking.credible import OUTSIDE, said_frozen

if TYPE_CHECKING:
    from ramsight.plant.unit import HydraulicUnit

_SMOOTH = 0.1  # s; over which position is averaged, and
_STILL = 2.0  # s; over which oil temperature is
_FEWEST = 50  # samples in common
_LONGEST_GAP = 0.5  # s; longer, and the position is not known between two of its samples


class IdentifyError(RamsightError):
    """A log from which nothing can be identified."""


@dataclass(frozen=True)
class Record:
    """What was recorded; the position is smoothed over 0.1 s, the oil's temperature over 2 s."""

    time: Array  # [s], shape (n,)
    motor_speed: Array  # [rad/s]
    motor_torque: Array  # [N m]
    oil_temperature: Array  # [K]
    position: Array  # [m]
    period: float  # of the samples [s]
    speed_step: float  # in which the drive reports speed [rad/s]

    @property
    def velocity(self) -> Array:
        """Velocity of the piston [m/s]."""
        return np.asarray(np.gradient(self.position, self.time))

    @property
    def step(self) -> Array:
        """From the sample before to each [s]; nothing for the first."""
        return np.diff(self.time, prepend=self.time[0])

    @property
    def largest_torque(self) -> float:
        """The largest torque either way, but for a thousandth of the samples [N m]."""
        return float(np.quantile(np.abs(self.motor_torque), 0.999))

    def changed(self, *, kelvin: float = 0.0, torque: float = 0.0, offset: float = 0.0) -> Record:
        """The record with warmer oil [K], a share more torque [1], or another zero of the torque [N m]."""
        return replace(
            self,
            oil_temperature=self.oil_temperature + kelvin,
            motor_torque=self.motor_torque * (1.0 + torque) + offset,
        )


def record(time: Array, motor_speed: Array, motor_torque: Array, oil_temperature: Array, position: Array) -> Record:
    """A record of columns; arguments as the attributes of `Record`, as measured."""
    period = float(np.median(np.diff(time)))
    steps = np.abs(np.diff(np.unique(motor_speed)))
    return Record(
        time,
        motor_speed,
        motor_torque,
        running_mean(oil_temperature, _samples(_STILL, period)),
        running_mean(position, _samples(_SMOOTH, period)),
        period,
        float(steps.min()) if steps.size else 0.0,
    )


def recorded(unit: HydraulicUnit, log: Dataset, truth: Dataset) -> Record:
    """The record of a log and its measured position.

    Args:
        log: Dataset over `time` with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].
        truth: Dataset over `time` with position [m].

    Raises:
        IdentifyError: they have no time in common, or the position is outside the stroke.
    """
    time, at = log["time"].values, truth["time"].values
    common = _longest_common(unit, log, truth)
    if common.sum() < _FEWEST:
        raise IdentifyError(
            f"the log ({time[0]:g} to {time[-1]:g} s) and the position ({at[0]:g} to {at[-1]:g} s) have too little "
            "time in common"
        )
    position = np.interp(time, at, truth["position"].values)[common]
    stroke = unit.cylinder.stroke
    if position.min() < -OUTSIDE * stroke or position.max() > (1.0 + OUTSIDE) * stroke:
        raise IdentifyError(
            f"the position runs from {1e3 * position.min():.0f} to {1e3 * position.max():.0f} mm; the cylinder's "
            f"stroke allows 0 to {1e3 * stroke:.0f} mm, 0 being retracted"
        )
    speed, torque, temperature = (
        log[name].values[common] for name in ("motor_speed", "motor_torque", "oil_temperature")
    )
    return record(time[common], speed, torque, temperature, position)


def _longest_common(unit: HydraulicUnit, log: Dataset, truth: Dataset) -> Bools:
    """The log's samples in the longest stretch for which the position is known, and is no frozen one."""
    time, at = log["time"].values, truth["time"].values
    common = (time >= at[0]) & (time <= at[-1])
    gaps = np.diff(at)
    for k in np.flatnonzero(gaps > max(_LONGEST_GAP, 2.0 * float(np.median(gaps)))):
        common &= (time <= at[k]) | (time >= at[k + 1])
    position = np.interp(time, at, truth["position"].values)
    common &= ~said_frozen(log, np.where(common, position, np.nan), unit, "position")
    chosen = np.zeros(len(time), dtype=bool)
    for a, b in sorted(true_intervals(common), key=lambda one: one[1] - one[0])[-1:]:
        chosen[a:b] = True
    return chosen


def running_mean(values: Array, width: int) -> Array:
    """Mean over an odd number of samples around each, fewer at the ends."""
    if width < 2:
        return values.astype(np.float64)
    half = width // 2
    total = np.concatenate([[0.0], np.cumsum(values)])
    index = np.arange(len(values))
    first, last = np.maximum(index - half, 0), np.minimum(index + half + 1, len(values))
    reach = np.minimum(index - first, last - 1 - index)  # symmetrical, so that a ramp stays a ramp
    first, last = index - reach, index + reach + 1
    return np.asarray((total[last] - total[first]) / (last - first))


def _samples(seconds: float, period: float) -> int:
    return max(1, round(seconds / period))
