"""Pictures of a tracked log, and of a run."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ramsight.arrays import true_intervals
from ramsight.errors import one_line
from ramsight.hindsight.innovations import NIS, UNEXPECTED
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.output import atomic_path
from ramsight.sensor.status import VALIDITIES, Status, validity_levels
from ramsight.sensor.virtual_sensor import HIGHEST, LIVE, LOWEST
from ramsight.signals import Samples
from ramsight.units import FREEZING, RPM

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ESTIMATE, TRUTH, ERROR, UNCERTAIN = "#c8401e", "#1f2a36", "#2a6f97", "#e9b44c"
AS_IT_CAME = "#8a94a0"
_SHADES = {
    VALIDITIES.index(one.validity): (one.validity, colour)
    for one, colour in (
        (Status.REFERENCE_DUE, UNCERTAIN),
        (Status.NOT_REFERENCED, "#8a94a0"),
        (Status.INPUT_LOST, ESTIMATE),
    )
}
"""Name and colour of each validity that is not ok."""

_NEVER_KNOWN = "The position is never known: give --start, or a log that meets an end stop."
_LEAST = 1e-3  # mm; smaller errors stand there on the logarithmic scale
STYLE = {
    "font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.25,
    "legend.frameon": False, "svg.hashsalt": "ramsight",
}  # fmt: skip


_JOURNAL = {
    "font.size": 7,
    "font.family": "serif",
    "mathtext.fontset": "stix",
    "axes.linewidth": 0.5,
    "grid.linewidth": 0.4,
    "pdf.fonttype": 42,  # TrueType, which publishers ask for
}
LOOKS = ("screen", "journal")
_INCH = 25.4e-3  # m
_NAME = 35e-3  # m, of a name in a legend with its line
_THIN = 0.6


@dataclass(frozen=True)
class Look:
    """How large a figure is, and for whom."""

    width: float | None = None  # [m]; None for that of the screen. The height stays as it is.
    style: str = LOOKS[0]  # one of `LOOKS`: journal has a serif font of 7 points, thin lines, and no title

    @property
    def is_for_print(self) -> bool:
        """Whether a caption says what the title would."""
        return self.style == "journal"

    def context(self) -> AbstractContextManager[Any]:
        """Matplotlib's parameters while a figure is made and saved."""
        with needing("figures"):
            import matplotlib as mpl

        return mpl.rc_context(STYLE | (_JOURNAL if self.is_for_print else {}))  # type: ignore[arg-type]

    def fit(self, figure: Any) -> None:
        """Give a figure its width, and thin lines where it is printed."""
        if self.width is not None:
            figure.set_size_inches(self.width / _INCH, figure.get_figheight())
        if self.is_for_print:
            for line in (line for axes in figure.axes for line in axes.lines):
                line.set_linewidth(_THIN * line.get_linewidth())

    def beside(self, columns: int) -> int:
        """How many names of a legend stand beside each other, of so many at most."""
        return columns if self.width is None else min(max(int(self.width / _NAME), 1), columns)


SCREEN = Look()


def verbatim(text: str) -> str:
    r"""A title with the name of a file in it: no control character, which XML forbids.

    And no formula, as which Matplotlib would set what is between two $.

    Example:
        >>> verbatim("a$b$.csv")
        'a\\$b\\$.csv'
    """
    return one_line(text).replace("$", r"\$")


def save(figure: Any, path: str | Path) -> None:
    """Write a figure whole, in the format of its suffix (.png, .svg, .pdf)."""
    with atomic_path(path) as draft:
        figure.savefig(draft, dpi=160, metadata={"Date": None} if draft.suffix in {".svg", ".pdf"} else None)


