"""What an estimator does not know: the covariance of a few quantities, in entries that are states of a sensor."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import casadi as ca

from ramsight.sensor.virtual_sensor import SensorGraph


class Covariance:
    """The symmetric covariance of (position, factors ...), of which only the position moves.

    Args:
        graph: the sensor's graph; gains the upper entries as states ``covariance_ij``.
        std: standard deviations at the start.
        prefix: of the states' names.
    """

    def __init__(self, graph: SensorGraph, std: Sequence[float], prefix: str = "") -> None:
        self._graph, self._n, self._prefix = graph, len(std), prefix
        self._pairs = [(i, j) for i in range(self._n) for j in range(i, self._n)]
        self.entries = {
            (i, j): graph.state(f"{prefix}covariance_{i}{j}", std[i] ** 2 if i == j else 0.0) for i, j in self._pairs
        }

    def copy(self) -> Covariance:
        """The entries as they are now, which no state follows."""
        same = copy(self)
        same.entries = dict(self.entries)
        return same

    def __getitem__(self, pair: tuple[int, int]) -> Any:
        i, j = pair
        return self.entries[(i, j) if i <= j else (j, i)]

    def predict(self, row: Sequence[Any], noise: Sequence[Any]) -> None:
        """The position moves by a step with these derivatives; P <- F P F' + Q, F = [[1 + r_0, r_1, ...], [0, I]].

        Args:
            row: derivative of the step with respect to each quantity.
            noise: variance that each gains.
        """
        n = self._n
        old = dict(self.entries)
        full = [[old[(min(i, j), max(i, j))] for j in range(n)] for i in range(n)]
        moved = [full[0][j] + sum(row[i] * full[i][j] for i in range(n)) for j in range(n)]
        self.entries[0, 0] = moved[0] + sum(row[j] * moved[j] for j in range(n))
        for j in range(1, n):
            self.entries[0, j] = moved[j]
        for i in range(n):
            self.entries[i, i] += noise[i]

    def update(
        self, row: Sequence[Any], innovation: Any, variance: Any, use: Any, only: Sequence[int] | None = None
    ) -> list[Any]:
        """A measurement that is `row` times the quantities; what each is corrected by, 0 where `use` is false.

        Args:
            row: derivative of the measurement with respect to each quantity; a plain 0 costs nothing.
            innovation: the measurement less what it was expected to be.
            variance: of the measurement.
            use: whether there is one at this sample.
            only: the quantities that it may correct; by default all (Schmidt's filter: the others are considered).
        """
        n = self._n
        cross = [sum(self[i, j] * row[j] for j in range(n) if not _is_zero(row[j])) for i in range(n)]
        total = sum(row[i] * cross[i] for i in range(n) if not _is_zero(row[i])) + variance
        corrected = range(n) if only is None else only
        gain = [ca.if_else(use, c / total, 0.0) if i in corrected else 0.0 for i, c in enumerate(cross)]
        for i, j in self._pairs:
            if i in corrected or j in corrected:
                self.entries[i, j] = self.entries[i, j] - (gain[i] * cross[j] if i in corrected else cross[i] * gain[j])
        return [k * innovation for k in gain]

    def consider(self, row: Sequence[Any], innovation: Any, variance: Any, use: dict[int, Any]) -> list[Any]:
        """A measurement that corrects single quantities, each where its condition holds; the others are considered.

        Args:
            row: derivative of the measurement with respect to each quantity; a plain 0 costs nothing.
            innovation: the measurement less what it was expected to be.
            variance: of the measurement.
            use: by the place of a quantity, whether it is corrected.

        Returns:
            What each quantity is corrected by.
        """
        n = self._n
        cross = [sum(self[i, j] * row[j] for j in range(n) if not _is_zero(row[j])) for i in range(n)]
        total = sum(row[i] * cross[i] for i in range(n) if not _is_zero(row[i])) + variance
        gain = {i: ca.if_else(condition, cross[i] / total, 0.0) for i, condition in use.items()}
        for i, j in self._pairs:
            change = sum(gain[k] * cross[other] for k, other in ((i, j), (j, i)) if k in gain)
            if i in gain and j in gain:
                change = gain[i] * (2.0 * cross[i] - gain[i] * total) if i == j else change - gain[i] * gain[j] * total
            self.entries[i, j] = self.entries[i, j] - change
        return [gain[i] * innovation if i in gain else 0.0 for i in range(n)]

    def variance(self, row: Sequence[Any]) -> Any:
        """Variance of a measurement that is `row` times the quantities."""
        n = self._n
        places = [i for i in range(n) if not _is_zero(row[i])]
        return sum(row[i] * row[j] * self[i, j] for i in places for j in places)

    def grow(self, std: Any) -> None:
        """The position's standard deviation grows by `std` [m] as a whole, not as independent noise."""
        here = self.entries[0, 0]
        self.entries[0, 0] = here + std * (2.0 * ca.sqrt(ca.fmax(here, 0.0)) + std)

    def add(self, quantity: int, variance: Any) -> None:
        """A quantity gains a variance that has nothing to do with the others."""
        self.entries[quantity, quantity] = self.entries[quantity, quantity] + variance

    def raise_to(self, quantity: int, variance: Any) -> None:
        """A quantity is at least so uncertain."""
        here = self.entries[quantity, quantity]
        self.entries[quantity, quantity] = ca.fmax(here, variance)

    def limit(self, std: Any, quantity: int = 0) -> None:
        """A quantity is nowhere outside a range so wide: its row and column shrink to it together.

        Args:
            std: standard deviation of the range.
            quantity: by default the position.
        """
        here = self[quantity, quantity]
        share = ca.fmin(1.0, std / ca.sqrt(ca.fmax(here, std * std)))
        for i, j in self._pairs:
            if quantity in (i, j):
                self.entries[i, j] = self.entries[i, j] * (share * share if i == j else share)

    def replaced(self, by: Covariance, where: Any, std: Any = None) -> None:
        """Take the entries of another one where a condition holds; with `std`, for a position that is not known."""
        for i, j in self._pairs:
            entry = by[i, j]
            if std is not None and i == 0:
                entry = std * std if j == 0 else 0.0
            self.entries[i, j] = ca.if_else(where, entry, self.entries[i, j])

    def close(self) -> None:
        """Hand the entries back to the graph."""
        for pair in self._pairs:
            i, j = pair
            entry = ca.fmax(self.entries[pair], 0.0) if i == j else self.entries[pair]
            self._graph.becomes(f"{self._prefix}covariance_{i}{j}", entry)


def _is_zero(value: Any) -> bool:
    return isinstance(value, float | int) and value == 0
