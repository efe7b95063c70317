"""How far measurements of the place were from what was expected, and what the log itself asks for in between.

The innovation nu of a measurement has the variance S, if the machine is the described one and changes as slowly as it
is assumed to. nu^2/S of n of them has the mean 1, and n times it the chi-square distribution with n degrees of freedom
(Bar-Shalom, Li and Kirubarajan, 2001, section 5.4.2).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ramsight.arrays import Array
from ramsight.normal import TWO_SIDED_95

NIS = "nis"
"""Squared innovation of a measurement of the place over its variance [1]; NaN where there was none."""
NAMED = 5
"""How many measurements that were not as expected are named by their time."""
UNEXPECTED = 9.0
"""Squared innovation over its variance that is not expected [1]: three standard deviations, one of 370."""


@dataclass(frozen=True)
class Innovation:
    """A measurement of the place, or where the piston was put back into the cylinder."""

    sample: int  # its place in the log
    time: float  # of it [s]
    normal: float  # nu^2/S [1]; NaN where the piston was put back
    moved: float  # by how much the position was moved [m]
    accepted: bool  # whether it was

    @property
    def excess(self) -> float:
        """By how much nu^2 is larger than S [m2]."""
        if not self.accepted:
            return 0.0
        return self.moved**2 * (1.0 if math.isnan(self.normal) else max(1.0 - 1.0 / max(self.normal, 1.0), 0.0))


@dataclass
class Innovations:
    """Of a log, as they come."""

    all: list[Innovation] = field(default_factory=list)  # in order
    by_start: int = 0  # how many samples there are until a place is measured, if a start was entered

    def append(self, first: int, time: Array, aside: Mapping[str, Array]) -> None:
        """Take those of consecutive samples.

        Args:
            time: of the samples [s].
        """
        self.by_start += int((aside["by_start"] > 0.0).sum())
        names = ("accepted", "rejected", "put_back", "normal", "moved")
        accepted, rejected, put_back, normal, moved = (aside[name] for name in names)
        measured = (accepted > 0.0) | (rejected > 0.0)
        for k in np.flatnonzero(measured | (put_back != 0.0)).tolist():
            where, when = first + k, float(time[k])
            if measured[k]:
                self.all.append(Innovation(where, when, float(normal[k]), float(moved[k]), bool(accepted[k] > 0.0)))
            else:
                self.all.append(Innovation(where, when, math.nan, float(put_back[k]), accepted=True))

    @property
    def measured(self) -> list[Innovation]:
        """The measurements."""
        return [one for one in self.all if not math.isnan(one.normal)]

    def column(self, samples: int) -> Array:
        """nu^2/S by sample [1], NaN where nothing was measured."""
        found = np.full(samples, math.nan)
        for one in self.measured:
            found[one.sample] = one.normal
        return found

    @property
    def text(self) -> str:
        """A line on whether the log is one of the described machine; empty where nothing was measured."""
        used = [one.normal for one in self.measured if one.accepted]
        if not used:
            return ""
        low, high = mean_range(len(used))
        line = (
            f"{len(used)} measurements of the place: normalised innovation squared {np.mean(used):.2g} on average "
            f"({low:.2g} to {high:.2g} in 95 of 100 logs of the described machine)"
        )
        odd = [f"{one.time:.0f} s" for one in self.measured if one.normal > UNEXPECTED or not one.accepted]
        named = ", ".join(odd[:NAMED]) + (f" and {len(odd) - NAMED} times more" if len(odd) > NAMED else "")
        return f"{line}; not as expected at {named}" if odd else line

    def unknown(self, position: Array) -> Array:
        """Variance of the position by what changed unknown since it was measured last [m2], shape (samples, 2).

        A position that was off by nu where S was expected has walked by nu^2 - S more than was assumed: as much of it
        as of the way has been gone. One by an entered start was off by that from the first sample on.

        Args:
            position: of the live sensor, by sample [m]; for the way alone.

        Returns:
            Before a measurement in that sample, and after it.
        """
        found = np.zeros((len(position), 2))
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.nan_to_num(np.diff(position))))])
        before = 0
        for one in self.all:
            if not one.accepted:
                continue
            whole = way[one.sample] - way[before]
            if one.sample < self.by_start:
                found[: one.sample + 1, 0] += one.excess
                found[: one.sample, 1] += one.excess
            elif one.excess > 0.0 and whole > 0.0:
                share = (way[before : one.sample + 1] - way[before]) / whole
                found[before + 1 : one.sample + 1, 0] = one.excess * share[1:]
                found[before : one.sample, 1] = one.excess * share[:-1]
            before = one.sample
        return found


def mean_range(n: int) -> tuple[float, float]:
    """Between what the mean of n squares of standard normal variables is in 95 of 100 cases.

    Source: Wilson and Hilferty (1931), The distribution of chi-square, PNAS 17, 684.

    Example:
        >>> [round(one, 2) for one in mean_range(10)]
        [0.32, 2.05]
    """
    spread = 2.0 / (9.0 * n)
    low, high = (max(1.0 - spread + way * TWO_SIDED_95 * math.sqrt(spread), 0.0) ** 3 for way in (-1.0, 1.0))
    return low, high
