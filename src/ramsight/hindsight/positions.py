"""What is said of a position in hindsight: by the rules that the live sensor has, of the smoothed hypotheses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.expression import count, scalar, scalar_symbol
from ramsight.machine.assumption_description import AssumedIntegrity
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.unit import HydraulicUnit
from ramsight.sensor.belief.hypothesis import Hypothesis
from ramsight.sensor.belief.mixture import Mixture
from ramsight.sensor.belief.reach import Reach
from ramsight.sensor.circuit.unseen_load import UnseenLoad
from ramsight.sensor.covariance import Covariance
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.report.detectors import DETECTORS
from ramsight.sensor.report.stated import Beside, stated
from ramsight.sensor.report.status_rules import reference_due, too_uncertain
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import END_GIVES
from ramsight.sensor.virtual_sensor import BOUND, HIGHEST, LOWEST

_BESIDE = ("others", "unseen", "unseen_most", "offset", "width", "wrong")
ASIDE_SAID = (*_BESIDE, "status", "beneath")
"""What of a sample's trace is needed beside the hypotheses."""
_SAID = ("below", "above", "std", "bound", "due", "too_uncertain")
_AT_ONCE = 65536  # samples: what is worked out of them takes some megabytes
_LEAST = 1e-6  # of a probability whose moments are no differences of what is nearly alike
_RANK = {Status.OK: 0} | {one.status: k for k, one in enumerate(DETECTORS, start=1)}


@dataclass(frozen=True)
class Positions:
    """Positions of the hypotheses in some samples, by the whole log."""

    position: Array  # shape (samples, hypotheses) [m]
    variance: Array  # of these [m2]
    log_weight: Array  # of each hypothesis, shape (hypotheses,)

    @property
    def likeliest(self) -> Array:
        """Positions of the likeliest hypothesis [m]."""
        return self.position[:, int(np.argmax(self.log_weight))]

    @property
    def start(self) -> tuple[float, float]:
        """Position of the likeliest in the first sample, and its deviation [m]."""
        return float(self.likeliest[0]), math.sqrt(self.variance[0, int(np.argmax(self.log_weight))])

    @classmethod
    def within_cylinder(cls, position: Array, variance: Array, log_weight: Array, stroke: float) -> Positions:
        """What the cylinder leaves of each hypothesis: the whole of its way lies within it.

        If a way is elsewhere as a whole, it is so by some d ~ N(0, c^2), and c is at most the least deviation of
        its places. Given that it lies within the cylinder, d has the mean m and the variance v of a normal distribution
        that ends there: x + m, s^2 - (c^2 - v). What its lowest and highest places are uncertain by besides leaves it
        so much more room, as an end does that gives way.

        Args:
            position: shape (samples, hypotheses) [m]; is overwritten.
            variance: of these [m2]; is overwritten.
            stroke: of the cylinder [m].
        """
        for k in range(len(log_weight)):
            way, own = position[:, k], variance[:, k]
            low, high, c = int(np.argmin(way)), int(np.argmax(way)), math.sqrt(own.min())
            if c == 0.0:
                continue
            more = END_GIVES * stroke + math.sqrt(max(own[low], own[high]) - c**2)
            mean, left = truncated(-(way[low] + more) / c, (stroke + more - way[high]) / c)
            way += mean * c
            own -= (1.0 - left) * c**2
        np.maximum(variance, 0.0, out=variance)
        return cls(position, variance, log_weight)


def probabilities(log_weight: Array) -> Array:
    """Of hypotheses, by the logarithms of their weights.

    Example:
        >>> probabilities(np.log([1.0, 3.0])).tolist()
        [0.25, 0.75]
    """
    shares = np.exp(log_weight - log_weight.max())
    return np.asarray(shares / shares.sum())


