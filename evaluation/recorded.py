"""The self-calibrating sensor on the recorded logs of the independent simulator, and what its assumptions do."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from judged_errors import Judged, judge

from ramsight import machine
from ramsight.logs import read_log, read_truth
from ramsight.machine import walk
from ramsight.plant.build import build
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.kalman import kalman

TRACES = Path(__file__).parents[1] / "tests" / "traces"
FACTOR = 1.5
"""By which each assumption is multiplied and divided."""
VARIED = ("drive", "machine", "thermometer", "stops")
"""Parts of the assumptions that are varied; the logs have no further signals, of which the other parts are."""


def logs() -> dict[str, tuple[str, xarray.Dataset, np.ndarray, float]]:
    """Unit, log, true position at its times and true start of each recorded case."""
    found = {}
    for folder in (TRACES, TRACES / "person"):
        for case in json.loads((folder / "cases.json").read_text()):
            name = case["name"]
            log = read_log(folder / f"{name}.csv.gz")
            truth = read_truth(folder / f"{name}_truth.csv.gz")
            position = np.interp(log["time"], truth["time"], truth["position"])
            found[name] = (case["unit"], log, position, float(truth["position"][0]))
            if "warming" in name:
                found[f"{name}, stuck"] = (case["unit"], stuck(log, 0.0), position, float(truth["position"][0]))
    return found


def stuck(log: xarray.Dataset, since: float) -> xarray.Dataset:
    """A log whose thermometer reports the same from some time on [s]."""
    reported = log["oil_temperature"]
    first = int(np.searchsorted(log["time"], since))
    return log.assign(oil_temperature=reported.where(log["time"] < log["time"][first], reported[first]))


def judged(assumptions: Assumptions | None = None, only: tuple[str, ...] = ("",)) -> dict[str, Judged]:
    """Every recorded log judged, with other assumptions perhaps."""
    loader = machine.load_machine("mining-loader")
    units = {name: build(loader.unit(name), name) for name in ("boom", "bucket")}
    sensors = {name: kalman(unit, assumptions) for name, unit in units.items()}
    found = {}
    for name, (unit, log, position, start) in logs().items():
        if not any(part in name for part in only):
            continue
        sensors[unit].start(start)
        day = "day" in name or "person" in name
        track = sensors[unit].track(log)
        found[name] = judge(
            track, log["motor_speed"].values, position, units[unit].cylinder.stroke, after=3 if day else 0
        )
    return found


def study(advance: Callable[[int], object]) -> dict[str, Any]:
    """All figures, by log."""
    found = {name: asdict(figures) for name, figures in judged().items()}
    advance(1)
    return found


def variants() -> list[tuple[str, Assumptions]]:
    """Each assumption times and over `FACTOR`, the others as they are."""
    base, found = Assumptions(), []
    for assumed in walk(base):
        if assumed.path.partition(".")[0] not in VARIED or assumed.value == 0.0:
            continue
        for factor, sign in ((FACTOR, "×"), (1.0 / FACTOR, "÷")):
            found.append((f"{assumed.path} {sign}", base.replace({assumed.path: assumed.value * factor})))
    return found


def sensitivity(advance: Callable[[int], object]) -> dict[str, dict[str, float]]:
    """The worst of the days' figures under each variant: p95 [m], coverage, wrong and ok."""
    found = {}
    for name, assumptions in [("as they are", Assumptions()), *variants()]:
        days = judged(assumptions, ("workday", "person"))
        others = [d for key, d in days.items() if not any(kind in key for kind in ("ground", "stuck"))]
        found[name] = {
            "p95_worst": max(d.p95 for d in others),
            "p95_median": float(np.median([d.p95 for d in others])),
            "coverage_least": min(d.coverage for d in days.values()),
            "wrong_and_ok_most": max(d.wrong_and_ok for d in days.values()),
        }
        advance(1)
    return found
