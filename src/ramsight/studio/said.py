"""What a page says of a sensor: the words of its status, and how it is coloured. Only what is ok is green."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ramsight.sensor.status import VALIDITIES, Status
from ramsight.sensor.virtual_sensor import Estimate
from ramsight.tracking.comparing import ALERTS, Verdict

UNCHECKED, SILENT = "unchecked", "no report"
"""Words for a sensor that cannot know how wrong it is, and for one that has reported nothing."""
LEVELS = (*VALIDITIES, UNCHECKED, SILENT)
"""What a status may be coloured as."""
LETTERS = dict(zip(LEVELS, "OUNX?–", strict=True))
"""What stands for it where there is no room for words."""


@dataclass(frozen=True)
class Said:
    """A status for the eye."""

    text: str
    level: str  # of `LEVELS`; `unchecked` and `no report` are neutral


def of_estimate(estimate: Estimate | None) -> Said:
    """What is said of a virtual sensor.

    Args:
        estimate: the newest one; None if there is none.

    Example:
        >>> nan = math.nan
        >>> of_estimate(Estimate(0.1, nan, 0.0, nan, Status.OK)).text, of_estimate(None).text
        ('unchecked', 'no report')
        >>> of_estimate(Estimate(0.1, 1e-3, 0.0, nan, Status.OK))
        Said(text='ok', level='ok')
    """
    if estimate is None:
        return Said(SILENT, SILENT)
    if estimate.status is Status.OK and not math.isfinite(estimate.position_std):
        return Said(UNCHECKED, UNCHECKED)
    return Said(estimate.status.text, estimate.status.validity)


def of_verdict(verdict: Verdict | None) -> Said:
    """What is said of two sensors of one position.

    Args:
        verdict: of their comparison; None if there is none.

    Example:
        >>> of_verdict(Verdict.AGREE).level, of_verdict(Verdict.APART).level
        ('unchecked', 'invalid')
    """
    if verdict is None:
        return Said(SILENT, SILENT)
    return Said(verdict.text, "invalid" if verdict in ALERTS else UNCHECKED)
