"""An uploaded log, looked through and tracked in a process of its own; every answer is plain and names no folder."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.api.machines import build
from ramsight.api.tracking import errors_of, follow, start_of
from ramsight.errors import LogWarning, RamsightError
from ramsight.logs import read_truth
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text
from ramsight.machine.description import Machine
from ramsight.normal import TWO_SIDED_95
from ramsight.study.tracking import error_text

_POINTS = 4000  # of a picture


def propose(file: str) -> dict[str, Any]:
    """What is in a log and what its channels are proposed for: `channels`, `map`; or `error`."""

    def look() -> dict[str, Any]:
        found = inspect_log(file)
        channels = [
            {
                "name": one.name,
                "unit": one.unit,
                "samples": one.samples,
                "least": _plain(one.least),
                "most": _plain(one.most),
                "role": one.role,
            }
            for one in found.channels
        ]
        return {"channels": channels, "map": map_text(found)}

    return _answered(look, Path(file).parent)


def track(
    machine: Machine, unit: str, file: str, truth: str | None, start: str, sensor: str, map_toml: str
) -> dict[str, Any]:
    """Track a log as `ramsight track` does: `summary`, what it prints, and `columns` for a picture; or `error`.

    Args:
        machine: the machine.
        unit: that the drive turned.
        file: the log.
        truth: file of the true position; None if there is none.
        start: where the piston is at first, in words; "" if nobody knows.
        sensor: kalman or balance.
        map_toml: the channel map; "" for a table with the usual columns.
    """

    def work() -> dict[str, Any]:
        built = build(machine, unit)
        position, std = start_of(built, start or None, "1 mm")
        known = None if truth is None else read_truth(truth)
        channel_map = None
        if map_toml:
            channel_map = Path(file).with_name("channels.toml")
            channel_map.write_text(map_toml, encoding="utf-8")
        done = follow(built, file, channel_map, sensor=sensor, start=position, start_std=std, keep_track=True)
        if done.track is None:
            return {"error": "the log has no samples"}
        lines = [done.summary]
        if known is not None:
            lines.append(error_text(errors_of(done.track, known), done.track.sizes["time"]))
        return {"summary": "\n".join(lines), "columns": _columns(done.track, known)}

    return _answered(work, Path(file).parent)


def _columns(found: Any, known: Any) -> dict[str, list[float | None]]:
    """A track in mm, thinned to what a picture can show."""
    time = found["time"].values
    every = max(len(time) // _POINTS, 1)
    position, std = 1e3 * found["position"].values[::every], 1e3 * found["position_std"].values[::every]
    columns = {
        "time": time[::every],
        "position": position,
        "high": position + TWO_SIDED_95 * std,
        "low": position - TWO_SIDED_95 * std,
    }
    if known is not None:
        at = known["time"].values
        columns["true"] = 1e3 * np.interp(time[::every], at, known["position"].values, left=np.nan, right=np.nan)
    return {name: [_plain(value) for value in values] for name, values in columns.items()}


def _plain(value: float) -> float | None:
    return round(float(value), 4) if np.isfinite(value) else None


def _answered(work: Any, folder: Path) -> dict[str, Any]:
    """What some work gives, with its warnings, or its error in words that name no folder."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", LogWarning)
        try:
            answer: dict[str, Any] = work()
        except RamsightError as error:
            answer = {"error": str(error)}
    answer["warnings"] = [str(one.message) for one in said if issubclass(one.category, LogWarning)]
    hidden = f"{folder}/"
    for key in ("error", "summary", "map"):
        if key in answer:
            answer[key] = answer[key].replace(hidden, "")
    answer["warnings"] = [text.replace(hidden, "") for text in answer["warnings"]]
    return answer
