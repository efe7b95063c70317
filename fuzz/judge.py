"""Whether a sensor that tracked a damaged log was wrong without saying so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parent.parent
TRACE = ROOT / "tests" / "traces" / "boom_258kN_40C"
WORK_DAY = ROOT / "tests" / "traces" / "boom_asbuilt1_workday"
START = 0.1  # m

FARTHEST, SIGMAS, LASTING = 5e-3, 4.0, 0.5
"""Silently wrong: ok with an error over 5 mm and four standard deviations for more than half a second."""


class Judge:
    """A kalman sensor for the boom, and where its piston really was.

    Args:
        trace: of the boom; log and truth.
    """

    def __init__(self, trace: Path = TRACE) -> None:
        from ramsight.calibration.sensors import sensor_for
        from ramsight.logs import read_log, read_truth
        from ramsight.machine import load_machine
        from ramsight.plant.ddh import build_ddh

        self.unit = build_ddh("boom", load_machine("mining-loader").unit("boom"))
        self.sensor = sensor_for(self.unit, "kalman")
        self.log = read_log(f"{trace}.csv.gz")
        columns = [self.log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")]
        self._rows = np.column_stack([*columns, np.zeros((len(columns[0]), 2))])  # no sample is a reference
        truth = read_truth(f"{trace}_truth.csv.gz")
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
        names = ("position", "position_std", "status")
        found = (self.silent(one["time"].values + begun, *(one[name].values for name in names)) for one in tracks)
        return next(filter(None, found), "")

    def followed(self, first: int, count: int) -> Any:
        """What the sensor says of so many samples of the log from one on: time, position, deviation, status."""
        from ramsight.engine.recursion import replay

        rows = self._rows[first : first + count]
        said = replay(self.sensor.recursion, rows, self.sensor.parameters, self.sensor._state)
        outputs = self.sensor.recursion.outputs.index
        return rows[:, 0], *(said[:, outputs(name)] for name in ("position", "position_std", "status"))

    def true(self, time: Any) -> Any:
        """Where the piston was [m]."""
        return np.interp(time, self._known_at, self._known)

    def silent(self, time: Any, position: Any, std: Any, status: Any) -> str:
        """What was silently wrong in the columns of a track [s, m, m], "" if nothing."""
        error = np.abs(position - self.true(time))
        inside = (time >= self._known_at[0]) & (time <= self._known_at[-1])
        bad = inside & (status == 0) & ~(error <= FARTHEST) & ~(error <= SIGMAS * std)
        for first, last in _runs(bad):
            lasting = float(time[last] - time[first])
            if lasting > LASTING:
                most = float(np.nanmax(error[first : last + 1], initial=0.0))
                return f"{1e3 * most:.1f} mm off for {lasting:.2f} s from {time[first]:.2f} s on"
        return ""


def _runs(chosen: Any) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(chosen.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(end) - 1) for first, end in zip(edges[::2], edges[1::2], strict=True)]
