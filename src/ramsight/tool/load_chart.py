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

import numpy as np

from ramsight.arrays import Array, Bools
from ramsight.machine.linkage import Linkage
from ramsight.plant.linkage import Mechanism
from ramsight.plant.linkage.members import Spot
from ramsight.tool.tool_place import place_at, tool_point
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


@dataclass(frozen=True, eq=False)
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
    reach: Array  # of the rows, increasing [m]
    moment: Array  # rated mass times reach [kg m]

    @classmethod
    def of(cls, linkage: Linkage) -> LoadChart | None:
        """The chart of a description; None if it has none."""
        stated = linkage.load_chart
        if stated is None:
            return None
        reach = np.array(stated.reach)
        about = (stated.about.x, stated.about.z)
        return cls(tool_point(linkage, stated.tool), about, reach, np.array(stated.rated) * reach)

    def shares(self, mechanism: Mechanism, positions: Array, inclination: float = 0.0) -> tuple[Array, Bools]:
        """Load moment of a kilogram over the rated one [1/kg], and where the chart has the reach; shape (samples,).

        Beyond the chart the rated moment is that at its end.

        Args:
            positions: of the cylinders [m], shape (samples, cylinders); NaN where unknown.
            inclination: of the machine, its front up [rad].
        """
        place = place_at(mechanism, self.point, positions)
        forward, up = place[:, 0] - self.about[0], place[:, 1] - self.about[1]
        reach = math.cos(inclination) * forward - math.sin(inclination) * up
        inside = (reach >= self.reach[0]) & (reach <= self.reach[-1])
        return reach / np.interp(reach, self.reach, self.moment), inside
