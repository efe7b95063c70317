"""The figure of docs/explanation/damaged-files.md: three channels at three rates, and what the log has of them."""

import sys
from pathlib import Path

import numpy as np

from ramsight.logs.align import Aligner, Samples
from ramsight.output import atomic_path

PLACES = {
    "torque": np.arange(0.0, 2.0, 0.1) + 0.03,
    "speed": np.arange(0.0, 1.0, 0.05),
    "temperature": np.array([0.15]),
}
HOLDS = {"torque": 0.5, "speed": 0.5, "temperature": 60.0}


def main(file: Path) -> None:
    """Draw it."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    values = {"torque": np.sin(3 * PLACES["torque"]), "speed": np.cos(2 * PLACES["speed"]), "temperature": np.ones(1)}
    block = {name: Samples(time, time, values[name]) for name, time in PLACES.items()}
    aligned = Aligner("torque", HOLDS, {}).push(block)
    with mpl.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(7.2, 3.4), layout="constrained")
        axes = figure.subplots(3, 1, sharex=True)
        for axis, (name, samples) in zip(axes, block.items(), strict=True):
            axis.plot(samples.time, samples.value, "o", ms=5, mfc="none", color="#1f2a36", label="what came")
            axis.plot(aligned["time"], aligned[name], ".", ms=6, color="#c8401e", label="what the log has")
            axis.set_ylabel(name)
            axis.set_yticks([])
        axes[1].axvspan(0.95 + HOLDS["speed"], 2.0, color="#e9b44c", alpha=0.3, lw=0)
        axes[1].text(1.48, 0.6, "silent for 0.5 s: NaN")
        axes[0].axvspan(-0.02, 0.145, color="#9aa5b1", alpha=0.3, lw=0)
        axes[0].text(0.16, -0.3, "not there: no temperature yet")
        axes[0].legend(loc="upper right", frameon=False)
        axes[-1].set_xlabel("time [s]")
        with atomic_path(file) as draft:
            figure.savefig(draft, dpi=160)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