def legend_above(axes: Any, **style: Any) -> None:
    """Put the legend above the axes, on the right: there it lies on no curve."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, **style)


def tracked_figure(
    log: Samples, tracked: Samples, truth: Samples | None, title: str, path: str | Path, look: Look = SCREEN
) -> None:
    """Draw a tracked log: position with the truth if there is one, the error, and what the drive reported.

    Args:
        truth: with `position` [m], or None.
    """
    with look.context():
        save(draw_track(log, tracked, truth, title, look), path)


def draw_track(log: Samples, tracked: Samples, truth: Samples | None, title: str, look: Look = SCREEN) -> Figure:
    """The picture of `tracked_figure`, a `matplotlib.figure.Figure`: a panel a quantity, so that each has its scale.

    Args:
        log: with motor_speed [rad/s], motor_torque [N m] and oil_temperature [K].
        tracked: with position, position_std [m] and status, and the ends of its band if the sensor states them.
        truth: with `position` [m], or None.
    """
    with needing("figures"):
        from matplotlib.figure import Figure

    time, band = tracked["time"].values, 1e3 * half_band(tracked)
    has_band = bool(np.isfinite(band).any())  # the volume balance states none
    with look.context():
        heights = [2.4, *[1.2] * ((truth is not None) + has_band), 0.8, 0.8, 0.6]
        figure = Figure(figsize=(7.2, 1.2 + 1.05 * sum(heights)), layout="constrained")
        axes = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        position = axes[0]
        if truth is not None:
            position.plot(
                truth["time"].values, 1e3 * truth["position"].values, color=TRUTH, lw=2.4, label="true position"
            )
        estimate = 1e3 * tracked["position"].values
        if f"{LIVE}{LOWEST}" in tracked:
            low, high = (1e3 * tracked[f"{LIVE}{end}"].values for end in (LOWEST, HIGHEST))
            position.fill_between(time, low, high, color=AS_IT_CAME, alpha=0.25, lw=0.0, label="95 % band, live")
        if LOWEST in tracked:
            low, high = (1e3 * tracked[end].values for end in (LOWEST, HIGHEST))
            position.fill_between(time, low, high, color=ESTIMATE, alpha=0.15, lw=0.0, label="95 % band")
        position.plot(time, estimate, color=ESTIMATE, lw=1.1, label=f"{tracked.attrs['sensor']} sensor")
        if NIS in tracked:
            draw_unexpected(position, time, estimate, tracked[NIS].values)
        position.set_ylabel("position\n[mm]")
        if not np.isfinite(estimate).any():
            position.text(0.5, 0.5, _NEVER_KNOWN, transform=position.transAxes, ha="center", va="center")
        error = None
        if truth is not None:
            error = estimate - 1e3 * np.interp(
                time, truth["time"].values, truth["position"].values, left=np.nan, right=np.nan
            )
            axes[1].plot(time, error, color=ERROR, lw=1.0)
            axes[1].axhline(0.0, color=TRUTH, lw=0.6)
            axes[1].set_ylabel("error\n[mm]")
        if has_band:
            draw_band(axes[-4], time, band, error, half_band(tracked, LIVE) if f"{LIVE}{LOWEST}" in tracked else None)
        draw_drive(axes[-3:], log)
        for one in axes[:-3]:
            shade_status(one, time, tracked["status"].values)
        legend_above(position, ncols=look.beside(5))
        if not look.is_for_print:
            figure.suptitle(title, x=0.01, ha="left", fontsize=10, fontweight="bold")
        figure.align_ylabels()
        look.fit(figure)
    return figure


def draw_unexpected(axes: Any, time: Any, position: Any, nis: Any) -> None:
    """Mark the measurements of the place that were not as expected [mm]."""
    odd = np.nan_to_num(nis) > UNEXPECTED
    if odd.any():
        axes.plot(time[odd], position[odd], "x", color=TRUTH, ms=6.0, label="not as expected")


def half_band(tracked: Samples, before: str = "") -> Any:
    """Half of the 95 % band's width [m]: by its ends where the sensor states them, else by its standard deviation."""
    if f"{before}{LOWEST}" in tracked:
        return 0.5 * (tracked[f"{before}{HIGHEST}"].values - tracked[f"{before}{LOWEST}"].values)
    return TWO_SIDED_95 * tracked["position_std"].values


def draw_band(axes: Any, time: Any, band: Any, error: Any, live: Any = None) -> None:
    """Draw half of the 95 % band [mm] on a logarithmic scale, with the error's magnitude and the live band if known.

    Args:
        time: of the samples [s].
        band: half of its width [mm].
        error: of the position [mm]; None if unknown.
        live: half the width of the live sensor's band [m]; None where it is that.
    """
    if error is not None:
        axes.plot(time, np.maximum(np.abs(error), _LEAST), color=ERROR, lw=0.8, label="error")
    if live is not None:
        axes.plot(time, 1e3 * live, color=AS_IT_CAME, lw=1.1, label="95 % band, live")
    axes.plot(time, band, color=ESTIMATE, lw=1.1, label="95 % band")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylabel("band ±\n[mm]")
    if error is not None or live is not None:
        legend_above(axes, ncols=3, fontsize=7)


def run_title(run: Samples) -> str:
    """What stands above the picture of a run."""
    return f"{run.attrs.get('unit')}: simulated run"


def run_figure(run: Samples, path: str | Path, look: Look = SCREEN) -> None:
    """Draw a simulated run into a file: .png, .svg or .pdf; arguments as `draw_run`."""
    with look.context():
        save(draw_run(run, run_title(run), look), path)


def draw_run(run: Samples, title: str, look: Look = SCREEN) -> Figure:
    """A picture of a simulated run: position, chamber pressures, motor speed, torque and oil temperature.

    Args:
        run: a Dataset as `ramsight.duty.simulate` returns it.
    """
    with needing("figures"):
        from matplotlib.figure import Figure

    with look.context():
        figure = Figure(figsize=(7.2, 7.2), layout="constrained")
        axes = figure.subplots(5, 1, sharex=True, height_ratios=[2.2, 1.2, 0.9, 0.9, 0.7])
        axes[0].plot(run["time"].values, 1e3 * run["position"].values, color=TRUTH, lw=1.6)
        axes[0].set_ylabel("position [mm]")
        if not look.is_for_print:
            axes[0].set_title(title, loc="left", fontweight="bold")
        for name, color in (("pressure_a", ESTIMATE), ("pressure_b", ERROR)):
            if name in run:
                axes[1].plot(
                    run["time"].values, run[name].values / 1e5, color=color, lw=1.0, label=f"chamber {name[-1].upper()}"
                )
        axes[1].set_ylabel("pressure\n[bar]")
        legend_above(axes[1], ncols=2)
        draw_drive(axes[-3:], run)
        figure.align_ylabels()
        look.fit(figure)
    return figure


def draw_drive(axes: Any, log: Samples) -> None:
    """Draw what the drive reported, into three axes."""
    axes[0].plot(log["time"].values, log["motor_speed"].values / RPM, color=TRUTH, lw=1.0)
    axes[0].set_ylabel("speed\n[rpm]")
    axes[1].plot(log["time"].values, log["motor_torque"].values, color=TRUTH, lw=0.6)
    axes[1].set_ylabel("torque\n[N m]")
    axes[2].plot(log["time"].values, log["oil_temperature"].values - FREEZING, color=TRUTH, lw=0.6)
    axes[2].set(ylabel="oil\n[°C]", xlabel="time [s]")


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
