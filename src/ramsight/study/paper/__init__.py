"""The paper, reproduced: its figures, its numbers, its limits, and the balance sensor on the same runs.

T. Sourander, M. Pietola, T. Minav, H. Hänninen: Sensorless position estimation of simulated direct driven hydraulic
actuators. SICFP'17, June 7-9, 2017.
"""

from __future__ import annotations

from collections.abc import Callable

from ramsight.study.paper.as_built import as_built
from ramsight.study.paper.bench import benches
from ramsight.study.paper.chapter import Chapter, Grid, Picture, Statement, Study, Verdict
from ramsight.study.paper.choices import Choices
from ramsight.study.paper.combined import combined
from ramsight.study.paper.curves import movements
from ramsight.study.paper.cycles import cycles, warm_and_cold
from ramsight.study.paper.diagrams import diagrams
from ramsight.study.paper.drawings import drawings
from ramsight.study.paper.efficiency import efficiencies
from ramsight.study.paper.energy import energy
from ramsight.study.paper.hoses import hoses
from ramsight.study.paper.instruments import instruments
from ramsight.study.paper.limits_load import load_change
from ramsight.study.paper.limits_ramps import ramps
from ramsight.study.paper.limits_relief import near_relief
from ramsight.study.paper.limits_speed import speeds
from ramsight.study.paper.limits_state import temperature, wear
from ramsight.study.paper.open_points import open_points
from ramsight.study.paper.provenance import provenance
from ramsight.study.paper.repeated import repeated
from ramsight.study.paper.taken import taken
from ramsight.study.paper.untested import untested
from ramsight.study.paper.writing import write_report

__all__ = [
    "CHAPTERS",
    "STEPS",
    "Chapter",
    "Choices",
    "Grid",
    "Picture",
    "Statement",
    "Study",
    "Verdict",
    "reproduce",
    "write_report",
]

CHAPTERS = (
    provenance,
    drawings,
    diagrams,
    open_points,
    efficiencies,
    movements,
    cycles,
    warm_and_cold,
    repeated,
    ramps,
    speeds,
    as_built,
    wear,
    temperature,
    load_change,
    near_relief,
    hoses,
    taken,
    combined,
    energy,
    instruments,
    untested,
)
"""The parts of the study, in the report's order."""

_FIGURES = 28
STEPS = len(CHAPTERS) + _FIGURES
"""Steps of progress that `reproduce` and `write_report` tell together."""


def reproduce(choices: Choices | None = None, *, advance: Callable[[int], object] | None = None) -> Study:
    """Redo the study.

    Args:
        choices: what the paper leaves open; by default as the catalogue's loader has it.
        advance: called with 1 after each chapter.

    Returns:
        All chapters with their numbers and statements; figures are drawn by `write_report`.

    Raises:
        DescriptionError: the machine cannot be used.
        SimulationError: a run does not reach its end.
    """
    choices = choices or Choices()
    bench = benches(choices)
    study = Study(chosen=choices.said)
    for chapter in CHAPTERS:
        study.chapters.append(chapter(bench))
        if advance is not None:
            advance(1)
    return study
