"""Writes the tables of the pages in docs that quote studies from results/study.json: python evaluation/pages.py."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import after_faults
import bounds
import commissioned
import constants_varied
import drive_control
import effects
import false_contacts
import fmeda
import hindsight
import in_service
import leak_learning
import loader_control
import loop_response
import named_faults
import new_kinds
import profiles
import real_machine
import second_channel
import signal_sets
import tool_edge
import troubles
import tuned_sensor
import undisturbed
import unit_control
import weighing
import wrong_descriptions
from page_tables import constant_table, drive_map_table, fault_table, object_table, quality_table, shared_table

from ramsight.closed_loop import thresholds as loop_thresholds
from ramsight.control import thresholds as control_thresholds
from ramsight.output import write_text
from ramsight.sensor import thresholds as sensor_thresholds
from ramsight.sensor.report.detectors import detector_table
from ramsight.study.datasheet.statistics import share_of

ROOT = Path(__file__).parents[1]
THRESHOLDS = {
    "sensor_thresholds": sensor_thresholds,
    "control_thresholds": control_thresholds,
    "loop_thresholds": loop_thresholds,
}
INPUTS = {
    "motor_speed": "motor speed", "motor_torque": "motor torque", "oil_temperature": "oil temperature",
    "shaft_angle": "counter", "dc_power": "DC power",
}  # fmt: skip


def work_days(found: dict[str, Any]) -> list[str]:
    """The table of the work days."""
    units = ("boom", "bucket")
    rows: list[tuple[str, Callable[[Any], str]]] = [
        ("days judged", lambda d: f"{d['judged']} of {d['machines']}"),
        ("95 % of a day within, median day", lambda d: f"{d['p95_median_mm']:.2f} mm"),
        ("… worst day", lambda d: f"{d['p95_worst_mm']:.1f} mm"),
        ("… days within 3 mm", lambda d: f"{100 * d['p95_within_3_mm']:.1f} %"),
        ("largest error of a day, median day", lambda d: f"{d['largest_median_mm']:.2f} mm"),
        ("… worst day", lambda d: f"{d['largest_worst_mm']:.1f} mm"),
        ("… days within 8 mm", lambda d: f"{100 * d['largest_within_8_mm']:.1f} %"),
        ("the 95 % band holds, of all samples", lambda d: f"{100 * d['band_holds']:.1f} %"),
        ("ok, and more than 4 standard deviations off", lambda d: f"{100 * d['ok_beyond_4_std']:.2f} %"),
        ("false alarms in 100 h", lambda d: f"{d['false_alarms_per_100_h']:.1f} (in {d['hours']:.0f} h)"),
    ]
    head = ["| | boom | bucket |", "|---|---|---|"]
    return head + [f"| {label} | " + " | ".join(show(found[unit]) for unit in units) + " |" for label, show in rows]


def faults(found: dict[str, Any]) -> list[str]:
    """The table of the faults with what every drive reports."""
    head = ["| input | fault | noticed | after, median | wrong and ok |", "|---|---|---|---|---|"]
    rows = []
    for row in found[next(iter(found))]["rows"]:
        delay = "–" if row["delay_s"] is None else f"{row['delay_s']:.2f} s"
        shares = [f"{100 * row[name]:.0f} %" for name in ("noticed", "harm_unseen")]
        rows.append(
            f"| {INPUTS.get(row['input'], row['input'])} | {row['fault']} | {shares[0]} | {delay} | {shares[1]} |"
        )
    return head + rows


def _electrical(found: dict[str, Any], cell: Callable[[dict[str, Any]], str]) -> list[str]:
    """A fault of a drive's signals a row, by what the sensor is given; what a cell says of that."""
    names = list(found)
    rows = [f"| input | fault | {' | '.join(names)} |", "|---" * (len(names) + 2) + "|"]
    of = {name: {(row["input"], row["fault"]): row for row in found[name]["rows"]} for name in names}
    for channel, fault in {key: None for name in names for key in of[name] if key[0] in ELECTRICAL}:
        cells = [cell(of[n][channel, fault]) if (channel, fault) in of[n] else "" for n in names]
        rows.append(f"| {INPUTS.get(channel, channel)} | {fault} | {' | '.join(cells)} |")
    return rows


def by_signals(found: dict[str, Any]) -> list[str]:
    """Wrong and ok."""
    rows = _electrical(found, lambda row: f"{100 * row['harm_unseen']:.1f} %")
    hours = [f"{one['contradictions_without_a_fault']} in {one['hours']:.1f} h" for one in found.values()]
    return [*rows, f"| – | contradictions said without a fault | {' | '.join(hours)} |"]


