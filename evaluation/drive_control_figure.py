"""The picture of docs/reference/control-accuracy.md: what drives and faults make of a move, from results/study.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import drive_control
import matplotlib as mpl
import matplotlib.figure
import numpy as np

from ramsight.tracking.figures import STYLE, legend_above, save

ROOT = Path(__file__).parents[1]
_MARKS = "osv^Dx"
_JUDGED = "stood_less_ramp"  # without what the motor needs by its declared acceleration
_SLOW = 1.0  # s; standstills that take longer have the same colour


def main() -> None:
    """Make it."""
    found = json.loads((ROOT / "results" / "study.json").read_text())["drive_control"]
    save(draw(found), ROOT / "docs" / "images" / "control-drives.png")


def draw(found: dict[str, Any]) -> Any:
    """The errors at targets by drive and unit, and how long faults take to a standstill by drive.

    Args:
        found: as `drive_control.study` gives it.
    """
    with mpl.rc_context(STYLE):
        figure = mpl.figure.Figure(figsize=(9.5, 10.0), layout="constrained")
        top, *below = figure.subplots(3, 1, height_ratios=(1.1, 1.0, 1.0))
        _draw_errors(top, found["moves"])
        for axes, phase in zip(below, drive_control.GOING, strict=True):
            shown = _draw_standstills(axes, found["faults"], phase)
        figure.colorbar(shown, ax=below, label="from the fault to standstill [s]", shrink=0.6, extend="max")
    return figure


def _draw_errors(axes: Any, moves: dict[str, dict[str, dict[str, Any]]]) -> None:
    for mark, unit in zip(_MARKS, next(iter(moves.values())), strict=True):
        p95 = [1e3 * of[unit]["p95"] if of[unit]["reached"] else np.nan for of in moves.values()]
        axes.plot(range(len(moves)), p95, mark, ms=5, label=unit)
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xticks(range(len(moves)), list(moves), rotation=25, ha="right")
    axes.set_ylabel("rod less target, p95 [mm]")
    legend_above(axes, ncols=6, fontsize=8)


def _draw_standstills(axes: Any, faults: dict[str, Any], phase: str) -> Any:
    kinds = list(next(iter(faults.values()))["kinds"])
    cases = [[of["kinds"][kind][phase] for of in faults.values()] for kind in kinds]
    times, judged = (np.array([[_seconds(case[key]) for case in row] for row in cases]) for key in ("stood", _JUDGED))
    shown = axes.imshow(times, cmap="YlOrBr", vmin=0.0, vmax=_SLOW, aspect="auto")
    allowed = [drive_control.STANDSTILL + of["latency"] for of in faults.values()]
    for (row, column), seconds in np.ndenumerate(times):
        late = judged[row, column] > allowed[column] + 1e-6
        axes.text(
            column, row, f"{seconds:.2f}", ha="center", va="center", fontsize=7,
            fontweight="bold" if late else "normal", color="white" if seconds > 0.7 * _SLOW else "black",
        )  # fmt: skip
    axes.grid(visible=False)
    axes.set_yticks(range(len(kinds)), kinds)
    axes.set_xticks(range(len(faults)), list(faults), rotation=25, ha="right")
    axes.set_title(f"fault: {phase}", loc="left")
    return shown


def _seconds(time: float | None) -> float:
    return float("nan") if time is None else float(time)


if __name__ == "__main__":
    main()
