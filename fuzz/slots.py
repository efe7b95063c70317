"""What becomes of two save slots: torn, erased, exchanged, of an earlier save, with values that cannot be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from harness import Rng
from mutate import mutated

Pair = tuple[bytes, bytes]

_EARLIER = 4  # saves; a memory that loses fewer of them in turn is not told from one that never had them
_IMPOSSIBLE = [float("nan"), float("inf"), -float("inf"), 1e300, -1e300, 1e31]


@dataclass(frozen=True)
class History:
    """What two slots held while a machine worked.

    Values are those that no state can have: with another one, and its checksum, it is another state.
    """

    pairs: Sequence[Pair]  # after each write, the first of them before all
    samples: Sequence[int]  # after which sample of the log each write came; -1 for the first
    # a slot with another value in one of its states, and the checksum that belongs to it
    sealed: Callable[[bytes, float, Rng], bytes]

    def cut(self, count: int, rng: Rng) -> tuple[int, int, Pair]:
        """Power lost at one of so many samples: the sample, the last write, and the slots; a write may be torn."""
        if rng.random() < 0.5 and len(self.samples) > 1:  # just when a slot is written
            write = int(rng.integers(1, len(self.samples)))
            return self.samples[write], write, self._torn(write, rng)
        sample = int(rng.integers(count))
        write = max(k for k, at in enumerate(self.samples) if at <= sample)
        return sample, write, self.pairs[write]

    def _torn(self, write: int, rng: Rng) -> Pair:
        """The slots when the power goes while one is written: as before, erased, in part, whole."""
        before, after = self.pairs[write - 1], self.pairs[write]
        old, new = b"".join(before), b"".join(after)
        where = int(rng.integers(len(new) + 1))
        torn = new[:where] + old[where:].ljust(len(new) - where, b"\xff")
        size = len(after[0])
        erased = tuple(b"\xff" * size if a != b else b for a, b in zip(before, after, strict=True))
        return (before, (torn[:size], torn[size:]), (erased[0], erased[1]), after)[int(rng.integers(4))]

    def damaged(self, write: int, pair: Pair, rng: Rng) -> Pair:
        """The slots with a damage; what they hold is that of a write."""
        kind, which = int(rng.integers(8)), int(rng.integers(2))
        slot, other = pair[which], pair[1 - which]
        if kind <= 2:
            slot = mutated(slot, rng)
        elif kind == 3:
            slot = bytes([int(rng.choice([0x00, 0xFF]))]) * len(slot)
        elif kind == 4:
            slot, other = other, slot
        elif kind == 5:
            slot = other
        elif kind == 6 and write > _EARLIER:
            slot = self.pairs[int(rng.integers(write - _EARLIER))][which]
        else:
            slot = self.sealed(slot, _IMPOSSIBLE[int(rng.integers(len(_IMPOSSIBLE)))], rng)
        return (slot, other) if which == 0 else (other, slot)
