"""Pictures of a tracked log, and of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.output import atomic_path
from ramsight.sensor.status import Status

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

ESTIMATE, TRUTH, ERROR, DOUBT = "#c8401e", "#1f2a36", "#2a6f97", "#e9b44c"
_STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "svg.hashsalt": "ramsight",
}


def save(figure: Any, path: str | Path) -> None:
    """Write a figure whole, in the format of its suffix (.png, .svg, .pdf)."""
    with atomic_path(path) as draft:
        figure.savefig(draft, dpi=160, metadata={"Date": None} if draft.suffix in {".svg", ".pdf"} else None)


def tracked_figure(
    log: xarray.Dataset, tracked: xarray.Dataset, truth: xarray.Dataset | None, title: str, path: str | Path
) -> None:
    """Draw a tracked log: position with the truth if there is one, the error, and what the drive reported.

    Args:
        log: the drive log.
        tracked: what the sensor made of it.
        truth: with `position` [m], or None.
        title: above the picture.
        path: .png, .svg or .pdf.
    """
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):  # type: ignore[arg-type]
        save(draw_track(log, tracked, truth, title), path)


def draw_track(log: xarray.Dataset, tracked: xarray.Dataset, truth: xarray.Dataset | None, title: str) -> Figure:
    """The picture of `tracked_figure`, a `matplotlib.figure.Figure`.

    Args:
        log: with motor_speed [rad/s] and motor_torque [N m].
        tracked: with position, position_std [m] and status.
        truth: with `position` [m], or None.
        title: above the picture.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    time = tracked["time"].values
    with mpl.rc_context(_STYLE):  # type: ignore[arg-type]
        rows = 4 if truth is not None else 3
        heights = [2.2, 1.2, 1.0, 1.0] if truth is not None else [2.2, 1.0, 1.0]
        figure = Figure(figsize=(7.2, 1.2 + 1.35 * rows), layout="constrained")
        axes = figure.subplots(rows, 1, sharex=True, height_ratios=heights)
        position = axes[0]
        if truth is not None:
            position.plot(truth["time"], 1e3 * truth["position"], color=TRUTH, lw=2.4, label="true position")
        position.plot(
            time, 1e3 * tracked["position"], color=ESTIMATE, lw=1.1, label=f"{tracked.attrs['sensor']} sensor"
        )
        band = 1.96e3 * tracked["position_std"].values
        if np.isfinite(band).any():
            middle = 1e3 * tracked["position"].values
            position.fill_between(
                time, middle - band, middle + band, color=ESTIMATE, alpha=0.15, lw=0, label="95 % band"
            )
        _shade(position, time, tracked["status"].values)
        position.set_ylabel("position [mm]")
        position.legend(loc="best")
        position.set_title(title, loc="left", fontweight="bold")
        if truth is not None:
            error = 1e3 * (tracked["position"].values - np.interp(time, truth["time"], truth["position"]))
            if np.isfinite(band).any():
                axes[1].fill_between(time, -band, band, color=ESTIMATE, alpha=0.15, lw=0)
                axes[1].set_ylim(*_reach(error, band))
            axes[1].plot(time, error, color=ERROR, lw=1.0)
            axes[1].axhline(0.0, color=TRUTH, lw=0.6)
            axes[1].set_ylabel("error [mm]")
        _draw_drive(axes[-2:], log)
        figure.align_ylabels()
    return figure


def draw_run(run: xarray.Dataset, title: str) -> Figure:
    """A picture of a simulated run: position, chamber pressures, motor speed and torque.

    Args:
        run: a Dataset as `ramsight.duty.simulate` returns it.
        title: above the picture.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(_STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 6.6), layout="constrained")
        axes = figure.subplots(4, 1, sharex=True, height_ratios=[2.2, 1.2, 1.0, 1.0])
        axes[0].plot(run["time"], 1e3 * run["position"], color=TRUTH, lw=1.6)
        axes[0].set_ylabel("position [mm]")
        axes[0].set_title(title, loc="left", fontweight="bold")
        for name, color in (("pressure_a", ESTIMATE), ("pressure_b", ERROR)):
            if name in run:
                axes[1].plot(run["time"], run[name] / 1e5, color=color, lw=1.0, label=f"chamber {name[-1].upper()}")
        axes[1].set_ylabel("pressure\n[bar]")
        axes[1].legend(loc="best")
        _draw_drive(axes[-2:], run)
        figure.align_ylabels()
    return figure


def _draw_drive(axes: Any, log: xarray.Dataset) -> None:
    """Draw what the drive reported, into two axes."""
    axes[0].plot(log["time"], log["motor_speed"].values * 60 / (2 * np.pi), color=TRUTH, lw=1.0)
    axes[0].set_ylabel("motor speed\n[rpm]")
    axes[1].plot(log["time"], log["motor_torque"], color=TRUTH, lw=0.6)
    axes[1].set_ylabel("motor torque\n[N m]")
    axes[1].set_xlabel("time [s]")


def _reach(error: Any, band: Any) -> tuple[float, float]:
    """Limits that show the error whole, and the band where it is not much wider."""
    reach = 1.1 * max(float(np.nanmax(np.abs(error))), min(float(np.nanmax(band)), 3.0 * float(np.nanmedian(band))))
    return -reach, reach


def _shade(axes: Any, time: Any, status: Any) -> None:
    """Mark where the sensor is not sure."""
    doubt = np.concatenate([[False], status != Status.OK, [False]])
    edges = np.flatnonzero(np.diff(doubt.astype(int)))
    for k, (first, last) in enumerate(zip(edges[::2], edges[1::2], strict=True)):
        label = "not sure" if k == 0 else None
        axes.axvspan(time[first], time[min(last, len(time) - 1)], color=DOUBT, alpha=0.3, lw=0, label=label)
