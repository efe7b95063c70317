"""The report as one HTML file, its figures inside it."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable
from html import escape
from pathlib import Path

from ramsight.output.html_page import page, row, table
from reproduction.chapter import Chapter, Study, Verdict
from reproduction.coverage import drawn
from reproduction.markdown import (
    COVERAGE,
    COVERAGE_HEAD,
    HEAD,
    INTRODUCTION,
    MEANING,
    SOURCE,
    STATEMENTS,
    TITLE,
    typeset,
)

_STYLE = """
nav { background: var(--shade); border-radius: .5rem; padding: .9rem 1.2rem; margin: 1.4rem 0; }
nav h2 { font-size: 1rem; margin: 0 0 .4rem; padding: 0; border: 0; }
nav ol { margin: 0; padding-left: 1.4rem; columns: 2 20rem; }
a { color: #1f5d86; } code { font-size: .9em; }
.stacked td:first-child { color: var(--soft); min-width: 6.5rem; }
@media (max-width: 46rem) {
  main { padding: 1.2rem .9rem 3rem; } h1 { font-size: 1.5rem; }
  .stacked, .stacked tbody, .stacked tr, .stacked td { display: block; width: auto; }
  .stacked tr:first-child { display: none; }
  .stacked tr { border-bottom: 1px solid var(--line); padding: .6rem 0; }
  .stacked td { border: 0; padding: .15rem 0; } .stacked td:nth-child(2) { font-style: italic; }
  .numbers { font-size: .78rem; } th, td { padding: .35rem .4rem; }
}
"""
_LONG = 16  # letters of a cell; a table with longer ones is no table of numbers
_CLASS = {
    Verdict.REPRODUCED: "good",
    Verdict.FITTED: "fair",
    Verdict.CONTRADICTED: "bad",
    Verdict.NOT_TESTABLE: "open",
}


def html(study: Study, folder: Path) -> str:
    """The report as a page that needs no other file.

    Args:
        study: what to report.
        folder: where its figures were drawn.
    """
    parts = [f"<h1>{escape(TITLE)}</h1>", f'<p class="source">{escape(SOURCE)}</p>']
    parts += _paragraphs((*INTRODUCTION, *study.chosen))
    parts.append(_contents(study))
    parts += [_heading(STATEMENTS), f"<p>{escape(study.summary())}. {escape(MEANING)}</p>"]
    said = [
        f"<tr><td>{escape(s.place)}</td><td>{escape(s.paper)}</td><td>{escape(typeset(s.ours))}</td>{_verdict(s.verdict)}</tr>"
        for s in study.statements
    ]
    parts.append(table("", HEAD, said, "stacked"))
    parts.append(_heading(COVERAGE))
    rows = [
        f"<tr><td>{escape(i.place)}</td><td>{escape(i.says)}</td><td>{_where(i.where)}</td>{_verdict(i.verdict)}</tr>"
        for i in drawn(study)
    ]
    parts.append(table("", COVERAGE_HEAD, rows, "stacked"))
    for chapter in study.chapters:
        parts += _chapter(chapter, folder)
    return page(TITLE, parts, _STYLE)


def _chapter(chapter: Chapter, folder: Path) -> list[str]:
    parts = [_heading(chapter.title), *_paragraphs(chapter.text)]
    for grid in chapter.grids:
        kind = "" if any(len(cell) > _LONG for row_ in grid.rows for cell in row_[1:]) else "numbers"
        parts.append(
            table(grid.caption, grid.head, [row(typeset(cell) for cell in cells) for cells in grid.rows], kind)
        )
    for picture in chapter.pictures:
        data = base64.b64encode((folder / f"{picture.name}.svg").read_bytes()).decode()
        parts.append(
            f'<figure id="{picture.name}"><img alt="{escape(picture.caption)}" '
            f'src="data:image/svg+xml;base64,{data}"><figcaption>{escape(picture.caption)}</figcaption></figure>'
        )
    return parts


def _contents(study: Study) -> str:
    titles = [STATEMENTS, COVERAGE, *(chapter.title for chapter in study.chapters)]
    lines = "".join(f'<li><a href="#{_name(title)}">{escape(title)}</a></li>' for title in titles)
    return f'<nav aria-label="Contents"><h2>Contents</h2><ol>{lines}</ol></nav>'


def _heading(title: str) -> str:
    return f'<h2 id="{_name(title)}">{escape(title)}</h2>'


def _where(where: str) -> str:
    """A chapter as a link to it, a command or page as it is."""
    is_name = where.startswith(("ramsight ", "docs/"))
    return f"<code>{escape(where)}</code>" if is_name else f'<a href="#{_name(where)}">{escape(where)}</a>'


def _name(title: str) -> str:
    """What a heading is called in links.

    Example:
        >>> _name("Pump efficiencies (Fig. 3)")
        'pump-efficiencies-fig-3'
    """
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


def _verdict(verdict: Verdict) -> str:
    return f'<td><span class="verdict {_CLASS[verdict]}">{verdict.value}</span></td>'


def _paragraphs(text: Iterable[str]) -> list[str]:
    return [f"<p>{escape(typeset(paragraph))}</p>" for paragraph in text]
