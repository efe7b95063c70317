"""A data sheet held against what the position is required for."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from html import escape
from typing import Any

from ramsight.machine.requirement_description import Requirement
from ramsight.study.datasheet.sheet import Sheet


@dataclass(frozen=True)
class SheetRequirement:
    """What a data sheet achieves of a requirement.

    Attributes:
        asked: the requirement.
        error: that 95 % of all machines' errors are within, after most references [m]; NaN if nothing is known.
        ok: share of the time in which the status is ok [1].
        mending: what would make the error smaller, the most first.
    """

    asked: Requirement
    error: float
    ok: float
    mending: tuple[str, ...] = ()

    @property
    def missing(self) -> tuple[str, ...]:
        """What of the requirement is missed, a phrase each."""
        return self.asked.missed(self.error, self.ok)

    @property
    def is_met(self) -> bool:
        """Whether nothing is missing."""
        return not self.missing

    @property
    def text(self) -> str:
        """The verdict, and what would mend it, in a line."""
        asked = f"required {self.asked.text}: "
        if self.is_met:
            return f"{asked}achieved, {1e3 * self.error:.3g} mm, ok for {100 * self.ok:.0f} % of the time"
        mends = f"; what would mend it: {'; or '.join(self.mending)}" if self.mending else ""
        return f"{asked}missed, {', '.join(self.missing)}{mends}"

    @property
    def html(self) -> list[str]:
        """The same as a section of the sheet's page."""
        return ["<h2>Requirement</h2>", f"<p>{escape(self.text[0].upper() + self.text[1:])}.</p>"]

    @property
    def numbers(self) -> dict[str, Any]:
        """The same as entries of the sheet's file, in SI."""
        return {**asdict(self), "asked": self.asked.model_dump(), "is_met": self.is_met}


def required(sheet: Sheet, asked: Requirement, mending: list[str]) -> SheetRequirement:
    """Hold a sheet against a requirement.

    Args:
        sheet: the data sheet.
        asked: the requirement; the time from reference to reference is the study's.
        mending: what would make the error smaller, the most first.
    """
    return SheetRequirement(asked, sheet.best.quantiles[1].value, sheet.validity.get("ok", 0.0), tuple(mending))
