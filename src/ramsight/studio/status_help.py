"""What every status means and what to do, from docs/reference: the pages of the documentation are the only source."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

_PAGES = ("status.md", "status-invalid.md", "messages.md")
_PACKAGED = Path(__file__).parent  # where a wheel has them
_IN_TREE = Path(__file__).parents[3] / "docs" / "reference"
_ENTRY = re.compile(r"^### (?P<words>[^\n]+)\n\n(?P<meaning>.+?)\n\n(?P<rest>.*?)(?=^##|\Z)", re.MULTILINE | re.DOTALL)
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
