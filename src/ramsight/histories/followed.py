"""What a history follows of a machine, in words that a fitter uses, and the limit of each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ramsight.errors import DescriptionError
from ramsight.histories.forecast import LIMIT


@dataclass(frozen=True)
class Followed:
    """A quantity."""

    words: str  # what it is
    is_factor: bool = True  # whether it is over the description's, so that its logarithm is followed
    limit: float = math.nan  # beyond which something is to be done [1]; NaN if there is none unless it is asked for

    @property
    def way(self) -> float:
        """1 if the limit is above what a new machine has, -1 if it is below."""
        return -1.0 if self.limit < (1.0 if self.is_factor else 0.0) else 1.0

    def level(self, value: float) -> float:
        """The level of a value [1]."""
        return math.log(value) if self.is_factor else value

    def value(self, level: float) -> float:
        """The value of a level [1]."""
        return math.exp(level) if self.is_factor else level


FOLLOWED = {
    "leak": Followed("leakage of the pumps", limit=LIMIT),
    "displacement": Followed("oil that a turn moves"),
    "compliance": Followed("softness of oil and hoses"),
    "exponent": Followed("law of the leakage: 0 through gaps, 0.5 through edges", is_factor=False),
    "relief": Followed("torque at the relief valves"),
}
"""All of them, by the names of records."""
_LEAST, _MOST = 0.01, 100.0


def limited(limits: Mapping[str, float] | None) -> dict[str, Followed]:
    """What is followed, with other limits.

    Args:
        limits: by name, over the description's [1].

    Raises:
        DescriptionError: there is no such quantity, or the limit is none.
    """
    found = dict(FOLLOWED)
    for name, limit in (limits or {}).items():
        if name not in found:
            raise DescriptionError("is not followed", key="limit", value=name, allowed=", ".join(FOLLOWED))
        least = _LEAST if found[name].is_factor else -1.0
        if not (isinstance(limit, int | float) and least <= limit <= _MOST):
            raise DescriptionError(
                "is out of range", key=f"limit {name}", value=limit, allowed=f"{least:g} to {_MOST:g}"
            )
        found[name] = Followed(found[name].words, found[name].is_factor, float(limit))
    return found
