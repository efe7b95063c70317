"""What a sensor of the angle of the body that a cylinder turns reports of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.stepped import stepped
from ramsight.plant.linkage.lever import Lever
from ramsight.plant.unit import HydraulicUnit

_OTHER = 0x616E676C  # apart from the drive's noise of the same seed


@dataclass(frozen=True)
class LinkReport:
    """How a sensor of the moved body's angle is.

    Args:
        lever: what the angle says of the position.
        offset: of the angle [rad].
        noise: of vibration and acceleration, standard deviation [rad].
        correlation: for which it stays what it is [s].
        lag: of the first order [s].
        step: [rad].
        seed: of the noise; the same seed gives the same angles.
    """

    lever: Lever
    offset: float = 0.0
    noise: float = 0.0
    correlation: float = 0.5
    lag: float = 0.0
    step: float = math.radians(0.01)
    seed: int = 0

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
    """The sensor that a unit declares, with an offset drawn from what is declared; None if it declares none.

    Args:
        unit: the unit.
        seed: of offset and noise; the same seed gives the same sensor.
    """
    assumed = unit.assumptions.link_angle
    if assumed.std == 0.0 or unit.lever is None:
        return None
    offset = assumed.offset * float(np.random.default_rng([seed, _OTHER]).standard_normal())
    return LinkReport(unit.lever, offset, assumed.std, assumed.correlation, assumed.lag, seed=seed)
