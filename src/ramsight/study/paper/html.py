"""The report as one HTML file, its figures inside it."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from pathlib import Path

from ramsight.study.page import page, row, table
from ramsight.study.paper.markdown import HEAD, INTRODUCTION, SOURCE, TITLE, typeset
from ramsight.study.paper.parts import Study, Verdict

_CLASS = {Verdict.REPRODUCED: "good", Verdict.PARTLY: "fair", Verdict.NOT: "bad"}


def html(study: Study, folder: Path) -> str:
    """The report as a page that needs no other file.

    Args:
        study: what to report.
        folder: where its figures were drawn.
    """
    parts = [f"<h1>{escape(TITLE)}</h1>", f'<p class="source">{escape(SOURCE)}</p>', *_paragraphs(INTRODUCTION)]
    parts += ["<h2>Statement, result, verdict</h2>", f"<p>{escape(study.summary())}.</p>"]
    rows = [
        f'<tr><td class="where">{escape(s.place)}</td><td>{escape(s.paper)}</td><td>{escape(typeset(s.ours))}</td>'
        f'<td><span class="verdict {_CLASS[s.verdict]}">{s.verdict.value}</span></td></tr>'
        for s in study.statements
    ]
    parts.append(table("", HEAD, rows, ""))
    for chapter in study.chapters:
        parts += [f"<h2>{escape(chapter.title)}</h2>", *_paragraphs(chapter.text)]
        for grid in chapter.grids:
            cells = [row(typeset(cell) for cell in cells) for cells in grid.rows]
            parts.append(table(grid.caption, grid.head, cells, "numbers"))
        for picture in chapter.pictures:
            data = base64.b64encode((folder / f"{picture.name}.svg").read_bytes()).decode()
            parts.append(
                f'<figure id="{picture.name}"><img alt="{escape(picture.caption)}" '
                f'src="data:image/svg+xml;base64,{data}"><figcaption>{escape(picture.caption)}</figcaption></figure>'
            )
    return page(TITLE, parts)


def _paragraphs(text: Iterable[str]) -> list[str]:
    return [f"<p>{escape(typeset(paragraph))}</p>" for paragraph in text]
