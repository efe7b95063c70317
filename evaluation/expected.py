"""The table "What to expect" of README.md and docs/index.md: python evaluation/expected.py.

It is made from the stored data sheets (docs/sheets) and from results/study.json; nothing is simulated.
"""

from __future__ import annotations

import json
from pathlib import Path

import datasheets
import pages

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", ROOT / "docs" / "index.md")
AXES = {
    "mining-loader-boom": "boom of a loader",
    "mining-loader-bucket": "bucket of a loader",
    "press-ram": "press",
    "forklift-mast-lift": "mast of a forklift",
}
"""Sheets of the table, and what a reader calls the axis."""
_GROUPS = 4  # before a reference, after one, two, three: the first groups of a sheet's accuracy
_P95 = 1  # place of the 95 % quantile among a group's quantiles


def expected() -> list[str]:
    """Errors by the references so far, an axis a row."""
    head = ("error [mm]", "stroke", "before a reference", "after 1", "after 2", "after 3", "status *ok*")
    rows = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    sheets = datasheets.found()
    for name, axis in AXES.items():
        sheet = sheets[name]
        errors = [f"{1e3 * group['quantiles'][_P95]['value']:.1f}" for group in sheet["accuracy"][:_GROUPS]]
        ok = f"{100 * sheet['validity']['ok']:.0f} % of the time"
        stroke = f"{1e3 * sheet['stroke']:.0f} mm"
        rows.append(f"| {' | '.join((axis, stroke, *errors, ok))} |")
    return rows


def better() -> list[str]:
    """What makes the error smaller, a measure a line."""
    trials = datasheets.measures()
    identified = next(one for one in trials if "identify" in one["measure"])
    alone = next(one for one in trials if one["measure"] == "nothing")
    together = json.loads((ROOT / "results" / "study.json").read_text())["real_machine"]["together"]
    before, after = (f"{1e3 * one['error']['value']:.1f}" for one in (alone, identified))
    stops, link = (f"{together[key]['p95_mm']:.1f} mm" for key in ("stops", "link"))
    return [
        "- A commissioning with a temporary position sensor (`ramsight identify`) reduces the error after three",
        f"  references from {before} mm to {after} mm on the boom ([data sheets](docs/reference/data-sheets.md)).",
        f"- An inclinometer of 0.2° on the boom gives {link} with an end stop every 30 minutes. Without it the error",
        f"  is {stops} with an end stop every 2 minutes ([validation](docs/reference/real-machines.md)).",
    ]


def tables(page: Path) -> dict[str, list[str]]:
    """The marked blocks of a page, with links as that page needs them."""
    lines = better()
    if page.name == "index.md":
        lines = [line.replace("](docs/", "](") for line in lines]
    return {"expected": expected(), "better": lines}


def main() -> None:
    """Renew both pages."""
    for page in PAGES:
        pages.put(page, tables(page))


if __name__ == "__main__":
    main()
