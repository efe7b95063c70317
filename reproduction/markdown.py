"""The report as Markdown, its figures beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable

from reproduction.chapter import Chapter, Study
from reproduction.coverage import drawn

TITLE = "Sensorless position of direct driven hydraulic actuators: the paper, reproduced"
SOURCE = (
    "T. Sourander, M. Pietola, T. Minav, H. Hänninen: Sensorless position estimation of simulated direct driven "
    "hydraulic actuators. The 15th Scandinavian International Conference on Fluid Power, SICFP'17, June 7-9, 2017."
)
INTRODUCTION = (
    "The paper finds the position of a hydraulic cylinder from the speed and torque of the electric motor that "
    "drives its pumps, by a table of movement per motor revolution over torque. This report redoes that study with "
    "a simulation of the same machine and by the paper's own method, and holds every figure, table, equation and "
    "statement of it against what came out. Beside the table two other sensors see the same runs: a volume balance, "
    "which counts the oil instead of the revolutions and knows the simulated machine exactly, and the self-calibrating "
    "sensor, which learns what its data sheet does not say.",
    "Most numbers of the paper's tables 1 and 2 are lost, so the machine's parameters are derived from what the "
    "text gives: loads, displacements, the laws and their nominal points. None of them was tuned to the paper's "
    "errors, but for one: the paper does not say how long the motor's ramps are, and 0.8 s is the length that gives "
    "the errors it reports, the same for both units. A verdict that rests on it says so. All numbers of this report "
    "are in results.json.",
)
MEANING = (
    "Verdicts: reproduced, the same came out with nothing fitted to it. Reproduced with a fitted value, it came out, "
    "and a value was chosen for that. Contradicted, something else came out; not testable, with the reason."
)
HEAD = ("where", "statement of the paper", "our result", "verdict")
COVERAGE = "Every figure, table, equation and number"
COVERAGE_HEAD = ("in the paper", "what it is", "where it is here", "verdict")
STATEMENTS = "Statement, result, verdict"


def markdown(study: Study) -> str:
    """The report's text.

    Args:
        study: what to report.
    """
    lines = [f"# {TITLE}", "", f"*{SOURCE}*", ""]
    for paragraph in (*INTRODUCTION, *study.chosen):
        lines += [paragraph, ""]
    lines += [f"## {STATEMENTS}", "", f"{study.summary()}. {MEANING}", ""]
    lines += table_lines(HEAD, ((s.place, s.paper, s.ours, f"**{s.verdict.value}**") for s in study.statements))
    lines += ["", f"## {COVERAGE}", ""]
    lines += table_lines(COVERAGE_HEAD, ((i.place, i.says, i.where, f"**{i.verdict.value}**") for i in drawn(study)))
    for chapter in study.chapters:
        lines += ["", *chapter_lines(chapter)]
    return "\n".join(lines).rstrip() + "\n"


def chapter_lines(chapter: Chapter) -> list[str]:
    """A chapter of the report.

    Args:
        chapter: the chapter; its pictures stand beside the report.
    """
    lines = [f"## {chapter.title}", ""]
    for paragraph in chapter.text:
        lines += [typeset(paragraph), ""]
    for grid in chapter.grids:
        lines += [f"{grid.caption}:", "", *table_lines(grid.head, grid.rows), ""]
    for picture in chapter.pictures:
        lines += [f"![{picture.caption}]({picture.name}.png)", ""]
        lines += [f"*{picture.caption}* ([SVG]({picture.name}.svg))", ""]
    return lines


def typeset(text: str) -> str:
    """A text with true minus signs before its numbers.

    Args:
        text: as composed.

    Example:
        >>> typeset("from -5 to +5 K, lift-lower")
        'from −5 to +5 K, lift-lower'
    """
    return re.sub(r"(?<![\w.-])-(?=\d)", "−", text)


def table_lines(head: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    """A table.

    Args:
        head: its headings.
        rows: cells as text.
    """
    head = list(head)
    cells = [[typeset(cell).replace("|", "\\|") for cell in row] for row in rows]
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *cells)]
