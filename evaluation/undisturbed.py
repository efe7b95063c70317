"""False alarms of what a drive's report is held against: many hours of work days of machines without a fault.

Machines are drawn at random, a third of them with oil that warms by 4 K a minute under a thermometer that is 90 s late,
and a third with a coarse drive (steps of 1 % of the torque at relief pressure, and of 2 rpm).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import work_days
from faults import SIGNALS, alarms, tracks_of

from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman

KINDS = ("as drawn", "warming", "coarse drive")
_BESIDE = 32  # days that are tracked side by side
_RATE, _LAG = 4.0 / 60.0, 90.0  # K/s; s
_TORQUE, _SPEED = 0.01, 2.0 * math.pi / 30.0  # share of the torque at relief pressure; rad/s
_EVENTS_95 = 3.0  # with 95 % confidence there are no more where none was seen, by Poisson's law


def _all_signals() -> dict[str, float]:
    return {key: value for keys in SIGNALS.values() for key, value in keys.items() if key.endswith(".std")}


def _day(unit: Any, seed: int) -> work_days.Day:
    """A day of a machine of a kind, by its number."""
    day = work_days.drawn(unit, seed)
    kind, log = KINDS[seed % len(KINDS)], day.log
    if kind == "warming":
        time = log["time"].values
        log["oil_temperature"] -= _RATE * _LAG * (1.0 - np.exp(-time / _LAG))
    elif kind == "coarse drive":
        step = _TORQUE * limits_of(unit).torque
        log["motor_torque"].values[:] = step * np.round(log["motor_torque"].values / step)
        log["motor_speed"].values[:] = _SPEED * np.round(log["motor_speed"].values / _SPEED)
    return day


def study(days: int, advance: Callable[[int], object]) -> dict[str, dict[str, Any]]:
    """Contradictions without a fault and hours, by what the sensor is given and by the kind of day.

    Args:
        days: of each unit.
        advance: called with the number of days done since the last call.
    """
    held = [name for name, keys in SIGNALS.items() if any(key.endswith(".std") for key in keys)]
    found = {name: {kind: {"alarms": 0, "hours": 0.0} for kind in KINDS} for name in held}
    for plain in work_days.data_sheets().values():
        unit = replace(plain, assumptions=plain.assumptions.replace(_all_signals()))
        sensors = {name: kalman(replace(plain, assumptions=plain.assumptions.replace(SIGNALS[name]))) for name in held}
        for numbers in _groups(days):
            several = [_day(unit, number) for number in numbers]
            for name, sensor in sensors.items():
                for number, day, track in zip(
                    numbers, several, tracks_of(sensor, several, [day.log for day in several]), strict=True
                ):
                    row, time = found[name][KINDS[number % len(KINDS)]], day.log["time"].values
                    row["alarms"] += alarms(track)
                    row["hours"] += float(time[-1] - time[0]) / 3600.0
            advance(len(numbers))
    return found


def _groups(days: int) -> Iterator[range]:
    for first in range(0, days, _BESIDE):
        yield range(first, min(first + _BESIDE, days))


def table(found: dict[str, dict[str, Any]]) -> list[str]:
    """For the page: a set of signals a row."""
    rows = [f"| given | {' | '.join(KINDS)} | together, in 100 h |", "|---" * (len(KINDS) + 2) + "|"]
    for name, of in found.items():
        cells = [f"{of[kind]['alarms']} in {of[kind]['hours']:.0f} h" for kind in KINDS]
        seen, hours = (sum(of[kind][key] for kind in KINDS) for key in ("alarms", "hours"))
        most = f"{100.0 * seen / hours:.1f}" if seen else f"0 (at most {100.0 * _EVENTS_95 / hours:.1f})"
        rows.append(f"| {name} | {' | '.join(cells)} | {most} |")
    return rows
