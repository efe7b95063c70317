"""How well a single unit of every circuit goes where it is sent, with a virtual sensor as the only feedback.

From a position that nobody knows: three visits to end stops, targets drawn at random, a load that changes at rest, a
minute at rest, and a torque that is lost in mid-move. All by the truth; the seed decides everything.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from circuits import CIRCUITS, catalogued

from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.plant.limits import limits_of
from ramsight.plant.unit import HydraulicUnit

UNITS = {**CIRCUITS, "bucket": ("mining-loader", "bucket")}
SEEDS, TARGETS = 3, 10
_INSIDE = (0.1, 0.9)  # shares of the stroke
_START, _LOAD, _MORE = 0.37, 0.4, 0.6  # share of the stroke; of the load at relief pressure
_STEP, _SETTLED, _RESTED = 0.5, 3.0, 60.0  # s


def homed(unit: HydraulicUnit, load: float, seed: int) -> UnitLoop:
    """A loop that has visited the lowered end, the lifted one and the lowered one again."""
    loop = UnitLoop(unit, unit, _START * unit.cylinder.stroke, load, LoopSettings(seed=seed))
    for lifted in (False, True, False):
        loop.home(unit.name, lifted=lifted)
    return loop


def driven(unit: HydraulicUnit, seed: int) -> dict[str, object]:
    """One run [m]: errors at targets, by truth and of the sensor, ways at rest, and what stopped it if anything did."""
    name, stroke, full = unit.name, float(unit.cylinder.stroke), limits_of(unit).load
    loop = homed(unit, _LOAD * full, seed)
    errors, sensed = [], []
    for share in np.random.default_rng([seed, 7]).uniform(*_INSIDE, TARGETS):
        if loop.stopped:
            break
        loop.go({name: float(share) * stroke})
        if not loop.stopped:
            errors.append(loop.now.position[name] - float(share) * stroke)
            sensed.append(loop.records[name].estimate[-1].position - loop.now.position[name])
    found: dict[str, object] = {"errors": errors, "sensed": sensed, "stopped": loop.reasons.get(name, "")}
    if not loop.stopped:
        found |= {"step": _gone(loop, name, lambda: loop.load(_MORE * full, _STEP), _SETTLED)}
        loop.load(_LOAD * full, _STEP)
        found |= {"minute": _gone(loop, name, lambda: None, _RESTED)}
        found["stopped"] = loop.reasons.get(name, "") if loop.stopped else ""
    return found


def _gone(loop: UnitLoop, name: str, what: Callable[[], object], then: float) -> float:
    """How far the rod is, a time after something has happened at rest, from where it was [m]."""
    before = loop.now.position[name]
    what()
    loop.rest(then)
    return abs(loop.now.position[name] - before)


def lost(unit: HydraulicUnit, seed: int = 0) -> dict[str, float]:
    """The torque is lost in mid-move: time until the motor stands [s], and the rod's way in it and in a second more."""
    name, stroke, load = unit.name, float(unit.cylinder.stroke), _LOAD * limits_of(unit).load
    loop = UnitLoop(unit, unit, 0.5 * stroke, load, LoopSettings(known=True, seed=seed))
    loop.rest(1.0)
    loop.send({name: (0.5 + 0.4 * unit.lift_sign) * stroke})
    loop.rest(0.9)
    loop.fault = lambda _, now: replace(now, motor_torque=math.nan)
    begins, place = loop.now.time, loop.now.position[name]
    while loop.now.motor_speed[name] != 0.0 or not loop.stopped:
        loop.step()
    standstill, stood = loop.now.time - begins, loop.now.position[name]
    loop.rest(1.0)
    sinks = abs(loop.now.position[name] - stood)
    return {"standstill": standstill, "went_on": abs(stood - place), "sinks_in_a_second": sinks}


def summed(unit: HydraulicUnit, runs: list[dict[str, object]]) -> dict[str, object]:
    """Of all runs of a unit: targets reached, errors [m], ways at rest [m], reasons of stops."""
    errors, sensed = (np.abs(np.concatenate([run[key] for run in runs])) for key in ("errors", "sensed"))
    result: dict[str, object] = {"stroke": float(unit.cylinder.stroke), "targets": len(errors)}
    for key, values in (("", errors), ("sensor_", sensed)):
        result |= {f"{key}p95": float(np.percentile(values, 95)) if len(values) else None}
        result |= {f"{key}largest": float(values.max()) if len(values) else None}
    for key in ("step", "minute"):
        result[key] = max((run[key] for run in runs if key in run), default=None)
    result["stopped"] = sorted({str(run["stopped"]) for run in runs if run["stopped"]})
    return result


def study(advance: Callable[[float], object] = lambda _: None, seeds: int = SEEDS) -> dict[str, object]:
    """All of it, by unit.

    Args:
        advance: called with 1 after each of `runs(seeds)` runs.
        seeds: runs of each unit.
    """
    found: dict[str, object] = {}
    for name, of in UNITS.items():
        unit, driven_so = catalogued(*of), []
        for seed in range(seeds):
            driven_so.append(driven(unit, seed))
            advance(1)
        found[name] = summed(unit, driven_so) | lost(unit)
        advance(1)
    return found


def runs(seeds: int = SEEDS) -> int:
    """How many runs `study` makes."""
    return len(UNITS) * (seeds + 1)


def table(found: dict[str, dict[str, Any]]) -> list[str]:
    """The figures as docs/reference/control-accuracy.md has them, lengths in mm."""
    rows = [
        "| unit | stroke | targets reached | rod, p95 | largest | sensor, p95 | load step | a minute at rest | stops |",
        "|---" * 9 + "|",
    ]
    for name, row in found.items():
        lengths = [_mm(row[key]) for key in ("p95", "largest", "sensor_p95", "step", "minute")]
        cells = [name, f"{1e3 * row['stroke']:.0f}", f"{row['targets']}", *lengths, "; ".join(row["stopped"]) or "none"]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def fault_table(found: dict[str, dict[str, Any]]) -> list[str]:
    """The same of a torque that is lost in mid-move."""
    rows = ["| unit | standstill after [s] | rod went on [mm] | and sank in a second [mm] |", "|---" * 4 + "|"]
    for name, row in found.items():
        rows.append(f"| {name} | {row['standstill']:.2f} | {_mm(row['went_on'])} | {_mm(row['sinks_in_a_second'])} |")
    return rows


def _mm(value: float | None) -> str:
    return "–" if value is None else f"{1e3 * value:.2f}"
