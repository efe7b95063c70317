"""A report as one HTML page that needs no other file, and fetches nothing."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

STYLE = """
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
.good { background: #dcefe3; color: #17603a; }
.fair { background: #fbeccb; color: #7a5200; }
.bad { background: #f8d9d2; color: #8c2410; }
.open { background: var(--shade); color: var(--soft); }
.signed td:first-child { width: 14rem; } .signed td { height: 2.6rem; } .signed tr:first-child { display: none; }
figure { margin: 1.4rem 0 2rem; }
figure img { width: 100%; max-width: 50rem; height: auto; }
figcaption { color: var(--soft); font-size: .9rem; max-width: 46rem; }
@media print { h2 { break-after: avoid; } figure, tr { break-inside: avoid; } main { padding: 0; } }
"""


def page(title: str, parts: Iterable[str], style: str = "") -> str:
    """A whole page."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}{style}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(parts)
        + "\n</main>\n</body>\n</html>\n"
    )


def table(caption: str, head: Iterable[str], rows: Iterable[str], kind: str = "") -> str:
    """A table, wider ones scroll.

    Args:
        caption: above it, as text; "" for none.
        kind: its class: ``numbers`` sets all but the first column to the right.
    """
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    above = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f'<div class="wide"><table class="{kind}">{above}<tr>{top}</tr>{"".join(rows)}</table></div>'


def row(cells: Iterable[str]) -> str:
    """A row of a table, its cells as text."""
    return f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"