def truncated(low: float, high: float) -> tuple[float, float]:
    """Mean and variance of a standard normal variable that is between two numbers.

    Where they leave nothing of it, it stays as it is: a way that is longer than the stroke says nothing.

    Source: Johnson, Kotz and Balakrishnan (1994), Continuous Univariate Distributions 1, section 13.10.1.

    Example:
        >>> [round(one, 3) for one in truncated(-1.0, 2.0)]
        [0.23, 0.52]
        >>> truncated(-40.0, 40.0)
        (0.0, 1.0)
    """
    share = 0.5 * (math.erf(high / math.sqrt(2.0)) - math.erf(low / math.sqrt(2.0)))
    if low >= high or share < _LEAST:
        return 0.0, 1.0
    at_low, at_high = (math.exp(-0.5 * one**2) / math.sqrt(2.0 * math.pi) for one in (low, high))
    mean = (at_low - at_high) / share
    return mean, 1.0 + (low * at_low - high * at_high) / share - mean**2


def said_of(positions: Positions, aside: Mapping[str, Array], unit: HydraulicUnit) -> dict[str, Array]:
    """Position, its deviation, band, bound and status of some samples, by the names of the sensor's outputs.

    Args:
        aside: what is traced beside the hypotheses, by the names in `ASIDE`.
    """
    stroke, k = float(unit.cylinder.stroke), len(positions.log_weight)
    shown = np.clip(positions.likeliest, 0.0, stroke)
    function, found = _function(k, stroke, unit.assumptions.integrity), np.empty((len(_SAID), len(shown)))
    for first in range(0, len(shown), _AT_ONCE):
        span = slice(first, first + _AT_ONCE)
        places = (positions.position[span] - shown[span, None]).T
        variances, count = np.minimum(positions.variance[span], stroke**2).T, places.shape[1]
        weights = np.repeat(positions.log_weight, count).reshape(-1, count)
        beside = np.stack([aside[name][span] for name in _BESIDE])
        found[:, span] = function(places, variances, weights, shown[None, span], beside)
    said = dict(zip(_SAID, found, strict=True))
    off = aside["offset"]
    return {
        "position": shown,
        "position_std": said["std"] + off,
        LOWEST: np.clip(shown - said["below"] - TWO_SIDED_95 * off, 0.0, stroke),
        HIGHEST: np.clip(shown + said["above"] + TWO_SIDED_95 * off, 0.0, stroke),
        BOUND: np.minimum(said["bound"] + off, stroke),
        "status": _status(aside["status"], said),
    }


def _status(sample: Array, said: Mapping[str, Array]) -> NDArray[np.int16]:
    """Of what is said of the sample and of the position, what weighs most."""
    rank = np.zeros(max(_RANK) + 1, dtype=np.int64)
    rank[[int(one) for one in _RANK]] = list(_RANK.values())
    status = sample.astype(np.int16)
    for name, other in (("due", Status.REFERENCE_DUE), ("too_uncertain", Status.TOO_UNCERTAIN)):
        weighs = (said[name] > 0.0) & (rank[int(other)] > rank[status])
        status = np.where(weighs, np.int16(other), status)
    return status


@lru_cache(maxsize=8)
def _function(hypotheses: int, stroke: float, integrity: AssumedIntegrity) -> ca.Function:
    """What is said, of columns: places over the one that is shown, variances, weights, that one, and what is beside."""
    places, variances, weights = (
        [scalar_symbol(f"{name}{k}") for k in range(hypotheses)] for name in ("place", "variance", "weight")
    )
    shown = scalar_symbol("shown")
    beside = {name: scalar_symbol(name) for name in _BESIDE}
    each = [
        Hypothesis(
            mean={Quantity.POSITION: place},
            covariance=Covariance({(Quantity.POSITION, Quantity.POSITION): variance}),
            log_weight=weight,
        )
        for place, variance, weight in zip(places, variances, weights, strict=True)
    ]
    widest = reduce(ca.fmax, variances)
    said = stated(
        Mixture.of(each, beside["wrong"]),
        beside["width"],
        Reach(-shown, stroke - shown, END_GIVES * stroke + ca.sqrt(widest)),
        Beside(beside["others"], UnseenLoad(beside["unseen"], beside["unseen_most"]), beside["offset"]),
        scalar(integrity.limit * stroke),
    )
    out = [said.below, said.above, said.std, said.bound]
    out += [count(reference_due(said, integrity, stroke)), count(too_uncertain(said, stroke))]
    inputs = [ca.vertcat(*one) for one in (places, variances, weights, [shown], list(beside.values()))]
    return ca.Function("said", inputs, [ca.vertcat(*out)])
