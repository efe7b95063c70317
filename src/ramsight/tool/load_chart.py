"""What may be lifted: the load moment of what is carried as a share of the rated one.

    u = m r / M(r),  M(r_k) = m_k r_k

r is the horizontal distance of the tool's point from the point that moments are about; gravity cancels. Between the
rows of a chart M is linear in r. A machine that tips has such a rated moment, of which its own arm takes a part that is
linear in r; linear masses would allow more than that. No chart says how well it is known: it is taken as it stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.expression import all_of, scalar, within
from ramsight.machine.linkage import Linkage
from ramsight.plant.linkage import Mechanism
from ramsight.plant.linkage.members import Spot
from ramsight.tool.tool_place import place_law, tool_point
from ramsight.tool.weighing_limits import EXCEEDED_FROM, NEAR_FROM


class LoadStatus(Enum):
    """Whether a lift exceeded the rated load, for the machine's own logic; the text says what it means."""

    WITHIN = "within: exceeded with a probability of less than 5 %"
    NEAR = "near: exceeded with a probability of 5 to 50 %"
    EXCEEDED = "exceeded with a probability of 50 % or more"
    UNKNOWN = "unknown: no good weighing, or a reach that the load chart does not have"


@dataclass(frozen=True)
class RatedLoad:
    """What a lift carried over what it may carry.

    Example:
        >>> RatedLoad.of(0.97, 0.02).status.name, round(RatedLoad.of(0.97, 0.02).exceeded, 3)
        ('NEAR', 0.067)
    """

    share: float = math.nan  # largest load moment of the lift over the rated one at the same reach [1]
    std: float = math.nan  # its standard deviation [1]
    exceeded: float = math.nan  # probability that the rated load was exceeded [1]
    status: LoadStatus = LoadStatus.UNKNOWN

    @classmethod
    def of(cls, share: float, std: float, *, covered: bool = True) -> RatedLoad:
        """By a normal error.

        Args:
            share: largest of the lift [1].
            std: its standard deviation [1].
            covered: whether the chart has all of the lift's reach: one that exceeded elsewhere did exceed.
        """
        exceeded = 0.5 * math.erfc((1.0 - share) / (math.sqrt(2.0) * std))
        if exceeded >= EXCEEDED_FROM:
            status = LoadStatus.EXCEEDED
        elif not covered:
            status = LoadStatus.UNKNOWN
        else:
            status = LoadStatus.WITHIN if exceeded < NEAR_FROM else LoadStatus.NEAR
        return cls(share, std, exceeded, status)


@dataclass(frozen=True)
class LoadChart:
    """A load chart as numbers.

    Example:
        >>> from ramsight import machine
        >>> from ramsight.plant.linkage import build_mechanism
        >>> spec = machine.load_machine("mining-loader").linkage
        >>> chart, loader = LoadChart.of(spec), build_mechanism(spec)
        >>> shares, inside = chart.shares(loader, np.array([[0.35, 0.25], [0.0, 0.0]]))
        >>> (7750.0 * shares).round(2).tolist(), inside.tolist()
        ([0.96, 0.94], [True, False])
    """

    point: Spot  # whose reach counts
    about: tuple[float, float]  # point of the frame that moments are about [m]
    reach: tuple[float, ...]  # of the rows, increasing [m]
    moment: tuple[float, ...]  # rated mass times reach [kg m]

    @classmethod
    def of(cls, linkage: Linkage) -> LoadChart | None:
        """The chart of a description; None if it has none."""
        stated = linkage.load_chart
        if stated is None:
            return None
        reach = tuple(map(float, stated.reach))
        about = (stated.about.x, stated.about.z)
        moment = tuple(mass * way for mass, way in zip(stated.rated, reach, strict=True))
        return cls(tool_point(linkage, stated.tool), about, reach, moment)

    def shares(self, mechanism: Mechanism, positions: Array, inclination: float = 0.0) -> tuple[Array, Bools]:
        """Load moment of a kilogram over the rated one [1/kg], and where the chart has the reach; shape (samples,).

        Beyond the chart the rated moment is that at its end.

        Args:
            positions: of the cylinders [m], shape (samples, cylinders); NaN where unknown.
            inclination: of the machine, its front up [rad].
        """
        tilt = np.full((1, len(positions)), inclination)
        found, inside = self.law(mechanism)(positions.T, tilt)
        return np.asarray(found.full()[0]), np.asarray(inside.full()[0] == 1.0)

    def law(self, mechanism: Mechanism) -> ca.Function:
        """Positions of the cylinders [m] and the slope [rad] to both, as a graph."""
        return _law(self, mechanism)


@lru_cache(maxsize=16)
def _law(chart: LoadChart, mechanism: Mechanism) -> ca.Function:
    x, slope = ca.SX.sym("x", len(mechanism.struts)), ca.SX.sym("slope")
    forward, up, _ = ca.vertsplit(place_law(mechanism, chart.point)(x))
    reach = ca.cos(slope) * (forward - chart.about[0]) - ca.sin(slope) * (up - chart.about[1])
    moment = scalar(chart.moment[0])
    rows = list(zip(chart.reach, chart.moment, strict=True))
    for (begin, lower), (end, upper) in pairwise(rows):
        moment += (upper - lower) / (end - begin) * (within(reach, begin, end) - begin)
    inside = all_of(reach >= chart.reach[0], reach <= chart.reach[-1])
    return ca.Function("moment", [x, slope], [reach / moment, inside])
