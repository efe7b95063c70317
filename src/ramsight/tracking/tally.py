"""What to say of a tracked log."""

from __future__ import annotations

import numpy as np

from ramsight.sensor.status import Status
from ramsight.signals import Samples
from ramsight.tracking.named_faults import FaultNames
from ramsight.tracking.passed_time import PassedTime


class Tally:
    """What is to be said of a track in the end, counted piece by piece."""

    def __init__(self) -> None:
        self._samples, self._sensor = 0, ""
        self._passed = PassedTime()
        self._position: list[float] = []
        self._counts: dict[int, int] = {}
        self._faults = FaultNames()

    def append(self, tracked: Samples) -> None:
        """Count the samples of a piece by their status."""
        time, position = tracked["time"].values, tracked["position"].values
        self._sensor, self._samples = tracked.attrs["sensor"], self._samples + len(time)
        self._passed.append(time)
        self._position = [*self._position[:1], float(position[0]), float(position[-1])]
        for code, count in zip(*np.unique(tracked["status"].values, return_counts=True), strict=True):
            self._counts[int(code)] = self._counts.get(int(code), 0) + int(count)
        self._faults.append(tracked)

    @property
    def text(self) -> str:
        """A line on the position, one on each status that is not ok, and one on each named fault of an input."""
        first, last = (_millimetres(self._position[k]) for k in (0, -1))
        lines = [
            f"{self._sensor} sensor: {self._samples} samples over {self._passed.seconds:.1f} s, "
            f"position {first} at first, {last} at last"
        ]
        for code, count in sorted(self._counts.items()):
            if code != Status.OK:
                lines.append(f"  {100 * count / self._samples:.1f} % of the samples {Status(code).text}")
        return "\n".join([*lines, *(f"  {one.text}" for one in self._faults.close())])


def _millimetres(position: float) -> str:
    return f"{1e3 * position:.1f} mm" if np.isfinite(position) else "unknown"
