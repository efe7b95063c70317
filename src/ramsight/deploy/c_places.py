"""Where the values of a step are kept that one of its functions gives to another."""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ramsight.deploy.c_cut import Call, Case, Part, Piece
from ramsight.deploy.c_lines import C_TYPES, Value

Kind = tuple[bool, str]
"""Whether a value is of each, and its kind."""


@dataclass(frozen=True)
class Places:
    """Where values are kept that one function gives to another; those that are not needed at once share a place.

    A function takes what it needs before it keeps anything, so that what it is the last to need makes room for that.
    """

    slots: Mapping[str, str]  # by name, for example `reals[3]`
    sizes: Mapping[Kind, int]  # of the arrays

    @classmethod
    def of(cls, parts: Sequence[Part], values: Mapping[str, Value]) -> Places:
        """Places of a step's values.

        Args:
            parts: of the step, in order.
            values: of the step, by name.
        """
        first, last = _lives(parts, values)
        kinds: dict[str, Kind] = {value.of: (value.one is not None, value.kind) for value in values.values()}
        free: dict[Kind, list[int]] = defaultdict(list)
        sizes: dict[Kind, int] = defaultdict(int)
        ending: dict[int, list[tuple[Kind, int]]] = defaultdict(list)
        slots: dict[str, str] = {}
        done = -1
        for begin, name in sorted((first.get(name, -1), name) for name in last):
            for number in range(done, begin + 1):
                for kind, slot in ending.pop(number, ()):
                    heapq.heappush(free[kind], slot)
            done, kind = begin, kinds[name]
            if not free[kind]:
                heapq.heappush(free[kind], sizes[kind])
                sizes[kind] += 1
            slot = heapq.heappop(free[kind])
            slots[name] = f"{kind[1]}s[{slot}]"
            ending[last[name]].append((kind, slot))
        return cls(slots, dict(sizes))

    def members(self, *, each: bool) -> list[str]:
        """Members of the struct, or of that of each."""
        kinds = [(kind, size) for (of_each, kind), size in self.sizes.items() if of_each == each]
        return [f"{C_TYPES[kind]} {kind}s[{size}];" for kind, size in sorted(kinds, reverse=True)]

    def place(self, value: Value) -> str:
        """Where a value is kept, in a function."""
        slot = self.slots[value.of]
        if value.one is None:
            return f"w->{slot}"
        return f"one->{slot}" if value.one < 0 else f"w->each[{value.one}].{slot}"


def _lives(parts: Sequence[Part], values: Mapping[str, Value]) -> tuple[dict[str, int], dict[str, int]]:
    """Numbers of the functions that give a value first, and that need it last."""
    first, last = dict[str, int](), dict[str, int]()
    called = (found for part in parts for call in part.calls for found in _called(call))
    for number, (piece, conditions) in enumerate(called):
        for value in piece.kept_here:
            first.setdefault(value.of, number)
        last |= {values[name].of: number for name in (*conditions, *piece.needed)}
    return first, last


def _called(call: Call | Case) -> Iterator[tuple[Piece, frozenset[str]]]:
    """Functions in order, the first of a case with the values of its condition."""
    if isinstance(call, Call):
        yield call.piece, frozenset()
        return
    for k, one in enumerate((*call.then, *call.otherwise)):
        yield one.piece, call.needs if k == 0 else frozenset()
