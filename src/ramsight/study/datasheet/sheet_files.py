"""A sheet as files: a page, every number, and what was assumed."""

from __future__ import annotations

from dataclasses import asdict
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from ramsight.output import whole_folder
from ramsight.output.html_page import row, table
from ramsight.study.datasheet.goal import Trial, Way
from ramsight.study.datasheet.sheet import Sheet
from ramsight.study.datasheet.sheet_figures import figures
from ramsight.study.datasheet.sheet_page import sheet_page, shown
from ramsight.study.datasheet.sheet_requirement import SheetRequirement

if TYPE_CHECKING:
    import xarray

FILES = ("sheet.html", "sheet.json", "assumed.toml")


def write_sheet(
    sheet: Sheet,
    found: xarray.Dataset,
    out: Path,
    title: str,
    way: Way | None = None,
    judged: SheetRequirement | None = None,
) -> None:
    """Write a sheet into a folder; what else is there stays.

    Args:
        sheet: the data sheet.
        found: what is kept of its machines, for the figures.
        out: the folder.
        title: of the machine and its unit.
        way: how a goal is reached, if one was asked for.
        judged: the sheet held against a requirement, if there is one.

    Raises:
        OutputError: it cannot be written.
    """
    sections = [*([] if judged is None else judged.html), *([] if way is None else _goal(way))]
    page = sheet_page(sheet, title, figures(found, sheet.budget), sections)
    numbers = {} if way is None else {"goal": asdict(way)}
    numbers |= {} if judged is None else {"requirement": judged.numbers}
    with whole_folder(out, last=FILES[0]) as draft:
        for name, text in zip(FILES, (page, sheet.to_json(numbers), sheet.to_toml()), strict=True):
            (draft / name).write_text(text, encoding="utf-8")


def goal_text(way: Way) -> str:
    """How a goal is reached, in a sentence."""
    goal = f"{1e3 * way.goal:g} mm"
    if way.chosen is None:
        best = min(way.trials, key=lambda one: one.reached)
        return f"{goal} is not reached; the best tried was {1e3 * best.reached:.3g} mm, with {_named(best.measures)}"
    reached = f"{1e3 * way.chosen.reached:.3g} mm on {way.chosen.machines} machines"
    if not way.chosen.measures:
        return f"{goal} is reached as it is: {reached}"
    return f"{goal} is reached by {_named(way.chosen.measures)}: {reached} that no trial had"


def _named(measures: tuple[str, ...]) -> str:
    return " and ".join(measures) if measures else "nothing done"


def _machines(trial: Trial) -> str:
    return f"{trial.machines} ({trial.seed})"


def _goal(way: Way) -> list[str]:
    rows = (
        row((_named(one.measures), str(one.effort), shown(one.known, "m", with_unit=False), _machines(one)))
        for one in way.trials
    )
    head = ("what was done", "effort", "95 % error [mm]", "machines (seed)")
    note = "After the third reference, all machines together; in the order in which it was tried"
    text = f"<p>{escape(goal_text(way))}.</p>"
    return [f"<h2>What it takes to reach {1e3 * way.goal:g} mm</h2>", text, table(note, head, rows, "numbers")]
