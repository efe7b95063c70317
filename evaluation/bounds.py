"""How often the sensor is wrong and says ok, and exceeds its own bound, on machines drawn from their tolerances.

    python evaluation/bounds.py [--runs FOLDER] [--machines N] [--out results/study.json]

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
from ramsight import machine as machines_of
from ramsight.machine import Machine
from ramsight.output import write_text

ROOT = Path(__file__).parents[1]
AXES = {
    "boom": ("mining-loader", 1.0),
    "bucket": ("mining-loader", 1.0),
    "pilot check": ("eha-single-rod", 0.2),
    "double rod": ("eha-test-bench", 0.2),
    "press": ("press", 0.2),
    "forklift": ("forklift-mast", 0.2),
}
"""Machine, and the share of the machines that are drawn of it."""
_SURELY = "0.0001 %"  # chance that an end is elsewhere than described: the least that can be said
_OF_THESE = 0.2  # share of the machines that are drawn again with ends that are surely where they are described


def study(runs: Path, machines: int) -> dict[str, Any]:
    """By axis: machines, hours, what the bound is, how often it does not hold, and how often ok is wrong.

    Once as described, and (`surely`) with ends that are surely where they are described.
    """
    found = {}
    for name, (described, share) in AXES.items():
        machine = machines_of.load(described)
        unit = name if described == "mining-loader" else next(iter(machine.units))
        found[name] = _one(machine, unit, round(share * machines), runs / f"{name}.zarr")
        sure = machine.replace({f"units.{unit}.assumptions.stops.undeclared": _SURELY})
        found[name]["surely"] = _one(sure, unit, round(_OF_THESE * machines), runs / f"{name} surely.zarr")
    return found


def _one(machine: Machine, unit: str, count: int, store: Path) -> dict[str, Any]:
    """The figures of a unit."""
    one = ramsight.Study(machine, unit=unit, machines=count)
    sheet = one.datasheet(one.run(store, progress=True))
    figures = {"drawn": sheet.machines, "hours": sheet.hours, "wrong_and_ok": sheet.ok_but_wrong}
    return figures | asdict(sheet.bound)


def table(found: dict[str, Any]) -> list[str]:
    """In Markdown."""
    head = [
        "| axis | machines | hours | bound, median | over the 95 % error | samples beyond it | machines with any "
        "| ok, and off by more than 4 σ | with ends that are sure: bound, median | over the 95 % error "
        "| samples beyond it |"
    ]
    rows = []
    for name, one in found.items():
        share, most = (100.0 * one["machines"][which] for which in ("value", "high"))
        cells = (
            name, str(one["drawn"]), f"{one['hours']:.0f}", f"{1e3 * one['median']:.1f} mm", f"{one['over_p95']:.1f}",
            f"{one['beyond']} of {one['samples']}", f"{share:.2f} % (at most {most:.2f} %)",
            f"{100.0 * one['wrong_and_ok']:.4f} % of the time",
            f"{1e3 * one['surely']['median']:.1f} mm", f"{one['surely']['over_p95']:.1f}",
            f"{one['surely']['beyond']} of {one['surely']['samples']}",
        )  # fmt: skip
        rows.append(f"| {' | '.join(cells)} |")
    return [*head, "|---|---|---|---|---|---|---|---|---|---|---|", *rows]


def main() -> None:
    """Run it, and put it among the other figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=Path, default=ROOT / "build" / "bounds", help="where the stores are")
    parser.add_argument("--machines", type=int, default=5000, help="of the loader's axes; a day of six minutes each")
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "study.json")
    given = parser.parse_args()
    found = json.loads(given.out.read_text()) if given.out.exists() else {}
    found["bounds"] = study(given.runs, given.machines)
    write_text(json.dumps(found, indent=2) + "\n", given.out)
    print("\n".join(table(found["bounds"])))


if __name__ == "__main__":
    main()
