"""Histories assessed: a trend of each quantity with its steps, the date of its limit, causes, and what to look at.

A cause moves some quantities together: levels change by a u, with u what it does to each, and an amount a >= 0 that is
half-normal. With the deviations of the changes and a small change that no cause explains, that gives the likelihood of
each cause (Bayes' theorem). Two causes that do the same stay as likely to each other as they were before: then nothing
in the records tells them apart, and the fitter has to look.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from ramsight.arrays import Array
from ramsight.histories.fleet import Member, Population, population
from ramsight.histories.forecast import Followed, Forecast, forecasts, limited
from ramsight.histories.history_store import Event, Kept
from ramsight.histories.record import Record, shown
from ramsight.histories.trend import Explained, Series, Step, explained


@dataclass(frozen=True)
class Cause:
    """Something that changes a machine."""

    words: str  # what it is
    look: str  # where to look
    prior: float  # how often it is, beside the others [1]
    does: Mapping[str, float] = field(default_factory=dict)  # change of each level for a usual amount [1]
    by_oil_change: float = 1.0  # how much likelier it is where the change came with a declared oil change


CAUSES = (
    Cause("nothing has changed", "nothing to do", 0.5),
    Cause("the pumps wear", "measure the case drain, hot and at rated speed", 0.15, {"leak": 0.3}, 0.05),
    Cause("the oil is thinner", "look at the oil's grade, its age and fuel in it", 0.07, {"leak": 0.3}, 10.0),
    Cause("the oil is thicker", "look at the oil's grade and age", 0.04, {"leak": -0.3}, 10.0),
    Cause("the thermometer reads too low", "compare it with another one", 0.03, {"leak": 0.2}, 0.2),
    Cause("the thermometer reads too high", "compare it with another one", 0.03, {"leak": -0.2}, 0.2),
    Cause("a groove in a pump, or a valve that leaks", "look at port plates and valve seats", 0.04,
          {"leak": 0.4, "exponent": 0.1}, 0.2),
    Cause("the pumps are other ones, or tighter", "look whether they were replaced", 0.02, {"leak": -0.4}, 0.5),
    Cause("air in the oil, or a soft hose", "bleed it, and feel the hoses under pressure", 0.06, {"compliance": 0.4}),
    Cause("a stiffer hose, or less air", "look whether a hose or the oil was replaced", 0.03, {"compliance": -0.4}),
    Cause("the pump takes in air", "look at oil level, strainer and suction line", 0.02,
          {"displacement": -0.02, "compliance": 0.4}),
    Cause("another displacement or belt", "look whether a pump or a belt was replaced", 0.01, {"displacement": 0.01}),
    Cause("the relief valve opens earlier", "measure its pressure", 0.02, {"relief": -0.1}, 0.5),
    Cause("the relief valve opens later", "measure its pressure", 0.01, {"relief": 0.1}, 0.5),
    Cause("the drive reports too much torque", "compare the motor's current with its data sheet", 0.005,
          {"relief": 0.05, "leak": -0.05}, 0.2),
    Cause("the drive reports too little torque", "compare the motor's current with its data sheet", 0.005,
          {"relief": -0.05, "leak": 0.05}, 0.2),
)  # fmt: skip
"""What is known to happen; how often is a guess."""
UNEXPLAINED = {"leak": 0.03, "displacement": 0.002, "compliance": 0.06, "exponent": 0.01, "relief": 0.01}
"""Deviations of a change that needs no cause [1]."""
_AMOUNTS = np.linspace(0.025, 3.975, 80)  # of a usual amount
_WEIGHTS = np.exp(-0.5 * _AMOUNTS**2) / np.exp(-0.5 * _AMOUNTS**2).sum()


@dataclass(frozen=True)
class Suspected:
    """A cause and its probability [1]."""

    cause: Cause
    probability: float

    @property
    def text(self) -> str:
        """In a line."""
        return f"{100 * self.probability:.0f} %: {self.cause.words} ({self.cause.look})"


def suspected(changes: Mapping[str, tuple[float, float]], *, at_oil_change: bool = False) -> list[Suspected]:
    """The causes of some changes, the likeliest first.

    Args:
        changes: of levels, and their standard deviations, by name [1].

    Example:
        >>> [one.cause.words for one in suspected({"compliance": (0.5, 0.05), "leak": (0.0, 0.03)})][0]
        'air in the oil, or a soft hose'
    """
    names = [name for name in UNEXPLAINED if name in changes and all(map(math.isfinite, changes[name]))]
    seen = np.array([changes[name][0] for name in names])
    std = np.array([math.hypot(changes[name][1], UNEXPLAINED[name]) for name in names])
    odds = []
    for one in CAUSES:
        does = np.array([one.does.get(name, 0.0) for name in names])
        amounts, weights = (_AMOUNTS, _WEIGHTS) if does.any() else (np.zeros(1), np.ones(1))
        if one.does and not does.any():  # nothing of what it does was measured
            odds.append(0.0)
            continue
        off = ((seen - amounts[:, None] * does) / std) ** 2
        odds.append(
            one.prior * (one.by_oil_change if at_oil_change else 1.0) * float(weights @ np.exp(-0.5 * off.sum(axis=1)))
        )
    whole = sum(odds)
    if whole <= 0.0:  # no cause does that: all of them are as likely as before
        odds, whole = [one.prior for one in CAUSES], sum(one.prior for one in CAUSES)
    found = [Suspected(one, chance / whole) for one, chance in zip(CAUSES, odds, strict=True)]
    return sorted(found, key=lambda one: -one.probability)


HEADLINE = "leak"
"""The quantity that says how a machine is."""
SURE = 3.0
"""Deviations from which a change is one."""
_TOGETHER = 48  # series that are worked out at once


class State(Enum):
    """How a machine is; the value is what a reader sees."""

    PASSED = "limit passed"
    DATED = "wears"
    CHANGED = "changed"
    STEADY = "steady"
    UNKNOWN = "too little known"


@dataclass(frozen=True)
class History:
    """What a store has of a unit, in order of time."""

    kept: Kept
    records: Sequence[Record]
    events: Sequence[Event]


@dataclass(frozen=True)
class QuantityTrend:
    """A quantity over the records that say something of it."""

    followed: Followed  # what it is
    time: Array  # of these records [s since 1970]
    # value, std: what each log alone says [1]
    value: Array
    std: Array
    # level, level_std: of the smoothed trend [1]; of a factor its logarithm
    level: Array
    level_std: Array
    # now, now_std: level after the last record [1]
    now: float
    now_std: float
    # change, change_std: of the level since the first one [1]
    change: float
    change_std: float
    steps: tuple[Step, ...]  # with places in `time`
    odd: tuple[str, ...]  # records that are none of the trend's, by their files
    forecast: Forecast  # of the limit

    @property
    def figures(self) -> dict[str, object]:
        """For scripts: value and slope now [1, 1/year], the change since the first record, and the limit's date."""
        found = self.forecast
        return {
            "value": self.followed.value(self.now), "level": self.now, "level_std": self.now_std,
            "slope": found.slope, "slope_std": found.slope_std, "change": self.change, "change_std": self.change_std,
            "limit": self.followed.limit, "limit_passed": found.probability, "limit_low": found.low,
            "limit_date": found.middle, "limit_high": found.high, "reason": found.reason,
            "steps": [float(self.time[one.record]) for one in self.steps if not one.is_declared], "odd": self.odd,
        }  # fmt: skip


