"""The paper, reproduced: its figures, its numbers, its limits, and the balance sensor on the same runs.

T. Sourander, M. Pietola, T. Minav, H. Hänninen: Sensorless position estimation of simulated direct driven hydraulic
actuators. SICFP'17, June 7-9, 2017.
"""

from __future__ import annotations

from collections.abc import Callable

from ramsight.study.paper.bench import benches
from ramsight.study.paper.curves import movements
from ramsight.study.paper.cycles import cycles
from ramsight.study.paper.efficiency import efficiencies
from ramsight.study.paper.limits_load import load_change, near_relief
from ramsight.study.paper.limits_ramps import ramps
from ramsight.study.paper.limits_speed import speeds
from ramsight.study.paper.limits_state import temperature, wear
from ramsight.study.paper.parts import Chapter, Grid, Picture, Statement, Study, Verdict
from ramsight.study.paper.repeated import repeated
from ramsight.study.paper.writing import write_report

__all__ = [
    "CHAPTERS",
    "STEPS",
    "Chapter",
    "Grid",
    "Picture",
    "Statement",
    "Study",
    "Verdict",
    "reproduce",
    "write_report",
]

CHAPTERS = (efficiencies, movements, cycles, repeated, ramps, speeds, temperature, wear, load_change, near_relief)
"""The parts of the study, in the report's order."""

_FIGURES = 17
STEPS = len(CHAPTERS) + _FIGURES
"""Steps of progress that `reproduce` and `write_report` tell together."""


def reproduce(*, advance: Callable[[int], object] | None = None) -> Study:
    """Redo the study.

    Args:
        advance: called with 1 after each chapter.

    Returns:
        All chapters with their numbers and statements; figures are drawn by `write_report`.
    """
    bench = benches()
    study = Study()
    for chapter in CHAPTERS:
        study.chapters.append(chapter(bench))
        if advance is not None:
            advance(1)
    return study
