"""Try what must not happen, by the thousand: `python fuzz/run.py --out results/fuzz.json`; a seed gives the same cases.

A section is a kind of case; each module lists its own in `SECTIONS`. The file keeps what other sections have said.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import sys
from importlib import import_module
from pathlib import Path

from harness import CRASHED, HUNG, WRONG, Section, run

MODULES = [
    "logs",
    "programs",
    "odd_inputs",
    "odd_arguments",
    "maps",
    "descriptions",
    "outputs",
    "states",
    "twins",
    "exported",
    "fmu_calls",
    "fmu_pointers",
    "encoder",
    "second_node",
    "stale",
    "drive_kinds",
    "sleeping",
    "rates",
    "growing",
    "histories",
    "long_day",
    "soak",
    "many_rows",
    "network",
    "restarts",
    "flooded",
    "studio",
    "covariance",
]
"""Modules with sections; a new one is named here."""


def main() -> int:
    """Run the sections and write what came of them; 1 if anything crashed, hung or was silently wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/fuzz.json"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scale", type=float, default=1.0, help="of the number of cases")
    parser.add_argument("--minutes", type=float, default=math.inf, help="of a section at most; it ends after a case")
    parser.add_argument("--section", action="append", help="only sections whose name begins so; may be repeated")
    options = parser.parse_args()
    sections: list[Section] = [one for name in MODULES for one in import_module(name).SECTIONS]
    found = json.loads(options.out.read_text()) if options.out.exists() else {}
    found |= {"seed": options.seed, "python": platform.python_version()}
    results, bad = found.setdefault("sections", {}), 0
    for section in sections:
        if options.section and not any(section.name.startswith(start) for start in options.section):
            continue
        tally = run(section, options.seed, max(int(section.cases * options.scale), 1), 60.0 * options.minutes)
        results[section.name] = tally.as_json(tells=section.tells)
        bad += sum(tally.counts[outcome] for outcome in (CRASHED, HUNG, WRONG))
        print(
            f"{section.name}: {dict(tally.counts)}, {tally.seconds:.0f} s",
            *tally.examples,
            *tally.told[-1:] * section.tells,
            sep="\n  ",
            flush=True,
        )
        options.out.write_text(json.dumps(found, indent=1) + "\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
