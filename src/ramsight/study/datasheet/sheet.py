"""The data sheet: what a study says of a sensor, in the terms of IEC 61298-2 and of sheets of position sensors."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ramsight.arrays import Array
from ramsight.duty.drive_report import DriveReport
from ramsight.duty.simulate import SAMPLE_PERIOD
from ramsight.sensor.status import VALIDITIES
from ramsight.signals import Dataset
from ramsight.study.datasheet.budget import Budget
from ramsight.study.datasheet.measuring import AGE, EDGES, GROUPS, NORMAL_95, TAUGHT, VOUCHED, drift_of
from ramsight.study.datasheet.statistics import (
    NOTHING,
    Known,
    pooled_quantiles,
    quantile_of_machines,
    share_of,
    slope_of,
)
from ramsight.study.datasheet.study_plan import Plan

SHARES = (0.5, 0.95, 0.997)
_WORST = 5
_FEW = 5  # samples in a place of the stroke, below which it says nothing


@dataclass(frozen=True)
class Accuracy:
    """Magnitudes of the errors of a group [m]."""

    group: str  # of errors, one of `GROUPS`
    machines: int  # that have such errors
    quantiles: tuple[Known, ...]  # of all errors of all machines, at the shares of `SHARES`
    machine: Known  # what 95 % of the machines keep for 95 % of their time
    largest: float  # of all
    worst: int  # number of the machine that has it
    coverage: float  # share of the errors within the 95 % band that the sensor states


@dataclass(frozen=True)
class Term:
    """One line of the sheet."""

    name: str  # the term
    known: Known  # the figure in SI, with its interval
    unit: str  # SI
    how: str  # what is meant, in a sentence


@dataclass(frozen=True)
class Worst:
    """One of the worst machines."""

    machine: int  # its number
    largest: float  # error after the third reference [m]
    values: dict[str, float]  # what it was drawn as, by name [SI]


@dataclass(frozen=True)
class Bound:
    """What the sensor's own bound of its error is worth while it says ok."""

    median: float  # of the machines' medians [m]; NaN of a sensor that states none
    over_p95: float  # that over the 95 % error while it says ok [1]
    samples: int  # that were ok
    beyond: int  # of these, errors beyond the bound
    machines: Known  # share of the machines that ever had one

    @property
    def is_said(self) -> bool:
        """Whether the sensor reports a bound."""
        return math.isfinite(self.median)

    @property
    def text(self) -> str:
        """The finding in a sentence."""
        return (
            f"while ok the error is said to be below {1e3 * self.median:.1f} mm,"
            f" {self.over_p95:.1f} times the error that 95 % are below;"
            f" {self.beyond} of {self.samples} samples exceed it, on {100 * self.machines.value:.2f} % of the machines"
            f" (at most {100 * self.machines.high:.2f} %)"
        )


