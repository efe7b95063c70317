"""A real position sensor on the same bus, held against the virtual one."""

from __future__ import annotations

import math

from ramsight.deploy.encoder.alarms import Fault
from ramsight.deploy.encoder.listening import Listener, Sample
from ramsight.deploy.encoder.server import Node
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.virtual_sensor import Estimate
from ramsight.tracking.comparing import Comparison, Verdict

TOLERANCE, ALERT = (0x2032, 0), (0x2033, 0)
"""Objects: what the real one may be wrong by [µm], and for how long both have to be apart [ms]."""
ALONE = 255
"""Verdict of a node that no real sensor is mapped for."""
_FAULTS = {
    Verdict.APART: Fault.APART,
    Verdict.OTHER_WRONG: Fault.OTHER_WRONG,
    Verdict.VIRTUAL_WRONG: Fault.VIRTUAL_WRONG,
}


class Beside:
    """The comparison, sample by sample of the drive.

    Both sensors report when they like. What the real one said is taken to the time of the drive's sample by the virtual
    one's velocity: at 0.3 m/s a report that is 10 ms old is 3 mm behind, more than many a tolerance.
    """

    def __init__(self, listener: Listener, unit: HydraulicUnit, node: Node) -> None:
        self._listener, self._node = listener, node
        self._pair = Comparison.of(unit, self._tolerance)
        self._verdict = Verdict.UNCHECKED
        self.position = math.nan

    @property
    def is_there(self) -> bool:
        """Whether a real sensor is mapped."""
        return self._listener.has_other

    @property
    def _tolerance(self) -> float:
        return 1e-6 * self._node.get(*TOLERANCE)

    def compare(self, now: float, sample: Sample, estimate: Estimate, bound: float) -> None:
        """What both say of a sample of the drive, `bound` [m] being the virtual one's."""
        if not self.is_there:
            return
        said, sent = self._listener.other(now)
        moved = estimate.velocity * (sample.time - sent)
        self.position = said + (moved if math.isfinite(moved) else 0.0)
        self._pair.tolerance, self._pair.time_to_alert = self._tolerance, 1e-3 * self._node.get(*ALERT)
        self._verdict = self._pair.step(sample.time, estimate.position, bound, estimate.status, self.position)

    def unchecked(self) -> None:
        """The virtual sensor has no samples: nothing can be said."""
        self._verdict = Verdict.UNCHECKED

    @property
    def verdict(self) -> int:
        """Number of the verdict; `ALONE` without a real sensor."""
        return int(self._verdict) if self.is_there else ALONE

    @property
    def fault(self) -> Fault | None:
        """What the verdict is for the node."""
        return _FAULTS.get(self._verdict)
