"""What a unit's position is needed for: the error that it may have."""

from __future__ import annotations

import math
from typing import Annotated

from ramsight.machine.assumption_description import AssumedIntegrity
from ramsight.machine.base import Part
from ramsight.machine.declare import quantity
from ramsight.normal import TWO_SIDED_95

DAY = 86400.0
MOST = 0.5  # share of the stroke; of a standard deviation that says anything, and of an error that is accepted


class Requirement(Part):
    """What the position has to achieve; commissioning, data sheet and track are judged by it, and *ok* says it.

    Example:
        >>> Requirement(error=5e-3).text
        'within 5 mm (95 %)'
        >>> Requirement(error="5 mm", ok="80 %", visit_every="45 s").text
        'within 5 mm (95 %) for 45 s after a reference, and ok for 80 % of the time'
    """

    error: Annotated[
        float, quantity("mm", "that 95 % of the position's errors have to be within", least=0.1, most="10 m")
    ]
    ok: Annotated[float, quantity("%", "share of the time in which the status has to be ok", least=0, most=100)] = 0.0
    visit_every: Annotated[
        float, quantity("s", "time after a reference for which that is required", least=1, most="24 h")
    ] = DAY

    def integrity(self, assumed: AssumedIntegrity, stroke: float) -> AssumedIntegrity:
        """When a position is ok by this: its standard deviation is that of a normal error within it.

        The largest error that is accepted stays as many of those deviations as it is without a requirement. What the
        description states of both itself holds.

        Args:
            stroke: of the cylinder [m].

        Example:
            >>> found = Requirement(error="5 mm").integrity(AssumedIntegrity(), 0.5)
            >>> round(found.due, 5), round(found.limit, 4), found.risk
            (0.0051, 0.0255, 0.001)
        """
        due = min(self.error / TWO_SIDED_95 / stroke, MOST)
        stated = assumed.model_fields_set
        found = {"due": due, "limit": min(assumed.limit / assumed.due * due, MOST)} | assumed.model_dump(include=stated)
        return AssumedIntegrity.model_construct(_fields_set=stated, **{**assumed.model_dump(), **found})

    @property
    def text(self) -> str:
        """The requirement in words."""
        after = "" if self.visit_every >= DAY else f" for {self.visit_every:g} s after a reference"
        ok = "" if self.ok == 0.0 else f", and ok for {100 * self.ok:g} % of the time"
        return f"within {1e3 * self.error:g} mm (95 %){after}{ok}"

    def missed(self, error: float, ok: float) -> tuple[str, ...]:
        """What of it is missed, a phrase each.

        Args:
            error: that 95 % are within [m]; infinite or NaN where nobody knows a limit.
            ok: share of the time in which the status is ok [1].

        Example:
            >>> Requirement(error="5 mm", ok="80 %").missed(7.25e-3, 0.6)
            ('7.25 mm of 5 mm', 'ok for 60 % of 80 % of the time')
        """
        found = []
        if not error <= self.error:
            found.append(f"{shown_error(error)} of {shown_error(self.error)}")
        if ok < self.ok:
            found.append(f"ok for {100 * ok:.0f} % of {100 * self.ok:g} % of the time")
        return tuple(found)


def shown_error(error: float) -> str:
    """An error in millimetres, as verdicts write it; one without a limit [m] in words."""
    return "no known limit" if math.isinf(error) else f"{1e3 * error:.3g} mm"
