"""Recorded machines held against a sheet: whether it would have promised what they did."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ramsight.logs import read_log, read_truth
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.study.datasheet.machine_tasks import Bench
from ramsight.study.datasheet.measuring import GROUPS, Track, measures
from ramsight.study.datasheet.sheet import Sheet

_START_KNOWN = 1e-3  # m; standard deviation of the sensor's start position


def held_against(sheet: Sheet, bench: Bench, log: Path, truth: Path) -> dict[str, Any]:
    """A recorded drive log with its true position, tracked as the sheet's machines are.

    Args:
        sheet: the data sheet.
        bench: of its study.
        log: a drive log, as `ramsight.logs.read_log` reads it.
        truth: its true position.

    Returns:
        The log's name and, for each group of errors, `p95` and `largest` [m] and whether they lie `inside` what
        95 % of the machines keep, with the interval of that, and the largest error found; None where it has no errors.

    Raises:
        LogError: a file cannot be read.
    """
    reported, true = read_log(log), read_truth(truth)
    position = np.interp(reported["time"].values, true["time"].values, true["position"].values)
    sensor = bench.virtual
    sensor.start(float(position[0]), _START_KNOWN)
    tracked = sensor.track(reported)
    track = Track(
        reported["time"].values,
        tracked["position"].values,
        tracked["position_std"].values,
        tracked["status"].values.astype(np.int64),
        position,
        sheet.stroke,
        tracked[BOUND].values if BOUND in tracked else None,
    )
    found = measures(track)
    after: list[dict[str, Any] | None] = []
    for k in range(len(GROUPS)):
        promised = sheet.accuracy[k]
        p95, largest = float(np.asarray(found["p95"])[k]), float(np.asarray(found["largest"])[k])
        if not np.isfinite(p95) or not promised.machines:
            after.append(None)
            continue
        inside = p95 <= promised.machine.high and largest <= promised.largest
        after.append({"p95": p95, "largest": largest, "inside": bool(inside)})
    return {"log": log.name, "after": after}
