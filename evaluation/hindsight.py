"""Logs looked back at: recorded ones, with different starts, and days of machines drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from judged_errors import wrong_and_ok
from numpy.typing import NDArray
from recorded import TRACES
from work_days import data_sheets, drawn

from ramsight import machine
from ramsight.hindsight.looking_back import looked_back
from ramsight.hindsight.trace import Tracer
from ramsight.logs import read_log, read_truth
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.build import build
from ramsight.sensor.status import Status
from ramsight.signals import Signals

Array = NDArray[np.float64]
FOLDERS = ("unknown", "person")
STARTS: dict[str, float | None] = {
    "unknown": None, "exact": 0.0, "15 mm too far out": 0.015, "15 mm too far in": -0.015,
    "40 mm too far out": 0.04, "40 mm too far in": -0.04,
}  # fmt: skip
"""The position that is entered for the first sample: none, or the true one and so much [m]."""
AT_END = 1e-6
"""A piston is on an end within so much [m]."""
DAYS = 100
"""Of each unit, drawn at random, with an unknown start."""


@dataclass(frozen=True)
class Judged:
    """A position with its deviation, bound and status."""

    error: Array  # magnitude [m]
    std: Array  # standard deviation [m]
    bound: Array  # [m]
    status: Array  # numbers of `Status`

    @classmethod
    def of(cls, track: Signals, true: Array, before: str = "") -> Judged:
        """What stands in a track, under names with something before them."""
        position, std, bound, status = (
            track[f"{before}{name}"].values for name in ("position", "position_std", "position_bound", "status")
        )
        return cls(np.abs(position - true), std, bound, status)

    def figures(self, where: NDArray[np.bool_]) -> dict[str, float]:
        """Of the samples there, which have a position; of all samples the share that is ok, and wrong and ok."""
        error, std = self.error[where], self.std[where]
        outside = np.maximum(error - TWO_SIDED_95 * std, 0.0)
        return {
            "known": float(np.isfinite(self.error).mean()),
            "rms": float(np.sqrt(np.mean(error**2))),
            "p95": float(np.percentile(error, 95.0)),
            "band": float(np.mean(outside == 0.0)),
            "score": float(np.mean(2.0 * TWO_SIDED_95 * std + 40.0 * outside)),  # Gneiting and Raftery, 2007, eq. 43
            "z2": float(np.mean((error / std) ** 2)),
            "ok": float((self.status == Status.OK).mean()),
            "wrong": float(wrong_and_ok(self.error, self.std, self.status).mean()),
            "beyond": float(np.mean(self.error[where] > self.bound[where])),
        }


def judged(tracer: Tracer, log: Signals, true: Array, start: float | None) -> dict[str, Any]:
    """The figures of a log: of the live sensor, in hindsight where that has a position, and in hindsight."""
    tracer.sensor.start(start)
    back = looked_back(tracer, [log], tracer.sensor.state, names=())
    live, all_of_it = Judged.of(back.track, true, "live_"), Judged.of(back.track, true)
    stroke = float(tracer.unit.cylinder.stroke)
    low, high = true <= AT_END, true >= stroke - AT_END
    between = ~(low | high)
    there = between & np.isfinite(live.error)
    if not there.any():
        return {"known": 0.0}
    first = back.track["position"].values[0] - true[0]
    return {
        "known": 1.0,
        "ends": int(low.any()) + int(high.any()),
        "live": live.figures(there),
        "same": all_of_it.figures(there),
        "hindsight": all_of_it.figures(between),
        "start_off": float(first),
        "start_std": float(back.track["position_std"].values[0]),
        "passes": back.passes,
    }


def names() -> list[str]:
    """The recorded logs, by folder and name."""
    found = (file for folder in FOLDERS for file in sorted((TRACES / folder).glob("*_truth.csv.gz")))
    return [f"{file.parent.name}/{file.name.removesuffix('_truth.csv.gz')}" for file in found]


def runs() -> int:
    """How many steps the study has."""
    return len(names()) + 2 * DAYS


def study(advance: Callable[[int], object]) -> dict[str, Any]:
    """The figures of each recorded log and start, and of each day."""
    loader = machine.load_machine("mining-loader")
    tracers = {name: Tracer.of(build(loader.unit(name), name)) for name in ("boom", "bucket")}
    recorded: dict[str, dict[str, Any]] = {}
    for name in names():
        unit = next(one for one in tracers if one in name)
        log, truth = read_log(TRACES / f"{name}.csv.gz"), read_truth(TRACES / f"{name}_truth.csv.gz")
        true = np.interp(log["time"].values, truth["time"].values, truth["position"].values)
        stroke = float(tracers[unit].unit.cylinder.stroke)
        recorded[name] = {}
        for start, off in STARTS.items():
            entered = None if off is None else float(np.clip(true[0] + off, 0.0, stroke))
            recorded[name][start] = judged(tracers[unit], Signals.of(log), true, entered)
        advance(1)
    days: dict[str, list[Any]] = {}
    for name in data_sheets():
        days[name] = []
        for seed in range(DAYS):
            day = drawn(data_sheets()[name], seed)
            days[name].append(judged(tracers[name], Signals.of(day.log), day.position, None))
            advance(1)
    return {"recorded": recorded, "days": days}


def tables(found: dict[str, Any]) -> dict[str, list[str]]:
    """The tables of the page, by their marks."""
    return {
        "hindsight_logs": _logs(found["recorded"]),
        "hindsight_starts": _starts(found["recorded"]),
        "hindsight_days": _days(found["days"]),
    }


def _logs(recorded: dict[str, Any]) -> list[str]:
    """Each recorded log without a start."""
    rows = [
        "| log | live: known, ok | RMS [mm] | in hindsight: RMS at the same samples | 95 % of all | band | ok "
        "| interval score over live |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, kinds in recorded.items():
        row = kinds["unknown"]
        if row["known"] == 0.0:
            rows.append(f"| {name} | 0 %, 0 % | – | – | – | – | 0 % | – |")
            continue
        live, same, back = row["live"], row["same"], row["hindsight"]
        rows.append(
            f"| {name} | {100 * live['known']:.0f} %, {100 * live['ok']:.0f} % | {1e3 * live['rms']:.2f} "
            f"| {1e3 * same['rms']:.2f} | {1e3 * back['p95']:.2f} | {100 * back['band']:.1f} % "
            f"| {100 * back['ok']:.0f} % | {same['score'] / live['score']:.2f} |"
        )
    return rows


def _starts(recorded: dict[str, Any]) -> list[str]:
    """All recorded logs by what was entered as start."""
    rows = [
        "| start | RMS, median of the logs [mm]: live | in hindsight | band, least: live | in hindsight "
        "| wrong and ok, most: live | in hindsight | true start within 2 σ |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for start in STARTS:
        logs = [kinds[start] for kinds in recorded.values() if kinds[start]["known"] > 0.0]
        live, back = [one["live"] for one in logs], [one["hindsight"] for one in logs]
        near = np.mean([abs(one["start_off"]) <= 2.0 * one["start_std"] for one in logs])
        rms = [f"{1e3 * np.median([row['rms'] for row in which]):.2f}" for which in (live, back)]
        band = [f"{100 * min(row['band'] for row in which):.1f} %" for which in (live, back)]
        wrong = [f"{100 * max(row['wrong'] for row in which):.2f} %" for which in (live, back)]
        rows.append(f"| {start} | " + " | ".join([*rms, *band, *wrong, f"{100 * near:.0f} %"]) + " |")
    return rows


def _days(days: dict[str, list[Any]]) -> list[str]:
    """The days of each unit."""
    rows = [
        "| unit | days with a position | 95 % of all samples: median, worst [mm] | band, least; below 93 % "
        "| wrong and ok, most | beyond the bound, most | RMS over live, median; above 1.02 "
        "| interval score over live, median; above 1.02 | ok: live, in hindsight "
        "| ok in hindsight where both ends were met |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for unit, drawn_days in days.items():
        known = [one for one in drawn_days if one["known"] > 0.0]
        back = [one["hindsight"] for one in known]
        p95 = 1e3 * np.array([row["p95"] for row in back])
        band = np.array([row["band"] for row in back])
        rms, score = (
            np.array([one["same"][key] / one["live"][key] for one in known]) for key in ("rms", "score")
        )  # fmt: skip
        ok = [np.mean([one[which]["ok"] for one in known]) for which in ("live", "hindsight")]
        both = [one["hindsight"]["ok"] for one in known if one["ends"] == 2]
        rows.append(
            f"| {unit} | {len(known)} of {len(drawn_days)} | {np.median(p95):.2f}, {p95.max():.2f} "
            f"| {100 * band.min():.1f} %; {int((band < 0.93).sum())} "
            f"| {100 * max(row['wrong'] for row in back):.2f} % | {100 * max(row['beyond'] for row in back):.3f} % "
            f"| {np.median(rms):.2f}; {int((rms > 1.02).sum())} | {np.median(score):.2f}; {int((score > 1.02).sum())} "
            f"| {100 * ok[0]:.0f} %, {100 * ok[1]:.0f} % | {100 * np.mean(both):.0f} % ({len(both)} days) |"
        )
    return rows
