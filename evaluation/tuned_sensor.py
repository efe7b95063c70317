"""Whether a sensor that identify tuned is better on the next day than the data sheet's, where a valve holds the load.

Machines as described, and drawn as for the coverage of the intervals; each is identified from one log and then works
another day, which both sensors follow from a known start. The seed decides everything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray
from identify_coverage import UNITS, deviating, drawn, machine_of, unit_of, worked

from ramsight.calibration.identify import AS_DESCRIBED
from ramsight.calibration.knowledge import of_identification
from ramsight.calibration.tuned import tuned
from ramsight.duty import Duty, report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.work_day import work_day
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman

MACHINES = ("boom", "bucket", "forklift", "forklift 63 mm")
KINDS = ("as described", "drawn")
_FIRST_SEED = 2000  # others than those of the coverage
_LOADS = (0.15, 0.6)  # share of the load at relief pressure
_DAY = 240.0  # s
_ALIKE = 0.5e-3  # m; what chance moves the error of a day by


def runs(machines: int) -> int:
    """How many days there are."""
    return machines * len(MACHINES) * len(KINDS)


def day(sheet: HydraulicUnit, made: HydraulicUnit, seed: int) -> tuple[Duty, xarray.Dataset, xarray.Dataset]:
    """A work day of a machine: what it did, what was true, and what its drive reported."""
    least, most = (share * limits_of(sheet).load for share in _LOADS)
    temperature = float(np.random.default_rng([seed, 2]).uniform(298.15, 323.15))
    duty = work_day(sheet, (least, most), temperature, duration=_DAY, seed=seed)
    run = simulate(made, duty)
    return duty, run, report(run, declared_report(sheet, seed))


def error(unit: HydraulicUnit, duty: Duty, run: xarray.Dataset, log: xarray.Dataset) -> float:
    """95 % of the errors of a unit's sensor on a day [m]."""
    sensor = kalman(unit)
    sensor.start(duty.start_position)
    return float(np.nanpercentile(np.abs(sensor.track(log)["position"].values - run["position"].values), 95.0))


def one(name: str, kind: str, seed: int) -> dict[str, float]:
    """A machine's errors on its day by the data sheet's sensor and by the tuned one [m], and its stiffness."""
    true = AS_DESCRIBED if kind == "as described" else drawn(seed)
    sheet: Any = unit_of(name)
    made = deviating(sheet, true)
    found = worked(sheet, made, seed, leak_factor=true["leak"] + true["orifice"])
    unit = UNITS[name][1]
    described = machine_of(name)
    known = of_identification(found, described.unit(unit))
    better = build(tuned(described, unit, known, "the study").machine.unit(unit), unit)
    work = day(sheet, made, seed)
    return {"untuned": error(sheet, *work), "tuned": error(better, *work)}


def study(machines: int, advance: Callable[[int], object]) -> dict[str, dict[str, dict[str, float]]]:
    """The figures of each machine and kind, over so many of each."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name in MACHINES:
        found[name] = {}
        for kind in KINDS:
            days = []
            for seed in range(_FIRST_SEED, _FIRST_SEED + machines):
                days.append(one(name, kind, seed))
                advance(1)
            found[name][kind] = _figures(days)
    return found


def _figures(days: list[dict[str, float]]) -> dict[str, float]:
    untuned, tuned_ = (np.array([one[key] for one in days]) for key in ("untuned", "tuned"))
    return {
        "machines": len(days),
        "untuned_mm": 1e3 * float(np.median(untuned)),
        "tuned_mm": 1e3 * float(np.median(tuned_)),
        "untuned_worst_mm": 1e3 * float(untuned.max()),
        "tuned_worst_mm": 1e3 * float(tuned_.max()),
        "worse": int((tuned_ > untuned + _ALIKE).sum()),
    }


def table(found: dict[str, dict[str, dict[str, float]]]) -> list[str]:
    """Table of docs/reference/accuracy-commissioned.md."""
    rows = ["| machine | | data sheet's sensor | tuned sensor | tuned one worse |", "|---|---|---|---|---|"]
    for name, kinds in found.items():
        for kind, f in kinds.items():
            before, after = (f"{f[k + '_mm']:.2f} mm ({f[k + '_worst_mm']:.2f})" for k in ("untuned", "tuned"))
            rows.append(f"| {name} | {kind} | {before} | {after} | {f['worse']} of {f['machines']} |")
    return rows
