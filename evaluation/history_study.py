"""Lives of pumps, simulated as records, and what their trends say of them: `python evaluation/history_study.py`.

A life is a year. Its leak factor stays, grows by a gamma process, steps up, or grows until a repair takes it back. The
records have the deviations that real logs give and a scatter that none states. The oil follows the season and the day,
the thermometer is up to 5 K off, and there are gaps. What is asked at a time is asked of the records until then alone.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ramsight.histories.forecast import LIMIT, Forecast, forecasts
from ramsight.histories.trend import YEAR, Explained, Series, explained
from ramsight.machine import load_machine
from ramsight.plant.build import build

Array = NDArray[np.float64]
DAY = 86400.0
KINDS = ("none", "slow", "sudden", "repaired")
"""Of lives, as many of each."""
PER_WEEK = (1.0, 20.0)  # records
STDS = (0.015, 0.08)  # relative, of a record's leak factor: a work day with five ends, some moves without one
SCATTER = 0.02  # relative, at most: what no record states
THERMOMETER = 5.0  # K, at most
AMBIENT, SEASON, WARMED = 278.15, 15.0, 50.0  # K: the year's mean, its amplitude, how much work warms the oil at most
RATES = (0.1, 0.6)  # 1/year, of slow wear
STARTS = (0.9, 1.3)  # leak factor of a new pump
STEP = 1.2
ROUGH = 0.005  # mean size of a jump of the gamma process [1]
AFTER = 5  # records after a step, within which it is to be found
NEAR = 3  # records by which its place may be off
QUARTER = 91.3  # d
ASKED = tuple((month + 1) / 12 for month in range(12))  # years, when it is looked for steps
DATED = (0.5, 0.75, 1.0)  # years, when the date of the limit is asked for
TOGETHER = 40  # lives


@dataclass(frozen=True)
class Life:
    """One pump's records."""

    kind: str  # of `KINDS`, or `quarter`
    time: Array  # of the records [years]
    # value, std: logarithm of the leak factor, and its deviation [1]
    value: Array
    std: Array
    # warm, warm2: its derivatives by how much warmer the oil is than reported [1/K, 1/K^2]
    warm: Array
    warm2: Array
    declared: NDArray[np.bool_]  # whether a repair was declared before a record
    stepped: int  # first record after a step; -1 without one
    step_at: float  # when it steps [years]; infinite if it does not
    # when the true factor reaches the limit [years], as it is worn until the step, and after it; infinite if it never
    # does. A date that is asked for before a repair is one of the pump that is still there.
    limit_at: tuple[float, float]

    def limit_from(self, at: float) -> float:
        """When the limit is reached by all that is there at a time [years]."""
        return self.limit_at[int(at >= self.step_at)]


@dataclass
class Found:
    """What was counted."""

    dated: list[dict[str, Any]] = field(default_factory=list)
    steps: list[bool] = field(default_factory=list)
    false: list[bool] = field(default_factory=list)
    quarter: list[float] = field(default_factory=list)


def thinness() -> tuple[Array, Array]:
    """Temperatures [K], and the logarithm of the viscosity of a loader's oil there."""
    oil = build(load_machine("mining-loader"), "boom").oil
    grid = np.linspace(250.0, 360.0, 221)
    return grid, np.log([float(oil.viscosity(one)) for one in grid])


def drawn(kind: str, seed: int, oil: tuple[Array, Array]) -> Life:
    """A life by its seed."""
    rng = np.random.default_rng([seed, len(kind)])
    at = moments(rng, 1.0 if kind != "quarter" else 1.25)
    path, before, after, step_at = wear(kind, rng)
    limit_at = reached(path, before), reached(path, np.where(path >= step_at, after, 0.0))
    if kind == "quarter":
        at = at[at < limit_at[0] - QUARTER / 365.25]
    true = np.where(at < step_at, np.interp(at, path, before), np.interp(at, path, after))
    reported = AMBIENT - SEASON * np.cos(2.0 * np.pi * (at + rng.random())) + rng.uniform(0.0, WARMED, len(at))
    off = rng.uniform(-THERMOMETER, THERMOMETER)
    grid, thick = oil
    low, here, high, true_oil = (np.interp(reported + by, grid, thick) for by in (-2.0, 0.0, 2.0, off))
    wrong = here - true_oil  # the pump leaks as its oil is, and is judged as it is reported
    std = np.exp(rng.uniform(*np.log(STDS), len(at)))
    noise = np.hypot(std, rng.uniform(0.0, SCATTER)) * rng.normal(size=len(at))
    warm, warm2 = (low - high) / 4.0, -(low - 2.0 * here + high) / 4.0
    stepped = int(np.searchsorted(at, step_at)) if np.isfinite(step_at) else -1
    declared = np.zeros(len(at), bool)
    if kind == "repaired" and rng.random() < 0.5 and 0 <= stepped < len(at):
        declared[stepped] = True
    return Life(kind, at, np.log(true) + wrong + noise, std, warm, warm2, declared, stepped, step_at, limit_at)


