"""A real position sensor beside the virtual ones: it may slip, and the two are compared sample by sample."""

from __future__ import annotations

from dataclasses import dataclass

from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.virtual_sensor import BOUND, Estimate, VirtualSensor
from ramsight.tracking.comparing import TOLERANCE, Comparison, Verdict


@dataclass(frozen=True)
class Compared:
    """One sample."""

    position: float  # that the real sensor reports [m]
    verdict: Verdict  # of the comparison with `kalman`


class Transducer:
    """A position sensor on one rod, with a magnet that may slip.

    Attributes:
        slipped: by which it reads too much [m].
    """

    def __init__(self, unit: HydraulicUnit) -> None:
        self.slipped = 0.0
        self._pair = Comparison.of(unit, TOLERANCE)

    def step(self, time: float, position: float, sensor: VirtualSensor, said: Estimate) -> Compared:
        """One sample.

        Args:
            time: [s].
            position: the true one [m].
        """
        shown = position + self.slipped
        verdict = self._pair.step(time, said.position, sensor.says(BOUND), int(said.status), shown)
        return Compared(shown, verdict)
