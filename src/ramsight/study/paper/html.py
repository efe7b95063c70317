"""The report as one HTML file, its figures inside it."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from html import escape
from pathlib import Path

from ramsight.study.paper.markdown import HEAD, INTRODUCTION, SOURCE, TITLE, typeset
from ramsight.study.paper.parts import Study, Verdict

_STYLE = """
:root { --ink: #1f2a36; --soft: #5b6875; --line: #dfe3e8; --paper: #ffffff; --accent: #c8401e; --shade: #f6f7f9; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: var(--paper);
  font: 16px/1.55 system-ui, "Segoe UI", Roboto, sans-serif; }
main { max-width: 62rem; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .6rem; }
h2 { font-size: 1.25rem; margin: 2.8rem 0 .6rem; padding-top: .9rem; border-top: 1px solid var(--line); }
p { margin: 0 0 .9rem; max-width: 46rem; }
.source { color: var(--soft); font-size: .9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; line-height: 1.4; }
caption { text-align: left; color: var(--soft); padding: .4rem 0; }
th, td { text-align: left; vertical-align: top; padding: .5rem .7rem; border-bottom: 1px solid var(--line); }
th { background: var(--shade); font-weight: 600; }
.numbers td:not(:first-child), .numbers th:not(:first-child) { text-align: right; font-variant-numeric: tabular-nums; }
.where { color: var(--soft); white-space: nowrap; }
.verdict { display: inline-block; padding: .1rem .55rem; border-radius: 1rem; font-weight: 600; white-space: nowrap; }
.reproduced { background: #dcefe3; color: #17603a; }
.partly { background: #fbeccb; color: #7a5200; }
.not { background: #f8d9d2; color: #8c2410; }
figure { margin: 1.4rem 0 2rem; }
figure img { width: 100%; max-width: 50rem; height: auto; }
figcaption { color: var(--soft); font-size: .9rem; max-width: 46rem; }
@media print { h2 { break-after: avoid; } figure, tr { break-inside: avoid; } main { padding: 0; } }
"""
_CLASS = {Verdict.REPRODUCED: "reproduced", Verdict.PARTLY: "partly", Verdict.NOT: "not"}


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
    parts.append(_table("", HEAD, rows, ""))
    for chapter in study.chapters:
        parts += [f"<h2>{escape(chapter.title)}</h2>", *_paragraphs(chapter.text)]
        for grid in chapter.grids:
            cells = [f"<tr>{''.join(f'<td>{escape(typeset(cell))}</td>' for cell in row)}</tr>" for row in grid.rows]
            parts.append(_table(grid.caption, grid.head, cells, "numbers"))
        for picture in chapter.pictures:
            data = base64.b64encode((folder / f"{picture.name}.svg").read_bytes()).decode()
            parts.append(
                f'<figure id="{picture.name}"><img alt="{escape(picture.caption)}" '
                f'src="data:image/svg+xml;base64,{data}"><figcaption>{escape(picture.caption)}</figcaption></figure>'
            )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(TITLE)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(parts)
        + "\n</main>\n</body>\n</html>\n"
    )


def _paragraphs(text: Iterable[str]) -> list[str]:
    return [f"<p>{escape(typeset(paragraph))}</p>" for paragraph in text]


def _table(caption: str, head: Iterable[str], rows: Iterable[str], kind: str) -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f'<div class="wide"><table class="{kind}">{above}<tr>{top}</tr>{"".join(rows)}</table></div>'
