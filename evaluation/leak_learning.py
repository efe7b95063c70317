"""How well the leakage is known by ordinary work alone: before any reference, by stops and starts of the motor.

Machines leak, slip and give otherwise than described, by as much as the sensor assumes. They lift and lower loads from
a known start; what is learned until the piston first meets an end counts. The seed decides everything.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from identify_coverage import deviating, unit_of

from ramsight.duty import report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.lift_lower import lift_lower
from ramsight.plant.limits import limits_of
from ramsight.sensor.contacts.mode import HELD
from ramsight.sensor.kalman import kalman

MACHINES = ("boom", "bucket", "forklift")
DRIVES = {"not declared": {}, "5 %": {"drive.release": 0.05}}
COUNT = 20
_SEED = 77
_AFTER = 60.0  # s
_LOADS = (0.15, 0.6)  # share of the load at relief pressure
_WARM = 313.15  # K


def runs() -> int:
    """How many machines there are."""
    return COUNT * len(MACHINES)


def drawn(seed: int) -> dict[str, float]:
    """How a machine differs from its description: by what the sensor assumes."""
    random = np.random.default_rng([_SEED, seed])
    return {
        "leak": float(np.clip(random.normal(1.0, 0.16), 0.6, 1.6)),
        "displacement": float(random.normal(1.0, 0.006)),
        "stiffness": float(random.uniform(0.8, 1.1)),
        "friction": float(random.uniform(0.8, 1.2)),
        "orifice": 0.0,
        "efficiency": 0.0,
        "no_load": 1.0,
    }


def study(advance: Callable[[int], object]) -> dict[str, dict[str, dict[str, float]]]:
    """By unit and what is declared of the drive: RMS of the leak factor's error, of what is stated, of their ratio."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for name in MACHINES:
        sheet = unit_of(name)
        sensors = {how: kalman(sheet, sheet.assumptions.replace(declared)) for how, declared in DRIVES.items()}
        rows: dict[str, list[tuple[float, float]]] = {how: [] for how in DRIVES}
        for seed in range(COUNT):
            true = drawn(seed)
            loads = np.random.default_rng([_SEED, seed, 1]).uniform(*_LOADS, 4) * limits_of(sheet).load
            duty = lift_lower(sheet, loads.tolist(), _WARM, cycles=4)
            log = report(simulate(deviating(sheet, true), duty), declared_report(sheet, seed))
            for how, sensor in sensors.items():
                sensor.start(duty.start_position)
                track = sensor.track(log)
                held = np.isin(track["mode"].values, HELD)
                first = int(np.argmax(held)) if held.any() else len(held)
                k = min(int(np.searchsorted(track["time"].values, _AFTER)), first) - 1
                rows[how].append((float(track["leak_factor"][k]) - true["leak"], float(track["leak_factor_std"][k])))
            advance(1)
        found[name] = {how: _figures(np.array(of)) for how, of in rows.items()}
    return found


def _figures(rows: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> dict[str, float]:
    error, std = rows.T
    values = {"error": error, "stated": std, "z": error / std}
    return {"machines": len(rows), **{key: float(np.sqrt(np.mean(one**2))) for key, one in values.items()}}


def table(found: dict[str, dict[str, dict[str, float]]]) -> list[str]:
    """Table of docs/explanation/estimation.md."""
    rows = [
        "| unit | `drive.release` | leak factor after 60 s: RMS error | stated | error over that, RMS |",
        "|---|---|---|---|---|",
    ]
    for name, kinds in found.items():
        for how, f in kinds.items():
            said = "30 % (not declared)" if how == "not declared" else how
            rows.append(f"| {name} | {said} | {100 * f['error']:.1f} % | {100 * f['stated']:.1f} % | {f['z']:.2f} |")
    return rows
