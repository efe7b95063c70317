"""What an occasional sensor of the position reports of a run: a reading now and then, late, off, sometimes wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.logs.channels import READINGS, Further
from ramsight.plant.unit import HydraulicUnit

_SEED = 0x72656164  # apart from the drive's noise of the same seed
_SOON = 1e-6  # s; of a reading that is due, rounding of a clock


@dataclass(frozen=True)
class ReadingReport:
    """How such a sensor is."""

    offset: float  # error that all readings share [m]
    noise: float  # of each, standard deviation [m]
    delay: float  # by which a reading is behind [s]
    wrong: float  # share of the readings that are of something else, anywhere in the stroke [1]
    every: float  # time between readings [s]; the first comes after that
    stroke: float  # of the cylinder [m]
    seed: int = 0  # of noise and wrong readings; the same seed gives the same ones

    def reported(self, time: Array, true: Array) -> Array:
        """Readings [m] at times [s], of true values [m], shape (samples,); NaN where there is none.

        Example:
            >>> time = np.arange(6.0)
            >>> ReadingReport(0.002, 0.0, 1.0, 0.0, 2.0, 0.5).reported(time, 0.01 * time).round(3).tolist()
            [nan, nan, 0.012, nan, 0.032, nan]
        """
        live = LiveReading(self)
        return np.array([live.sample(*now) for now in zip(time.tolist(), true.tolist(), strict=True)])


class LiveReading:
    """The sensor, sample by sample."""

    def __init__(self, how: ReadingReport) -> None:
        self._how, self._random = how, np.random.default_rng([how.seed, _SEED])
        self._due: float | None = None
        self._past: list[tuple[float, float]] = []

    def sample(self, time: float, true: float) -> float:
        """The reading that comes at a time [s] of the true value then [m]; NaN where none does."""
        how = self._how
        self._past.append((time, true))
        while len(self._past) > 1 and self._past[1][0] <= time - how.delay:
            del self._past[0]
        if self._due is None:
            self._due = time + how.every
        if time < self._due - _SOON:
            return math.nan
        self._due += how.every
        noise, chance, elsewhere = self._random.standard_normal(), self._random.random(), self._random.random()
        if chance < how.wrong:
            return how.stroke * elsewhere
        return self._past[0][1] + how.offset + how.noise * float(noise)


def declared_readings(unit: HydraulicUnit, seed: int) -> dict[Further, ReadingReport]:
    """The sensors that a unit declares, by their channels, with offsets drawn from what is declared.

    Args:
        unit: the unit.
        seed: of offset and noise; the same seed gives the same sensors.
    """
    found = {}
    for k, channel in enumerate(READINGS):
        assumed = getattr(unit.assumptions, channel.declared)
        if assumed.std > 0.0:
            offset = assumed.offset * float(np.random.default_rng([seed, k, _SEED]).standard_normal())
            stroke = float(unit.cylinder.stroke)
            found[channel] = ReadingReport(
                offset, assumed.std, assumed.delay, assumed.wrong, assumed.every, stroke, seed + k
            )
    return found