def noticed(found: dict[str, Any]) -> list[str]:
    """Share that is noticed, what it is at least with 97.5 % confidence, and after how long."""

    def cell(row: dict[str, Any]) -> str:
        least = share_of(round(row["noticed"] * row["injected"]), row["injected"]).low
        delay = "" if row["delay_s"] is None else f", {row['delay_s']:.1f} s"
        return f"{100 * row['noticed']:.0f} (≥ {100 * least:.0f}) %{delay}"

    return _electrical(found, cell)


def beyond_bound(found: dict[str, Any]) -> list[str]:
    """Share of the faults with a sample that is ok and beyond its bound."""
    return _electrical(found, lambda row: f"{100 * row['beyond_bound_and_ok']:.1f} %")


def recorded(found: dict[str, Any]) -> list[str]:
    """The table of the recorded logs."""
    head = ["| log | median | 95 % | largest [mm] | band | wrong and ok | ok | σ, median [mm] |"]
    rows = []
    for name, row in sorted(found.items(), key=lambda item: ("day" in item[0], "person" in item[0], item[0])):
        errors = ["–" if math.isnan(row[key]) else f"{1e3 * row[key]:.2f}" for key in ("median", "p95", "largest")]
        shares = [f"{100 * row['coverage']:.1f} %", f"{100 * row['wrong_and_ok']:.2f} %", f"{100 * row['ok']:.0f} %"]
        rows.append(f"| {name} | " + " | ".join([*errors, *shares, f"{1e3 * row['std']:.1f}"]) + " |")
    return [*head, "|---|---|---|---|---|---|---|---|", *rows]


def starts(found: dict[str, Any]) -> list[str]:
    """The table of the logs with different starts."""
    rows = [
        "| log | start | 95 % [mm] | band | wrong and ok | beyond the bound | ok |",
        "|---|---|---|---|---|---|---|",
    ]
    for log, kinds in found.items():
        for start, row in kinds.items():
            far = "–" if math.isnan(row["p95"]) else f"{1e3 * row['p95']:.2f}"
            shares = [f"{100 * row['coverage']:.1f} %", f"{100 * row['wrong_and_ok']:.2f} %"]
            shares += [f"{100 * row['beyond_bound']:.3f} %", f"{100 * row['ok']:.0f} %"]
            rows.append(f"| {log} | {start} | {far} | " + " | ".join(shares) + " |")
    return rows


def structure(found: dict[str, Any]) -> list[str]:
    """The table of the machines with random structure."""
    head = ["| circuit | law | days judged | 95 % within: median, worst | worst ok | band | wrong and ok |"]
    rows = []
    for circuit, laws in found.items():
        for law, row in laws.items():
            worst = [f"{row[key]:.1f} mm" for key in ("p95_median_mm", "p95_worst_mm", "ok_worst_mm")]
            rows.append(
                f"| {circuit} | {law} | {row['judged']} of {row['days']} | {worst[0]}, {worst[1]} | {worst[2]} "
                f"| {100 * row['band_holds']:.0f} % | {100 * row['wrong_and_ok']:.2f} % |"
            )
    return [*head, "|---|---|---|---|---|---|---|", *rows]


def sensitivity(found: dict[str, Any]) -> list[str]:
    """The table of the assumptions varied."""
    head = [
        "| assumption | p95, worst day | p95, median day | band, least | wrong and ok, most |",
        "|---|---|---|---|---|",
    ]
    return head + [
        f"| {name} | {1e3 * row['p95_worst']:.1f} mm | {1e3 * row['p95_median']:.2f} mm "
        f"| {100 * row['coverage_least']:.0f} % | {100 * row['wrong_and_ok_most']:.1f} % |"
        for name, row in found.items()
    ]


ELECTRICAL = ("motor_speed", "motor_torque", "shaft_angle", "dc_power")


TABLES: dict[str, Callable[[Any], list[str]]] = {
    "recorded": recorded,
    "starts": starts,
    "structure": structure,
    "leak_learning": leak_learning.table,
    "work_days": work_days,
    "sensitivity": sensitivity,
    "new_kinds": new_kinds.table,
    "false_contacts": false_contacts.table,
    "faults": faults,
}


CONTROL_TABLES: dict[str, tuple[str, Callable[[Any], list[str]]]] = {
    "unit_control": ("unit_control", unit_control.table),
    "lost": ("unit_control", unit_control.fault_table),
    "drives": ("drive_control", drive_control.table),
    "missed": ("drive_control", drive_control.missed),
    "drive_faults": ("drive_control", drive_control.fault_table),
    "repeats": ("drive_control", drive_control.repeat_table),
    "drive_commands": ("drive_control", drive_control.command_table),
    "drive_longer": ("drive_control", drive_control.longer),
    "drive_loader": ("drive_control", drive_control.loader_table),
    "loop": ("loop_response", loop_response.table),
}
"""The tables and lists of the control by their marks: whose figures, and how they are written."""

