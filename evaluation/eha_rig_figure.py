"""Figures of the real actuator: every judged run, its position and the error inside its band."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

from ramsight.normal import TWO_SIDED_95
from ramsight.output import atomic_path

COLUMNS = 4
_TRUE, _SAID, _BAND = "#222222", "#1f6fb2", "#a9cbe8"


def draw(runs: list[tuple[Any, Any]], file: Path) -> None:
    """A figure of judged runs.

    Args:
        runs: and their tracks.
        file: where the figure goes.
    """
    rows = -(-len(runs) // COLUMNS)
    figure, axes = plt.subplots(
        2 * rows, COLUMNS, figsize=(3.4 * COLUMNS, 3.4 * rows), sharex=True, squeeze=False,
        height_ratios=[2, 3] * rows, layout="constrained",
    )  # fmt: skip
    for place, (run, track) in enumerate(runs):
        row, column = 2 * (place // COLUMNS), place % COLUMNS
        _run(axes[row, column], axes[row + 1, column], run, track)
        if column == 0:
            axes[row, 0].set_ylabel("position [mm]")
            axes[row + 1, 0].set_ylabel("error [mm]")
    for empty in range(len(runs), rows * COLUMNS):
        for k in (0, 1):
            axes[2 * (empty // COLUMNS) + k, empty % COLUMNS].set_axis_off()
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    axes[0, 0].legend(loc="upper right", fontsize=7, frameon=False)
    with atomic_path(file) as draft:
        figure.savefig(draft, dpi=110)
    plt.close(figure)


def _run(above: Any, below: Any, run: Any, track: Any) -> None:
    time = run.log["time"].values
    true, said = run.measured["position"].values * 1e3, track["position"].values * 1e3
    std = track["position_std"].values * 1e3
    above.plot(time, true, color=_TRUE, lw=2.0, label="measured")
    above.plot(time, said, color=_SAID, lw=1.0, label="estimated")
    above.set_title(run.name.partition(".")[0].replace("_", ", "), fontsize=9)
    below.fill_between(time, -TWO_SIDED_95 * std, TWO_SIDED_95 * std, color=_BAND, lw=0, label="95 % band")
    below.plot(time, said - true, color=_TRUE, lw=0.8)
    below.set_ylim(-3, 3)
    for axis in (above, below):
        axis.grid(alpha=0.3)
        axis.tick_params(labelsize=7)