@dataclass(frozen=True)
class Sheet:
    """A sensor's data sheet."""

    plan: Plan  # of the study
    stroke: float  # as described [m]
    machines: int  # that were simulated
    failed: int  # machines whose duty could not be simulated to its end
    hours: float  # of work, of all machines together
    accuracy: tuple[Accuracy, ...]  # by group of errors
    terms: tuple[Term, ...]  # the other figures
    validity: dict[str, float]  # share of the time with each validity
    # ok_but_wrong: share of the time in which the sensor reports ok and is off by more than four standard deviations
    ok_but_wrong: float
    bound: Bound  # what the sensor's bound is worth
    worst: tuple[Worst, ...]  # machines found
    budget: Budget | None = None  # the error budget; None if it was not asked for
    recorded: tuple[dict[str, Any], ...] = ()  # recorded machines held against the sheet

    def term(self, name: str) -> Known:
        """The figure of a term."""
        return next((one.known for one in self.terms if one.name == name), NOTHING)

    @property
    def best(self) -> Accuracy:
        """The accuracy after most references, of those that there are."""
        held = [one for one in self.accuracy[: TAUGHT + 1] if one.machines]
        return held[-1] if held else self.accuracy[0]

    @property
    def text(self) -> str:
        """A few lines on it, in mm."""
        lines = [f"{self.machines} machines, {self.hours:.3g} h of work, {self.failed} that could not be simulated"]
        for one in self.accuracy:
            if one.machines:
                p95, most = 1e3 * one.quantiles[1].value, 1e3 * one.machine.value
                which = f"{one.group}, after any number of references" if one.group == GROUPS[-1] else one.group
                lines.append(
                    f"  {which}: 95 % within {p95:.2f} mm, of 95 % of the machines within {most:.2f} mm, "
                    f"largest {1e3 * one.largest:.1f} mm (machine {one.worst})"
                )
        said = ", ".join(f"{name} {100.0 * share:.1f} %" for name, share in self.validity.items())
        lines.append(f"  status: {said}; ok but off by more than 4 std {100 * self.ok_but_wrong:.3f} %")
        if self.bound.is_said:
            lines.append(f"  {self.bound.text}")
        for held in self.recorded:
            inside = all(after is None or after["inside"] for after in held["after"])
            lines.append(f"  {held['log']}: {'inside' if inside else 'outside'} the sheet")
        return "\n".join(lines)

    def to_json(self, more: Mapping[str, Any] | None = None) -> str:
        """All of it, in SI; what is not known is null.

        Args:
            more: further entries.
        """
        content = {"format": 1, "kind": "data sheet", **self.numbers, **(more or {})}
        return json.dumps(_finite(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n"

    @property
    def numbers(self) -> dict[str, Any]:
        """All of it by name, in SI."""
        return {
            "unit": self.plan.unit,
            "sensor": self.plan.sensor,
            "duty": asdict(self.plan.work),
            "seed": self.plan.seed,
            "design": self.plan.method,
            "stroke": self.stroke,
            "machines": self.machines,
            "failed": self.failed,
            "hours": self.hours,
            "shares": SHARES,
            "accuracy": [asdict(one) for one in self.accuracy],
            "terms": [asdict(one) for one in self.terms],
            "validity": self.validity,
            "ok_but_wrong": self.ok_but_wrong,
            "bound": asdict(self.bound),
            "worst": [asdict(one) for one in self.worst],
            "recorded": list(self.recorded),
            "budget": None if self.budget is None else _budget(self.budget),
        }

    def to_toml(self) -> str:
        """What was assumed: every quantity that varied, with its tolerance and where that comes from."""
        lines = [
            f"# What the data sheet of {self.plan.unit} rests on: {self.plan.count} machines, SI units.",
            f"seed = {self.plan.seed}", f"design = {_text(self.plan.method)}", f"machines = {self.plan.count}",
            f"sensor = {_text(self.plan.sensor)}", f"duty = {_text(self.plan.work.kind)}",
            f"duration = {self.plan.work.duration!r}", f"visit_every = {self.plan.work.visit_every!r}",
        ]  # fmt: skip
        for one in self.plan.quantities:
            low, high = one.spread.ends
            lines += [
                "", f"[quantities.{_text(one.name)}]", f"meaning = {_text(one.text)}",
                f"centre = {one.spread.centre!r}", f"tolerance = {one.spread.half!r}",
                f"distribution = {_text(one.spread.distribution)}", f"least = {low!r}", f"most = {high!r}",
                f"source = {_text(one.source)}", f"default = {str(one.is_default).lower()}",
            ]  # fmt: skip
        if self.plan.correlations:
            lines += ["", "[correlations]", *(f"{pair} = {value!r}" for pair, value in self.plan.correlations)]
        return "\n".join(lines) + "\n"


def data_sheet(plan: Plan, found: Dataset, budget: Budget | None = None) -> Sheet:
    """What a study says."""
    done = found.isel(machine=np.flatnonzero(found["outcome"].values == 0))
    statuses = done["statuses"].values.sum(axis=0).astype(float)
    samples = max(statuses.sum(), 1.0)
    accuracy = tuple(_accuracy(done, k, plan.seed) for k in range(len(GROUPS)))
    return Sheet(
        plan=plan,
        stroke=float(plan.bench.sheet.cylinder.stroke),
        machines=found.sizes["machine"],
        failed=found.sizes["machine"] - done.sizes["machine"],
        hours=float(done["duration"].sum()) / 3600.0,
        accuracy=accuracy,
        terms=tuple(_terms(plan, done)),
        validity=dict(zip(VALIDITIES, (statuses / samples).tolist(), strict=True)),
        ok_but_wrong=float(done["ok_beyond_4_std"].sum() / samples),
        bound=_bound(done, accuracy[VOUCHED]),
        worst=_worst(done),
        budget=budget,
    )


def _bound(done: Dataset, ok: Accuracy) -> Bound:
    beyond, medians = done["ok_beyond_bound"].values, done["bound"].values
    median = float(np.nanmedian(medians)) if np.isfinite(medians).any() else math.nan
    return Bound(
        median=median,
        over_p95=median / ok.quantiles[1].value if ok.machines else math.nan,
        samples=int(done["samples"].values[:, VOUCHED].sum()),
        beyond=int(beyond.sum()),
        machines=share_of(int((beyond > 0).sum()), int(np.isfinite(medians).sum())),
    )


def _accuracy(done: Dataset, k: int, seed: int) -> Accuracy:
    samples, largest = done["samples"].values[:, k], done["largest"].values[:, k]
    held = samples > 0
    if not held.any():
        return Accuracy(GROUPS[k], 0, (NOTHING,) * len(SHARES), NOTHING, math.nan, -1, math.nan)
    row = int(np.nanargmax(largest))
    return Accuracy(
        group=GROUPS[k],
        machines=int(held.sum()),
        quantiles=tuple(pooled_quantiles(done["errors"].values[:, k], EDGES, SHARES, seed)),
        machine=quantile_of_machines(done["p95"].values[:, k], 0.95),
        largest=float(largest[row]),
        worst=int(done["machine"].values[row]),
        coverage=float(done["inside"].values[:, k].sum() / samples.sum()),
    )


def _terms(plan: Plan, done: Dataset) -> list[Term]:
    found = [Term(name, quantile_of_machines(values, 0.95), "m", how) for name, values, how in _of_profiles(done)]
    best = _best_p95(done)
    if "oil_temperature" in plan.names:
        warm = done["values"].values[:, plan.names.index("oil_temperature")]
        how = "change of a machine's 95 % error with the oil's temperature"
        found.append(Term("temperature drift", slope_of(warm, best), "m/K", how))
    ageing = done["ageing"].values
    at_once, slope = drift_of(ageing.sum(axis=0))
    how = f"growth of the mean error per hour of work, from the first {AGE * ageing.shape[1]:.0f} s after a reference"
    found.append(Term("drift without reference", _drift(ageing, 3600.0 * slope, plan.seed), "m/h", how))
    found.append(Term("error just after a reference", Known(at_once), "m", "mean, by the same straight line"))
    step = DriveReport().speed_step * SAMPLE_PERIOD * plan.bench.sheet.travel_per_radian
    found.append(
        Term("resolution", Known(abs(step)), "m", "way in a sample at the smallest step of the reported speed")
    )
    found.append(Term("update time", Known(SAMPLE_PERIOD), "s", "a position for each sample that the drive reports"))
    first, error = done["first_position"].values, done["first_error"].values
    if np.isfinite(first).any():
        never = int((~np.isfinite(first)).sum())
        found.append(
            Term(
                "time to first position",
                quantile_of_machines(first, 0.5),
                "s",
                "median, without a position at power-up",
            )
        )
        found.append(Term("time to first position, 95 %", quantile_of_machines(first, 0.95), "s", "of the machines"))
        found.append(
            Term("error of the first position", quantile_of_machines(error, 0.95), "m", "of 95 % of the machines")
        )
        how = "machines that met no end stop, or rejected it, over the whole duty"
        found.append(Term("no position", share_of(never, len(first)), "1", how))
    return found


def _best_p95(done: Dataset) -> Array:
    """The 95 % error of each machine after most references."""
    p95 = done["p95"].values
    best = np.full(len(p95), np.nan)
    for k in range(TAUGHT + 1):
        best = np.where(np.isfinite(p95[:, k]), p95[:, k], best)
    return best


def _of_profiles(done: Dataset) -> list[tuple[str, Array, str]]:
    """Non-linearity, hysteresis and non-repeatability of each machine, from its errors by place and direction."""
    profile = done["profile"].values
    number = profile[..., 0]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(number >= _FEW, profile[..., 1] / number, np.nan)
        variance = np.where(number >= _FEW, profile[..., 2] / number - mean**2, np.nan)
    both = np.where(np.isfinite(mean).all(axis=1), mean.mean(axis=1), np.nan)
    bent = np.array([_off_line(one) for one in both])
    between = np.abs(mean[:, 0] - mean[:, 1])
    wide = _largest(between)
    weights = np.where(np.isfinite(variance), number, 0.0).sum(axis=(1, 2))
    within = np.nansum(number * np.nan_to_num(variance), axis=(1, 2)) / np.maximum(weights, 1.0)
    spread = np.where(weights > 0.0, NORMAL_95 * np.sqrt(np.maximum(within, 0.0)), np.nan)
    of = "; of 95 % of the machines"
    line = "largest distance of the mean error from a straight line over the stroke"
    ways = "largest difference of the mean errors at one place, extending and retracting"
    near = "95 % of the errors at one place in one direction lie so near to their mean"
    return [
        ("non-linearity", bent, line + of),
        ("hysteresis", wide, ways + of),
        ("non-repeatability", spread, near + of),
    ]


def _off_line(mean: Array) -> float:
    held = np.isfinite(mean)
    if held.sum() < 3:
        return math.nan
    place = np.arange(len(mean))[held]
    return float(np.abs(mean[held] - np.polyval(np.polyfit(place, mean[held], 1), place)).max())


def _largest(values: Array) -> Array:
    return np.where(np.isfinite(values).any(axis=1), np.nan_to_num(values, nan=-1.0).max(axis=1), np.nan)


def _drift(ageing: Array, value: float, seed: int) -> Known:
    """The growth with its interval, by drawing the machines again."""
    if not np.isfinite(value) or len(ageing) < 2:
        return Known(value)
    random = np.random.default_rng(seed)
    several = []
    for _ in range(200):
        rows = random.integers(0, len(ageing), len(ageing))
        several.append(3600.0 * drift_of(ageing[rows].sum(axis=0))[1])
    low, high = np.nanquantile(several, [0.025, 0.975])
    return Known(value, float(low), float(high))


def _worst(done: Dataset) -> tuple[Worst, ...]:
    largest = done["largest"].values[:, TAUGHT]
    order = [int(k) for k in np.argsort(-np.nan_to_num(largest, nan=-1.0))[:_WORST] if np.isfinite(largest[k])]
    names = [str(name) for name in done["quantity"].values]
    rows = done["values"].values
    numbers = done["machine"].values
    return tuple(
        Worst(int(numbers[k]), float(largest[k]), dict(zip(names, rows[k].tolist(), strict=True))) for k in order
    )


def _budget(budget: Budget) -> dict[str, Any]:
    found = budget.dataset()
    quantities = {
        str(name): {key: float(found[key].values[k]) for key in map(str, found.data_vars)}
        for k, name in enumerate(budget.names)
    }
    return {
        "runs": 0 if budget.indices is None else budget.indices.runs,
        "failed": budget.failed,
        "moments": budget.moments,
        "error_std": budget.std,
        "limit": budget.limit,
        "largest_difference_linear": budget.agreement,
        "quantities": quantities,
    }


def _finite(content: Any) -> Any:
    """The same with null for what is no number."""
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    if isinstance(content, float) and not math.isfinite(content):
        return None
    return content


def _text(words: str) -> str:
    return json.dumps(words, ensure_ascii=False)
