"""The paper, reproduced: its figures, its numbers, its limits, and the balance sensor on the same runs.

T. Sourander, M. Pietola, T. Minav, H. Hänninen: Sensorless position estimation of simulated direct driven hydraulic
actuators. SICFP'17, June 7-9, 2017.
"""

from __future__ import annotations

from collections.abc import Callable

from reproduction.bench import benches
from reproduction.chapter import Chapter, Grid, Picture, Statement, Study, Verdict
from reproduction.choices import Choices
from reproduction.combined import combined
from reproduction.curves import movements
from reproduction.cycles import cycles, warm_and_cold
from reproduction.deviating_machines import as_built
from reproduction.diagrams import diagrams
from reproduction.hoses import hoses
from reproduction.instruments import instruments
from reproduction.limits_load import load_change
from reproduction.limits_ramps import ramps
from reproduction.limits_relief import near_relief
from reproduction.limits_speed import speeds
from reproduction.limits_state import temperature, wear
from reproduction.machine_drawings import drawings
from reproduction.open_points import open_points
from reproduction.provenance import provenance
from reproduction.pump_efficiencies import efficiencies
from reproduction.repeated import repeated
from reproduction.report_folder import write_report
from reproduction.taken import taken
from reproduction.unit_energy import energy
from reproduction.untested import untested

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
