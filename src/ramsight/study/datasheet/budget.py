"""The error budget: Sobol's indices on runs of their own, and the linear budget beside them.

All machines of the budget do the same duty with the same noise, so that what differs between them is what they were
drawn from. The errors that count are those of every second after the third reference. An error beyond the 95 % error of
them all counts as that: of a sensor that has lost its way, which it says, the size of the error would drown the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ramsight.argument_kinds import whole_argument
from ramsight.arrays import Array
from ramsight.errors import DescriptionError
from ramsight.optional import needing
from ramsight.signals import Dataset
from ramsight.study.datasheet.cluster import run
from ramsight.study.datasheet.linear import Linear, linear_budget, nominal_run
from ramsight.study.datasheet.measuring import SETTLED, TAUGHT
from ramsight.study.datasheet.statistics import Indices, indices
from ramsight.study.datasheet.study_plan import Plan
from ramsight.study.datasheet.tracks_of_many import Run

_DAYS = 8  # days that are looked at for one with references enough
_EVERY = 1.0  # s, at which an error counts
_COUNTED = 0.95  # of the errors; the others count as the largest of these
_ENOUGH = 60  # moments of a day with references enough
_MOST_POINTS = 2**20  # base points


@dataclass(frozen=True)
class Budget:
    """The error budget of a study."""

    names: tuple[str, ...]  # of what varies
    linear: Linear  # what each quantity makes of the error by itself
    moments: int  # how many
    indices: Indices | None = None  # Sobol's, of the errors at the moments; None if there are only linear ones
    std: float = math.nan  # of the error over the machines of the indices, root of its mean square over the moments [m]
    limit: float = math.nan  # error that larger ones count as [m]
    failed: int = 0  # machines that could not be simulated, whose error counts as the mean of the others'

    @property
    def agreement(self) -> float:
        """Largest difference between a first-order index and the linear budget's share [1]."""
        if self.indices is None:
            return math.nan
        return float(np.abs(self.indices.first - self.linear.shares).max())

    def dataset(self) -> Dataset:
        """All of it over `quantity`: shares [1], and effects of one standard deviation [m]."""
        with needing("study"):
            import xarray

        shares = {"linear_share": self.linear.shares}
        if (found := self.indices) is not None:
            shares |= {"first": found.first, "first_half": found.first_half}
            shares |= {"total": found.total, "total_half": found.total_half}
        data: dict[str, Any] = {name: ("quantity", values, {"units": "1"}) for name, values in shares.items()}
        data["linear"] = ("quantity", self.linear.rms, {"units": "m"})
        attributes = {"kind": "error budget", "moments": self.moments}
        return xarray.Dataset(data, {"quantity": list(self.names)}, attributes)


def check_base(base: int) -> None:
    """Reject a number of base points that Sobol's indices cannot be made of.

    Args:
        base: how many; 0 for none.

    Raises:
        DescriptionError: it is no power of two, or too many.
    """
    whole_argument(base, "budget", 0, _MOST_POINTS)
    if base & (base - 1):
        raise DescriptionError("is no power of two", key="budget", value=base, allowed="0, 16, 32, 64, …")


def budget_plan(plan: Plan, base: int) -> Plan:
    """The runs that a budget of a study needs.

    Args:
        base: base points of the design, a power of two; runs are so many times the quantities and two.
    """
    common, found = 0, None
    for number in range(_DAYS):
        one = nominal_run(plan.bench, plan.quantities, number, plan.seed).run
        if found is None or len(one.visits) > len(found.visits):
            common, found = number, one
        if len(one.visits) > TAUGHT and len(_moments(one)) > _ENOUGH:
            break
    assert found is not None
    moments = tuple(round(float(moment), 3) for moment in _moments(found))
    count = base * (len(plan.quantities) + 2)
    return replace(plan, correlations=(), count=count, common=common, moments=moments, saltelli=base)


def budget(
    plan: Plan,
    base: int,
    path: Path | None,
    *,
    client: Any = None,
    threads: int | None = None,
    advance: Callable[[int], object] = lambda machines: None,
) -> Budget:
    """The error budget of a study; correlations are left out of it, because an index has a meaning without them.

    Args:
        base: as `budget_plan`'s; 0 for the linear budget alone.
        path: folder of its store; None keeps everything in memory.
    """
    own = budget_plan(plan, base)
    common, moments = own.common or 0, np.array(own.moments)
    linear = linear_budget(plan.bench, plan.quantities, moments, common, plan.seed)
    if base == 0:
        return Budget(plan.names, linear, len(moments))
    found = run(own, path, client=client, threads=threads, advance=advance)
    error = found["moment_error"].values
    bad = ~np.isfinite(error).all(axis=1)
    error = np.where(bad[:, None], error[~bad].mean(axis=0), error)
    limit = float(np.quantile(np.abs(error), _COUNTED))
    error = np.clip(error, -limit, limit)
    return Budget(
        names=plan.names,
        linear=linear,
        moments=len(moments),
        indices=indices(len(plan.quantities), error, plan.seed),
        std=float(np.sqrt(error.var(axis=0).mean())),
        limit=limit,
        failed=int(bad.sum()),
    )


def _moments(one: Run) -> Array:
    """Every second after the third reference; of a duty with fewer, after the last one; without any, all of it."""
    visits = one.visits
    after = visits[min(len(visits), TAUGHT) - 1] + SETTLED if len(visits) else 0.0
    return np.arange(np.ceil(after), one.time[-1], _EVERY)
