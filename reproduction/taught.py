"""The self-calibrating sensor on a machine that it has come to know, and what it errs by then."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ramsight import simulate
from ramsight.plant.ddh import DdhUnit
from reproduction.bench import Bench

if TYPE_CHECKING:
    import xarray

VISITS = 4
"""End stops that it meets before the cycle that counts, the lower and the upper one in turn."""
START = 0.5
"""Share of the stroke at which that cycle begins, far from the stops."""


def taught_mm(bench: Bench, actual: DdhUnit, *, add: Callable[[xarray.Dataset], xarray.Dataset] | None = None) -> float:
    """Largest error of one cycle at the high load, after visits to the end stops [mm].

    The sensor knows the machine's data sheet alone; no switch and no start position.

    Args:
        bench: the unit as its data sheet has it.
        actual: as it was built.
        add: changes the log first, for example its temperature.
    """
    load = bench.loads["high"]
    duty = bench.cycle(load, of=actual, start=START, visits=VISITS)
    begins = duty.duration - bench.cycle(load, of=actual, start=START).duration
    tracked = bench.track(simulate(actual, duty), bench.sensors["kalman"], add=add, start_known=False)
    return float(1e3 * np.abs(tracked.error[tracked.time >= begins]).max())
