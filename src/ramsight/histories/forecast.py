"""When a trend reaches its limit: a date with an interval, or a refusal that says why.

After the last record the level of each kind of trend is normal, and its variance grows with that of the slope. The
probability that the limit is passed at a time, over all kinds, is taken for the distribution of the date. A leak factor
may grow by the same amount in each month, or by the same share: a gap that widens steadily is between both. Nobody
knows which, so that both count as much.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import DescriptionError
from ramsight.histories.trend import KINDS, YEAR, Trend
from ramsight.normal import ONE_SIDED_95, upper_tail

LIMIT = 1.5
"""Of a factor over the data sheet's, from which a pump is worn, unless another one is asked for."""


@dataclass(frozen=True)
class Followed:
    """A quantity."""

    words: str  # what it is
    is_factor: bool = True  # whether it is over the description's, so that its logarithm is followed
    limit: float = math.nan  # beyond which something is to be done [1]; NaN if there is none unless it is asked for

    @property
    def way(self) -> float:
        """1 if the limit is above what a new machine has, -1 if it is below."""
        return -1.0 if self.limit < (1.0 if self.is_factor else 0.0) else 1.0

    def level(self, value: float) -> float:
        """The level of a value [1]."""
        return math.log(value) if self.is_factor else value

    def value(self, level: float) -> float:
        """The value of a level [1]."""
        return math.exp(level) if self.is_factor else level


FOLLOWED = {
    "leak": Followed("leakage of the pumps", limit=LIMIT),
    "displacement": Followed("oil that a turn moves"),
    "compliance": Followed("softness of oil and hoses"),
    "exponent": Followed("law of the leakage: 0 through gaps, 0.5 through edges", is_factor=False),
    "relief": Followed("torque at the relief valves"),
}
"""All of them, by the names of records."""
_LEAST, _MOST = 0.01, 100.0


def limited(limits: Mapping[str, float] | None) -> dict[str, Followed]:
    """What is followed, with other limits.

    Args:
        limits: by name, over the description's [1].

    Raises:
        DescriptionError: there is no such quantity, or the limit is none.
    """
    found = dict(FOLLOWED)
    for name, limit in (limits or {}).items():
        if name not in found:
            raise DescriptionError("is not followed", key="limit", value=name, allowed=", ".join(FOLLOWED))
        least = _LEAST if found[name].is_factor else -1.0
        if not (isinstance(limit, int | float) and least <= limit <= _MOST):
            raise DescriptionError(
                "is out of range", key=f"limit {name}", value=limit, allowed=f"{least:g} to {_MOST:g}"
            )
        found[name] = Followed(found[name].words, found[name].is_factor, float(limit))
    return found


QUANTILES = (0.05, 0.5, 0.95)
"""Of the date: the interval of 90 %, and its middle."""
HORIZON = 5.0
"""Years ahead in which a date is given; a planner has no use for a later one."""
FEWEST = 5
"""Records before which no trend is looked for."""
_GRID = np.concatenate([[0.0], np.geomspace(0.2 / 365.25, HORIZON, 250)])
_LONGEST_WAIT = 366.0  # d


@dataclass(frozen=True)
class Forecast:
    """When a level reaches its limit."""

    # low, middle, high: the interval of 90 % and its middle [s since 1970]; NaN where no date is given. `low` is
    # -infinity where the limit may be passed already.
    low: float
    middle: float
    high: float
    last: float  # time of the last record [s since 1970]
    probability: float  # that the limit is passed then [1]
    # slope, slope_std: of the level [1/year]
    slope: float
    slope_std: float
    reason: str = ""  # why there is no date; empty where there is one

    @property
    def dates(self) -> tuple[float, float, float]:
        """The interval and its middle [s since 1970]; from the last record on where it may be passed already."""
        return (self.last if self.low == -math.inf else self.low), self.middle, self.high

    @property
    def is_dated(self) -> bool:
        """Whether there is a date."""
        return not self.reason


