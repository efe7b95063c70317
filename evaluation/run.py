"""Runs the studies that the docs quote and writes their figures: python evaluation/run.py --out study.json [--only X].

The real-oil study needs the data of the UCI repository (see docs/identify.md) in a folder that is given by --data or
by RAMSIGHT_DATA; without it its figures in the file stay as they are.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

import after_faults
import drive_control
import effects
import faults
import identify_coverage
import in_service
import loader_control
import loop_response
import named_faults
import quadrants
import real_machine
import real_oil
import recorded
import second_channel
import starts
import structure
import tuned_sensor
import undisturbed
import unit_control
import work_days

from ramsight.output import atomic_path
from ramsight.progress import progress

STUDIES = (
    "recorded",
    "starts",
    "sensitivity",
    "structure",
    "real_oil",
    "identify",
    "tuned_sensor",
    "work_days",
    "faults",
    "after_faults",
    "named_faults",
    "undisturbed",
    "second_channel",
    "loader_control",
    "unit_control",
    "drive_control",
    "loop_response",
    "real_machine",
    "in_service",
    "quadrants",
    "effects",
)


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("study.json"))
    parser.add_argument("--data", type=Path, default=None, help="folder with uci_hydraulic in it")
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--days", type=int, default=500, help="work days of each unit")
    parser.add_argument("--machines", type=int, default=10, help="machines of each circuit and law")
    parser.add_argument("--only", choices=STUDIES, nargs="*", default=STUDIES, help="leave the others as they are")
    given = parser.parse_args()
    data = given.data or Path(os.environ.get("RAMSIGHT_DATA", Path(__file__).parents[2] / "shared" / "data"))
    found = json.loads(given.out.read_text()) if given.out.exists() else {}
    if "recorded" in given.only:
        with progress(1, "recorded logs") as bar:
            found["recorded"] = recorded.study(bar.advance)
    if "starts" in given.only:
        with progress(len(starts.names()), "starts") as bar:
            found["starts"] = starts.study(bar.advance)
    if "sensitivity" in given.only:
        with progress(1 + len(recorded.variants()), "assumptions varied") as bar:
            found["sensitivity"] = recorded.sensitivity(bar.advance)
    if "structure" in given.only:
        with progress(given.machines * len(structure.CIRCUITS) * len(structure.LAWS), "machines drawn") as bar:
            found["structure"] = structure.study(given.machines, bar.advance)
    if "real_oil" in given.only:
        if (data / "uci_hydraulic" / "FS1.csv.gz").exists():
            found["real_oil"] = real_oil.study(data / "uci_hydraulic")
        else:
            print(f"{data}: no uci_hydraulic here; the real-oil study is left out")
    if "identify" in given.only:
        with progress(given.seeds * len(identify_coverage.UNITS), "identifying") as bar:
            found["identify"] = identify_coverage.coverage(given.seeds, bar.advance)
    if "tuned_sensor" in given.only:
        with progress(tuned_sensor.runs(given.machines), "days of tuned sensors") as bar:
            found["tuned_sensor"] = tuned_sensor.study(given.machines, bar.advance)
    if "work_days" in given.only:
        with progress(2 * given.days, "work days") as bar:
            found["work_days"] = work_days.study(given.days, bar.advance)
    if "faults" in given.only:
        with progress(given.seeds, "faults") as bar:
            found["faults"] = faults.study(given.seeds, bar.advance)
    if "after_faults" in given.only:
        with progress(given.seeds * len(after_faults.SIGNALS), "after faults") as bar:
            found["after_faults"] = after_faults.study(given.seeds, bar.advance)
    if "named_faults" in given.only:
        with progress(given.seeds, "naming faults") as bar:
            found["named_faults"] = named_faults.study(given.seeds, bar.advance)
    if "undisturbed" in given.only:
        with progress(2 * given.days, "days without a fault") as bar:
            found["undisturbed"] = undisturbed.study(given.days, bar.advance)
    if "second_channel" in given.only:
        with progress(given.seeds, "a second channel") as bar:
            found["second_channel"] = second_channel.study(given.seeds, bar.advance)
    if "loader_control" in given.only:
        with progress(loader_control.runs(), "driving the loader") as bar:
            found["loader_control"] = loader_control.study(bar.advance)
    if "unit_control" in given.only:
        with progress(unit_control.runs(), "driving every circuit") as bar:
            found["unit_control"] = unit_control.study(bar.advance)
    if "drive_control" in given.only:
        with progress(drive_control.runs(), "driving with every drive") as bar:
            found["drive_control"] = drive_control.study(bar.advance)
    if "loop_response" in given.only:
        with progress(loop_response.runs(), "the loop's response") as bar:
            found["loop_response"] = loop_response.study(bar.advance)
    if "real_machine" in given.only:
        with progress(real_machine.runs(real_machine.DAYS), "days of real machines") as bar:
            found["real_machine"] = real_machine.study(real_machine.DAYS, bar.advance)
    if "in_service" in given.only:
        with progress(in_service.runs(in_service.DAYS), "days of loaders in service") as bar:
            found["in_service"] = in_service.study(in_service.DAYS, bar.advance)
    if "quadrants" in given.only:
        with progress(quadrants.runs(), "moves in four quadrants") as bar:
            found["quadrants"] = quadrants.study(bar.advance)
    if "effects" in given.only:
        with progress(len(effects.EFFECTS), "effects of a real machine") as bar:
            found["effects"] = effects.study(bar.advance)
    with atomic_path(given.out) as draft:
        draft.write_text(json.dumps(found, indent=2) + "\n")
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
