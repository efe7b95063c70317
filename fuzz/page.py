"""Writes the table of docs/reference/fuzzing.md from fuzz.json, between its marks: python fuzz/page.py."""

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


def main() -> None:
    """Put the table between its marks."""
    text = "\n".join(table(json.loads((ROOT / "fuzz.json").read_text())))
    page = PAGE.read_text(encoding="utf-8")
    marked = re.compile(r"(<!-- fuzz -->\n).*?(<!-- end of fuzz -->)", flags=re.DOTALL)
    PAGE.write_text(marked.sub(lambda match: f"{match[1]}\n{text}\n\n{match[2]}", page), encoding="utf-8")


if __name__ == "__main__":
    main()
