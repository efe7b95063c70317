"""Runs the studies that the docs quote: python evaluation/run.py --out results/study.json [--only X].

The real-oil study needs the data of the UCI repository (docs/reference/plant-accuracy.md) in a folder that is given by
--data or by RAMSIGHT_DATA; without it its figures in the file stay as they are.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import after_faults
import commissioned
import drive_control
import effects
import false_contacts
import faults
import hindsight
import identify_coverage
import in_service
import leak_learning
import loader_control
import loop_response
import named_faults
import new_kinds
import profiles
import quadrants
import real_machine
import real_oil
import recorded
import second_channel
import starts
import structure
import tool_edge
import troubles
import tuned_sensor
import undisturbed
import unit_control
import weighing
import work_days
import wrong_descriptions

from ramsight.output import write_text
from ramsight.progress import progress

_OIL = "uci_hydraulic"  # folder of the real-oil study's data
Advance = Callable[[int], object]


@dataclass(frozen=True)
class Study:
    """A study that is run."""

    what: str  # it does, in words beside a bar
    steps: Callable[[argparse.Namespace], int]  # how many it has, by what was asked for
    # it; is passed what was asked for, and what is called with 1 after each step
    run: Callable[[argparse.Namespace, Advance], Any]


def whole(what: str, module: Any) -> Study:
    """A study that is always the same: a module with `runs`, how many steps it has, and `study`."""
    return Study(what, lambda given: module.runs(), lambda given, advance: module.study(advance))


STUDIES = {
    "recorded": Study("recorded logs", lambda given: 1, lambda given, advance: recorded.study(advance)),
    "starts": Study("starts", lambda given: len(starts.names()), lambda given, advance: starts.study(advance)),
    "sensitivity": Study(
        "assumptions varied",
        lambda given: 1 + len(recorded.variants()),
        lambda given, advance: recorded.sensitivity(advance),
    ),
    "structure": Study(
        "machines drawn",
        lambda given: given.machines * len(structure.CIRCUITS) * len(structure.LAWS),
        lambda given, advance: structure.study(given.machines, advance),
    ),
    "profiles": Study(
        "profiles of exports",
        lambda given: len(profiles.PROFILES),
        lambda given, advance: profiles.study(10, advance),
    ),
    "real_oil": Study("real oil", lambda given: 1, lambda given, advance: real_oil.study(given.data / _OIL)),
    "identify": Study(
        "identifying",
        lambda given: given.seeds * len(identify_coverage.UNITS),
        lambda given, advance: identify_coverage.coverage(given.seeds, advance),
    ),
    "tuned_sensor": Study(
        "days of tuned sensors",
        lambda given: tuned_sensor.runs(given.machines),
        lambda given, advance: tuned_sensor.study(given.machines, advance),
    ),
    "commissioned": whole("machines commissioned", commissioned),
    "wrong_descriptions": whole("machines described wrongly", wrong_descriptions),
    "leak_learning": whole("leakages learned", leak_learning),
    "work_days": Study(
        "work days", lambda given: 2 * given.days, lambda given, advance: work_days.study(given.days, advance)
    ),
    "faults": Study("faults", lambda given: given.seeds, lambda given, advance: faults.study(given.seeds, advance)),
    "after_faults": Study(
        "after faults",
        lambda given: given.seeds * len(after_faults.SIGNALS),
        lambda given, advance: after_faults.study(given.seeds, advance),
    ),
    "named_faults": Study(
        "naming faults", lambda given: given.seeds, lambda given, advance: named_faults.study(given.seeds, advance)
    ),
    "undisturbed": Study(
        "days without a fault",
        lambda given: 2 * given.days,
        lambda given, advance: undisturbed.study(given.days, advance),
    ),
    "second_channel": Study(
        "a second channel", lambda given: given.seeds, lambda given, advance: second_channel.study(given.seeds, advance)
    ),
    "loader_control": whole("driving the loader", loader_control),
    "unit_control": whole("driving every circuit", unit_control),
    "drive_control": whole("driving with every drive", drive_control),
    "loop_response": whole("the loop's response", loop_response),
    "hindsight": whole("logs looked back at", hindsight),
    "new_kinds": whole("days of new kinds", new_kinds),
    "false_contacts": whole("hours of work", false_contacts),
    "weighing": whole("machines that weigh", weighing),
    "tool_edge": whole("loaders' edges", tool_edge),
    "troubles": whole("what goes wrong in the studio", troubles),
    "real_machine": Study(
        "days of real machines",
        lambda given: real_machine.runs(real_machine.DAYS),
        lambda given, advance: real_machine.study(real_machine.DAYS, advance),
    ),
    "in_service": Study(
        "days of loaders in service",
        lambda given: in_service.runs(in_service.DAYS),
        lambda given, advance: in_service.study(in_service.DAYS, advance),
    ),
    "quadrants": whole("moves in four quadrants", quadrants),
    "effects": Study(
        "effects of a real machine",
        lambda given: len(effects.EFFECTS),
        lambda given, advance: effects.study(advance),
    ),
}


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/study.json"))
    parser.add_argument("--data", type=Path, default=None, help="folder with uci_hydraulic in it")
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--days", type=int, default=500, help="work days of each unit")
    parser.add_argument("--machines", type=int, default=10, help="machines of each circuit and law")
    parser.add_argument(
        "--only", choices=STUDIES, nargs="*", default=list(STUDIES), help="leave the others as they are"
    )
    given = parser.parse_args()
    given.data = given.data or Path(os.environ.get("RAMSIGHT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    found = json.loads(given.out.read_text()) if given.out.exists() else {}
    for name, study in STUDIES.items():
        if name not in given.only:
            continue
        if name == "real_oil" and not (given.data / _OIL / "FS1.csv.gz").exists():
            print(f"{given.data}: no {_OIL} here; the real-oil study is left out")
            continue
        with progress(study.steps(given), study.what) as bar:
            found[name] = study.run(given, bar.advance)
    write_text(json.dumps(found, indent=2) + "\n", given.out)
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
