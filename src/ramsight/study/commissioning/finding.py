"""What a check of a commissioning found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """The verdict on a check, and on a commissioning as a whole."""

    PASSED = "passed"
    LOOK_TWICE = "look twice"
    FAILED = "failed"
    OPEN = "not judged"


@dataclass(frozen=True)
class Finding:
    """What a check found."""

    check: str  # what was looked at, for example ``leak test``
    verdict: Verdict  # on it
    found: str  # what was found, as a sentence
    remedy: str = ""  # what to do about it; "" if nothing

    @property
    def text(self) -> str:
        """The finding in one line."""
        line = f"{self.verdict.value:<10}  {self.check}: {self.found}"
        return f"{line}; {self.remedy}" if self.remedy else line
