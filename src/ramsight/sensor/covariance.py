"""The covariance of a few estimated quantities: a value whose operations give new ones."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TypeVar

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Condition, Flag, Real, Scalar, scalar
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import TINY

Pair = tuple[str, str]
K = TypeVar("K", bound=str)
_LARGEST = 1e30  # of a measurement that says nothing, in any unit: infinity times no gain is no number
_OF_MACHINE = frozenset(Quantity) - {Quantity.POSITION}


def _describes_machine(key: str) -> bool:
    """Whether an entry is of quantities of the machine alone, by its name."""
    return all(one in _OF_MACHINE for one in key.split(","))


def _is_diagonal(key: str) -> bool:
    """Whether an entry is a variance, by its name."""
    one, _, other = key.partition(",")
    return one == other


@dataclass(frozen=True)
class Covariance:
    """The symmetric covariance of some quantities; the first of them may move."""

    # entries: of the upper triangle, by pairs of quantities in their order
    entries: Mapping[Pair, Scalar] = leaf(
        "product", None, learned=_describes_machine, variance=_is_diagonal, inline=True
    )

    @classmethod
    def diagonal(cls, std: Mapping[K, float]) -> Covariance:
        """Of independent quantities with these standard deviations."""
        names = list(std)
        pairs = [(i, j) for k, i in enumerate(names) for j in names[k:]]
        return cls({(i, j): scalar(std[i] ** 2 if i == j else 0.0) for i, j in pairs})

    @property
    def quantities(self) -> list[str]:
        """Their names in order."""
        return [i for i, j in self.entries if i == j]

    def __getitem__(self, pair: Pair) -> Scalar:
        i, j = pair
        return self.entries[i, j] if (i, j) in self.entries else self.entries[j, i]

    def std(self, quantity: str) -> Scalar:
        """Standard deviation of a quantity."""
        return ca.sqrt(ca.fmax(self.entries[quantity, quantity], 0.0))

    def variance(self, H: Mapping[K, Real]) -> Real:
        """Variance of a measurement that is `H` times the quantities; those that are left out count 0."""
        return sum(H[i] * H[j] * self[i, j] for i in self._in(H) for j in self._in(H))

    def _in(self, H: Mapping[K, Real]) -> list[K]:
        """The quantities that a H has a derivative for, in order."""
        return sorted(H, key=self.quantities.index)

    def predicted(self, H: Mapping[K, Real], noise: Mapping[K, Real]) -> Covariance:
        """After the first quantity moved by a step: P <- F P F' + Q, F = [[1, r_1, ...], [0, I]]."""
        first, *others = self.quantities
        moved = {j: self[first, j] + sum(H[i] * self[i, j] for i in self._in(H)) for j in (first, *others)}
        entries = dict(self.entries)
        entries[first, first] = moved[first] + sum(H[j] * moved[j] for j in self._in(H))
        entries |= {(first, j): moved[j] for j in others}
        entries |= {(i, i): entries[i, i] + noise[i] for i in self._in(noise)}
        return Covariance(entries)

    def updated(
        self,
        H: Mapping[K, Real],
        innovation: Real,
        variance: Real,
        use: Condition,
        only: Collection[str] | None = None,
    ) -> tuple[Covariance, dict[str, Scalar]]:
        """After a measurement that is `H` times the quantities, and the correction of each.

        Args:
            use: whether there is one at this sample; corrections are 0 elsewhere.
            only: quantities that it may correct; by default all (Schmidt's filter: the others are considered).
        """
        corrected = self.quantities if only is None else [one for one in self.quantities if one in only]
        return self._corrected(dict(H.items()), innovation, variance, dict.fromkeys(corrected, use))

    def considered(
        self, H: Mapping[K, Real], innovation: Real, variance: Real, use: Mapping[K, Condition]
    ) -> tuple[Covariance, dict[str, Scalar]]:
        """After a measurement that corrects single quantities, each where its condition holds."""
        return self._corrected(dict(H.items()), innovation, variance, dict(use.items()))

    def _corrected(
        self, H: dict[str, Real], innovation: Real, variance: Real, use: dict[str, Condition]
    ) -> tuple[Covariance, dict[str, Scalar]]:
        cross = {i: sum((self[i, j] * H[j] for j in self._in(H)), scalar(0.0)) for i in self.quantities}
        total = sum(H[i] * cross[i] for i in self._in(H)) + variance
        gain = {i: ca.if_else(condition, cross[i] / total, 0.0) for i, condition in use.items() if i in cross}
        return self._joseph(H, cross, gain, variance), {i: by * innovation for i, by in gain.items()}

    def _joseph(
        self, H: dict[str, Real], cross: dict[str, Scalar], gain: dict[str, Scalar], variance: Real
    ) -> Covariance:
        """P <- A P A' + K R K' with A = I - K H, whatever the gain; what is small is a sum of what is small.

        P - K H P is the same, but where a measurement is far better than what is known it is the small difference of
        two large numbers, and floats make no covariance of it. Of a quantity i that is not in H, H i of A takes
        K_i times H x from x_i, and H x is the same for all of them: so most entries take two products more than in the
        short form.
        """
        known = self._in(H)
        off = {(i, k): (1.0 if i == k else 0.0) - gain[i] * H[k] for i in gain if i in known for k in known}
        half: dict[Pair, Scalar] = {}  # A P

        def in_half(i: str, j: str) -> Scalar:
            if (i, j) not in half:
                if i not in gain:
                    half[i, j] = self[i, j]
                elif i in known:
                    half[i, j] = sum((off[i, k] * self[k, j] for k in known), scalar(0.0))
                else:
                    half[i, j] = self[i, j] - gain[i] * cross[j]
            return half[i, j]

        finite = ca.fmin(variance, _LARGEST)
        noise = {i: finite * by for i, by in gain.items()}
        rest: dict[str, Scalar] = {}  # R K' - H P A', which is small

        def in_rest(j: str) -> Scalar:
            if j not in rest:
                rest[j] = noise.get(j, scalar(0.0)) - sum((H[k] * in_half(j, k) for k in known), scalar(0.0))
            return rest[j]

        entries = dict(self.entries)
        for pair in self.entries:
            i, j = sorted(pair, key=lambda one: (one not in gain, one in known))  # what is short comes first
            if i not in gain:
                continue
            if j not in gain:
                entries[pair] = in_half(i, j)
            elif i in known:
                entries[pair] = sum((off[i, k] * in_half(j, k) for k in known), noise[i] * gain[j])
            else:
                entries[pair] = in_half(j, i) + gain[i] * in_rest(j)
        return Covariance(entries)

    def grown(self, std: Real, given: Collection[K] = ()) -> Covariance:
        """The first quantity's standard deviation is larger by `std`, as a persistent error and not as noise.

        Errors of one kind add up, those of different kinds do not: what it is uncertain by other quantities counts as
        of another kind, P_11 - sum P_1i^2 / P_ii.
        """
        first = self.quantities[0]
        here = self.entries[first, first]
        by_others = sum(self[first, i] ** 2 / ca.fmax(self[i, i], TINY**2) for i in given)
        larger = here + std * (2.0 * ca.sqrt(ca.fmax(here - by_others, 0.0)) + std)
        return Covariance({**self.entries, (first, first): larger})

    def added(self, quantity: str, variance: Real) -> Covariance:
        """A quantity gains a variance that is independent of the others."""
        here = self.entries[quantity, quantity]
        return Covariance({**self.entries, (quantity, quantity): here + variance})

    def at_least(self, quantity: str, variance: Real) -> Covariance:
        """A quantity has at least this variance."""
        here = self.entries[quantity, quantity]
        return Covariance({**self.entries, (quantity, quantity): ca.fmax(here, variance)})

    def limited(self, std: Real, quantity: str) -> Covariance:
        """A quantity lies within a range: its H and column shrink together to this standard deviation."""
        here = self.entries[quantity, quantity]
        share = ca.fmin(1.0, std / ca.sqrt(ca.fmax(here, std * std)))
        entries = dict(self.entries)
        for i, j in self.entries:
            if quantity in (i, j):
                entries[i, j] = self.entries[i, j] * (share * share if i == j else share)
        return Covariance(entries)

    def independent(self, quantity: str, std: Real) -> Covariance:
        """A quantity that is unknown: this standard deviation, and no covariance with the others."""
        entries = dict(self.entries)
        for i, j in self.entries:
            if quantity in (i, j):
                entries[i, j] = scalar(0.0) + std * std if i == j else scalar(0.0)
        return Covariance(entries)

    def tied(self, quantity: str, std: Real, follows: Real) -> Covariance:
        """A quantity that is unknown, the first one depends on: P <- P + s^2 u u', u = (follows, ..., 1, ...)."""
        first, own = self.quantities[0], scalar(1.0) * std * std
        entries = dict(self.independent(quantity, std).entries)
        entries[first, first] = entries[first, first] + follows * follows * own
        entries[first, quantity] = follows * own
        return Covariance(entries)

    def closed(self) -> Covariance:
        """With variances that rounding has not made negative."""
        return Covariance({(i, j): ca.fmax(one, 0.0) if i == j else one for (i, j), one in self.entries.items()})


def where(condition: Flag, then: Covariance, otherwise: Covariance) -> Covariance:
    """One of two covariances of the same quantities."""
    return Covariance({pair: ca.if_else(condition, one, otherwise.entries[pair]) for pair, one in then.entries.items()})
