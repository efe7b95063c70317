"""Quantiles, and shares of variance after Sobol, with their intervals: of errors at all times, and of machines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ramsight.arrays import Array
from ramsight.optional import needing, needs

_RESAMPLED = 400  # times, of the machines, for the interval of a quantile of errors
_TAIL = 0.025  # on each side of a 95 % interval
_MOST = 4000  # machines beyond which resampling takes a part of them, and the interval is scaled


@dataclass(frozen=True)
class Known:
    """A figure and its 95 % interval; NaN where it is not available."""

    value: float  # the figure
    # low, high: ends of the interval; the high one infinite where too few machines say anything of it
    low: float = np.nan
    high: float = np.nan


NOTHING = Known(np.nan)


def quantile_of_counts(counts: Array, edges: Array, share: float) -> float:
    """The value that a share of all counted is below; between the edges of a bin its logarithm runs straight.

    Args:
        counts: shape (bins,).
        edges: shape (bins + 1,); the first 0, the last infinite.
        share: 0 to 1.

    Example:
        >>> quantile_of_counts(np.array([0.0, 10.0, 0.0]), np.array([0.0, 1.0, 100.0, np.inf]), 0.5)
        10.0
    """
    below = np.cumsum(counts)
    if not below[-1] > 0.0:
        return float("nan")
    wanted = share * below[-1]
    k = int(np.searchsorted(below, wanted))
    before = below[k - 1] if k else 0.0
    inside = (wanted - before) / counts[k] if counts[k] > 0.0 else 1.0
    low, high = float(edges[k]), float(edges[k + 1])
    if low == 0.0 or np.isinf(high):
        return high if low == 0.0 else low
    return float(low * (high / low) ** inside)


def pooled_quantiles(counts: Array, edges: Array, shares: tuple[float, ...], seed: int) -> list[Known]:
    """Quantiles of the errors of all machines together, each machine for as long as it was looked at.

    The interval is that of the machines: they are drawn again many times, each with all its errors, because errors of
    one machine are alike.

    Args:
        counts: of errors, shape (machines, bins).
        edges: shape (bins + 1,).
    """
    held = counts[counts.sum(axis=1) > 0].astype(np.float64)
    if len(held) < 2:
        return [Known(quantile_of_counts(counts.sum(axis=0), edges, share)) for share in shares]
    random = np.random.default_rng(seed)
    part = held if len(held) <= _MOST else held[random.choice(len(held), _MOST, replace=False)]
    weights = random.multinomial(len(part), np.full(len(part), 1.0 / len(part)), size=_RESAMPLED)
    drawn = weights @ part
    found, narrower = [], np.sqrt(len(part) / len(held))
    for share in shares:
        value = quantile_of_counts(held.sum(axis=0), edges, share)
        several = np.array([quantile_of_counts(one, edges, share) for one in drawn])
        low, high = np.quantile(several, [_TAIL, 1.0 - _TAIL])
        found.append(Known(value, value - narrower * max(value - low, 0.0), value + narrower * max(high - value, 0.0)))
    return found


def quantile_of_machines(values: Array, share: float) -> Known:
    """What a share of the machines keeps within, with its distribution-free interval (order statistics).

    Args:
        values: one a machine, NaN where it has none.
        share: 0 to 1.

    Example:
        >>> quantile_of_machines(np.arange(1.0, 101.0), 0.5)
        Known(value=50.5, low=40.0, high=61.0)
    """
    with needing("study"):
        from scipy.stats import binom

    held = np.sort(values[np.isfinite(values)])
    n = len(held)
    if n == 0:
        return NOTHING
    lower, upper = int(binom.ppf(_TAIL, n, share)), int(binom.ppf(1.0 - _TAIL, n, share)) + 1
    low = float(held[lower - 1]) if lower >= 1 else -np.inf
    high = float(held[upper - 1]) if upper <= n else np.inf
    return Known(float(np.quantile(held, share)), low, high)


def share_of(count: int, total: int) -> Known:
    """A share and its interval (Clopper and Pearson, Biometrika 26, 1934).

    Example:
        >>> round(share_of(0, 100).high, 3)
        0.036
    """
    with needing("study"):
        from scipy.stats import beta

    if total == 0:
        return NOTHING
    low = 0.0 if count == 0 else float(beta.ppf(_TAIL, count, total - count + 1))
    high = 1.0 if count == total else float(beta.ppf(1.0 - _TAIL, count + 1, total - count))
    return Known(count / total, low, high)


def slope_of(x: Array, y: Array) -> Known:
    """Slope of the straight line through points, one a machine, with its interval."""
    held = np.isfinite(x) & np.isfinite(y)
    if held.sum() < 3 or np.ptp(x[held]) == 0.0:
        return NOTHING
    with needing("study"):
        from scipy.stats import linregress, t

    line = linregress(x[held], y[held])
    half = float(t.ppf(1.0 - _TAIL, held.sum() - 2) * line.stderr)
    return Known(float(line.slope), float(line.slope) - half, float(line.slope) + half)


_INTERVAL_SAMPLES = 200  # times, for the intervals
_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Indices:
    """Shares of a variance, each of shape (quantities,) [1]."""

    first: Array  # that a quantity causes by itself
    first_half: Array  # half of the 95 % interval of that
    total: Array  # that it takes part in
    total_half: Array  # half of the 95 % interval of that
    runs: int  # that they rest on


def saltelli(dimensions: int, base: int, seed: int) -> Array:
    """The design for the indices, shape (base (dimensions + 2), dimensions), in the unit cube.

    Args:
        base: number of base points, a power of two.
    """
    sample = needs("SALib.sample.sobol", "study").sample
    return np.asarray(sample(_problem(dimensions), base, calc_second_order=False, seed=seed))


def indices(dimensions: int, values: Array, seed: int) -> Indices:
    """Indices of one outcome, or of several at once.

    Those of several are shares of the sum of their variances (generalised indices): what each outcome has for its own
    is weighted by its variance, and so are the halves of the intervals, which cannot be too narrow by that.

    Args:
        values: at the points of `saltelli`, shape (points,) or (points, outcomes).

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
            num_resamples=_INTERVAL_SAMPLES,
            conf_level=_CONFIDENCE,
            seed=seed,
        )
        summed += share * np.array([found[key] for key in ("S1", "S1_conf", "ST", "ST_conf")])
    return Indices(summed[0], summed[1], summed[2], summed[3], len(values))


def _problem(dimensions: int) -> dict[str, object]:
    return {"num_vars": dimensions, "names": [f"x{k}" for k in range(dimensions)], "bounds": [[0.0, 1.0]] * dimensions}
