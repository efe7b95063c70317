"""A data sheet held against what the position is required for, and against recorded machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.logs import read_log, read_truth
from ramsight.machine.description import Machine
from ramsight.machine.requirement_description import Requirement
from ramsight.sensor.virtual_sensor import BOUND
from ramsight.study.datasheet.budget import Budget, budget
from ramsight.study.datasheet.machine_tasks import Bench
from ramsight.study.datasheet.measuring import GROUPS, Track, measures
from ramsight.study.datasheet.quantities import varied
from ramsight.study.datasheet.sheet import Sheet
from ramsight.study.datasheet.study_plan import Plan


@dataclass(frozen=True)
class SheetRequirement:
    """What a data sheet achieves of a requirement."""

    asked: Requirement
    error: float  # that 95 % of all machines' errors are within, after most references [m]; NaN if nothing is known
    ok: float  # share of the time in which the status is ok [1]
    mending: tuple[str, ...] = ()  # what would make the error smaller, the most first

    @property
    def missing(self) -> tuple[str, ...]:
        """What of the requirement is missed, a phrase each."""
        return self.asked.missed(self.error, self.ok)

    @property
    def is_met(self) -> bool:
        """Whether nothing is missing."""
        return not self.missing

    @property
    def text(self) -> str:
        """The verdict, and what would mend it, in a line."""
        asked = f"required {self.asked.text}: "
        if self.is_met:
            return f"{asked}achieved, {1e3 * self.error:.3g} mm, ok for {100 * self.ok:.0f} % of the time"
        mends = f"; what would mend it: {'; or '.join(self.mending)}" if self.mending else ""
        return f"{asked}missed, {', '.join(self.missing)}{mends}"

    @property
    def html(self) -> list[str]:
        """The same as a section of the sheet's page."""
        return ["<h2>Requirement</h2>", f"<p>{escape(self.text[0].upper() + self.text[1:])}.</p>"]

    @property
    def numbers(self) -> dict[str, Any]:
        """The same as entries of the sheet's file, in SI."""
        return {**asdict(self), "asked": self.asked.model_dump(), "is_met": self.is_met}


def required(sheet: Sheet, asked: Requirement, mending: list[str]) -> SheetRequirement:
    """Hold a sheet against a requirement."""
    return SheetRequirement(asked, sheet.best.quantiles[1].value, sheet.validity.get("ok", 0.0), tuple(mending))


_WORTH = 0.1  # share of the error's variance, below which a measure is not named


@dataclass(frozen=True)
class Measure:
    """Something that can be done about an error."""

    name: str
    tolerances: Mapping[str, str]  # that are left by it, as text


MEASURES = (
    Measure("a leak test at commissioning", {"leakage": "± 5 % normal"}),
    Measure(
        "the data sheet identified from a day with a measured position (ramsight identify)",
        {
            "leakage": "± 4 % normal", "displacement": "± 0.1 % normal", "stiffness": "± 10 % normal",
            "pump_friction": "± 5 % normal", "friction": "± 10 % normal",
        },
    ),
    Measure("relief valves set with a gauge", {"relief": "± 1 % normal"}),
    Measure("a thermometer in the pump's line", {"thermometer_offset": "± 0.5 K", "thermometer_lag": "5 s ± 5 s"}),
    Measure("the drive's torque calibrated", {"torque_gain": "± 0.6 % normal", "torque_offset": "± 0.1 % normal"}),
)  # fmt: skip
"""What is looked at. The tolerances that are left are usual ones [G]."""


def mending(machine: Machine, study: Plan, known: Budget | None = None) -> list[str]:
    """Measures that take most of the error's variance, with their share, the largest first."""
    found = budget(study, 0, None) if known is None else known
    shares = dict(zip(found.names, found.linear.shares.tolist(), strict=True))
    before = {one.name: one.spread.std for one in study.quantities}
    worth = []
    for measure in MEASURES:
        after = varied(machine, study.unit, dict(measure.tolerances))
        taken = sum(
            shares[one.name] * max(1.0 - (one.spread.std / before[one.name]) ** 2, 0.0)
            for one in after
            if one.name in measure.tolerances and before.get(one.name, 0.0) > 0.0
        )
        worth.append((taken, measure.name))
    best = sorted((one for one in worth if one[0] > _WORTH), reverse=True)
    return [f"{name} ({100 * taken:.0f} % of the error's variance)" for taken, name in best]


_START_KNOWN = 1e-3  # m; standard deviation of the sensor's start position


def held_against(sheet: Sheet, bench: Bench, log: Path, truth: Path) -> dict[str, Any]:
    """A recorded drive log with its true position, tracked as the sheet's machines are.

    Args:
        log: a drive log, as `ramsight.logs.read_log` reads it.

    Returns:
        The log's name and, for each group of errors, `p95` and `largest` [m] and whether they lie `inside` what
        95 % of the machines keep, with the interval of that, and the largest error found; None where it has no errors.

    Raises:
        LogError: a file cannot be read.
    """
    reported, true = read_log(log), read_truth(truth)
    position = np.interp(reported["time"].values, true["time"].values, true["position"].values)
    sensor = bench.virtual
    sensor.start(float(position[0]), _START_KNOWN)
    tracked = sensor.track(reported)
    track = Track(
        reported["time"].values,
        tracked["position"].values,
        tracked["position_std"].values,
        tracked["status"].values.astype(np.int64),
        position,
        sheet.stroke,
        tracked[BOUND].values if BOUND in tracked else None,
    )
    found = measures(track)
    after: list[dict[str, Any] | None] = []
    for k in range(len(GROUPS)):
        promised = sheet.accuracy[k]
        p95, largest = float(np.asarray(found["p95"])[k]), float(np.asarray(found["largest"])[k])
        if not np.isfinite(p95) or not promised.machines:
            after.append(None)
            continue
        inside = p95 <= promised.machine.high and largest <= promised.largest
        after.append({"p95": p95, "largest": largest, "inside": bool(inside)})
    return {"log": log.name, "after": after}
