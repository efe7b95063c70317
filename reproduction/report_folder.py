"""The report's directory: drawn beside its place, then moved into it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from ramsight import __version__
from ramsight.output import whole_folder
from reproduction.chapter import Study
from reproduction.coverage import coverage
from reproduction.figure_style import draw
from reproduction.html import html
from reproduction.markdown import markdown
from reproduction.pdf import write_pdf

FORMAT = 1
_LAST = "results.json"  # moved last: where it is, the report is whole


def write_report(study: Study, out: str | Path, *, advance: Callable[[int], object] | None = None) -> None:
    """Write report.html, report.pdf, report.md with its figures, and results.json.

    A new directory appears whole; in one that exists the files of an earlier report are replaced one by one, and
    results.json last.

    Args:
        study: what to report.
        out: the directory.
        advance: called with 1 after each figure.

    Raises:
        OutputError: it cannot be written.
    """
    with whole_folder(Path(out), _LAST) as draft:
        _fill(study, draft, advance)


def _fill(study: Study, folder: Path, advance: Callable[[int], object] | None) -> None:
    for picture in study.pictures:
        draw(picture, folder)
        if advance is not None:
            advance(1)
    (folder / "report.md").write_text(markdown(study), encoding="utf-8")
    (folder / "report.html").write_text(html(study, folder), encoding="utf-8")
    write_pdf(study, folder, folder / "report.pdf")
    verdicts = [
        {"place": s.place, "statement": s.paper, "result": s.ours, "verdict": s.verdict.value} for s in study.statements
    ]
    lines = [item._asdict() | {"verdict": item.verdict.value} for item in coverage(study)]
    results = {"format": FORMAT, "ramsight": __version__, "statements": verdicts, "coverage": lines, **study.numbers}
    (folder / _LAST).write_text(
        json.dumps(results, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
    )
