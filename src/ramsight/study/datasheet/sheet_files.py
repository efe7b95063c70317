"""A sheet as files: a page, every number, and what was assumed."""

from __future__ import annotations

from pathlib import Path

from ramsight.output import whole_folder
from ramsight.signals import Dataset
from ramsight.study.datasheet.sheet import Sheet
from ramsight.study.datasheet.sheet_figures import figures
from ramsight.study.datasheet.sheet_page import sheet_page
from ramsight.study.datasheet.sheet_requirement import SheetRequirement

FILES = ("sheet.html", "sheet.json", "assumed.toml")


def write_sheet(sheet: Sheet, found: Dataset, out: Path, title: str, judged: SheetRequirement | None = None) -> None:
    """Write a sheet into a folder; what else is there stays.

    Args:
        sheet: the data sheet.
        found: what is kept of its machines, for the figures.
        out: the folder.
        title: of the machine and its unit.
        judged: the sheet held against a requirement, if there is one.

    Raises:
        OutputError: it cannot be written.
    """
    page = sheet_page(sheet, title, figures(found, sheet.budget), () if judged is None else judged.html)
    numbers = {} if judged is None else {"requirement": judged.numbers}
    with whole_folder(out, last=FILES[0]) as draft:
        for name, text in zip(FILES, (page, sheet.to_json(numbers), sheet.to_toml()), strict=True):
            (draft / name).write_text(text, encoding="utf-8", newline="\n")
