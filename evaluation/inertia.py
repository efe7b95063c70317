"""What the inertia of the shaft shows of a wrong sign: false alarms on undisturbed days, and how soon a sign is found.

    python evaluation/inertia.py --out results/inertia.json [--days 220]

Machines are drawn as in work_days.py. The sum of the detector (`ramsight.sensor.checks.inertia_check`) is kept of each
day. The largest ones of days without a fault fall off like exp(-sum/scale). That tail says how often the alarm is
reached.
A gain is looked for with the same signals, for what it could show at best: the slope of steps of the torque over those
that the inertia asks for, stretch by stretch of an hour.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import work_days

from ramsight.output import write_text
from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import ALARM_EVIDENCE

DECLARED = 0.3  # of the inertia
TAIL = 0.1  # share of the days whose sums make the tail
FAULTS = {"torque": "motor_torque", "speed": "motor_speed"}
_FROM = 1.0 / 3.0  # of a day, from where on a sign is wrong
_WINDOW, _TURNS = 5, 15.0  # samples of 20 ms; rad/s
_HOUR = 10  # days that make an hour


def slope(unit: Any, log: Any) -> tuple[float, float]:
    """Sums of products of steps of the torque with those that the inertia asks for, and of squares of the latter."""
    time, speed, torque = (log[name].values for name in ("time", "motor_speed", "motor_torque"))
    n = _WINDOW
    mean = np.convolve(torque, np.ones(n) / n, "valid")
    asked = unit.drive.inertia * (speed[n:] - speed[:-n]) / (time[n:] - time[:-n])
    y, x = mean[n:-1] - mean[: -n - 1], asked[n:] - asked[:-n]
    fast = np.array([np.abs(speed[k : len(speed) - 2 * n + k]) > _TURNS for k in range(2 * n)]).all(axis=0)
    ways = np.array([np.sign(speed[k : len(speed) - 2 * n + k]) for k in range(2 * n)])
    noise = unit.assumptions.drive.torque * limits_of(unit).torque
    good = fast & (np.abs(ways.sum(axis=0)) == 2 * n) & (np.abs(x) > noise) & (np.abs(y) < 2.0 * np.abs(x) + noise)
    return float(x[good] @ y[good]), float(x[good] @ x[good])


def measure(days: int) -> dict[str, Any]:
    """Sums of undisturbed days, times until a sign is found, and slopes, over a number of days of each unit."""
    sums, hours, alarms = [], 0.0, 0
    after: dict[str, list[float]] = {name: [] for name in FAULTS}
    slopes: list[float] = []
    for plain in work_days.data_sheets().values():
        sensor = kalman(plain, plain.assumptions.replace({"inertia.std": DECLARED}))
        parts = []
        for seed in range(days):
            day = work_days.drawn(plain, seed)
            time = day.log["time"].values
            sensor.start(day.start)
            track = sensor.track(day.log)
            sums.append(ALARM_EVIDENCE * float(track["sign_reversed"].max()))
            alarms += int((track["status"] == Status.SIGN_CONTRADICTED).any())
            hours += float(time[-1] - time[0]) / 3600.0
            parts.append(slope(plain, day.log))
            begin = len(time) * _FROM
            for name, variable in FAULTS.items():
                wrong = day.log.copy(deep=True)
                wrong[variable].values[int(begin) :] *= -1.0
                sensor.start(day.start)
                told = sensor.track(wrong)["status"].values[int(begin) :] == Status.SIGN_CONTRADICTED
                after[name].append(
                    float(time[int(begin) + np.argmax(told)] - time[int(begin)]) if told.any() else math.inf
                )
        hourly = np.array(parts)[: days // _HOUR * _HOUR].reshape(-1, _HOUR, 2).sum(axis=1)
        slopes += (hourly[:, 0] / hourly[:, 1]).tolist()
    return {"hours": hours, "alarms": alarms, **tail(np.array(sums), hours), "after": waits(after),
            "slope_mean": float(np.mean(slopes)), "slope_std": float(np.std(slopes))}  # fmt: skip


def tail(sums: np.ndarray, hours: float) -> dict[str, float]:
    """Largest sum, the tail's scale, and how often in 1000 h the alarm is reached by it."""
    ordered = np.sort(sums)[::-1]
    count = max(int(TAIL * len(ordered)), 2)
    begins = float(ordered[count])
    scale = float(np.mean(ordered[:count] - begins))
    expected = count * math.exp(-(ALARM_EVIDENCE - begins) / scale) * 1000.0 / hours
    return {"largest": float(ordered[0]), "scale": scale, "in_1000_h": expected}


def waits(after: dict[str, list[float]]) -> dict[str, dict[str, float]]:
    """How many wrong signs are found within the day, and after how long."""
    found = {name: np.array(times) for name, times in after.items()}
    return {
        name: {
            "found": float(np.isfinite(times).mean()),
            "median": float(np.median(times)),
            "upper": float(np.quantile(times[np.isfinite(times)], 0.95)),
        }
        for name, times in found.items()
    }


def table(found: dict[str, Any]) -> list[str]:
    """For the page."""
    rows = ["| sign reversed | found within 4 min | after: median, 95 % of those found |", "|---|---|---|"]
    for name, row in found["after"].items():
        rows.append(f"| {name} | {100.0 * row['found']:.0f} % | {row['median']:.0f} s, {row['upper']:.0f} s |")
    return rows


def gains(found: dict[str, Any]) -> str:
    """Of the slope, for the page."""
    return f"the slope of an hour is {found['slope_mean']:.2f} ± {found['slope_std']:.2f}"


def sentence(found: dict[str, Any]) -> str:
    """Of false alarms, for the page."""
    return (
        f"{found['alarms']} false alarms in {found['hours']:.0f} h; the largest sum was {found['largest']:.0f}, and "
        f"the tail says {found['in_1000_h']:.2g} in 1000 h"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--days", type=int, default=220)
    asked = parser.parse_args()
    result = measure(asked.days)
    write_text(json.dumps(result, indent=1) + "\n", asked.out)
    print("\n".join([*table(result), sentence(result)]))
