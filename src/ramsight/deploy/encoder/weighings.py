"""What a node says of lifts: the last weighing, how many there were, and the total since power-up."""

from __future__ import annotations

import math

from ramsight.deploy.encoder.objects import LOAD_STATUSES, NO_SCALE, NO_WEIGHING, QUALITIES
from ramsight.sensor.virtual_sensor import VirtualSensor
from ramsight.tool.load_chart import LoadStatus
from ramsight.tool.weigher import Weigher
from ramsight.tool.weighing_events import Weighing
from ramsight.tool.weighing_tally import Total


class Weighings:
    """The weighings of a unit, sample by sample of its drive.

    Args:
        weigher: of the machine; None where it weighs nothing.
    """

    def __init__(self, weigher: Weigher | None, unit: str) -> None:
        self._weigher, self._unit = weigher, unit

    def take(self, time: float, sensor: VirtualSensor) -> None:
        """Take what the sensor said of a sample [s]."""
        if self._weigher is not None:
            self._weigher.step(time, {self._unit: sensor})

    @property
    def rated(self) -> float:
        """Rated payload [kg]; 0 where nothing is weighed."""
        return 0.0 if self._weigher is None else self._weigher.scene.rated

    @property
    def count(self) -> int:
        """How many there were since power-up; one that lowering the same load made better is counted once."""
        return 0 if self._weigher is None else self._weigher.tally.count

    @property
    def mass(self) -> float:
        """Of the last one [kg]; NaN where there is none."""
        return math.nan if self._last is None else self._last.mass

    @property
    def std(self) -> float:
        """Standard deviation of that mass [kg]; NaN where there is none."""
        return math.nan if self._last is None else self._last.std

    @property
    def quality(self) -> int:
        """Number of `objects.QUALITIES`; `NO_WEIGHING` before the first one, `NO_SCALE` where nothing is weighed."""
        if self._weigher is None:
            return NO_SCALE
        return NO_WEIGHING if self._last is None else QUALITIES.index(self._last.quality)

    @property
    def share(self) -> float:
        """Of the rated load, at most in that lift [1]; NaN where it is unknown."""
        return math.nan if self._last is None else self._last.rated_share

    @property
    def share_std(self) -> float:
        """Standard deviation of that share [1]; NaN where it is unknown."""
        return math.nan if self._last is None else self._last.rated_share_std

    @property
    def status(self) -> int:
        """Number of `objects.LOAD_STATUSES`."""
        return LOAD_STATUSES.index(LoadStatus.UNKNOWN if self._last is None else self._last.rated_status)

    @property
    def total(self) -> float:
        """Mass of all cycles since power-up, one good weighing of each [kg]."""
        return self._total.mass

    @property
    def total_std(self) -> float:
        """Standard deviation of the total [kg]."""
        return 0.0 if self._weigher is None else self._total.std(self._weigher.tally.scale)

    @property
    def _last(self) -> Weighing | None:
        return None if self._weigher is None else self._weigher.tally.last

    @property
    def _total(self) -> Total:
        return Total() if self._weigher is None else self._weigher.tally.total
