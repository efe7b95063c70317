"""The functions of a step as C.

What one gives to another is kept in a struct, `work`; what is of each of several, in an array of it. A function takes
what it needs out of it first, and puts into it last what others need.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ramsight.deploy.c_cut import Call, Case, Part, Piece
from ramsight.deploy.c_lines import C_TYPES, Value
from ramsight.deploy.c_places import Places


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
        parts: of the step.
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
    for piece in part.pieces():
        body = "\n".join(_body(piece, values, places))
        handed = _handed(body, known)
        texts.append(f"static void {piece.name}({', '.join(handed.values())}) {{\n{body}\n}}\n")
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
