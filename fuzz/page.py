"""Writes the tables of docs/reference/fuzzing.md from results/fuzz.json, between their marks: python fuzz/page.py."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "reference" / "fuzzing.md"
COLUMNS = ("tried", "read", "warned", "refused", "crashed", "hung", "silently_wrong")


def table(found: dict[str, Any]) -> list[str]:
    """A row a section."""
    names = [name.replace("_", " ") for name in COLUMNS]
    rows = [f"| | {' | '.join(names)} | slowest |", "|---|" + "---|" * (len(COLUMNS) + 1)]
    for name, one in found["sections"].items():
        counts = " | ".join(str(one[column]) for column in COLUMNS)
        rows.append(f"| {name} | {counts} | {one['slowest_s']:.1f} s |")
    return rows


def measured(found: dict[str, Any]) -> list[str]:
    """A row a section that measures something: what was told of its last case."""
    told = {name: one["told"][-1] for name, one in found["sections"].items() if one.get("told")}
    return ["| | of the last case |", "|---|---|", *(f"| {name} | {words} |" for name, words in told.items())]


def main() -> None:
    """Put the tables between their marks."""
    found, page = json.loads((ROOT / "results" / "fuzz.json").read_text()), PAGE.read_text(encoding="utf-8")
    for name, rows in (("fuzz", table(found)), ("measured", measured(found))):
        text = "\n".join(rows)
        marked = re.compile(f"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", flags=re.DOTALL)
        page = marked.sub(lambda match, text=text: f"{match[1]}\n{text}\n\n{match[2]}", page)
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
