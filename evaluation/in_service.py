"""How the sensor does on the loader in service, described as it is and as the bench is.

Each day is of another machine: its values are drawn from the spreads that `mining-loader-in-service` declares. Once the
sensor is made of that description, once of `mining-loader`, which has the bench's values; as a measure, the bench's
machine with the bench's sensor works the same day. The seed decides everything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from circuits import catalogued
from judged_errors import Judged, judge
from real_machine import figures

from ramsight import machine
from ramsight.duty import DriveReport, report, simulate
from ramsight.duty.work_day import work_day
from ramsight.plant.build import build
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.kalman import kalman

BENCH, SERVICE = "mining-loader", "mining-loader-in-service"
LOADS = {"boom": (100e3, 370e3), "bucket": (20e3, 140e3)}  # N
DAYS = 6
KINDS = {
    "bench": ("bench's machine", "bench's"),
    "described": ("in service", "in service"),
    "not described": ("in service", "bench's"),
}
"""By the key in results/study.json: the machine, and the sensor's description."""
_DAY, _VISITS = 1200.0, 120.0  # s
_OIL = 313.15  # K


def runs(days: int) -> int:
    """How many tracks there are."""
    return days * len(LOADS) * len(KINDS)


def drawn(unit: str, seed: int) -> HydraulicUnit:
    """A machine of those in service: each value that has a spread drawn from it."""
    service = machine.load_machine(SERVICE)
    begins, random = f"units.{unit}.", np.random.default_rng(seed)
    spreads = {p.removeprefix(begins): s for p, s in service.tolerances.items() if p.startswith(begins)}
    values = {path: float(random.uniform(*spread.ends)) for path, spread in sorted(spreads.items())}
    return build(service.unit(unit).replace(values), unit)


def day(unit: str, kind: str, seed: int, *, duration: float = _DAY) -> Judged:
    """A day of a machine, judged after three stops.

    Args:
        unit: boom or bucket.
        kind: of `KINDS`.
        seed: of the machine, its work and its drive's noise.
        duration: [s].
    """
    real = catalogued(BENCH, unit) if kind == "bench" else drawn(unit, seed)
    duty = work_day(real, LOADS[unit], _OIL, duration=duration, visit_every=_VISITS, seed=seed)
    run = simulate(real, duty)
    sensor = kalman(catalogued(SERVICE if kind == "described" else BENCH, unit))
    sensor.start(duty.start_position)
    track = sensor.track(report(run, DriveReport(seed=seed)))
    return judge(track, run["motor_speed"].values, run["position"].values, float(real.cylinder.stroke))


def study(days: int, advance: Callable[[int], object]) -> dict[str, dict[str, Any]]:
    """Figures of each unit and kind, over so many days."""
    found: dict[str, dict[str, Any]] = {}
    for unit in LOADS:
        found[unit] = {}
        for kind in KINDS:
            judged = []
            for seed in range(days):
                judged.append(day(unit, kind, seed))
                advance(1)
            found[unit][kind] = figures(judged)
    return found


def table(found: dict[str, dict[str, Any]]) -> list[str]:
    """The table of docs/reference/real-machines.md."""
    head = "| unit | machine | sensor's description | 95 % within: median, worst day | largest | band | ok beyond 4 σ |"
    rows = [head, "|---|---|---|---|---|---|---|"]
    for unit, kinds in found.items():
        for kind, row in kinds.items():
            within = f"{row['p95_mm']:.1f}, {row['p95_worst_mm']:.1f} mm | {row['largest_mm']:.1f} mm"
            held = f"{100 * row['band']:.0f} % | {100 * row['wrong_and_ok']:.2f} %"
            rows.append(f"| {unit} | {' | '.join(KINDS[kind])} | {within} | {held} |")
    return rows