LOADER_TABLES: dict[str, Callable[[Any], list[str]]] = {
    "loader": loader_control.table,
    "limits": loader_control.limits,
    "loader_faults": loader_control.fault_table,
}
"""The same of the loader."""


def page_of(mark: str) -> Path:
    """The page of docs that has a mark; index.md repeats those of README.md and is left out."""
    pages = (page for page in sorted((ROOT / "docs").rglob("*.md")) if page != ROOT / "docs" / "index.md")
    (found,) = [page for page in pages if f"<!-- {mark} -->\n" in page.read_text(encoding="utf-8")]
    return found


def put_where_marked(tables: dict[str, list[str]]) -> None:
    """Put rows between their marks, whatever page has them."""
    for name, rows in tables.items():
        put(page_of(name), {name: rows})


def put(page: Path, tables: dict[str, list[str]]) -> None:
    """Put rows between their marks."""
    text = page.read_text()
    for name, rows in tables.items():
        marked = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end of {name} -->)", flags=re.DOTALL)
        text = marked.sub(lambda match, rows=rows: f"{match[1]}\n" + "\n".join(rows) + f"\n\n{match[2]}", text)
    write_text(text, page)


def all_tables(found: dict[str, Any]) -> dict[str, list[str]]:
    """Every table that comes from results/study.json or from the code, by its mark."""
    tables = {name: table(found[name]) for name, table in TABLES.items()}
    tables["real_machine"] = real_machine.table(found["real_machine"])
    tables["in_service"] = in_service.table(found["in_service"])
    tables |= {"identify": identified(found["identify"]), "tuned_sensor": tuned_sensor.table(found["tuned_sensor"])}
    tables["commissioned"] = commissioned.table(found["commissioned"])
    tables["wrong_descriptions"] = wrong_descriptions.table(found["wrong_descriptions"])
    tables["profiles"] = profiles.table(found["profiles"])
    tables["effects"] = effects.table(found["effects"])
    tables |= {"by_signals": by_signals(found["faults"]), "bounds": bounds.table(found["bounds"])}
    tables |= {"noticed": noticed(found["faults"]), "beyond_bound": beyond_bound(found["faults"])}
    tables["after_faults"] = after_faults.table(found["after_faults"])
    tables["named_faults"] = named_faults.table(found["named_faults"])
    tables["undisturbed"] = undisturbed.table(found["undisturbed"])
    tables |= {"redundancy": signal_sets.table(), "detectors": detector_table().splitlines()}
    tables["shared"] = shared_table().splitlines()
    tables |= {"encoder_objects": object_table().splitlines(), "encoder_faults": fault_table().splitlines()}
    tables |= {"encoder_quality": quality_table().splitlines(), "drive_maps": drive_map_table().splitlines()}
    tables |= {name: constant_table(table).splitlines() for name, table in THRESHOLDS.items()}
    varied = json.loads((ROOT / "results" / "constants.json").read_text(encoding="utf-8"))
    tested = json.loads((ROOT / "results" / "constants_tested.json").read_text(encoding="utf-8"))
    tables["constants"] = constants_varied.table(varied, tested)
    tables["second_channel"] = second_channel.table(found["second_channel"])
    tables |= {name: table(found["loader_control"]) for name, table in LOADER_TABLES.items()}
    tables |= hindsight.tables(found["hindsight"])
    tables |= weighing.tables(found["weighing"]) | {"tool_edge": tool_edge.table(found["tool_edge"])}
    tables["troubles"] = troubles.table(found["troubles"])
    return tables | {name: table(found[study]) for name, (study, table) in CONTROL_TABLES.items()}


def main() -> None:
    """Put each table between its marks."""
    found = json.loads((ROOT / "results" / "study.json").read_text())
    put_where_marked(all_tables(found))
    fmeda.renew(found)


def identified(found: dict[str, dict[str, dict[str, float]]]) -> list[str]:
    """Table of an identification: of those told how many intervals hold, and their median half width."""
    factors = list(next(iter(found.values())))
    rows = [f"| machine | {' | '.join(factors)} |", "|---" * (len(factors) + 1) + "|"]
    for name, figures in found.items():
        rows.append(f"| {name} | {' | '.join(_held(figures[key]) for key in factors)} |")
    return rows


def _held(entry: dict[str, float]) -> str:
    if not entry["told"]:
        return "–"
    return f"{entry['held']} of {entry['told']}, ± {entry['half_width']:.4f}"


if __name__ == "__main__":
    main()