def reached(path: Array, factor: Array) -> float:
    """When a factor reaches the limit [years]."""
    beyond = np.flatnonzero(factor >= LIMIT)
    return float(path[beyond[0]]) if beyond.size else float(np.inf)


def moments(rng: np.random.Generator, years: float) -> Array:
    """When records are made, up to two gaps of some weeks left out [years]."""
    count = rng.poisson(52.0 * years * np.exp(rng.uniform(*np.log(PER_WEEK))))
    at = np.sort(rng.uniform(0.0, years, max(count, 20)))
    for _ in range(rng.integers(3)):
        begin = rng.uniform(0.1, 0.8)
        at = at[(at < begin) | (at > begin + rng.uniform(2.0, 8.0) / 52.0)]
    return at


def wear(kind: str, rng: np.random.Generator) -> tuple[Array, Array, Array, float]:
    """The true leak factor over eight years, without the step and after it, and when that is [years]; or infinite."""
    path = np.arange(0.0, 8.0, 1.0 / 365.25)
    start, rate, is_gap = rng.uniform(*STARTS), rng.uniform(*RATES), rng.random() < 0.5
    if kind == "quarter":
        factor = LIMIT - 0.3 * rng.uniform(0.75, 1.25) + 0.3 * path
        return path, factor, factor, np.inf
    grown = np.cumsum(rng.gamma(rate / 365.25 / ROUGH, ROUGH, len(path)))
    if is_gap:  # what leaks through a gap grows with its cube
        grown = start * ((1.0 + grown / 3.0 / start) ** 3 - 1.0)
    if kind == "slow":
        return path, start + grown, start + grown, np.inf
    step_at = rng.uniform(0.2, 0.9)
    if kind == "sudden":
        return path, np.full(len(path), start), np.full(len(path), STEP * start), step_at
    if kind == "repaired":
        return path, start + grown, start + grown - grown[np.searchsorted(path, step_at)], step_at
    return path, np.full(len(path), start), np.full(len(path), start), np.inf


def together(lives: Sequence[Life], until: Sequence[float] | None = None, last: Sequence[int] | None = None) -> Series:
    """Lives as series, until a time [years] or a number of records each."""
    ends = (
        [int(np.searchsorted(one.time, t, side="right")) for one, t in zip(lives, until, strict=True)]
        if until
        else last
    )
    assert ends is not None
    rows = max(*ends, 1)
    series = Series(*(np.full((rows, len(lives)), np.nan) for _ in range(5)), np.zeros((rows, len(lives)), bool))
    for column, (one, end) in enumerate(zip(lives, ends, strict=True)):
        at = YEAR * one.time[:end]
        series.time[:end, column], series.time[end:, column] = at, at[-1] if end else 0.0
        for name, values in (
            ("value", one.value),
            ("std", one.std),
            ("per_kelvin", one.warm),
            ("per_kelvin2", one.warm2),
            ("jumps", one.declared),
        ):
            getattr(series, name)[:end, column] = values[:end]
    return series


def dates(found: Explained) -> list[Forecast]:
    """The date of the limit of each series."""
    series, count = found.series, found.series.value.shape[1]
    known = series.known
    times = series.time[-1]
    first = series.time[known.argmax(axis=0), np.arange(count)]
    return forecasts(
        found.trend, times, known.sum(axis=0), times - first, np.full(count, np.log(LIMIT)), np.ones(count)
    )


def undeclared(found: Explained, column: int) -> list[int]:
    """Records at which a step was found."""
    return [one.record for one in found.steps[column] if not one.is_declared]


def asked(lives: list[Life]) -> Found:
    """All that is asked of some lives."""
    said = Found()
    quarter = [one for one in lives if one.kind == "quarter"]
    if quarter:
        for life, date in zip(quarter, dates(explained(together(quarter, [2.0] * len(quarter)))), strict=True):
            said.quarter.append(date.middle / DAY - 365.25 * life.limit_at[0] if date.is_dated else np.nan)
        return said
    stepped = [one for one in lives if one.kind == "sudden" and AFTER <= one.stepped <= len(one.time) - AFTER]
    if stepped:
        found = explained(together(stepped, last=[one.stepped + AFTER for one in stepped]))
        near = [[abs(k - one.stepped) <= NEAR for k in undeclared(found, c)] for c, one in enumerate(stepped)]
        said.steps += [any(one) for one in near]
    false = [False] * len(lives)
    for at in ASKED:
        found = explained(together(lives, [at] * len(lives)))
        for column, life in enumerate(lives):
            false[column] |= life.stepped < 0 and bool(undeclared(found, column))
        if at in DATED:
            for life, date in zip(lives, dates(found), strict=True):
                said.dated.append(judged(life, date, at))
    said.false += [one for one, life in zip(false, lives, strict=True) if life.stepped < 0]
    return said


