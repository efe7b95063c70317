"""Which machines are looked at: points of a cube, evenly spread, the same for the same seed, as values."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence

import numpy as np

from ramsight.arrays import Array
from ramsight.errors import DescriptionError
from ramsight.machine.spread import Spread
from ramsight.optional import needing
from ramsight.study.datasheet.quantities import Varied

METHODS = ("sobol", "latin-hypercube")
_INSIDE = 1e-12  # from the ends of (0, 1), where a normal distribution has no value


def points(method: str, count: int, dimensions: int, seed: int, first: int = 0) -> Array:
    """Points of the unit cube, shape (count, dimensions).

    Those of ``sobol`` (scrambled) are a sequence: more machines begin with the same ones, so that a study can be
    extended. A Latin hypercube is as many as it is made for.

    Args:
        first: number of the first one; of a Latin hypercube 0.

    Example:
        >>> both = points("sobol", 8, 3, seed=1)
        >>> bool((both[4:] == points("sobol", 4, 3, seed=1, first=4)).all())
        True
    """
    with needing("study"):
        from scipy.stats import qmc

    if dimensions == 0:
        return np.zeros((count, 0))
    if method == "latin-hypercube":
        return np.asarray(qmc.LatinHypercube(dimensions, rng=np.random.default_rng(seed)).random(count))
    sequence = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed))
    with warnings.catch_warnings():  # that a number which is no power of two is less even
        warnings.simplefilter("ignore", UserWarning)
        if first:
            sequence.fast_forward(first)
        return np.asarray(sequence.random(count))


def check_method(method: str) -> None:
    """Reject a design that is not there.

    Raises:
        DescriptionError: it is none.
    """
    if method not in METHODS:
        raise DescriptionError("no such design", key="method", value=method, allowed=", ".join(METHODS))


def correlation_of(quantities: Sequence[Varied], pairs: Mapping[str, float]) -> Array | None:
    """The matrix of correlations, shape (quantities, quantities); None where there is none.

    Args:
        pairs: by two names with a hyphen between; of pairs of which one does not vary nothing is left.

    Raises:
        DescriptionError: together they are no correlation matrix.
    """
    names = [one.name for one in quantities]
    matrix = np.eye(len(names))
    for pair, value in pairs.items():
        one, _, other = pair.partition("-")
        if one in names and other in names:
            i, j = names.index(one), names.index(other)
            matrix[i, j] = matrix[j, i] = value
    if np.array_equal(matrix, np.eye(len(names))):
        return None
    if np.linalg.eigvalsh(matrix)[0] <= 1e-9:
        shown = ", ".join(f"{pair} = {value:g}" for pair, value in pairs.items())
        text = "is no correlation matrix: no quantities can be correlated like that"
        raise DescriptionError(text, key="correlations", value=shown, allowed="positive definite")
    return matrix


def values_at(cube: Array, quantities: Sequence[Varied], correlation: Array | None) -> Array:
    """Values [SI] of points of the unit cube, shape (points, quantities); correlated by a Gaussian copula.

    Args:
        cube: shape (points, quantities).
    """
    if correlation is not None:
        with needing("study"):
            from scipy.special import ndtr, ndtri

        normal = ndtri(np.clip(cube, _INSIDE, 1.0 - _INSIDE)) @ np.linalg.cholesky(correlation).T
        cube = ndtr(normal)
    columns = [value_at(cube[:, k], one.spread) for k, one in enumerate(quantities)]
    return np.column_stack(columns) if columns else np.zeros((len(cube), 0))


def value_at(share: Array, spread: Spread) -> Array:
    """The value [SI] that so large a share of all is below: the inverse of the distribution, cut off where it ends.

    Example:
        >>> wide = Spread(1.0, 0.2, "triangular", least=0.9)
        >>> value_at(np.array([0.0, 1.0]), wide).round(6).tolist()
        [0.9, 1.2]
    """
    low, high = spread.ends
    if spread.distribution == "uniform":
        return np.asarray(low + share * (high - low))
    below, above = _share_below(np.array([low, high]), spread)
    inner = np.clip(below + share * (above - below), _INSIDE, 1.0 - _INSIDE)
    return np.clip(_inverse(inner, spread), low, high)


def _share_below(value: Array, spread: Spread) -> Array:
    with needing("study"):
        from scipy.special import ndtr

    if spread.distribution == "triangular":
        x = np.clip((value - spread.centre) / spread.half, -1.0, 1.0)
        return np.where(x < 0.0, 0.5 * (1.0 + x) ** 2, 1.0 - 0.5 * (1.0 - x) ** 2)
    if spread.distribution == "log-normal":
        return np.asarray(ndtr(np.log(value / spread.centre) / (spread.std / spread.centre)))
    return np.asarray(ndtr((value - spread.centre) / spread.std))


def _inverse(share: Array, spread: Spread) -> Array:
    with needing("study"):
        from scipy.special import ndtri

    if spread.distribution == "triangular":
        x = np.where(share < 0.5, np.sqrt(2.0 * share) - 1.0, 1.0 - np.sqrt(2.0 * (1.0 - share)))
        return np.asarray(spread.centre + spread.half * x)
    if spread.distribution == "log-normal":
        return np.asarray(spread.centre * np.exp(ndtri(share) * spread.std / spread.centre))
    return np.asarray(spread.centre + spread.std * ndtri(share))
