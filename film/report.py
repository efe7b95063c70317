"""What the film leaves: animation, figures and numbers, in a directory that appears whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from film.animation import write_animation
from film.loading_cycle import UNITS, Options, Work
from ramsight import Status, __version__
from ramsight.normal import TWO_SIDED_95
from ramsight.optional import needing
from ramsight.output import whole_folder
from ramsight.tracking.figures import ERROR, ESTIMATE, STYLE, TRUTH, UNCERTAIN, save
from ramsight.units import RPM

FORMAT = 1
_LAST = "results.json"  # moved last: where it is, the rest is whole


def write_work(
    work: Work, options: Options, out: Path, *, title: str = "", advance: Callable[[float], object] | None = None
) -> None:
    """Write loader.html, loader.gif, control.png, control.svg and results.json.

    Args:
        work: what to show.
        options: with what it was done.
        out: the directory; made if it is not there. Other files in it stay.
        title: above page and figure.
        advance: called now and then with the share of the work done since the last call; 1 in all.

    Raises:
        OutputError: it cannot be written.
    """
    with whole_folder(out, _LAST) as draft:
        write_animation(work.machine, work.run, work.tracks, draft, phases=work.phases, title=title, advance=advance)
        for suffix in ("png", "svg"):
            control_figure(work, draft / f"control.{suffix}", title)
        written = {"format": FORMAT, "ramsight": __version__, "machine": work.machine.name, "options": vars(options)}
        text = json.dumps(written | work.results(), indent=1, ensure_ascii=False, allow_nan=False)
        (draft / _LAST).write_text(text + "\n", encoding="utf-8")


def control_figure(work: Work, path: Path, title: str = "") -> None:
    """Draw targets and positions, errors with the sensors' 95 % bands, motor speeds and torques.

    Args:
        work: what to draw.
        path: .png, .svg or .pdf.
        title: above it.
    """
    with needing("figures"):
        import matplotlib as mpl
        from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure = Figure(figsize=(11.0, 8.0), layout="constrained")
        axes = figure.subplots(4, len(UNITS), sharex=True, height_ratios=[2.0, 1.4, 1.0, 1.0])
        for column, name in enumerate(UNITS):
            _unit(axes[:, column], work, name)
        for row, label in enumerate(("position [mm]", "error [mm]", "motor speed [rpm]", "motor torque [N m]")):
            axes[row, 0].set_ylabel(label)
        figure.suptitle(title or work.machine.name, fontweight="bold")
        figure.align_ylabels()
        save(figure, path)


def _unit(axes: Any, work: Work, name: str) -> None:
    run, track = work.run, work.tracks[name]
    time = run["time"].values
    true, said = 1e3 * run[f"{name}_position"].values, 1e3 * track["position"].values
    known = np.where(track["status"].values < Status.NOT_REFERENCED, said, np.nan)
    axes[0].plot(time, 1e3 * track["target"].values, color=UNCERTAIN, lw=3.0, alpha=0.8, label="target")
    axes[0].plot(time, true, color=TRUTH, lw=2.0, label="true")
    axes[0].plot(time, known, color=ESTIMATE, lw=1.0, label="virtual sensor")
    axes[0].set_title(name, loc="left")
    axes[0].legend(loc="best")
    error, band = known - true, 1e3 * TWO_SIDED_95 * track["position_std"].values
    band = np.where(np.isfinite(known), band, np.nan)
    axes[1].fill_between(time, -band, band, color=ESTIMATE, alpha=0.15, lw=0, label="sensor's 95 % band")
    axes[1].plot(time, error, color=ERROR, lw=1.0, label="sensor less truth")
    axes[1].axhline(0.0, color=TRUTH, lw=0.6)
    reach = 1.1 * max(float(np.nanmax(one, initial=0.5)) for one in (np.abs(error), band))
    axes[1].set_ylim(-reach, reach)
    axes[1].legend(loc="best")
    axes[2].plot(time, run[f"{name}_motor_speed"].values / RPM, color=TRUTH, lw=1.0)
    axes[3].plot(time, track["motor_torque"].values, color=TRUTH, lw=0.6)
    axes[3].set_xlabel("time [s]")
    for axis in axes:
        axis.axvspan(0.0, work.works_from, color=UNCERTAIN, alpha=0.12, lw=0)


def summary(work: Work) -> str:
    """Errors, energy, and whether it stopped, as lines of text."""
    found = work.results()
    lines = [f"{found['duration']:.1f} s, the work from {found['works_from']:.1f} s on, after the references"]
    for name in UNITS:
        own = found[name]
        missed = own["target_error_largest"]
        targets = "no target" if missed is None else f"targets missed by {1e3 * missed:.2f} mm at most"
        lines.append(
            f"{name}: sensor off by {1e3 * own['sensor_error_largest']:.2f} mm at most, in its 95 % band "
            f"{100 * own['within_band']:.0f} % of the time; {targets}; "
            f"motor gave {own['shaft_energy_given'] / 1e3:.1f} kJ, took {own['shaft_energy_taken'] / 1e3:.1f} kJ back"
        )
    lines.append(
        f"bucket's tip: {1e3 * found['tip_error_largest']:.1f} mm at most from where the sensors have it, "
        f"{1e3 * found['tip_error_p95']:.1f} mm in 95 % of the time"
    )
    if work.stopped:
        lines.append(f"stopped in {work.phases[-1][0]!r}: {work.stopped}")
    return "\n".join(lines)
