"""What every status means and what to do, from docs/faq.md: the page of the documentation is the only source."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

_PACKAGED = Path(__file__).parent / "faq.md"  # where a wheel has it
_IN_TREE = Path(__file__).parents[3] / "docs" / "faq.md"
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
    text = (_PACKAGED if _PACKAGED.exists() else _IN_TREE).read_text(encoding="utf-8")
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
