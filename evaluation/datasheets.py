"""The sheets that docs/reference/data-sheets.md shows: python evaluation/datasheets.py [--runs FOLDER] [--pages-only].

Runs what is not done yet of the studies of both units of the loader and of one machine of each other circuit (a quarter
of an hour on two cores), copies their pages and numbers to docs/sheets, and renews their tables.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pages

from ramsight import Study
from ramsight.output import write_text
from ramsight.study.datasheet.cluster import run
from ramsight.study.datasheet.quantities import varied
from ramsight.study.datasheet.sheet import data_sheet
from ramsight.study.datasheet.sheet_requirement import MEASURES, Measure
from ramsight.study.datasheet.study_plan import Plan

ROOT = Path(__file__).parents[1]
SHEETS, TRACES = ROOT / "docs" / "sheets", ROOT / "tests" / "traces"

BOOM = ("boom_asbuilt1_workday", "boom_441kN_40C", "boom_441kN_20C", "boom_441kN_60C", "boom_129kN_40C")
BUCKET = ("bucket_asbuilt1_workday", "bucket_162kN_40C", "bucket_48kN_40C", "bucket_96kN_40C")
STUDIES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "mining-loader-boom": (("--machines", "1000", "--budget", "128"), BOOM),
    "mining-loader-bucket": (("--machines", "1000", "--budget", "64"), BUCKET),
    "eha-single-rod-axis": (("--machines", "600"), ()),
    "eha-test-bench-axis": (("--machines", "600"), ()),
    "forklift-mast-lift": (("--machines", "600"), ()),
    "press-ram": (("--machines", "600"), ()),
    "eha-valve-rig-axis": (("--machines", "600", "--duty", "lift-lower"), ()),
}
"""Each with its options, and with the recorded logs that are held against it."""


TRIED = 256  # machines with each measure
OFTEN = (Measure("a reference every 20 s of work", {}), 20.0)  # s


def work(name: str, runs: Path) -> None:
    """Run a study, and copy its sheet."""
    options, logs = STUDIES[name]
    machine, _, unit = name.rpartition("-")
    held = [
        word for log in logs for word in ("--log", f"{TRACES / log}.csv.gz", "--truth", f"{TRACES / log}_truth.csv.gz")
    ]
    command = [sys.executable, "-m", "ramsight", "datasheet", machine, "--unit", unit, "--out", str(runs / name)]
    subprocess.run([*command, *options, *held], check=True)
    for end in ("html", "json"):
        shutil.copy(runs / name / f"sheet.{end}", SHEETS / f"{name}.{end}")


def found() -> dict[str, dict[str, Any]]:
    """The numbers of all sheets, by name."""
    return {name: json.loads((SHEETS / f"{name}.json").read_text()) for name in STUDIES}


def _millimetres(value: float | None) -> str:
    """A length [m]; a dash where no machine came so far."""
    return "–" if value is None else f"{1e3 * value:.1f}"


def table(sheets: dict[str, dict[str, Any]]) -> list[str]:
    """What the sheets say, a machine a line."""
    head = ("sheet", "machines", "before", "after 1", "after 2", "after 3", "… of 95 % of machines", "ok", "while ok")
    rows = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for name, sheet in sheets.items():
        errors = [_millimetres(one["quantiles"][1]["value"]) for one in sheet["accuracy"]]
        taught = _millimetres(sheet["accuracy"][3]["machine"]["value"])
        said = f"{100 * sheet['validity']['ok']:.0f} %"
        cells = [f"[{name}](../sheets/{name}.html)", str(sheet["machines"]), *errors[:4], taught, said, errors[4]]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def budget(sheet: dict[str, Any]) -> list[str]:
    """The largest of an error budget."""
    head = ("tolerance", "total [%]", "first order [%]", "linear [%]", "one standard deviation [mm]")
    rows = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    quantities = sorted(sheet["budget"]["quantities"].items(), key=lambda item: -item[1]["total"])
    for name, of in quantities[:8]:
        shares = [f"{100 * of[key]:.0f} ± {100 * of[f'{key}_half']:.0f}" for key in ("total", "first")]
        linear = [f"{100 * of['linear_share']:.0f}", f"{1e3 * of['linear']:.2f}"]
        rows.append(f"| {' | '.join((name.replace('_', ' '), *shares, *linear))} |")
    return rows


def measure() -> None:
    """Run the boom's study with each measure by itself, and keep the 95 % errors after the third reference."""
    study = Study("mining-loader", unit="boom", machines=TRIED)
    found = []
    for one, visit_every in ((Measure("nothing", {}), None), *((one, None) for one in MEASURES), OFTEN):
        plan = with_measure(study, one, visit_every)
        error = data_sheet(plan, run(plan, None)).best.quantiles[1]
        found.append({"measure": one.name, "machines": plan.count, "error": asdict(error)})
    write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", SHEETS / "measures.json")


def with_measure(study: Study, measure: Measure, visit_every: float | None) -> Plan:
    """The plan of a machine that a measure was taken on; only what is narrower than before counts."""
    held = {one.name: one for one in study.plan.quantities}
    for one in varied(study.machine, study.plan.unit, dict(measure.tolerances)):
        if one.name in measure.tolerances and one.name in held and one.spread.std < held[one.name].spread.std:
            held[one.name] = replace(one, source=measure.name)
    work = study.plan.work if visit_every is None else replace(study.plan.work, visit_every=visit_every)
    return replace(study.plan, work=work, quantities=tuple(held.values()))


def measures() -> list[dict[str, Any]]:
    """What each measure brings by itself, as `measure` has kept it."""
    return json.loads((SHEETS / "measures.json").read_text())


def measure_table() -> list[str]:
    """The same as a table."""
    rows = ["| what was done | 95 % error [mm] | machines |", "|---|---|---|"]
    for one in measures():
        value, low, high = (f"{1e3 * one['error'][key]:.2f}" for key in ("value", "low", "high"))
        rows.append(f"| {one['measure']} | {value} ({low} to {high}) | {one['machines']} |")
    return rows


def tables() -> dict[str, list[str]]:
    """All tables of the page."""
    sheets = found()
    boom = sheets["mining-loader-boom"]
    return {"sheets": table(sheets), "budget": budget(boom), "measures": measure_table()}


def main() -> None:
    """Run, copy, renew."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=Path, default=ROOT / "build" / "datasheets", help="where the stores are")
    parser.add_argument("--pages-only", action="store_true", help="renew the tables alone")
    options = parser.parse_args()
    if not options.pages_only:
        options.runs.mkdir(parents=True, exist_ok=True)
        SHEETS.mkdir(exist_ok=True)
        for name in STUDIES:
            work(name, options.runs)
        measure()
    pages.put_where_marked(tables())


if __name__ == "__main__":
    main()
