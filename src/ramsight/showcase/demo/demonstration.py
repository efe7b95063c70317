"""The demonstration: two tracks of the log that ships with the package."""

from __future__ import annotations

from ramsight.api.tracking import track
from ramsight.logs import read_log, read_truth
from ramsight.plant.build import build
from ramsight.showcase.demo import LOG, MACHINE, TRUTH, UNIT
from ramsight.showcase.demo.showing import Shown


def demonstrated(progress: bool = False) -> Shown:
    """Track the log of the package: by the sensor without a start, and by the data sheet with the true one.

    Args:
        progress: show a bar on a terminal if it takes long.
    """
    unit, log, truth = build(MACHINE, UNIT), read_log(LOG), read_truth(TRUTH)
    start = float(truth["position"][0])
    sensor = track(unit, log, truth=truth, progress=progress)
    sheet = track(unit, log, start, truth, sensor="balance", progress=progress)
    return Shown(sensor, sheet, truth, unit.cylinder.stroke)
