"""What to say of a tracked log."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ramsight.sensor.status import Status
from ramsight.study.errors import PositionErrors, TrackErrors
from ramsight.study.named_faults import FaultNames

if TYPE_CHECKING:
    import xarray


class Tally:
    """What is to be said of a track in the end, counted piece by piece."""

    def __init__(self) -> None:
        self._samples, self._sensor = 0, ""
        self._time: list[float] = []
        self._position: list[float] = []
        self._counts: dict[int, int] = {}
        self._faults = FaultNames()

    def append(self, tracked: xarray.Dataset) -> None:
        """Count the samples of a piece by their status."""
        time, position = tracked["time"].values, tracked["position"].values
        self._sensor, self._samples = tracked.attrs["sensor"], self._samples + len(time)
        self._time = [*self._time[:1], float(time[0]), float(time[-1])]
        self._position = [*self._position[:1], float(position[0]), float(position[-1])]
        for code, count in zip(*np.unique(tracked["status"].values, return_counts=True), strict=True):
            self._counts[int(code)] = self._counts.get(int(code), 0) + int(count)
        self._faults.append(tracked)

    @property
    def text(self) -> str:
        """One line on where the piston is now, one on each doubt, and one on each fault of an input that has a name."""
        first, last = (_millimetres(self._position[k]) for k in (0, -1))
        lines = [
            f"{self._sensor} sensor: {self._samples} samples over {self._time[-1] - self._time[0]:.1f} s, "
            f"position {first} at first, {last} at last"
        ]
        for code, count in sorted(self._counts.items()):
            if code != Status.OK:
                lines.append(f"  {100 * count / self._samples:.1f} % of the samples {Status(code).text}")
        return "\n".join([*lines, *(f"  {one.text}" for one in self._faults.close())])


def _millimetres(position: float) -> str:
    return f"{1e3 * position:.1f} mm" if np.isfinite(position) else "unknown"


def error_text(found: TrackErrors, samples: int) -> str:
    """One line on the errors of a track, in mm, how many samples they rest on, and a line on each kind left out.

    Args:
        found: the errors.
        samples: of the track.
    """
    lines = [f"error against the truth: {_usable_text(found.usable, samples)}"]
    if found.invalid:
        lines.append(f"  not counted: {found.invalid} invalid samples, largest {1e3 * found.invalid_largest:.3f} mm")
    if found.set_back:
        lines.append(f"  not counted: {found.set_back} samples whose clock was set back")
    return "\n".join(lines)


def _usable_text(found: PositionErrors | None, samples: int) -> str:
    if found is None:
        return f"none to be had, 0 of {samples} samples have a position where it is known"
    final = f"{1e3 * found.final:.3f} mm" if np.isfinite(found.final) else "unknown"
    return (
        f"largest {1e3 * found.largest:.3f} mm, 95 % within {1e3 * found.p95:.3f} mm, "
        f"final {final}; over {found.samples} of {samples} samples"
    )
