"""What further sensors report of a run: the angle of the body that a cylinder turns, and occasional readings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.lagging import stepped
from ramsight.logs.channels import READINGS, Further
from ramsight.plant.linkage.lever import Lever
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
    """The sensors that a unit declares, by their channels, with offsets drawn from what is declared."""
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


_OTHER = 0x616E676C  # apart from the drive's noise of the same seed


@dataclass(frozen=True)
class LinkReport:
    """How a sensor of the moved body's angle is."""

    lever: Lever  # what the angle says of the position
    offset: float = 0.0  # of the angle [rad]
    noise: float = 0.0  # of vibration and acceleration, standard deviation [rad]
    correlation: float = 0.5  # for which it stays what it is [s]
    lag: float = 0.0  # of the first order [s]
    step: float = math.radians(0.01)  # [rad]
    seed: int = 0  # of the noise; the same seed gives the same angles

    def reported(self, time: Array, position: Array) -> Array:
        """Angles [rad] at times [s], of positions [m], shape (samples,)."""
        live = LiveLink(self, np.random.default_rng(self.seed))
        steps = np.diff(time, prepend=time[0]).tolist()
        return np.array([live.sample(dt, angle) for dt, angle in zip(steps, self.lever.angle(position), strict=True)])


class LiveLink:
    """The sensor, sample by sample."""

    def __init__(self, how: LinkReport, random: np.random.Generator) -> None:
        self._how, self._random = how, random
        self._shaken = how.noise * float(random.standard_normal())
        self._shown: float | None = None

    def sample(self, elapsed: float, angle: float) -> float:
        """The angle that is reported [rad], a time [s] after the last one, of the true angle [rad]."""
        how, shown = self._how, angle if self._shown is None else self._shown
        self._shown = shown + (1.0 - math.exp(-elapsed / how.lag) if how.lag > 0.0 else 1.0) * (angle - shown)
        kept = math.exp(-elapsed / how.correlation)
        fresh = how.noise * math.sqrt(1.0 - kept**2) * float(self._random.standard_normal())
        self._shaken = kept * self._shaken + fresh
        return stepped(self._shown + self._shaken + how.offset, how.step)


def declared_link(unit: HydraulicUnit, seed: int) -> LinkReport | None:
    """The sensor that a unit declares, with an offset drawn from what is declared; None if it declares none."""
    assumed = unit.assumptions.link_angle
    if assumed.std == 0.0 or unit.lever is None:
        return None
    offset = assumed.offset * float(np.random.default_rng([seed, _OTHER]).standard_normal())
    return LinkReport(unit.lever, offset, assumed.std, assumed.correlation, assumed.lag, seed=seed)
