"""The report's directory: drawn beside its place, then moved into it."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from ramsight import __version__
from ramsight.errors import OutputError
from ramsight.output import _one_line
from ramsight.study.paper.drawing import draw
from ramsight.study.paper.html import html
from ramsight.study.paper.markdown import markdown
from ramsight.study.paper.parts import Study

FORMAT = 1
_LAST = "results.json"  # moved last: where it is, the report is whole


def check_directory(out: Path) -> None:
    """Refuse a place where no report can be written, before the work rather than after it.

    Args:
        out: the report's directory.

    Raises:
        OutputError: it is a file, or there is no directory to make it in.
    """
    shown = _one_line(out)
    if out.exists() and not out.is_dir():
        raise OutputError(f"{shown}: is a file, not a directory")
    if not out.exists() and not out.absolute().parent.is_dir():
        raise OutputError(f"{shown}: there is no directory {_one_line(out.parent)}")
    if not os.access(out if out.exists() else out.absolute().parent, os.W_OK):
        raise OutputError(f"{shown}: cannot be written: no permission")


def write_report(study: Study, out: str | Path, *, advance: Callable[[int], object] | None = None) -> None:
    """Write report.html, report.md with its figures, and results.json.

    A new directory appears whole; in one that exists the files of an earlier report are replaced one by one, and
    results.json last.

    Args:
        study: what to report.
        out: the directory.
        advance: called with 1 after each figure.

    Raises:
        OutputError: it cannot be written.
    """
    out = Path(out)
    check_directory(out)
    try:
        draft = Path(tempfile.mkdtemp(dir=out.absolute().parent, prefix=f".{out.name}-"))
    except OSError as error:
        raise OutputError(f"{_one_line(out)}: cannot be written: {_one_line(error.strerror or error)}") from error
    try:
        _fill(study, draft, advance)
        draft.chmod(0o755)
        if not out.exists():
            draft.rename(out)
            return
        (out / _LAST).unlink(missing_ok=True)
        for file in sorted(draft.iterdir(), key=lambda file: file.name == _LAST):
            os.replace(file, out / file.name)
    except OSError as error:
        raise OutputError(f"{_one_line(out)}: cannot be written: {_one_line(error.strerror or error)}") from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _fill(study: Study, folder: Path, advance: Callable[[int], object] | None) -> None:
    for picture in study.pictures:
        draw(picture, folder)
        if advance is not None:
            advance(1)
    (folder / "report.md").write_text(markdown(study), encoding="utf-8")
    (folder / "report.html").write_text(html(study, folder), encoding="utf-8")
    verdicts = [
        {"place": s.place, "statement": s.paper, "result": s.ours, "verdict": s.verdict.value} for s in study.statements
    ]
    results = {"format": FORMAT, "ramsight": __version__, "statements": verdicts, **study.numbers}
    (folder / _LAST).write_text(
        json.dumps(results, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
    )