@dataclass(frozen=True)
class Assessed:
    """A unit's history, assessed."""

    history: History  # what it rests on
    quantities: Mapping[str, QuantityTrend]  # that are known, by name
    causes: tuple[Suspected, ...]  # of what has changed since the first record, the likeliest first
    sisters: Population | None = None  # the population of machines that are described alike; None if there is none
    among: Member | None = None  # its place among them

    @property
    def state(self) -> State:
        """How the machine is."""
        leak = self.quantities.get(HEADLINE)
        if leak is None:
            return State.UNKNOWN
        if leak.forecast.probability > 0.5:
            return State.PASSED
        if leak.forecast.is_dated:
            return State.DATED
        if any(abs(one.change) > SURE * one.change_std for one in self.quantities.values()):
            return State.CHANGED
        return State.STEADY if len(leak.time) > 1 else State.UNKNOWN

    @property
    def looks(self) -> list[str]:
        """Logs to look at, and why."""
        said = [f"{one.file}: {one.mistake}" for one in self.history.records if one.mistake]
        said += [f"{one.file}: {fault}" for one in self.history.records for fault in one.faults]
        for name, one in self.quantities.items():
            said += [f"{file}: its {name} is none of the trend's" for file in one.odd]
        return said

    @property
    def date_text(self) -> str:
        """When the leakage reaches its limit, or why no date is given."""
        leak = self.quantities.get(HEADLINE)
        return "no log says anything of the leakage" if leak is None else forecast_text(leak.forecast)


