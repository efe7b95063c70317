"""Whether a mass may be used, as a number with words for C, FMUs and the bus."""

from __future__ import annotations

from enum import IntEnum

from ramsight.tool.lift_values import QUALITIES


class WeighedAs(IntEnum):
    """The quality of the last weighing; those of `Quality` have their places in `QUALITIES`.

    Example:
        >>> WeighedAs.SPILLED.text
        'spilled: the mass fell within the lift'
    """

    GOOD = 0
    TOO_SHORT = 1
    TOO_FAST = 2
    DIGGING = 3
    SPILLED = 4
    UNKNOWN_POSITION = 5
    NONE = 254

    @property
    def text(self) -> str:
        """The words for it."""
        return _OWN.get(self) or QUALITIES[self].value


_OWN = {
    WeighedAs.UNKNOWN_POSITION: "position not known: visit an end stop",  # there is no command line
    WeighedAs.NONE: "nothing was weighed yet",
}
assert [one.name for one in WeighedAs][:-1] == [one.name for one in QUALITIES], "a number for each quality"
