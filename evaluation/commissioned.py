"""What a commissioning saves: the next day's lift before any reference, by the data sheet and by what was found.

Each machine is commissioned as docs/how-to/commission.md says. Then it lifts and lowers its largest usual load; the
start is known, and the piston meets no end. The seed decides everything.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from identify_coverage import UNITS, deviating, drawn, machine_of, unit_of

import ramsight
from ramsight.calibration.identify import AS_DESCRIBED
from ramsight.calibration.knowledge import of_identification, of_leak_test
from ramsight.calibration.tuned import tuned
from ramsight.duty import report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.lift_lower import lift_lower
from ramsight.machine import Machine, load_machine
from ramsight.machine.assumption_description import SURE_START
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

MACHINES = ("boom", "bucket", "forklift")
DAYS = 4
_FIRST_SEED = 3000  # others than those of the other studies
STATED = {"machine.leaks_otherwise": 1e-5, "machine.unseen_load": 0.05}
"""What an owner may state of a machine that was measured: that it leaks as on that day but in one case of 100 000, and
that no load changes at rest by more than a twentieth of that at relief pressure."""
_LOAD = 0.7  # share of the load at relief pressure
_WARM = 313.15  # K


def runs() -> int:
    """How many machines there are."""
    return DAYS * len(MACHINES)


def described(name: str, made: Any, seed: int, folder: Path) -> Iterator[tuple[str, Machine]]:
    """The machine by its data sheet, and as each way of commissioning it found it."""
    sheet, unit = machine_of(name), UNITS[name][1]
    yield "data sheet", sheet
    run = simulate(made, ramsight.duty_for(unit_of(name), "commissioning"))
    log = report(run, declared_report(made, seed))
    if (done := ramsight.commission(sheet, log, unit=unit, tuned=folder / "learned.toml")).leak_test is not None:
        known = of_leak_test(done.leak_test, sheet.unit(unit))
        yield "leak test", tuned(sheet, unit, known, "the study").machine
    if (folder / "learned.toml").exists():
        yield "without a position", load_machine(folder / "learned.toml")
    found = ramsight.identify(sheet, log, run[["position"]], unit=unit)
    yield "with a position", tuned(sheet, unit, of_identification(found, sheet.unit(unit)), "the study").machine


def one(name: str, seed: int) -> dict[str, dict[str, float]]:
    """A machine's next day: figures by what its sensor knew."""
    true, sheet = (AS_DESCRIBED if seed == _FIRST_SEED else drawn(seed)), unit_of(name)
    made = deviating(sheet, true)
    duty = lift_lower(sheet, _LOAD * limits_of(sheet).load, _WARM)
    run = simulate(made, duty)
    log, position = report(run, declared_report(made, seed + 500)), run["position"].values
    figures = {}
    with tempfile.TemporaryDirectory() as folder:
        for how, machine in described(name, made, seed, Path(folder)):
            unit = build(machine.unit(UNITS[name][1]), UNITS[name][1])
            for stated in ({}, STATED) if how.endswith("a position") else ({},):
                sensor = kalman(unit, unit.assumptions.replace({**SURE_START, **stated}))
                sensor.start(duty.start_position)
                figures[how + (", stated" if stated else "")] = _figures(sensor.track(log), position)
    return figures


def _figures(track: xarray.Dataset, position: np.ndarray) -> dict[str, float]:
    """What a track of a day comes to."""
    error = np.abs(track["position"].values - position)
    low, high = track["position_low"].values, track["position_high"].values
    return {
        "largest": float(error.max()),
        "std": float(track["position_std"].max()),
        "bound": float(track["position_bound"].max()),
        "ok": float(np.mean(track["status"].values == Status.OK)),
        "band": float(np.mean((low <= position) & (position <= high))),
    }


def study(advance: Callable[[int], object]) -> dict[str, dict[str, dict[str, float]]]:
    """Medians and worst over the machines, by unit and by what its sensor knew."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name in MACHINES:
        days = []
        for seed in range(_FIRST_SEED, _FIRST_SEED + DAYS):
            days.append(one(name, seed))
            advance(1)
        found[name] = {how: _over([day[how] for day in days if how in day]) for how in days[0]}
    return found


def _over(days: list[dict[str, float]]) -> dict[str, float]:
    columns = {key: np.array([day[key] for day in days]) for key in days[0]}
    worst = {f"{key}_worst": float(columns[key].max()) for key in ("largest", "std", "bound")}
    least = {f"{key}_least": float(columns[key].min()) for key in ("ok", "band")}
    return {"machines": len(days), **{key: float(np.median(of)) for key, of in columns.items()}, **worst, **least}


def table(found: dict[str, dict[str, dict[str, float]]]) -> list[str]:
    """Table of docs/reference/accuracy-commissioned.md."""
    rows = [
        "| unit | commissioned | largest error | largest standard deviation | largest bound | ok | band, least |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, kinds in found.items():
        for how, f in kinds.items():
            cells = [f"{1e3 * f[key]:.1f} mm ({1e3 * f[key + '_worst']:.1f})" for key in ("largest", "std", "bound")]
            shares = [f"{100 * f['ok']:.0f} % ({100 * f['ok_least']:.0f})", f"{100 * f['band_least']:.0f} %"]
            rows.append(f"| {name} | {how} | " + " | ".join([*cells, *shares]) + " |")
    return rows