def forecast_text(forecast: Forecast) -> str:
    """A date with its interval, or why there is none."""
    if not forecast.is_dated:
        return forecast.reason
    since = "now, perhaps passed already" if math.isinf(forecast.low) else shown(forecast.low)
    return f"{shown(forecast.middle)} (90 %: {since} to {shown(forecast.high)})"


def assessed(histories: Sequence[History], limits: Mapping[str, float] | None = None) -> list[Assessed]:
    """Assess histories, and each among its sisters.

    Args:
        limits: of quantities, by name, over the description's [1].

    Raises:
        DescriptionError: there is no such quantity, or the limit is none.
    """
    followed = limited(limits)
    columns = [column for k, one in enumerate(histories) for column in _columns(k, one, followed)]
    # Those of a length together: shorter ones wait for longer ones, and those with a thermometer take twice as long.
    columns.sort(key=lambda one: (one.name == HEADLINE, len(one.time)))
    trends: dict[int, dict[str, QuantityTrend]] = {k: {} for k in range(len(histories))}
    for first in range(0, len(columns), _TOGETHER):
        part = columns[first : first + _TOGETHER]
        for column, found in zip(part, _trends(part), strict=True):
            trends[column.history][column.name] = found
    alone = []
    for k, one in enumerate(histories):
        known = {name: trends[k][name] for name in followed if name in trends[k]}
        changes = _changes(known)
        causes = suspected(changes, at_oil_change=_at_oil_change(one, known)) if changes else []
        alone.append(Assessed(one, known, tuple(causes)))
    return _with_sisters(alone)


@dataclass(frozen=True)
class _Column:
    """A quantity of one history."""

    history: int
    name: str
    followed: Followed
    time: Array
    value: Array
    std: Array
    warm: Array
    warm2: Array
    jumps: Array
    files: tuple[str, ...]


def _columns(k: int, history: History, followed: Mapping[str, Followed]) -> Iterator[_Column]:
    """The quantities that a history's records say something of."""
    usable = [one for one in history.records if not one.mistake]
    for name, what in followed.items():
        rows, files = [], []
        for one in usable:
            found = one.quantities[name].evidence if name in one.quantities else None
            if found is None or (what.is_factor and found[0] <= 0.0):
                continue
            warm = (one.leak_per_kelvin, one.leak_per_kelvin2) if name == HEADLINE else (0.0, 0.0)
            if all(map(math.isfinite, warm)):
                rows.append((one.begun, *found, *warm))
                files.append(one.file)
        if rows:
            time, value, std, first, second = np.array(rows).T
            jumps = np.zeros(len(time))
            for event in history.events:
                place = int(np.searchsorted(time, event.at))
                if 0 < place < len(time):
                    jumps[place] = 1.0
            yield _Column(k, name, what, time, value, std, first, second, jumps, tuple(files))


