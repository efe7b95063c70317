"""Values of a step that a case leaves as they were: they keep their place, and nothing copies them.

A sensor's graph says of each state what a contact makes of it, `if_else(contact, new, old)`. Where neither case needs
the old value behind that, the chosen one is kept where the old one is: the case without a contact then does nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from ramsight.deploy.c_cut import Call, Case, Part, lives
from ramsight.deploy.c_lines import Line, Value


def staying(parts: Sequence[Part], values: Mapping[str, Value]) -> tuple[list[Part], dict[str, Value]]:
    """The parts without copies of what stays as it was, and their values, which tell where they are kept.

    Args:
        values: of the step, by name.
    """
    calls = [call for part in parts for call in part.calls]
    found = _Keeper(values, *lives(((call.needs, call.pieces) for call in calls), values))
    for number, call in enumerate(calls):
        if isinstance(call, Case):
            found.merge(number, call)
    placed = {name: found.placed(value) for name, value in values.items()}
    kept = [Part(part.name, tuple(one for call in part.calls for one in found.without(call))) for part in parts]
    return kept, placed


@dataclass
class _Keeper:
    """What is known of where values are kept."""

    values: Mapping[str, Value]
    # first, last: numbers of the calls that make what is kept under a name first, and that need it last
    first: dict[str, int]
    last: dict[str, int]
    instead: dict[str, str] = field(default_factory=dict)  # under which other name something is kept, by its own

    def of(self, value: Value) -> str:
        """The name under which a value is kept."""
        return self.instead.get(value.of, value.of)

    def placed(self, value: Value) -> Value:
        """A value with that name."""
        return replace(value, of=self.of(value))

    def merge(self, number: int, case: Case) -> None:
        """Keep what a case chooses where that is which it leaves as it was, if nothing needs that any more."""
        for stays, comes in ((case.otherwise, case.then), (case.then, case.otherwise)):
            for line in (line for one in stays for line in one.piece.lines):
                old, new = self.values.get(line.text), line.sets
                if old is None or new is None or (old.kind, old.one) != (new.kind, new.one) or new.of in self.instead:
                    continue
                kept = self.of(old)
                ends = self.first.get(kept, number) < number and self.last[kept] == number
                if ends and not self._needed_behind(comes, new, kept):
                    self.instead[new.of] = kept
                    self.last[kept] = self.last[new.of]

    def _needed_behind(self, comes: Sequence[Call], new: Value, kept: str) -> bool:
        """Whether a case needs what is kept under a name when it has already set the new value there."""
        is_set = False
        for piece in (one.piece for one in comes):
            here = False
            for line in piece.lines:
                if is_set and any(self.of(self.values[name]) == kept for name in line.needs):
                    return True
                here = here or line.sets == new
                is_set = is_set or here
            # Called for each, it has set what is of the first when it comes to the second.
            others = (self.values[name] for name in piece.needed)
            if here and piece.each and any(value.one != -1 and self.of(value) == kept for value in others):
                return True
        return False

    def without(self, call: Call | Case) -> Iterator[Call | Case]:
        """A call without lines that copy a value to where it is, or nothing if no other is in it."""
        if isinstance(call, Call):
            yield from self._rest([call])
            return
        then, otherwise = tuple(self._rest(call.then)), tuple(self._rest(call.otherwise))
        if then:
            yield replace(call, then=then, otherwise=otherwise)
        elif otherwise:
            yield Case(f"!{call.condition}", call.needs, otherwise, ())

    def _rest(self, calls: Sequence[Call]) -> Iterator[Call]:
        for call in calls:
            lines = tuple(self._line(line) for line in call.piece.lines if not self._copies(line))
            if lines:
                yield Call(replace(call.piece, lines=lines))

    def _copies(self, line: Line) -> bool:
        """Whether it would copy a value to where it is."""
        old = self.values.get(line.text)
        return (
            old is not None
            and line.sets is not None
            and line.sets.of in self.instead
            and self.of(line.sets) == self.of(old)
        )

    def _line(self, line: Line) -> Line:
        sets = None if line.sets is None else self.placed(line.sets)
        return replace(line, sets=sets, gives=tuple(map(self.placed, line.gives)))
