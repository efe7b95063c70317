"""Whether a sensor that tracked a damaged log was wrong without saying so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parent.parent
TRACE = ROOT / "tests" / "traces" / "boom_258kN_40C"
START = 0.1  # m

FARTHEST, SIGMAS, LASTING = 5e-3, 4.0, 0.5
"""Silently wrong: ok with an error over 5 mm and four standard deviations for more than half a second."""


class Judge:
    """A kalman sensor for the boom, and where its piston really was."""

    def __init__(self) -> None:
        from ramsight.calibration.sensors import sensor_for
        from ramsight.logs import read_drive_log, read_truth
        from ramsight.machine import load
        from ramsight.plant.ddh import build

        self.unit = build("boom", load("mining-loader").unit("boom"))
        self.sensor = sensor_for(self.unit, "kalman")
        self.log = read_drive_log(f"{TRACE}.csv.gz")
        truth = read_truth(f"{TRACE}_truth.csv.gz")
        self._known_at, self._known = truth["time"].values, truth["position"].values
        if wrong := self.wrong(self.track([self.log])):
            raise RuntimeError(f"the sensor is wrong on the log before it is damaged: {wrong}")

    def track(self, pieces: Any, begun: float = 0.0) -> list[Any]:
        """What the sensor says of a log that begins so late [s]; it is told where the piston is at the first sample."""
        tracks: list[Any] = []
        for piece in pieces:
            if not tracks:
                first = float(piece["time"].values[0]) + begun
                known = np.interp(first, self._known_at, self._known) if 0.0 < first < self._known_at[-1] else START
                self.sensor.start(float(known), 1e-3)
            tracks.append(self.sensor.track(piece))
        return tracks

    def wrong(self, tracks: list[Any], begun: float = 0.0) -> str:
        """What was silently wrong in tracks whose clock began so many seconds late, "" if nothing."""
        for track in tracks:
            time = track["time"].values + begun
            error = np.abs(track["position"].values - np.interp(time, self._known_at, self._known))
            inside = (time >= self._known_at[0]) & (time <= self._known_at[-1])
            bad = inside & (track["status"].values == 0) & ~(error <= FARTHEST)
            bad &= ~(error <= SIGMAS * track["position_std"].values)
            for first, last in _runs(bad):
                lasting = float(time[last] - time[first])
                if lasting > LASTING:
                    most = float(np.nanmax(error[first : last + 1], initial=0.0))
                    return f"{1e3 * most:.1f} mm off for {lasting:.2f} s from {time[first]:.2f} s on"
        return ""


def _runs(chosen: Any) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(end) - 1) for first, end in zip(edges[::2], edges[1::2], strict=True)]
