"""The demonstration: two tracks of the log that ships with the package."""

from __future__ import annotations

from ramsight.api.tracking import follow
from ramsight.demo import LOG, MACHINE, TRUTH, UNIT
from ramsight.demo.showing import Shown
from ramsight.logs.truth import truth_signals
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.thresholds import START_STD
from ramsight.signals import Signals
from ramsight.tracking.compared_track import with_error


def demonstrated(progress: bool = False) -> Shown:
    """Track the log of the package: by the sensor without a start, and by the data sheet with the true one.

    Args:
        progress: show a bar on a terminal if it takes long.
    """
    unit, truth = build(MACHINE, UNIT), truth_signals(TRUTH)
    sensor = _track(unit, truth, "kalman", None, progress=progress)
    sheet = _track(unit, truth, "balance", float(truth["position"].values[0]), progress=progress)
    return Shown(sensor, sheet, truth, unit.cylinder.stroke)


def _track(unit: HydraulicUnit, truth: Signals, kind: str, start: float | None, *, progress: bool) -> Signals:
    """The log with a sensor's track and its error."""
    done = follow(
        unit, LOG, sensor=kind, start=start, start_std=START_STD, keep_track=True, keep_log=True, all_of_it=True,
        progress=progress,
    )  # fmt: skip
    assert done.track is not None
    assert done.log is not None
    return with_error(Signals({**done.log.columns, **done.track.columns}, done.track.attrs), truth)
