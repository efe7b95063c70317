"""The demonstration: two tracks of the log that ships with the package, and what they show side by side.

The sensor finds its position and learns; the data sheet alone does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.api.following import follow
from ramsight.demo import AS_BUILT, LOG, MACHINE, POSITION, UNIT
from ramsight.logs.truth import truth_signals
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.thresholds import START_STD
from ramsight.signals import Signals
from ramsight.tracking import figures
from ramsight.tracking.track_errors import stop_visits, with_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_TAUGHT = 3  # visits to an end stop after which the sensor is judged
_SETTLES = 3.0  # s after a visit
_SHEET = "#8a94a0"
_LEARNED = (("leak", "leakage"), ("displacement", "displacement"))


@dataclass(frozen=True)
class Shown:
    """Two tracks of one log, with their errors [m]."""

    sensor: Signals  # of the kalman sensor, which started without a position
    sheet: Signals  # of the volume balance by the data sheet, which was started at the known position
    truth: Signals  # true `position` [m] over time
    stroke: float  # of the cylinder [m]

    @property
    def taught(self) -> float:
        """When the third visit to an end stop is over [s]."""
        visits = stop_visits(self.truth["time"].values, self.truth["position"].values, self.stroke)
        return float(visits[_TAUGHT - 1]) + _SETTLES

    def within(self, track: Signals) -> float:
        """What 95 % of a track's errors are within after the third visit [m]."""
        later = np.abs(track["error"].values[track["time"].values > self.taught])
        return float(np.nanpercentile(later, 95.0))

    @property
    def text(self) -> str:
        """What is to be seen, as lines of text."""
        found = np.isfinite(self.sensor["position"].values)
        when = float(self.sensor["time"].values[np.argmax(found)])
        factors = [
            f"{words} {float(self.sensor[f'{name}_factor'].values[-1]):.3f} ± "
            f"{TWO_SIDED_95 * float(self.sensor[f'{name}_factor_std'].values[-1]):.3f} (it is {AS_BUILT[name]:g})"
            for name, words in _LEARNED
        ]
        return "\n".join(
            [
                "A loader's boom, six minutes of work, simulated by another program; it is not its data sheet.",
                f"The sensor is started without a position, finds it at the first end stop, after {when:.0f} s, and",
                f"learns the machine over its data sheet: {', '.join(factors)}.",
                f"From {self.taught:.0f} s on, after three visits to an end stop, 95 % of the errors are within "
                f"{1e3 * self.within(self.sensor):.1f} mm;",
                f"by the data sheet alone, started at the known position, {1e3 * self.within(self.sheet):.1f} mm.",
            ]
        )


def write_figure(shown: Shown, path: Path) -> None:
    """Draw what is shown: .png, .svg or .pdf."""
    with needing("figures"):
        import matplotlib as mpl

    with mpl.rc_context(figures.STYLE):  # type: ignore[arg-type]
        figures.save(draw(shown), path)


def draw(shown: Shown) -> Figure:
    """The picture: positions, errors of both, the sensor's band, what it learned, what the drive reported."""
    with needing("figures"):
        from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 11.0), layout="constrained")
    axes = figure.subplots(8, 1, sharex=True, height_ratios=[2.2, 1.4, 1.1, 1.0, 1.0, 0.7, 0.7, 0.6])
    sensor, sheet, time = shown.sensor, shown.sheet, shown.sensor["time"].values
    axes[0].plot(
        shown.truth["time"].values,
        1e3 * shown.truth["position"].values,
        color=figures.TRUTH,
        lw=2.4,
        label="true position",
    )
    axes[0].plot(time, 1e3 * sheet["position"].values, color=_SHEET, lw=1.0, label="data sheet alone, known start")
    axes[0].plot(time, 1e3 * sensor["position"].values, color=figures.ESTIMATE, lw=1.1, label="sensor, unknown start")
    axes[0].set_ylabel("position\n[mm]")
    axes[1].plot(time, 1e3 * sheet["error"].values, color=_SHEET, lw=1.0)
    axes[1].plot(time, 1e3 * sensor["error"].values, color=figures.ERROR, lw=1.2)
    axes[1].axhline(0.0, color=figures.TRUTH, lw=0.6)
    axes[1].set_ylabel("errors\n[mm]")
    figures.draw_band(axes[2], time, TWO_SIDED_95 * 1e3 * sensor["position_std"].values, 1e3 * sensor["error"].values)
    for panel, (name, words) in zip(axes[3:5], _LEARNED, strict=True):
        _learned(panel, sensor, name, words)
    figures.draw_drive(axes[5:], sensor)
    for panel in axes[:5]:
        figures.shade_status(panel, time, sensor["status"].values)
    figures.legend_above(axes[0], ncols=3, fontsize=8)
    figure.suptitle("A boom that is not its data sheet, six minutes of work", x=0.01, ha="left", fontsize=11)
    figure.align_ylabels()
    return figure


def _learned(axes: Any, sensor: Signals, name: str, words: str) -> None:
    """Draw a factor over time with its 95 % band, and what it is in truth."""
    time, value = sensor["time"].values, sensor[f"{name}_factor"].values
    half = TWO_SIDED_95 * sensor[f"{name}_factor_std"].values
    axes.fill_between(time, value - half, value + half, color=figures.ESTIMATE, alpha=0.2, lw=0)
    axes.plot(time, value, color=figures.ESTIMATE, lw=1.2)
    axes.axhline(AS_BUILT[name], color=figures.TRUTH, lw=1.0, ls="--", label="what it is")
    figures.legend_above(axes, fontsize=7)
    axes.set_ylabel(f"{words}\n[1]")


def demonstrated(progress: bool = False) -> Shown:
    """Track the log of the package: by the sensor without a start, and by the data sheet with the true one."""
    unit, truth = build(MACHINE, UNIT), truth_signals(POSITION)
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
