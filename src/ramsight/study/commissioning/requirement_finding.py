"""A commissioning held against what the position is required for."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ramsight.machine.requirement_description import Requirement
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.tracking.requirement_check import require

if TYPE_CHECKING:
    import xarray

CHECK = "requirement"
UNSTATED = Finding(
    CHECK,
    Verdict.OPEN,
    "none is stated: the verdict says whether the sensor works as described, not whether that is good enough",
    'state one: --require "5 mm", or requirement.error of the unit',
)


def requirement(
    track: xarray.Dataset, asked: Requirement | None, stroke: float, mending: Callable[[], list[str]] = list
) -> Finding:
    """Whether the track achieves what the position is required for.

    Args:
        track: as `require` takes it.
        asked: the requirement; None if there is none.
        stroke: of the cylinder [m].
        mending: what else would make the error smaller, the most first; called where the requirement is missed.
    """
    if asked is None:
        return UNSTATED
    check = require(track, asked, stroke)
    if not check.is_met:
        ways = [check.remedy, *mending()] if check.samples and check.error > asked.error else ["visit the end stops"]
        found = f"missed: {', '.join(check.missing)}; {check.text}"
        return Finding(CHECK, Verdict.FAILED, found, "; or ".join(filter(None, ways)))
    if check.is_vague:
        remedy = "errors of one log prove less than the band: describe the machine as it is, or add a reference"
        return Finding(CHECK, Verdict.LOOK_TWICE, f"the band is wider than what is required: {check.text}", remedy)
    return Finding(CHECK, Verdict.PASSED, check.text)