def judged(life: Life, date: Forecast, at: float) -> dict[str, Any]:
    """One date, held against the truth."""
    true = life.limit_from(at) * YEAR
    is_passed = life.limit_from(at) <= at
    holds = bool(date.low <= true <= date.high) if date.is_dated else None
    off = (date.middle - true) / DAY if date.is_dated and np.isfinite(true) else None
    return {"kind": life.kind, "at": at, "is_passed": is_passed, "holds": holds, "off": off, "reason": date.reason}


def summary(said: list[Found], lives: int) -> dict[str, Any]:
    """What is written down."""
    dated = [one for part in said for one in part.dated]
    given = [one for one in dated if one["holds"] is not None]
    quarter = np.array([one for part in said for one in part.quarter])
    steps, false = ([one for part in said for one in getattr(part, name)] for name in ("steps", "false"))
    known = quarter[np.isfinite(quarter)]
    by_kind = {
        kind: {
            "asked": sum(one["kind"] == kind for one in dated),
            "given": sum(one["kind"] == kind for one in given),
            "hold": sum(bool(one["holds"]) for one in given if one["kind"] == kind),
        }
        for kind in KINDS
    }
    by_time = {
        str(at): {
            "given": sum(one["at"] == at for one in given),
            "hold": sum(bool(one["holds"]) for one in given if one["at"] == at),
        }
        for at in DATED
    }
    return {
        "lives": lives,
        "dates_asked": len(dated),
        "dates_given": len(given),
        "dates_hold": float(np.mean([one["holds"] for one in given])) if given else None,
        "dates_by_kind": by_kind,
        "dates_by_time": by_time,
        "date_off_median_d": float(np.median([abs(one["off"]) for one in given if one["off"] is not None])),
        "steps": len(steps),
        "steps_found": float(np.mean(steps)),
        "lives_without": len(false),
        "without_none_found": 1.0 - float(np.mean(false)),
        "quarter_lives": len(quarter),
        "quarter_given": float(np.mean(np.isfinite(quarter))),
        "quarter_off_median_d": float(np.median(np.abs(known))),
        "quarter_off_mean_d": float(np.mean(known)),
    }


def table(found: dict[str, Any]) -> list[str]:
    """Rows for docs/how-to/history.md."""
    by_kind = found["dates_by_kind"]
    return [
        f"| intervals of 90 % that hold the true date | {100 * found['dates_hold']:.0f} % of {found['dates_given']} |",
        f"| … of slow wear, of wear with a repair | {_share(by_kind['slow'])}, {_share(by_kind['repaired'])} |",
        f"| dates that were given of {found['dates_asked']} that were asked for | {found['dates_given']} |",
        f"| … of pumps that do not wear, or step once | {by_kind['none']['given']}, {by_kind['sudden']['given']} |",
        f"| middle of the interval off by, median | {found['date_off_median_d']:.0f} d |",
        f"| steps of 20 % found within five records | {100 * found['steps_found']:.1f} % of {found['steps']} |",
        f"| lives without a step in which none was found, asked each month | {100 * found['without_none_found']:.1f} % "
        f"of {found['lives_without']} |",
        f"| slow wear of 30 % a year, asked a quarter ahead: off by, median | {found['quarter_off_median_d']:.0f} d |",
        f"| … for which a date was given | {100 * found['quarter_given']:.0f} % of {found['quarter_lives']} |",
    ]


def _share(kind: dict[str, int]) -> str:
    return f"{100 * kind['hold'] / max(kind['given'], 1):.0f} %"


def main() -> None:
    """Draw the lives, ask, and write what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/history.json"))
    parser.add_argument("--lives", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=7)  # 1 to 6 were looked at while limits were chosen
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    begun, oil = time.perf_counter(), thinness()
    lives = [drawn(KINDS[k % len(KINDS)], options.seed * 1_000_000 + k, oil) for k in range(options.lives)]
    lives += [drawn("quarter", options.seed * 1_000_000 + k, oil) for k in range(options.lives // 5)]
    lives.sort(key=lambda one: (one.kind == "quarter", len(one.time)))
    parts = [lives[k : k + TOGETHER] for k in range(0, options.lives, TOGETHER)]
    parts += [lives[k : k + TOGETHER] for k in range(options.lives, len(lives), TOGETHER)]
    with ProcessPoolExecutor(options.jobs) as pool:
        said = list(pool.map(asked, reversed(parts)))
    found = summary(said, options.lives) | {"seed": options.seed, "seconds": round(time.perf_counter() - begun)}
    options.out.write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
