"""Figures of real-machines.md, of machines with every effect: what the sensor says of its error, and of leakage.

python evaluation/real_machine_figure.py [--days 6] [--out docs/images]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from real_machine import DAYS, LONG_DAY, RARE_VISITS, TOGETHER, VISITS, Day, tracked

from ramsight.normal import TWO_SIDED_95
from ramsight.output import atomic_path
from ramsight.sensor.status import Status

mpl.use("Agg")
from matplotlib.figure import Figure

_TITLES = ("an end stop every 2 minutes", "an inclinometer of 0.2°, a stop every 30 minutes")
_LEAST, _MOST = 0.05, 100.0  # mm
_BINS = 90
_SECONDS = 10.0  # of a curve's points


def days(seeds: Sequence[int]) -> list[list[Day]]:
    """Long days with stops, and with an inclinometer."""
    kinds = ((VISITS, False), (RARE_VISITS, True))
    return [
        [tracked(TOGETHER, seed, duration=LONG_DAY, visits=visits, told=True, link=link) for seed in seeds]
        for visits, link in kinds
    ]


def draw(found: list[list[Day]], folder: Path) -> None:
    """Write the figures."""
    _save(_stanford(found), folder / "real-machine-stanford.png")
    _save(_hours([one[0] for one in found]), folder / "real-machine-hours.png")
    _save(_leakage(found), folder / "real-machine-leakage.png")


def _save(figure: Figure, path: Path) -> None:
    with atomic_path(path) as draft:
        figure.savefig(draft, dpi=110, format="png")


def _stanford(found: list[list[Day]]) -> Figure:
    """How often which error comes with which standard deviation, of samples that are ok."""
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    edges = np.geomspace(_LEAST, _MOST, _BINS)
    for panel, some, title in zip(axes, found, _TITLES, strict=True):
        ok = [one.track["status"].values == Status.OK for one in some]
        error = np.concatenate(
            [1e3 * np.abs(one.track["position"].values - one.position)[k] for one, k in zip(some, ok, strict=True)]
        )
        std = np.concatenate([1e3 * one.track["position_std"].values[k] for one, k in zip(some, ok, strict=True)])
        counts, _, _ = np.histogram2d(np.clip(error, _LEAST, _MOST), np.clip(std, _LEAST, _MOST), bins=(edges, edges))
        shares = np.where(counts > 0, counts / counts.sum(), np.nan)
        mesh = panel.pcolormesh(edges, edges, shares.T, norm="log", cmap="viridis", rasterized=True)
        for factor, style in ((TWO_SIDED_95, "--"), (4.0, "-")):
            panel.plot(edges, edges / factor, style, color="#c0392b", lw=1.0)
            panel.annotate(f"{factor:.3g} σ", (edges[-18], edges[-18] / factor), color="#c0392b", fontsize=9)
        panel.set(xscale="log", yscale="log", title=title, xlabel="error [mm]")
        outside = float(np.mean(error > TWO_SIDED_95 * std))
        panel.text(0.02, 0.96, f"outside the 95 % band: {100 * outside:.1f} %", transform=panel.transAxes, va="top")
    axes[0].set_ylabel("standard deviation that is said [mm]")
    figure.colorbar(mesh, ax=list(axes), label="share of the samples that are ok")
    return figure


def _hours(found: list[Day]) -> Figure:
    """Error and band over a day from a cold start."""
    figure = Figure(figsize=(10.0, 5.2), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    for panel, one, title in zip(axes, found, _TITLES, strict=True):
        time = one.track["time"].values
        every = max(round(_SECONDS / float(np.median(np.diff(time)))), 1)
        hours = time[::every] / 3600.0
        error = 1e3 * (one.track["position"].values - one.position)[::every]
        band = TWO_SIDED_95 * 1e3 * one.track["position_std"].values[::every]
        panel.fill_between(hours, -band, band, color="#a9cbe8", lw=0, label="95 % band")
        panel.plot(hours, error, color="#1f6fb2", lw=0.6, label="error")
        panel.set(ylabel="error [mm]", title=title, ylim=(-25.0, 25.0))
        panel.grid(alpha=0.3)
    axes[0].legend(loc="upper right", ncols=2)
    axes[1].set(xlabel="hours since the cold start", xlim=(0.0, None))
    return figure


def _leakage(found: list[list[Day]]) -> Figure:
    """The factor of leakage over the temperature of the oil in the pumps: found, and the machine's."""
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    for panel, some, title in zip(axes, found, _TITLES, strict=True):
        for number, one in enumerate(some):
            time = one.track["time"].values
            every = max(round(_SECONDS / float(np.median(np.diff(time)))), 1)
            celsius = one.oil[::every] - 273.15
            panel.plot(celsius, one.track["leak_factor"].values[::every], color=f"C{number}", lw=1.2)
            panel.plot(celsius, one.leak[::every], "--", color=f"C{number}", lw=1.0)
        panel.set(title=title, xlabel="oil in the pumps [°C]")
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("leakage over the description's [1]")
    axes[0].plot([], [], color="#222222", lw=1.2, label="found by the sensor")
    axes[0].plot([], [], "--", color="#222222", lw=1.0, label="of the machine, at the reported temperature")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    return figure


def main() -> None:
    """Simulate, follow and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--days", type=int, default=DAYS)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    given = parser.parse_args()
    draw(days(range(given.days)), given.out)


if __name__ == "__main__":
    main()
