"""What a smaller profile of an exported sensor costs: the recorded days, and days of machines whose pumps are worn.

Days of drawn machines are those of `work_days`, once as drawn and once with the leakage twice as large. The figures are
those after the third visit to an end stop.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import recorded
import work_days
from judged_errors import Judged, judge

from ramsight.deploy.profiles import Profile
from ramsight.duty import report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.work_day import work_day
from ramsight.plant.as_built import AsBuilt
from ramsight.sensor.virtual_sensor import BOUND

PROFILES = (
    ("kalman", Profile.KALMAN, False),
    ("kalman, sure ends", Profile.KALMAN, True),
    ("kalman-small, sure ends", Profile.KALMAN_SMALL, True),
    ("balance, a switch at half the stroke", Profile.BALANCE, False),
)
"""Name in the table, profile, and whether the machine's ends are declared as sure."""
LEAKS = {"as drawn": 1.0, "leakage twice as large": 2.0}
_SURE = 1e-6
_GROUND = "ground"  # in the names of logs whose first contact is with the ground


def study(machines: int, advance: Callable[[int], object]) -> dict[str, Any]:
    """By profile and set of days: how many, p95, how much is ok, and how much is wrong and ok."""
    found: dict[str, Any] = {}
    for name, profile, sure in PROFILES:
        units = {}
        for key, plain in work_days.data_sheets().items():
            assumed = plain.assumptions.replace({"stops.undeclared": _SURE}) if sure else plain.assumptions
            units[key] = replace(plain, assumptions=assumed)
        sensors = {key: profile.sensor(unit) for key, unit in units.items()}
        sets: dict[str, list[Judged]] = {"recorded": [], "recorded, ground": []}
        for log, (unit, drive, position, start) in recorded.logs().items():
            if "day" in log or "person" in log:
                of = _judged(sensors[unit], units[unit], drive, position, start)
                sets["recorded, ground" if _GROUND in log else "recorded"].append(of)
        for words, leak in LEAKS.items():
            sets[words] = [_day(sensors[key], units[key], seed, leak) for key in units for seed in range(machines)]
        found[name] = {words: _figures(days) for words, days in sets.items()}
        advance(1)
    return found


def _day(sensor: Any, unit: Any, seed: int, leak: float) -> Judged:
    """A day of a machine drawn by its seed, with so much more leakage."""
    random = np.random.default_rng([seed, len(unit.name)])
    built = AsBuilt(
        leak=leak * random.uniform(0.75, 1.25),
        displacement=random.uniform(0.995, 1.005),
        stiffness=random.uniform(0.6, 1.4),
        friction=random.uniform(0.6, 1.4),
    )
    duty = work_day(unit, work_days.LOADS[unit.name], random.uniform(298.15, 328.15), duration=360.0, seed=seed)
    run = simulate(built.apply(unit), duty)
    log = report(run, declared_report(unit, seed))
    return _judged(sensor, unit, log, run["position"].values, duty.start_position)


def _judged(sensor: Any, unit: Any, log: Any, position: Any, start: float) -> Judged:
    """A track of a log, judged; a sensor without a bound has a switch."""
    if BOUND not in sensor.recursion.outputs:
        at = 0.5 * unit.cylinder.stroke
        passes = np.append(np.diff(np.sign(position - at)) != 0.0, False)
        passes = np.roll(passes, 1)
        log = log.assign(reference=("time", np.where(passes, position, np.nan)))
    sensor.start(start)
    track = sensor.track(log)
    if BOUND not in track:
        track = track.assign({BOUND: ("time", np.full(len(position), np.inf))})
    return judge(track, log["motor_speed"].values, position, unit.cylinder.stroke)


def _figures(days: list[Judged]) -> dict[str, float]:
    p95 = [one.p95 for one in days if np.isfinite(one.p95)]
    return {
        "days": len(days),
        "judged": len(p95),
        "p95_median_mm": 1e3 * float(np.median(p95)) if p95 else float("nan"),
        "p95_worst_mm": 1e3 * max(p95) if p95 else float("nan"),
        "ok": float(np.mean([one.ok for one in days])),
        "wrong_and_ok_most": max(one.wrong_and_ok for one in days),
    }


def table(found: dict[str, Any]) -> list[str]:
    """In Markdown: p95 of the median and of the worst day, and the most of a day that is wrong and ok."""
    sets = list(next(iter(found.values())))
    rows = [f"| profile | {' | '.join(sets)} |", "|---" * (len(sets) + 1) + "|"]
    for name, of in found.items():
        cells = []
        for one in of.values():
            errors = f"{one['p95_median_mm']:.2f}, {one['p95_worst_mm']:.1f} mm; " if one["judged"] else ""
            cells.append(f"{errors}{100 * one['wrong_and_ok_most']:.2f} %")
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return rows


if __name__ == "__main__":
    print("\n".join(table(found := study(10, lambda _: None))))
    print(json.dumps(found, indent=1))
