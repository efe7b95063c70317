"""What is said of a position in hindsight: by the rules that the live sensor has, of the smoothed hypotheses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight.arrays import Array
from ramsight.engine.recursion import Graph, Recursion, replay
from ramsight.expression import count, scalar
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
    """Positions of the hypotheses in some samples, by the whole log and by what the cylinder leaves of each.

    If a way is elsewhere as a whole, it is so by some d ~ N(0, c^2), and c is at most the least deviation of its
    places. Given that it lies within the cylinder, d has the mean m and the variance v of a normal distribution that
    ends there: x + m, s^2 - (c^2 - v). What its lowest and highest places are uncertain by besides leaves it so much
    more room, as an end does that gives way.
    """

    position: Array  # shape (samples, hypotheses), not yet within the cylinder [m]
    variance: Array  # of these [m2]
    log_weight: Array  # of each hypothesis, shape (hypotheses,)
    stroke: float  # of the cylinder [m]

    @cached_property
    def _within(self) -> tuple[Array, Array]:
        """By how much the cylinder moves the way of each hypothesis [m], and lessens its variance [m2]."""
        moves, lessens = np.zeros(len(self.log_weight)), np.zeros(len(self.log_weight))
        for k in range(len(self.log_weight)):
            way, own = self.position[:, k], self.variance[:, k]
            low, high, c = int(np.argmin(way)), int(np.argmax(way)), math.sqrt(own.min())
            if c > 0.0:
                more = END_GIVES * self.stroke + math.sqrt(max(own[low], own[high]) - c**2)
                mean, left = truncated(-(way[low] + more) / c, (self.stroke + more - way[high]) / c)
                moves[k], lessens[k] = mean * c, (1.0 - left) * c**2
        return moves, lessens

    def at(self, samples: slice | int) -> tuple[Array, Array]:
        """Positions and their variances under each hypothesis in some samples [m, m2]."""
        moves, lessens = self._within
        return self.position[samples] + moves, np.maximum(self.variance[samples] - lessens, 0.0)

    @property
    def likeliest(self) -> int:
        """Place of the likeliest hypothesis."""
        return int(np.argmax(self.log_weight))

    @property
    def start(self) -> tuple[float, float]:
        """Position of the likeliest in the first sample, and its deviation [m]."""
        position, variance = self.at(0)
        return float(position[self.likeliest]), math.sqrt(variance[self.likeliest])


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
    stroke, k = positions.stroke, len(positions.log_weight)
    shown, found = np.empty(len(positions.position)), np.empty((len(positions.position), len(_SAID)))
    said_by = _recursion(k, stroke, unit.assumptions.integrity)
    for first in range(0, len(shown), _AT_ONCE):
        span = slice(first, first + _AT_ONCE)
        places, variances = positions.at(span)
        shown[span] = np.clip(places[:, positions.likeliest], 0.0, stroke)
        beside = np.column_stack([shown[span], *(aside[name][span] for name in _BESIDE)])
        inputs = np.hstack([places - shown[span, None], np.minimum(variances, stroke**2), beside])
        found[span] = replay(said_by, inputs, positions.log_weight, np.empty(0))
    said = dict(zip(_SAID, found.T, strict=True))
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
def _recursion(hypotheses: int, stroke: float, integrity: AssumedIntegrity) -> Recursion:
    """What is said of a sample, by places over the one that is shown, variances, that one and what is beside it."""
    names = [f"{name}[{k}]" for name in ("place", "variance") for k in range(hypotheses)]
    inputs, parameters = (*names, "shown", *_BESIDE), tuple(f"log_weight[{k}]" for k in range(hypotheses))

    def drawn() -> Graph:
        u, p = ca.SX.sym("u", len(inputs)), ca.SX.sym("p", hypotheses)
        given, weights = dict(zip(inputs, ca.vertsplit(u), strict=True)), ca.vertsplit(p)
        variances = [given[f"variance[{k}]"] for k in range(hypotheses)]
        each = [
            Hypothesis(
                mean={Quantity.POSITION: given[f"place[{k}]"]},
                covariance=Covariance({(Quantity.POSITION, Quantity.POSITION): variances[k]}),
                log_weight=weights[k],
            )
            for k in range(hypotheses)
        ]
        shown, widest = given["shown"], reduce(ca.fmax, variances)
        said = stated(
            Mixture.of(each, given["wrong"]),
            given["width"],
            Reach(-shown, stroke - shown, END_GIVES * stroke + ca.sqrt(widest)),
            Beside(given["others"], UnseenLoad(given["unseen"], given["unseen_most"]), given["offset"]),
            scalar(integrity.limit * stroke),
            scalar(integrity.due * stroke),
        )
        due, uncertain = reference_due(said, integrity, stroke), too_uncertain(said, stroke)
        out = ca.vertcat(said.below, said.above, said.std, said.bound, count(due), count(uncertain))
        nothing = ca.SX(0, 1)
        return Graph(nothing, u, p, nothing, out)

    return Recursion((), inputs, parameters, _SAID, drawn)
