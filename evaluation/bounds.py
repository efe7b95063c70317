"""How often the sensor's error exceeds the bound that it says, on machines drawn from their tolerances.

    python evaluation/bounds.py [--runs FOLDER] [--machines N] [--out study.json]

Machines, drives and days are those of `ramsight datasheet`; a store in the folder is gone on with, so that more hours
cost only what is new.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import ramsight
from ramsight.output import atomic_path

ROOT = Path(__file__).parents[1]
UNITS = ("boom", "bucket")


def study(runs: Path, machines: int) -> dict[str, Any]:
    """By unit of the loader: machines, hours, what the bound is, and how often it does not hold."""
    found = {}
    for unit in UNITS:
        one = ramsight.Study("mining-loader", unit=unit, n=machines)
        sheet = one.datasheet(one.run(runs / f"{unit}.zarr", progress=True))
        found[unit] = {"drawn": sheet.machines, "hours": sheet.hours, **asdict(sheet.bound)}
    return found


def table(found: dict[str, Any]) -> list[str]:
    """In Markdown."""
    head = ["| unit | machines | hours | bound, median | over the 95 % error | samples beyond it | machines with any |"]
    rows = []
    for unit, one in found.items():
        share, most = (100.0 * one["machines"][name] for name in ("value", "high"))
        cells = (
            unit, str(one["drawn"]), f"{one['hours']:.0f}", f"{1e3 * one['median']:.1f} mm", f"{one['over_p95']:.1f}",
            f"{one['beyond']} of {one['samples']}", f"{share:.2f} % (at most {most:.2f} %)",
        )  # fmt: skip
        rows.append(f"| {' | '.join(cells)} |")
    return [*head, "|---|---|---|---|---|---|---|", *rows]


def main() -> None:
    """Run it, and put it among the other figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=Path, default=ROOT / "build" / "bounds", help="where the stores are")
    parser.add_argument("--machines", type=int, default=5000, help="of each unit; a day of six minutes each")
    parser.add_argument("--out", type=Path, default=ROOT / "study.json")
    given = parser.parse_args()
    found = json.loads(given.out.read_text()) if given.out.exists() else {}
    found["bounds"] = study(given.runs, given.machines)
    with atomic_path(given.out) as draft:
        draft.write_text(json.dumps(found, indent=2) + "\n")
    print("\n".join(table(found["bounds"])))


if __name__ == "__main__":
    main()
