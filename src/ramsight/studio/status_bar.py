"""The bar that stays on the screen: of every sensor position, band and status, and what the status asks for.

What a status means and what to do is from docs/reference: the pages of the documentation are the only source.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

from nicegui import ui

from ramsight.studio.knobs import KINDS, SECOND
from ramsight.studio.said import SILENT

_NAMES = {kind: kind for kind in KINDS} | {SECOND: "transducer"}
_OFF = set(_NAMES) - {"kalman", "balance"}  # hidden until they report something


def status_bar(units: list[str]) -> None:
    """Build the bar; `studio.js` fills it from frames."""
    rows = "".join(
        f'<div class="unit">{"".join(_row(unit, kind, name) for kind, name in _NAMES.items())}</div>' for unit in units
    )
    numbers = (
        ("true", "now-true", "mm"), ("kalman", "now-kalman", "mm"), ("its error", "now-error", "mm"),
        ("balance's error", "now-balance-error", "mm"), ("time", "now-time", "s"), ("speed-up", "now-factor", "×"),
    )  # fmt: skip
    now = "".join(f'<span>{words} <b id="{place}">–</b> {unit}</span>' for words, place, unit in numbers)
    ui.html(
        f'<div class="rows">{rows}</div>'
        '<p class="meaning" tabindex="0" role="group" aria-label="what the status means">'
        '<b id="meaning-of">–</b> <span id="meaning">No sensor has reported anything yet.</span>'
        ' <span id="remedy"></span></p>'
        f'<div class="now"><b id="now-unit">–</b>{now}</div>'
        '<span id="status-said" class="unseen" role="status"></span>',
        sanitize=False,
    ).classes("bar").props('id=bar role=region aria-label="what the sensors say"')


def _row(unit: str, kind: str, name: str) -> str:
    place = f"{unit}-{kind}"
    hidden = " hidden" if kind in _OFF else ""
    return (
        f'<button type="button" class="said" data-unit="{unit}" data-kind="{kind}"{hidden}>'
        f'<span class="who">{unit} <b>{name}</b></span><span class="at"><b id="at-{place}">–</b> mm</span>'
        f'<span class="width">± <b id="width-{place}">–</b> mm</span>'
        f'<span class="status" id="status-{place}">{SILENT}</span></button>'
    )


_PAGES = ("status.md", "messages.md")
_PACKAGED = Path(__file__).parent  # where a wheel has them
_IN_TREE = Path(__file__).parents[3] / "docs" / "reference"
_ENTRY = re.compile(r"^### (?P<words>[^\n]+)\n\n(?P<meaning>.+?)\n\n(?P<rest>.*?)(?=^#|\Z)", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"^`[A-Z_]+`, [0-9]+\. ")
_BULLET = re.compile(r"^- \*\*(.+?):\*\* (.+?)(?=^- |\Z)", re.MULTILINE | re.DOTALL)
_TABLES = ("Verdicts of compare", "Words of the studio")
_ROW = re.compile(r"^\| (.+?) \| (.+?) \| (.+?) \|$", re.MULTILINE)


@lru_cache(maxsize=1)
def status_help() -> dict[str, dict[str, str]]:
    """Meaning and remedy of every status, by its words.

    Returns:
        By the words: `meaning`, `why` where the page has a reason, and `do`; plain text.

    Example:
        >>> status_help()["not referenced"]["do"].partition(".")[0]
        'Move to an end stop'
    """
    folder = _PACKAGED if (_PACKAGED / _PAGES[0]).exists() else _IN_TREE
    text = "\n".join((folder / page).read_text(encoding="utf-8") for page in _PAGES)
    found = {}
    for entry in _ENTRY.finditer(text):
        parts = {name: _plain(words) for name, words in _BULLET.findall(entry["rest"])}
        found[entry["words"]] = {
            "meaning": _plain(_CODE.sub("", entry["meaning"])),
            "why": parts.get("Why", ""),
            "do": parts.get("What to do", ""),
        }
    for title in _TABLES:
        chapter = text.partition(f"## {title}\n")[2].partition("\n## ")[0]
        for words, meaning, remedy in _ROW.findall(chapter)[1:]:
            if not words.startswith("-"):
                found[words] = {"meaning": _plain(meaning), "why": "", "do": _plain(remedy)}
    return found


def _plain(markdown: str) -> str:
    """Words of Markdown: without emphasis, code marks and targets of links, in one line."""
    words = re.sub(r"\[(.+?)\]\(.+?\)", r"\1", markdown)
    return " ".join(re.sub(r"[`*]", "", words).split())
