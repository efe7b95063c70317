"""The self-calibrating sensor on recorded logs whose start is entered, unknown or wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
from judged_errors import judge
from recorded import TRACES

from ramsight import machine
from ramsight.logs import read_log, read_truth
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman

FOLDER = TRACES / "unknown"
STARTS: dict[str, float | None] = {"unknown": None, "exact": 0.0, "40 mm too far out": 0.04, "40 mm too far in": -0.04}
"""The position that is entered for the first sample: none, or the true one and so much [m]."""


def names() -> list[str]:
    """The logs; the first word of each is the loader's unit that it is of."""
    return sorted(file.name.removesuffix("_truth.csv.gz") for file in FOLDER.glob("*_truth.csv.gz"))


def study(advance: Callable[[int], object]) -> dict[str, dict[str, dict[str, Any]]]:
    """The figures of each log and start."""
    loader = machine.load_machine("mining-loader")
    units = {name: build(loader.unit(name), name) for name in ("boom", "bucket")}
    sensors = {name: kalman(unit) for name, unit in units.items()}
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for name in names():
        unit = name.partition("_")[0]
        log, truth = read_log(FOLDER / f"{name}.csv.gz"), read_truth(FOLDER / f"{name}_truth.csv.gz")
        position = np.interp(log["time"], truth["time"], truth["position"])
        stroke = float(units[unit].cylinder.stroke)
        found[name] = {}
        for start, off in STARTS.items():
            entered = None if off is None else float(np.clip(position[0] + off, 0.0, stroke))
            sensors[unit].start(entered)
            track = sensors[unit].track(log)
            found[name][start] = asdict(judge(track, log["motor_speed"].values, position, stroke))
        advance(1)
    return found
