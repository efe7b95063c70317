"""Pictures of a tracked log, and of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.intervals import true_intervals
from ramsight.normal import TWO_SIDED_95
from ramsight.output import atomic_path
from ramsight.sensor.status import VALIDITIES, Status, validity_levels
from ramsight.sensor.virtual_sensor import HIGHEST, LOWEST
from ramsight.units import FREEZING, RPM

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

ESTIMATE, TRUTH, ERROR, UNCERTAIN = "#c8401e", "#1f2a36", "#2a6f97", "#e9b44c"
_SHADES = {
    VALIDITIES.index(one.validity): (one.validity, colour)
    for one, colour in (
        (Status.REFERENCE_DUE, UNCERTAIN),
        (Status.NOT_REFERENCED, "#8a94a0"),
        (Status.INPUT_LOST, ESTIMATE),
    )
}
"""Name and colour of each validity that is not ok."""

_LEAST = 1e-3  # mm; smaller errors stand there on the logarithmic scale
STYLE = {
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


def legend_above(axes: Any, **style: Any) -> None:
    """Put the legend above the axes, on the right: there it lies on no curve."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, **style)


def tracked_figure(
    log: xarray.Dataset, tracked: xarray.Dataset, truth: xarray.Dataset | None, title: str, path: str | Path
) -> None:
    """Draw a tracked log: position with the truth if there is one, the error, and what the drive reported.

    Args:
        log: the drive log.
        tracked: the track.
        truth: with `position` [m], or None.
        title: above the picture.
        path: .png, .svg or .pdf.
    """
    import matplotlib as mpl

    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        save(draw_track(log, tracked, truth, title), path)


def draw_track(log: xarray.Dataset, tracked: xarray.Dataset, truth: xarray.Dataset | None, title: str) -> Figure:
    """The picture of `tracked_figure`, a `matplotlib.figure.Figure`: a panel a quantity, so that each has its scale.

    Args:
        log: with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].
        tracked: with position, position_std [m] and status, and the ends of its band if the sensor states them.
        truth: with `position` [m], or None.
        title: above the picture.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    time, band = tracked["time"].values, 1e3 * TWO_SIDED_95 * tracked["position_std"].values
    has_band = bool(np.isfinite(band).any())  # the volume balance states none
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        heights = [2.4, *[1.2] * ((truth is not None) + has_band), 0.8, 0.8, 0.6]
        figure = Figure(figsize=(7.2, 1.2 + 1.05 * sum(heights)), layout="constrained")
        axes = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        position = axes[0]
        if truth is not None:
            position.plot(truth["time"], 1e3 * truth["position"], color=TRUTH, lw=2.4, label="true position")
        estimate = 1e3 * tracked["position"].values
        if LOWEST in tracked:
            low, high = (1e3 * tracked[end].values for end in (LOWEST, HIGHEST))
            position.fill_between(time, low, high, color=ESTIMATE, alpha=0.15, lw=0.0, label="95 % band")
        position.plot(time, estimate, color=ESTIMATE, lw=1.1, label=f"{tracked.attrs['sensor']} sensor")
        position.set_ylabel("position\n[mm]")
        error = None
        if truth is not None:
            error = estimate - 1e3 * np.interp(time, truth["time"], truth["position"], left=np.nan, right=np.nan)
            axes[1].plot(time, error, color=ERROR, lw=1.0)
            axes[1].axhline(0.0, color=TRUTH, lw=0.6)
            axes[1].set_ylabel("error\n[mm]")
        if has_band:
            draw_band(axes[-4], time, band, error)
        draw_drive(axes[-3:], log)
        for one in axes[:-3]:
            shade_status(one, time, tracked["status"].values)
        legend_above(position, ncols=5)
        figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
        figure.align_ylabels()
    return figure


def draw_band(axes: Any, time: Any, band: Any, error: Any) -> None:
    """Draw half of the 95 % band [mm], and the magnitude of the error if it is known, on one logarithmic scale."""
    if error is not None:
        axes.plot(time, np.maximum(np.abs(error), _LEAST), color=ERROR, lw=0.8, label="error")
    axes.plot(time, band, color=ESTIMATE, lw=1.1, label="95 % band")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylabel("band ±\n[mm]")
    if error is not None:
        legend_above(axes, ncols=2, fontsize=7)


def draw_run(run: xarray.Dataset, title: str) -> Figure:
    """A picture of a simulated run: position, chamber pressures, motor speed, torque and oil temperature.

    Args:
        run: a Dataset as `ramsight.duty.simulate` returns it.
        title: above the picture.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(7.2, 7.2), layout="constrained")
        axes = figure.subplots(5, 1, sharex=True, height_ratios=[2.2, 1.2, 0.9, 0.9, 0.7])
        axes[0].plot(run["time"], 1e3 * run["position"], color=TRUTH, lw=1.6)
        axes[0].set_ylabel("position [mm]")
        axes[0].set_title(title, loc="left", fontweight="bold")
        for name, color in (("pressure_a", ESTIMATE), ("pressure_b", ERROR)):
            if name in run:
                axes[1].plot(run["time"], run[name] / 1e5, color=color, lw=1.0, label=f"chamber {name[-1].upper()}")
        axes[1].set_ylabel("pressure\n[bar]")
        legend_above(axes[1], ncols=2)
        draw_drive(axes[-3:], run)
        figure.align_ylabels()
    return figure


def draw_drive(axes: Any, log: xarray.Dataset) -> None:
    """Draw what the drive reported, into three axes."""
    axes[0].plot(log["time"], log["motor_speed"].values / RPM, color=TRUTH, lw=1.0)
    axes[0].set_ylabel("speed\n[rpm]")
    axes[1].plot(log["time"], log["motor_torque"], color=TRUTH, lw=0.6)
    axes[1].set_ylabel("torque\n[N m]")
    axes[2].plot(log["time"], log["oil_temperature"].values - FREEZING, color=TRUTH, lw=0.6)
    axes[2].set_ylabel("oil\n[°C]")
    axes[2].set_xlabel("time [s]")


def shade_status(axes: Any, time: Any, status: Any) -> None:
    """Mark where the status is not ok, a colour for each validity."""
    validity = validity_levels(status)
    for level, (name, colour) in _SHADES.items():
        shade(axes, time, validity == level, colour, name)


def shade(axes: Any, time: Any, where: Any, colour: str, name: str, alpha: float = 0.25) -> None:
    """Mark the stretches at which something holds, one of them with its name for the legend."""
    for k, (first, end) in enumerate(true_intervals(where)):
        label = name if k == 0 else None
        axes.axvspan(time[first], time[min(end, len(time) - 1)], color=colour, alpha=alpha, lw=0, label=label)
