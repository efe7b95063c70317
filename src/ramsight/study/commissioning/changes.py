"""What has changed of a machine since it was commissioned: then, now, and the change over its deviation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ramsight.normal import TWO_SIDED_95
from ramsight.study.commissioning.finding import Finding, Verdict
from ramsight.study.commissioning.kept_values import Kept, Measured

_SURE = 3.0
"""Deviations from which a change is one: of ten values, one in forty second commissionings has one by chance."""
_LEAST = 1e-6  # of a deviation, so that equal values of a file that was changed divide by something
_SAYS = {
    "leak": ("the pumps have worn, or the oil is thinner than described", "the pumps leak less: were they replaced?"),
    "displacement": ("more oil a turn: was a pump or a belt replaced?", "less oil a turn: look for air at the suction"),
    "stiffness": ("stiffer: was a hose or the oil replaced?", "softer: look for air in the oil, and at the hoses"),
    "compliance": ("softer: look for air in the oil, and at the hoses", "stiffer: was a hose or the oil replaced?"),
    "friction": ("look at seals and guides of the cylinder", "less friction: were seals replaced?"),
}
"""What more and less of a value means."""


@dataclass(frozen=True)
class Change:
    """One value then and now, over that of the description [1].

    Attributes:
        name: what it is.
        then, now: with their standard deviations.
    """

    name: str
    then: Measured
    now: Measured

    @property
    def change(self) -> float:
        """Now less then [1]."""
        return self.now.value - self.then.value

    @property
    def deviations(self) -> float:
        """The change over its standard deviation [1]."""
        return self.change / max(math.hypot(self.then.std, self.now.std), _LEAST)

    @property
    def is_sure(self) -> bool:
        """Whether it is more than chance."""
        return abs(self.deviations) > _SURE

    @property
    def cells(self) -> tuple[str, str, str, str, str]:
        """A row of the table."""
        then, now = (f"{one.value:.3f} ± {TWO_SIDED_95 * one.std:.3f}" for one in (self.then, self.now))
        return self.name, then, now, f"{self.change:+.3f}", f"{self.deviations:+.1f}"

    @property
    def says(self) -> str:
        """What the change means."""
        of = "leak" if self.name == "leak test" else self.name.rpartition(" ")[2]
        return _SAYS[of][0 if self.change > 0.0 else 1]


HEAD = ("over the description", "then", "now", "change", "over its deviation")


def changes(kept: Kept, now: Mapping[str, Measured]) -> tuple[Change, ...]:
    """What both commissionings measured."""
    return tuple(Change(name, then, now[name]) for name, then in kept.values.items() if name in now)


def changed(kept: Kept, found: Sequence[Change]) -> Finding:
    """Whether something has changed, as a finding."""
    if not found:
        remedy = "commission with a leak test, and with a measured position as before"
        return Finding("changes", Verdict.OPEN, f"nothing was measured both now and on {kept.made}", remedy)
    sure = [one for one in found if one.is_sure]
    if not sure:
        largest = max(found, key=lambda one: abs(one.deviations))
        said = f"the largest of {len(found)} is {largest.name}, {largest.deviations:+.1f} deviations"
        return Finding("changes", Verdict.PASSED, f"none since {kept.made}; {said}")
    said = ", ".join(f"{one.name} {100 * one.change:+.1f} % ({one.deviations:+.1f} deviations)" for one in sure)
    first = max(sure, key=lambda one: abs(one.deviations))
    return Finding("changes", Verdict.LOOK_TWICE, f"since {kept.made}: {said}", first.says)


def table_text(found: Sequence[Change]) -> str:
    """The changes as a table of text, "" if there are none."""
    if not found:
        return ""
    rows = [HEAD, *(one.cells for one in found)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(HEAD))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )
