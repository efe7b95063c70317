"""What is said of the clocks of a file with several: time stamps beside the others, and a clock that was set."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ramsight.errors import warn_of_log
from ramsight.logs.arrival import Arrival
from ramsight.logs.falls import Falls


def warn_of_clocks(
    file: str, times: Mapping[int, NDArray[np.float64]], came: Mapping[int, Arrival], names: Mapping[int, str]
) -> None:
    """Say of each group which time stamps stand beside the others, and of the file whether its clock was set.

    Args:
        file: the log.
        times: of each group [s].
        came: how the samples of each group came.
        names: of the groups.
    """
    for group, one in came.items():
        count = int(one.wild.sum())
        if count:
            first = int(np.argmax(one.wild))
            what = "1 time stamp is" if count == 1 else f"{count} time stamps are"
            more = "" if count == 1 else ", the first"
            warn_of_log(
                f"{what} not between those before and after{more} in sample {first + 1}:"
                f" {times[group][first]:.9g} s; the rest of the group is read as it is",
                file=file,
                column=names[group],
            )
    falls = Falls(file)
    for before, after in max((one.falls for one in came.values()), key=len, default=()):
        falls.count(before, after)
    falls.warn()
