"""A real position sensor that fails, beside the virtual one: how often that is found, how soon, and who is blamed.

Each fault is put into what the real sensor says (the truth with 0.1 mm of noise, tolerance 1 mm) on work days of
machines drawn at random, whose drives have a counter and DC power. Counted from the fault on until the day's end.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import faults
import numpy as np
import work_days
from numpy.typing import NDArray
from scipy.stats import beta

from ramsight.arrays import true_intervals
from ramsight.plant.limits import limits_of
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.tracking.comparing import ALERTS, Comparison, Verdict, verdicts

Array = NDArray[np.float64]

NOISE, TOLERANCE, ALERT = 0.1e-3, 1e-3, 0.2
FAULTS: dict[str, Callable[[Array, Array, np.random.Generator], Array]] = {
    "stuck": lambda time, true, random: np.full_like(true, true[0]),
    "no signal": lambda time, true, random: np.full_like(true, np.nan),
    "offset 100 mm": lambda time, true, random: true + 0.1,
    "offset 20 mm": lambda time, true, random: true + 0.02,
    "offset 5 mm": lambda time, true, random: true + 0.005,
    "drift 10 mm/min": lambda time, true, random: true + 0.01 * (time - time[0]) / 60.0,
    "gain 1.1": lambda time, true, random: 1.1 * true,
    "noise 10 mm": lambda time, true, random: true + 0.01 * random.standard_normal(len(true)),
}


def study(machines: int, advance: Callable[[int], object], times: int = 4) -> dict[str, Any]:
    """By fault: injected, found, its share's 95 % interval, after how long, and who was blamed; false alerts."""
    found: dict[str, list[tuple[bool, float, int]]] = {name: [] for name in FAULTS}
    false, hours, agree = 0, 0.0, []
    for sensor, day, seed in work_days.days(machines, faults.SIGNALS["+ counter and DC power"], advance):
        fastest = float(day.unit.travel_per_radian) * limits_of(day.unit).max_speed
        sensor.start(day.start)
        track = sensor.track(day.log)
        random = np.random.default_rng(seed)
        time = day.log["time"].values
        real = day.position + NOISE * random.standard_normal(len(time))

        def said(
            other: Array, track: Any = track, time: Array = time, unit: Any = day.unit, fast: float = fastest
        ) -> Any:
            pair = Comparison(float(unit.cylinder.stroke), fast, TOLERANCE, ALERT)
            status = track["status"].values.astype(np.int64)
            return verdicts(pair, time, track["position"].values, track[BOUND].values, status, other)

        clean = said(real)
        false += len(true_intervals(np.isin(clean, ALERTS)))
        hours += float(time[-1] - time[0]) / 3600.0
        agree.append(float((clean == Verdict.AGREE).mean()))
        for at in random.integers(len(time) // 3, 2 * len(time) // 3, times):
            for name, fault in FAULTS.items():
                other = real.copy()
                other[at:] = fault(time[at:], real[at:], random)
                after = said(other)[at:]
                alert = np.isin(after, ALERTS)
                first = int(np.argmax(alert))
                blamed = int(after[first]) if alert.any() else -1
                found[name].append((bool(alert.any()), float(time[at + first] - time[at]), blamed))
    return {
        "faults": {name: _figures(rows) for name, rows in found.items()},
        "false_alerts": false,
        "hours": hours,
        "compared": float(np.mean(agree)),
    }


def _figures(rows: list[tuple[bool, float, int]]) -> dict[str, float]:
    hit, total = sum(one[0] for one in rows), len(rows)
    delays = [one[1] for one in rows if one[0]]
    return {
        "injected": total,
        "found": hit / total,
        "found_at_least": float(beta.ppf(0.025, hit, total - hit + 1)) if hit else 0.0,
        "median_s": float(np.median(delays)) if delays else float("nan"),
        "p95_s": float(np.percentile(delays, 95.0)) if delays else float("nan"),
        "other_blamed": sum(one[2] == Verdict.OTHER_WRONG for one in rows) / total,
        "virtual_blamed": sum(one[2] == Verdict.VIRTUAL_WRONG for one in rows) / total,
    }


def table(found: dict[str, Any]) -> list[str]:
    """In Markdown."""
    rows = [
        "| fault of the real sensor | found | at least (95 %) | after: median, 95 % | it is blamed | nothing tells |",
        "|---|---|---|---|---|---|",
    ]
    for name, one in found["faults"].items():
        unsure = one["found"] - one["other_blamed"] - one["virtual_blamed"]
        shares = [f"{100 * one[key]:.0f} %" for key in ("found", "found_at_least")]
        when = f"{one['median_s']:.1f} s, {one['p95_s']:.1f} s"
        rows.append(
            f"| {name} | {' | '.join(shares)} | {when} | {100 * one['other_blamed']:.0f} % | {100 * unsure:.0f} % |"
        )
    return rows
