"""The report as Markdown, its figures beside it."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ramsight.study.paper.parts import Study

TITLE = "Sensorless position of direct driven hydraulic actuators: the paper, reproduced"
SOURCE = (
    "T. Sourander, M. Pietola, T. Minav, H. Hänninen: Sensorless position estimation of simulated direct driven "
    "hydraulic actuators. The 15th Scandinavian International Conference on Fluid Power, SICFP'17, June 7-9, 2017."
)
INTRODUCTION = (
    "The paper finds the position of a hydraulic cylinder from the speed and torque of the electric motor that "
    "drives its pumps, by a table of movement per motor revolution over torque. This report redoes that study with "
    "a simulation of the same machine, by the paper's own method, shows where the method ends and why, and runs a "
    "second sensor beside it: volume balance, which counts the oil instead of the revolutions.",
    "Most numbers of the paper's tables 1 and 2 are lost, so the machine's parameters are derived from what the "
    "text gives: loads, displacements, the laws and their nominal points. None of them was tuned to the paper's "
    "errors, but for one: the paper does not say how long the motor's ramps are, and 0.8 s is the length that gives "
    "the errors it reports, the same for both units. All numbers of this report are in results.json.",
)
HEAD = ("where", "statement of the paper", "our result", "verdict")


def markdown(study: Study) -> str:
    """The report's text.

    Args:
        study: what to report.
    """
    lines = [f"# {TITLE}", "", f"*{SOURCE}*", ""]
    for paragraph in INTRODUCTION:
        lines += [paragraph, ""]
    lines += ["## Statement, result, verdict", "", f"{study.summary()}.", ""]
    lines += _table(HEAD, ((s.place, s.paper, s.ours, f"**{s.verdict.value}**") for s in study.statements))
    for chapter in study.chapters:
        lines += [*([] if lines[-1] == "" else [""]), f"## {chapter.title}", ""]
        for paragraph in chapter.text:
            lines += [typeset(paragraph), ""]
        for grid in chapter.grids:
            lines += [f"{grid.caption}:", "", *_table(grid.head, grid.rows), ""]
        for picture in chapter.pictures:
            lines += [
                f"![{picture.caption}]({picture.name}.png)",
                "",
                f"*{picture.caption}* ([SVG]({picture.name}.svg))",
                "",
            ]
    return "\n".join(lines).rstrip() + "\n"


def typeset(text: str) -> str:
    """A text with true minus signs before its numbers.

    Args:
        text: as composed.

    Example:
        >>> typeset("from -5 to +5 K, lift-lower")
        'from −5 to +5 K, lift-lower'
    """
    return re.sub(r"(?<![\w.-])-(?=\d)", "−", text)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    head = list(head)
    cells = [[typeset(cell).replace("|", "\\|") for cell in row] for row in rows]
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *cells)]
