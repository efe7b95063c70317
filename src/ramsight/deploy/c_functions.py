"""The functions of a step as C.

What one gives to another is kept in a struct, `work`; what is of each of several, in an array of it. A function takes
what it needs out of it first, and puts into it last what others need.
"""

from __future__ import annotations

import heapq
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ramsight.deploy.c_cut import Call, Case, Part, Piece, lives
from ramsight.deploy.c_lines import C_TYPES, Value

MUCH = 4
"""Functions: a case that needs as many waits for an event, as a contact is, and is compiled to be short. Less, such as
what is said of a single hypothesis, is the case of many samples."""


@dataclass(frozen=True)
class Handed:
    """What a function may be handed a pointer to."""

    type: str  # that it points to
    where: str = r"\A(?!)"  # where a function's text needs it beside `NAME->`, a pattern


@dataclass(frozen=True)
class Functions:
    """The C of a step."""

    texts: Mapping[str, str]  # of its parts, by name: functions, of which the last calls the others
    headers: Sequence[str]  # declarations of those last ones
    calls: Sequence[str]  # of them, in order
    given: Mapping[str, str]  # where values are kept that no part works out, by name
    # work, each: members of the struct, and of that of each
    work: Sequence[str]
    each: Sequence[str]


def functions(parts: Sequence[Part], values: Mapping[str, Value], handed: Mapping[str, Handed]) -> Functions:
    """The C of a step's parts.

    Args:
        values: of it, by name.
        handed: what a function is handed a pointer to where its text has it, by name; `w` is the struct, `one` that of
            each.
    """
    places = Places.of(parts, values)
    written = [_part(part, values, places, handed) for part in parts]
    made = {value.of for part in parts for piece in part.pieces() for value in piece.kept_here}
    return Functions(
        texts={part.name: text for part, (text, _, _) in zip(parts, written, strict=True)},
        headers=[header for _, header, _ in written],
        calls=[call for _, _, call in written],
        given={name: slot for name, slot in places.slots.items() if name not in made},
        work=places.members(each=False),
        each=places.members(each=True),
    )


def _part(part: Part, values: Mapping[str, Value], places: Places, known: Mapping[str, Handed]) -> tuple[str, str, str]:
    """Text, declaration and call of a part."""
    texts, said, all_handed = list[str](), dict[str, str](), dict[str, str]()
    cases = [call.then for call in part.calls if isinstance(call, Case)]
    rare = {one.piece.name for then in cases if len(then) >= MUCH for one in then}
    for piece in part.pieces():
        body = "\n".join(_body(piece, values, places))
        handed = _handed(body, known)
        kind = "static RARELY void" if piece.name in rare else "static void"
        texts.append(f"{kind} {piece.name}({', '.join(handed.values())}) {{\n{body}\n}}\n")
        call = f"{piece.name}({', '.join('&w->each[k]' if name == 'one' else name for name in handed)});"
        said[piece.name] = f"for (int k = 0; k < EACH; k++) {call}" if piece.each else call
        for name, one in handed.items():
            if name != "one" and (name not in all_handed or not one.startswith("const ")):
                all_handed[name] = one
        if "one" in handed:
            all_handed["w"] = f"{known['w'].type} *w"
    all_handed.setdefault("w", f"const {known['w'].type} *w")
    all_handed = {name: all_handed[name] for name in known if name in all_handed}
    header = f"void {part.name}({', '.join(all_handed.values())})"
    lines = [line for call in part.calls for line in _called(call, said, values, places)]
    text = "\n".join([*texts, f"{header} {{", *(f"  {line}" for line in lines), "}", ""])
    return text, f"{header};", f"{part.name}({', '.join('&w' if name == 'w' else name for name in all_handed)});"


def _called(call: Call | Case, said: Mapping[str, str], values: Mapping[str, Value], places: Places) -> Iterator[str]:
    """Lines that call functions."""
    if isinstance(call, Call):
        yield said[call.piece.name]
        return
    condition = _replaced(call.condition, {name: places.place(values[name]) for name in call.needs})
    yield f"if ({condition}) {{"
    yield from (f"  {said[one.piece.name]}" for one in call.then)
    if call.otherwise:
        yield "} else {"
        yield from (f"  {said[one.piece.name]}" for one in call.otherwise)
    yield "}"


def _handed(body: str, known: Mapping[str, Handed]) -> dict[str, str]:
    """What a function is handed: declarations by name; what it does not change is constant."""
    found = {}
    for name, of in known.items():
        if re.search(rf"\b{name}->|{of.where}", body):
            changes = re.search(rf"^(.*[;)])? *{name}->[\w.\[\]]* = ", body, flags=re.MULTILINE)
            found[name] = f"{'' if changes else 'const '}{of.type} *{name}"
    return found


def _body(piece: Piece, values: Mapping[str, Value], places: Places) -> Iterator[str]:
    """Lines of a function: what it takes, what it does, what it keeps."""
    lines = piece.lines
    texts = [f"{places.place(line.sets)} = {line.text};" if line.sets else line.text for line in lines]
    words = Counter(word for text in texts for word in re.findall(r"\w+", text))
    # What is needed once is taken there, unless its place may have been given away by then.
    once = (
        {} if any(line.sets for line in lines) else {n: places.place(values[n]) for n in piece.needed if words[n] == 1}
    )
    for name in sorted(piece.needed - once.keys(), key=lambda name: (len(name), name)):
        yield f"  const {C_TYPES[values[name].kind]} {name} = {places.place(values[name])};"
    for text in texts:
        yield from (f"  {one}" for one in _replaced(text, once).split("\n"))
    for value in piece.given.values():
        if value.of in places.slots:
            yield f"  {places.place(value)} = {value.name};"


def _replaced(text: str, by: Mapping[str, str]) -> str:
    """A text with other names."""
    return re.sub(r"\w+", lambda word: by.get(word[0], word[0]), text)


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
            values: of the step, by name.
        """
        first, last = lives((found for part in parts for call in part.calls for found in _in_order(call)), values)
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


def _in_order(call: Call | Case) -> Iterator[tuple[frozenset[str], tuple[Piece]]]:
    """Functions in order, the first of a case with the values of its condition."""
    for k, piece in enumerate(call.pieces):
        yield call.needs if k == 0 else frozenset(), (piece,)
