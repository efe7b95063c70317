"""A tolerance as text, ``"0.9 ± 0.02"`` or ``"± 5 % normal"``: how far from a value, and how often."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from ramsight import units
from ramsight.errors import DescriptionError
from ramsight.machine.declare import Quantity

DISTRIBUTIONS = ("uniform", "normal", "triangular", "log-normal")
#: a normal distribution is cut at so many standard deviations; its tolerance is two of them
CUT = 3.0

_TEXT = re.compile(r"(?P<centre>[^±]*)±\s*(?P<half>.*?)\s*(?P<distribution>uniform|normal|triangular|log-normal)?\s*")
_LONGEST = 200  # letters of a tolerance
_VALUE = re.compile(r"\s*[-+.0-9][^±]*±[^±]*")


@dataclass(frozen=True)
class Spread:
    """How a value is spread, in SI.

    Raises:
        DescriptionError: the tolerance has no meaning.
    """

    centre: float  # the value itself; of a log-normal one the median
    # half: the tolerance: half the width of what is uniform or triangular, two standard deviations of what is normal,
    # what two standard deviations upwards make of a log-normal value
    half: float
    distribution: str = "uniform"  # one of `DISTRIBUTIONS`
    # least, most: what physics allows; no value beyond is drawn
    least: float = -math.inf
    most: float = math.inf

    def __post_init__(self) -> None:
        if not (math.isfinite(self.half) and self.half > 0.0):
            raise DescriptionError("is no tolerance", value=self.half, allowed="more than 0")
        if self.distribution not in DISTRIBUTIONS:
            raise DescriptionError("unknown distribution", value=self.distribution, allowed=", ".join(DISTRIBUTIONS))
        if self.distribution == "log-normal" and not self.centre > 0.0:
            raise DescriptionError("only what is above 0 can be log-normal", value=self.centre, allowed="above 0")
        low, high = self.ends
        if not low < high:
            raise DescriptionError("leaves no value that could be", value=self.centre)

    @property
    def std(self) -> float:
        """Standard deviation before anything is cut off; of a log-normal value its logarithm's, times the centre."""
        if self.distribution == "log-normal":
            return self.centre * 0.5 * math.log1p(self.half / self.centre)
        return self.half / {"uniform": math.sqrt(3.0), "triangular": math.sqrt(6.0), "normal": 2.0}[self.distribution]

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value that is drawn."""
        if self.distribution == "log-normal":
            wide = CUT * self.std / self.centre
            low, high = self.centre * math.exp(-wide), self.centre * math.exp(wide)
        else:
            wide = CUT * self.std if self.distribution == "normal" else self.half
            low, high = self.centre - wide, self.centre + wide
        return max(low, self.least), min(high, self.most)


def has_spread(value: Any) -> bool:
    """Whether a value of a description is one with its tolerance, as ``"0.9 ± 0.02"``."""
    return isinstance(value, str) and _VALUE.fullmatch(value) is not None


def halves(text: str) -> tuple[str, str]:
    """A value with its tolerance taken apart.

    Example:
        >>> halves("0.9 ± 0.02 normal")
        ('0.9', '± 0.02 normal')
    """
    value, _, rest = text.partition("±")
    return value.strip(), f"± {rest.strip()}"


def read_spread(text: Any, declared: Quantity, centre: float | None) -> Spread:
    """Read a tolerance.

    Args:
        text: ``"± 0.02"``, ``"± 5 %"`` (of the value, unless the value itself is a share), perhaps with a value before
            it and a distribution behind it; without one the limits are all that is known, and it is uniform.
        centre: the value [SI]; None if the text has to have it.

    Raises:
        DescriptionError: it is none; the text states what is expected.

    Example:
        >>> from ramsight.machine.declare import quantity
        >>> round(read_spread("± 2 % normal", quantity("1", "efficiency", above=0.5, most=1), 0.9).half, 6)
        0.018
    """
    example = "'± 5 %', '± 0.02 normal'"
    match = _TEXT.fullmatch(text.strip()) if isinstance(text, str) and len(text) <= _LONGEST else None
    if match is None or not match["half"]:
        raise DescriptionError("is no tolerance", value=text, allowed=example)
    stated = match["centre"].strip()
    if stated:
        centre = units.parse(stated, declared.unit)
    if centre is None:
        raise DescriptionError("needs a value before its ±", value=text)
    share = match["half"].removesuffix("%").strip() if match["half"].endswith("%") and declared.unit != "%" else None
    try:
        if share is not None:
            half = abs(centre) * units.parse(share, "1") / 100.0
        else:
            unit = "delta_K" if units.name_of(declared.unit).startswith("a temperature") else declared.unit
            half = units.parse(match["half"], unit)
        bounds = ((declared.above, declared.least), (declared.below, declared.most))
        low, high = ([units.parse(one, declared.unit) for one in pair if one is not None] for pair in bounds)
        return Spread(
            centre, half, match["distribution"] or "uniform", max(low, default=-math.inf), min(high, default=math.inf)
        )
    except DescriptionError as error:
        raise DescriptionError(error.message, value=text, allowed=error.allowed or example) from None
