"""What pages show: their fenced blocks, the files that they tell a reader to save, and outputs that are alike."""

import re
from dataclasses import dataclass
from datetime import date
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)
DATE = re.compile(r"\b\d{4}-\d\d-\d\d\b")
DAYS = 3
"""By which dates that a page shows may be off on another processor."""
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")
SAVED = re.compile(r"[Ss]ave (?:it|this) as\s+`([\w.-]+)`")


@dataclass(frozen=True)
class Block:
    """A block of a page, what it prints if the page shows it, and the file that it is saved as."""

    kind: str
    text: str
    shown: str | None
    saved: str | None


def blocks(page):
    """The blocks of a page that are run or saved; `text` right behind one is what it prints."""
    text = (ROOT / page).read_text(encoding="utf-8")
    fences = list(FENCE.finditer(text))
    begin = 0
    for fence, after in zip(fences, [*fences, None][1:], strict=True):
        if fence[1] in ("sh", "python", "toml", "c"):
            follows = after is not None and after[1] == "text" and not text[fence.end() : after.start()].strip()
            saved = SAVED.findall(text[begin : fence.start()])
            yield Block(fence[1], fence[2], after[2] if follows else None, saved[-1] if saved else None)
        begin = fence.end()


def alike(said, shown):
    """Whether two outputs have the same words, and numbers that agree within what another processor may change."""
    days = [[date.fromisoformat(one) for one in DATE.findall(text)] for text in (said, shown)]
    if len(days[0]) != len(days[1]) or any(abs((a - b).days) > DAYS for a, b in zip(*days, strict=True)):
        return False
    said, shown = (DATE.sub("@", text) for text in (said, shown))
    words = [NUMBER.sub("#", text) for text in (said, shown)]
    pairs = zip(*(NUMBER.findall(text) for text in (said, shown)), strict=False)
    return words[0].split() == words[1].split() and all(
        float(one) == pytest.approx(float(other), rel=0.03, abs=0.02) for one, other in pairs
    )
