"""Faults that the sensor names: whether the hypotheses that are left hold the true one, with counter and DC power.

Faults of speed, torque and counter are put into work days of machines drawn at random. Of each that is noticed
the name is *right* if the true kind alone is left, *among* if others are left as well (a motor that keeps its speed
does not tell a gain from an offset), and *wrong* if it is none of those that are left. Gain and offset are those said
where their kind is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import faults
import numpy as np
import work_days

from ramsight.duty.faults import Fault
from ramsight.tracking.named_faults import NamedFault, named_faults

SIGNALS = "+ counter and DC power"
CHANNELS = ("motor_speed", "shaft_angle", "motor_torque")
KINDS = ("gain", "offset", "sign", "stuck")
_EARLIEST, _LATEST = 100.0, 300.0  # s


def study(machines: int, advance: Callable[[int], object]) -> list[dict[str, Any]]:
    """A row a fault.

    Args:
        machines: of boom and bucket together.
        advance: told of each that is done.
    """
    found: dict[tuple[str, str], list[tuple[Fault, NamedFault | None]]] = {}
    for sensor, day, seed in work_days.days(machines, faults.SIGNALS[SIGNALS], advance):
        at = float(np.random.default_rng(seed).choice(faults.turning(day.log, _EARLIEST, _LATEST)))
        for channel, words, fault in faults.faults(at, day.log):
            if channel in CHANNELS and fault.kind in KINDS:
                log, _ = faults.with_rows(day, fault, seed)
                sensor.start(day.start)
                names = [one for one in named_faults(sensor.track(log)) if fault.start <= one.first <= fault.end]
                found.setdefault((channel, words), []).append((fault, names[0] if names else None))
    return [_row(*key, results) for key, results in found.items()]


def _row(channel: str, words: str, results: list[tuple[Fault, NamedFault | None]]) -> dict[str, Any]:
    named = [(fault, name) for fault, name in results if name is not None]
    holds = [(fault, name) for fault, name in named if fault.kind in name.kinds]
    values = [abs(getattr(name, fault.kind) - fault.size) for fault, name in holds if fault.kind in ("gain", "offset")]
    return {
        "input": channel,
        "fault": words,
        "faults": len(results),
        "noticed": len(named),
        "right": sum(len(name.kinds) == 1 for _, name in holds),
        "among": sum(len(name.kinds) > 1 for _, name in holds),
        "off": float(np.median(values)) if values and channel in ("motor_speed", "motor_torque") else None,
    }


def table(found: list[dict[str, Any]]) -> list[str]:
    """The table of docs/reference/fault-detection.md."""
    rows = [
        "| input | fault | noticed | named | among those left | named wrongly | value off by, median |",
        "|---" * 7 + "|",
    ]
    for row in found:
        wrong = row["noticed"] - row["right"] - row["among"]
        unit = "" if row["fault"].startswith("gain") else " rad/s" if row["input"] == "motor_speed" else " N m"
        off = "" if row["off"] is None else f"{row['off']:.2g}{unit}"
        said = f"{row['noticed']} of {row['faults']} | {row['right']} | {row['among']} | {wrong} | {off}"
        name = {"shaft_angle": "counter"}.get(row["input"], row["input"].replace("_", " "))
        rows.append(f"| {name} | {row['fault']} | {said} |")
    return rows
