"""A track held against what its position is required for.

Samples count from the first known position on. One without a valid position misses the requirement, whatever the error
is. What the sensor states of itself is the expected share of errors within the limit, from its standard deviations;
where the true position is known, that is counted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array, Bools
from ramsight.machine.requirement_description import Requirement, shown_error
from ramsight.normal import upper_tail
from ramsight.sensor.status import Status, is_invalid
from ramsight.signals import Samples
from ramsight.tracking.end_visits import visits

SHARE = 0.95
"""Of the errors that a requirement is for."""
_TAUGHT = 2  # references, from which on their frequency decides: the first does not yet separate leakage from position
_HALVINGS = 50  # of an interval of 100 m: far below a micrometre
_FARTHEST = 100.0  # m
_AGES = (5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0, 180.0, 300.0)  # s, ages that are tried


@dataclass(frozen=True)
class RequirementCheck:
    """What a track achieves of a requirement."""

    asked: Requirement
    samples: int
    stated: float  # error that 95 % are within by the sensor's own standard deviations [m]; infinite if there is none
    measured: float  # error that 95 % are within by the true position [m]; NaN where that is unknown
    ok: float  # share of the counted samples whose status is ok [1]
    # longest time after a reference for which the error is within the requirement [s]; 0 if there is none
    good_for: float

    @property
    def error(self) -> float:
        """The error that is judged: measured where the truth is known, else stated [m]."""
        return self.stated if math.isnan(self.measured) else self.measured

    @property
    def missing(self) -> tuple[str, ...]:
        """What of the requirement is missed, a phrase each."""
        if not self.samples:
            return ("the position was never known",)
        return self.asked.missed(self.error, self.ok)

    @property
    def is_met(self) -> bool:
        """Whether nothing is missing."""
        return not self.missing

    @property
    def is_vague(self) -> bool:
        """Whether the true errors are within the requirement and the sensor's band is not."""
        return not math.isnan(self.measured) and self.stated > self.asked.error

    @property
    def text(self) -> str:
        """What is achieved, in a line."""
        said = f"by the sensor's own band 95 % within {shown_error(self.stated)}"
        true = "" if math.isnan(self.measured) else f"95 % of the errors within {shown_error(self.measured)}, "
        return f"{true}{said}, ok for {100 * self.ok:.0f} % of the time; required {self.asked.text}"

    @property
    def verdict(self) -> str:
        """Whether it is met, what is missing and what would mend it, in a line."""
        if self.is_met:
            return f"requirement achieved: {self.text}"
        mends = f"; what would mend it: {self.remedy}" if self.remedy else ""
        return f"requirement missed: {', '.join(self.missing)}; {self.text}{mends}"

    @property
    def remedy(self) -> str:
        """How often a reference is needed, as this track shows it; "" if no frequency is enough."""
        if not self.samples or self.error <= self.asked.error or self.good_for == 0.0:
            return ""
        if self.good_for == _AGES[-1]:
            return f"{_TAUGHT} references (end stop, switch) before the position is used"
        return f"a reference (end stop, switch) every {self.good_for:g} s of work"


def require(track: Samples, asked: Requirement, stroke: float) -> RequirementCheck:
    """Hold a track against a requirement.

    Args:
        track: `position` [m], `position_std` [m] and `status` over `time` [s]; `error` [m] where the truth is known;
            `mode` and `motor_speed` [rad/s], from which references are known, and `reference` [m].
        stroke: of the cylinder [m].

    Example:
        >>> import numpy as np, xarray
        >>> std = np.full(100, 1e-3)
        >>> status = np.zeros(100, int)
        >>> data = {"position": ("time", 0.1 + 0 * std), "position_std": ("time", std), "status": ("time", status)}
        >>> track = xarray.Dataset(data, {"time": np.arange(100.0)})
        >>> check = require(track, Requirement(error="1 mm"), 0.5)
        >>> check.is_met, round(1e3 * check.stated, 2)
        (False, 1.96)
    """
    known = np.isfinite(track["position"].values)
    counts = np.cumsum(known) > 0
    age, number = _ages(track, stroke)
    error = np.abs(track["error"].values) if "error" in track else np.full(len(known), np.nan)
    std = track["position_std"].values if "position_std" in track else np.full(len(known), np.nan)
    lost = ~known | is_invalid(track["status"].values)
    error = np.where(lost & np.isfinite(error), np.inf, error)
    std = np.where(lost | ~np.isfinite(std), np.inf, std)
    within = counts & (age <= asked.visit_every)

    def errors_of(chosen: Bools) -> tuple[float, float]:
        true = error[chosen & ~np.isnan(error)]
        measured = float(np.quantile(true, SHARE, method="higher")) if true.size else math.nan
        return _stated(std[chosen]), measured

    good_for = 0.0
    for limit in _AGES:
        chosen = counts & (age <= limit) & (number >= _TAUGHT)
        stated, measured = errors_of(chosen) if chosen.any() else (math.inf, math.nan)
        if (stated if math.isnan(measured) else measured) > asked.error:
            break
        good_for = limit
    stated, measured = errors_of(within)
    ok = float(np.mean(track["status"].values[counts] == Status.OK)) if counts.any() else 0.0
    return RequirementCheck(asked, int(within.sum()), stated, measured, ok, good_for)


def _ages(track: Samples, stroke: float) -> tuple[Array, NDArray[np.int64]]:
    """Time since the last reference, or since the position was known first [s], and how many came, shapes (n,)."""
    time = track["time"].values
    there = np.isfinite(track["position"].values)
    begins = np.zeros(len(time), dtype=np.bool_)
    begins[int(np.argmax(there))] = True
    if "reference" in track:
        begins |= np.isfinite(track["reference"].values)
    if "mode" in track and "motor_speed" in track:
        for one in visits(track, stroke):
            if one.where != "elsewhere":
                begins |= (time >= one.begins) & (time <= one.ends)
    last = np.maximum.accumulate(np.where(begins, np.arange(len(time)), 0))
    return np.asarray(time - time[last]), np.cumsum(np.diff(begins, prepend=False) & begins)


def _stated(std: Array) -> float:
    """The limit that a share of errors is within, of normal errors with these standard deviations [m]."""
    finite = std[np.isfinite(std)]
    if finite.size < SHARE * std.size or not std.size:
        return math.inf
    low, high = 0.0, _FARTHEST
    kinds, counts = np.unique(np.round(finite, 7), return_counts=True)  # of 0.1 µm: a day has few different ones
    kinds = np.maximum(kinds, 1e-9)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        inside = float(((1.0 - 2.0 * upper_tail(middle / kinds)) * counts).sum()) / std.size
        low, high = (middle, high) if inside < SHARE else (low, middle)
    return high