def _trends(columns: Sequence[_Column]) -> list[QuantityTrend]:
    """Their trends, worked out at once."""
    rows = max(len(one.time) for one in columns)

    def padded(parts: list[Array], fill: float | None) -> Array:
        """As columns of one length; the last row again where there is no filling."""
        return np.array(
            [np.append(one, np.full(rows - len(one), one[-1] if fill is None else fill)) for one in parts]
        ).T

    factor = [one.followed.is_factor for one in columns]
    levels = [np.log(one.value) if log else one.value for one, log in zip(columns, factor, strict=True)]
    stds = [one.std / one.value if log else one.std for one, log in zip(columns, factor, strict=True)]
    series = Series(
        padded([one.time for one in columns], None),
        padded(levels, math.nan),
        padded(stds, math.nan),
        padded([one.warm for one in columns], 0.0),
        padded([one.warm2 for one in columns], 0.0),
        padded([one.jumps for one in columns], 0.0) > 0.0,
    )
    found = explained(series)
    limits = np.array([_limit(one.followed) for one in columns])
    ways = np.array([one.followed.way for one in columns])
    counts = np.array([len(one.time) for one in columns])
    spans = np.array([one.time[-1] - one.time[0] for one in columns])
    dates = forecasts(found.trend, series.time[-1], counts, spans, limits, ways)
    return [_one(column, found, k, date) for k, (column, date) in enumerate(zip(columns, dates, strict=True))]


def _limit(followed: Followed) -> float:
    return math.nan if math.isnan(followed.limit) else followed.level(followed.limit)


def _one(column: _Column, found: Explained, k: int, date: Forecast) -> QuantityTrend:
    trend, rows = found.trend, len(column.time)
    mean, covariance, weight = trend.mean[:, :, k], trend.covariance[:, :, :, k], trend.weight[:, k]
    now, now_std = _mixed(mean[0], covariance[0, 0], weight)
    spread = covariance[0, 0] + covariance[3, 3] - 2.0 * covariance[0, 3]
    change, change_std = _mixed(mean[0] - mean[3], spread, weight)
    return QuantityTrend(
        column.followed, column.time, column.value, column.std, trend.level[:rows, k], trend.level_std[:rows, k],
        now, now_std, change, change_std, found.steps[k], tuple(column.files[row] for row in found.odd[k]), date,
    )  # fmt: skip


def _mixed(mean: Array, variance: Array, weight: Array) -> tuple[float, float]:
    """Mean and standard deviation over all kinds of trends."""
    middle = float(weight @ mean)
    return middle, math.sqrt(max(float(weight @ (variance + (mean - middle) ** 2)), 0.0))


def _changes(known: Mapping[str, QuantityTrend]) -> dict[str, tuple[float, float]]:
    return {name: (one.change, one.change_std) for name, one in known.items() if len(one.time) > 1}


def _at_oil_change(history: History, known: Mapping[str, QuantityTrend]) -> bool:
    """Whether most of the leakage's change came with an oil change."""
    leak = known.get(HEADLINE)
    if leak is None:
        return False
    stepped = 0.0
    for event in history.events:
        place = int(np.searchsorted(leak.time, event.at))
        if event.kind == "oil change" and 0 < place < len(leak.time):
            stepped += float(leak.level[place] - leak.level[place - 1])
    return stepped * leak.change > 0.5 * leak.change**2 > 0.0


def _with_sisters(alone: list[Assessed]) -> list[Assessed]:
    """Each among the machines that are described alike, by the level of their leakage."""
    groups: dict[str, list[int]] = {}
    for k, one in enumerate(alone):
        if HEADLINE in one.quantities:
            groups.setdefault(f"{one.history.kept.digest} {one.history.kept.key.unit}", []).append(k)
    found = list(alone)
    for members in groups.values():
        if len(members) > 1:
            leaks = [alone[k].quantities[HEADLINE] for k in members]
            together = population([one.now for one in leaks], [one.now_std for one in leaks])
            for k, member in zip(members, together.members, strict=True):
                one = alone[k]
                found[k] = Assessed(one.history, one.quantities, one.causes, together, member)
    return found
