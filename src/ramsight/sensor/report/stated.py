"""What is said of a position by all hypotheses: band, bound, root mean square, and the chance of a large error."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.expression import Scalar, negated
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.belief.mixture import Mixture
from ramsight.sensor.belief.reach import Reach
from ramsight.sensor.circuit.unseen_load import UnseenLoad


@dataclass(frozen=True)
class Beside:
    """What is uncertain of a position beside what the hypotheses follow."""

    others: Scalar  # variance by stops, noise and oil that waits at a relief valve [m2]
    unseen: UnseenLoad  # by a load that changes unseen
    offset: Scalar  # how far the position that is shown may be from the estimate [m]


@dataclass(frozen=True)
class Stated:
    """What is said of a position."""

    # below, above: how far the truth is in 95 of 100 cases [m]
    below: Scalar
    above: Scalar
    overall: Scalar  # root mean square of the error over all hypotheses [m]
    settled: Scalar  # the same without a load that changes unseen [m]
    beyond: Scalar  # probability of an error above the limit; 0 where `settled` is above what is due
    bound: Scalar  # error that no more than `RISK` of the samples exceed [m]

    @property
    def std(self) -> Scalar:
        """Whose 1.96-fold is the band, to the wider side [m]."""
        return ca.fmax(self.below, self.above) / TWO_SIDED_95


def stated(together: Mixture, width: Scalar, reach: Reach, beside: Beside, limit: Scalar, due: Scalar) -> Stated:
    """What is said of a position.

    Args:
        width: factor of the filters' standard deviations by references [1].
        limit: of an error [m].
        due: standard deviation above which a reference is due, whatever the chance of a large error [m].
    """
    unseen = beside.unseen
    seen = unseen.std**2 + beside.others
    below, above = together.band(width, seen, reach)
    spread = ca.fmax(together.variance(reach), 0.0) + beside.others
    settled = ca.sqrt(spread)
    return Stated(
        below=below,
        above=above,
        overall=ca.sqrt(spread + unseen.std**2),
        settled=settled,
        beyond=together.beyond(limit, width, seen, reach, where=negated(settled > due)),
        bound=ca.sqrt(together.bound(width, beside.others) ** 2 + unseen.most**2),
    )
