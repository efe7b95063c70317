"""What to say of a tracked log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ramsight.sensor.status import Status
from ramsight.study.errors import position_errors

if TYPE_CHECKING:
    import xarray


class Tally:
    """What is to be said of a track in the end, counted piece by piece."""

    def __init__(self) -> None:
        self._samples, self._sensor = 0, ""
        self._time: list[float] = []
        self._position: list[float] = []
        self._counts: dict[int, int] = {}

    def append(self, tracked: xarray.Dataset) -> None:
        """Count a piece."""
        time, position = tracked["time"].values, tracked["position"].values
        self._sensor, self._samples = tracked.attrs["sensor"], self._samples + len(time)
        self._time = [*self._time[:1], float(time[0]), float(time[-1])]
        self._position = [*self._position[:1], float(position[0]), float(position[-1])]
        for code, count in zip(*np.unique(tracked["status"].values, return_counts=True), strict=True):
            self._counts[int(code)] = self._counts.get(int(code), 0) + int(count)

    @property
    def text(self) -> str:
        """One line on where the piston is now, and one on each doubt."""
        lines = [
            f"{self._sensor} sensor: {self._samples} samples over {self._time[-1] - self._time[0]:.1f} s, "
            f"position {1e3 * self._position[0]:.1f} mm at first, {1e3 * self._position[-1]:.1f} mm at last"
        ]
        for code, count in sorted(self._counts.items()):
            if code != Status.OK:
                lines.append(f"  {100 * count / self._samples:.1f} % of the samples {Status(code).text}")
        return "\n".join(lines)


def error_summary(tracked: xarray.Dataset, truth: xarray.Dataset) -> str:
    """The largest, the 95th-percentile and the final error in mm.

    Raises:
        ComparisonError: the two have no time in common.
    """
    found = position_errors(
        tracked["time"].values, tracked["position"].values, truth["time"].values, truth["position"].values
    )
    return (
        f"error: largest {1e3 * found.largest:.3f} mm, 95 % within {1e3 * found.p95:.3f} mm, "
        f"final {1e3 * found.final:.3f} mm"
    )