def forecasts(found: Trend, times: Array, records: Array, spans: Array, limit: Array, way: Array) -> list[Forecast]:
    """The dates of some series.

    Args:
        times: of the last records [s since 1970].
        spans: time from the first to the last of these [s].
        limit: of each level [1]; NaN where there is none.
        way: 1 where the level reaches the limit from below, -1 from above.
    """
    return [
        _forecast(found, k, float(times[k]), int(records[k]), float(spans[k]), float(limit[k]), float(way[k]))
        for k in range(len(times))
    ]


def passed(found: Trend, k: int, limit: float, way: float, ahead: Array) -> Array:
    """Probability that the limit is passed, at times after the last record [1].

    Args:
        way: 1 from below, -1 from above.
        ahead: times [years].
    """
    mean, covariance, weight = found.mean[:, :, k], found.covariance[:, :, :, k], found.weight[:, k]
    ahead = ahead[:, None]
    walked = KINDS[:, 1] ** 2 * ahead + KINDS[:, 2] ** 2 * ahead**3 / 3.0
    chance = np.zeros(len(ahead))
    for gone, by_slope in _laws(mean[1], ahead):
        variance = covariance[0, 0] + 2.0 * by_slope * covariance[0, 1] + by_slope**2 * covariance[1, 1] + walked
        size = way * (limit - mean[0] - gone) / np.sqrt(np.maximum(variance, 1e-18))
        chance += 0.5 * upper_tail(size) @ weight
    return chance


def _laws(slope: Array, ahead: Array) -> Iterator[tuple[Array, Array]]:
    """How far a level goes from now on, and its derivative by the slope: as it does now, and as its factor does now."""
    yield slope * ahead, ahead + 0.0 * slope
    grown = np.maximum(1.0 + slope * ahead, 0.1)
    yield np.log(grown), ahead / grown


def _forecast(found: Trend, k: int, last: float, records: int, span: float, limit: float, way: float) -> Forecast:
    weight = found.weight[:, k]
    slope = float(weight @ found.mean[1, :, k])
    spread = found.covariance[1, 1, :, k] + (found.mean[1, :, k] - slope) ** 2
    std = math.sqrt(max(float(weight @ spread), 0.0))
    nowhere = (math.nan,) * 3
    if not math.isfinite(limit):
        return Forecast(*nowhere, last, math.nan, slope, std, "no limit is given")
    chance = np.maximum.accumulate(passed(found, k, limit, way, _GRID))
    now = float(chance[0])
    if records < FEWEST:
        return Forecast(*nowhere, last, now, slope, std, f"{records} records are too few; {FEWEST} are needed")
    if now > QUANTILES[1]:
        reason = f"the limit is passed already, with a probability of {100 * now:.0f} %"
        return Forecast(*nowhere, last, now, slope, std, reason)
    if chance[-1] < QUANTILES[2]:
        return Forecast(*nowhere, last, now, slope, std, _why(way * slope, std, span, float(chance[-1])))
    low, middle, high = (last + YEAR * float(np.interp(q, chance, _GRID)) for q in QUANTILES)
    low = -math.inf if now >= QUANTILES[0] else low
    return Forecast(low, middle, high, last, now, slope, std)


def _why(slope: float, std: float, span: float, chance: float) -> str:
    """Why no date is given, and how much longer to wait for one: the slope's deviation falls as span^-3/2."""
    if slope > ONE_SIDED_95 * std:
        if chance >= QUANTILES[1]:
            return f"too unsure for a date: the limit is passed within {HORIZON:.0f} years by {100 * chance:.0f} %"
        return f"the limit is more than {HORIZON:.0f} years away, with a probability of {100 * (1 - chance):.0f} %"
    days = span / 86400.0
    more = days * ((ONE_SIDED_95 * std / slope) ** (2.0 / 3.0) - 1.0) if slope > 0.0 else math.inf
    if more > _LONGEST_WAIT:
        return "no trend is visible"
    return f"no trend is visible yet: {max(math.ceil(more), 1)} more days like these would show one of this size"
