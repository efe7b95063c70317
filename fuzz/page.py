"""Tables of docs/reference/fuzzing.md and SECURITY.md, from results/fuzz.json, between marks: python fuzz/page.py."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "reference" / "fuzzing.md"
SECURITY = ROOT / "SECURITY.md"
LIMITS = ("drive's node, plain", "drive's node, telling", "computer asleep, nothing tells", "soak")
"""Sections in which something is known to be valid, or ok, and wrong."""
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


def limits(found: dict[str, Any]) -> list[str]:
    """A row a section with known limits: what came of all its cases."""
    pieces = {name: found["sections"][name]["told"][-1].split("; ") for name in LIMITS}
    told = {name: next(one for one in said if " and wrong" in one) for name, said in pieces.items()}
    return ["| | what came of it |", "|---|---|", *(f"| {name} | {words} |" for name, words in told.items())]


def main() -> None:
    """Put the tables between their marks."""
    found = json.loads((ROOT / "results" / "fuzz.json").read_text())
    for path, name, rows in ((PAGE, "fuzz", table), (PAGE, "measured", measured), (SECURITY, "limits", limits)):
        text = "\n".join(rows(found))
        marked = re.compile(f"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", flags=re.DOTALL)
        page = marked.sub(
            lambda match, text=text: f"{match[1]}\n{text}\n\n{match[2]}", path.read_text(encoding="utf-8")
        )
        path.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
