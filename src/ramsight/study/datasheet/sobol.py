"""Sobol's indices with their intervals, by SALib: which quantity causes how much of a variance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.optional import needs

_RESAMPLED = 200  # times, for the intervals
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Indices:
    """Shares of a variance, each of shape (quantities,) [1].

    Attributes:
        first: that a quantity causes by itself.
        first_half: half of the 95 % interval of that.
        total: that it takes part in.
        total_half: half of the 95 % interval of that.
        runs: that they rest on.
    """

    first: Array
    first_half: Array
    total: Array
    total_half: Array
    runs: int


def saltelli(dimensions: int, base: int, seed: int) -> Array:
    """The design for the indices, shape (base (dimensions + 2), dimensions), in the unit cube.

    Args:
        dimensions: how many quantities vary.
        base: number of base points, a power of two.
        seed: the same seed gives the same points.
    """
    sample = needs("SALib.sample.sobol", "study").sample
    return np.asarray(sample(_problem(dimensions), base, calc_second_order=False, seed=seed))


def indices(dimensions: int, values: Array, seed: int) -> Indices:
    """Indices of one outcome, or of several at once.

    Those of several are shares of the sum of their variances (generalised indices): what each outcome has for its own
    is weighted by its variance, and so are the halves of the intervals, which cannot be too narrow by that.

    Args:
        dimensions: how many quantities vary.
        values: at the points of `saltelli`, shape (points,) or (points, outcomes).
        seed: of the resampling that gives the intervals.

    Example:
        >>> import numpy as np
        >>> x = saltelli(2, 64, seed=1)
        >>> found = indices(2, 2.0 * x[:, 0] + x[:, 1], seed=1)
        >>> bool(abs(found.first[0] - 0.8) <= found.first_half[0])
        True
    """
    analyze = needs("SALib.analyze.sobol", "study").analyze
    several = values.reshape(len(values), -1)
    variance = several.var(axis=0)
    kept = np.flatnonzero(variance > 0.0)
    shares = variance[kept] / variance[kept].sum()
    summed = np.zeros((4, dimensions))
    for share, column in zip(shares, kept, strict=True):
        found = analyze(
            _problem(dimensions),
            several[:, column],
            calc_second_order=False,
            num_resamples=_RESAMPLED,
            conf_level=_CONFIDENCE,
            seed=seed,
        )
        summed += share * np.array([found[key] for key in ("S1", "S1_conf", "ST", "ST_conf")])
    return Indices(summed[0], summed[1], summed[2], summed[3], len(values))


def _problem(dimensions: int) -> dict[str, object]:
    return {"num_vars": dimensions, "names": [f"x{k}" for k in range(dimensions)], "bounds": [[0.0, 1.0]] * dimensions}
