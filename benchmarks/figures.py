"""Draws how cost grows, from results/bench.json: python benchmarks/figures.py results/bench.json docs/images."""

import json
import sys
from pathlib import Path

from matplotlib.figure import Figure

INK, ACCENT = "#1f2a36", "#c8401e"


def axes_of(ax, x, y, title):
    ax.set(xlabel=x, ylabel=y, xlim=(0, None), ylim=(0, 1.1 * ax.dataLim.y1))
    ax.set_title(title, loc="left", fontsize=10)
    ax.grid(alpha=0.25)
    ax.spines[["top", "right"]].set_visible(False)


def main():
    found, folder = json.loads(Path(sys.argv[1]).read_text()), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    figure = Figure(figsize=(9.6, 2.9), layout="constrained")
    time, runs, memory = figure.subplots(1, 3)
    time.plot(*zip(*[(t, 1e3 * s) for t, s in found["time_over_simulated_s"]], strict=True), "o-", color=ACCENT)
    axes_of(time, "simulated time [s]", "computing time [ms]", "one run")
    rows = found["runs_seconds_and_peak_mib"]
    runs.plot([r[0] for r in rows], [r[1] for r in rows], "o-", color=ACCENT)
    axes_of(runs, "runs of 20 s", f"computing time [s], {found['cores']} cores", "a batch")
    memory.plot([r[0] for r in rows], [r[2] for r in rows], "o-", color=INK)
    axes_of(memory, "runs of 20 s", "peak memory [MiB], whole process", "a batch that keeps summaries")
    figure.savefig(folder / "performance-growth.png", dpi=150)


if __name__ == "__main__":
    main()
