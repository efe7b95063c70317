"""A step's lines cut into functions of some hundred lines: compilers and checkers take too much of a long one.

What is done for each of several is a function as well, called once for each of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ramsight.deploy.c_lines import C_TYPES, Fork, Line, Value

LONGEST = 100
"""Statements of a function, nearly. What compilers and checkers do with a function grows faster than it, and what it
works with does not stay in registers: of 50 to 600, 100 gives the fastest steps, and shorter ones than 200."""


@dataclass(frozen=True)
class Piece:
    """A function."""

    name: str
    lines: tuple[Line, ...]  # in order
    each: bool  # whether it is called for each

    @property
    def given(self) -> dict[str, Value]:
        """Values that it declares, by name."""
        return {value.name: value for line in self.lines for value in line.gives}

    @property
    def kept_here(self) -> Iterator[Value]:
        """Values that it may give to others."""
        for line in self.lines:
            yield from line.gives if line.sets is None else (line.sets,)

    @property
    def needed(self) -> set[str]:
        """Values that it takes from others."""
        return {name for line in self.lines for name in line.needs} - self.given.keys()


@dataclass(frozen=True)
class Call:
    """A piece that is called."""

    piece: Piece

    @property
    def needs(self) -> frozenset[str]:
        """Names of the values that decide whether it is called: none."""
        return frozenset()

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """Its function."""
        return (self.piece,)


@dataclass(frozen=True)
class Case:
    """Calls that wait for a condition."""

    condition: str
    needs: frozenset[str]  # names of the values in it
    # then, otherwise: calls of either case
    then: tuple[Call, ...]
    otherwise: tuple[Call, ...]

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """Functions of both cases, in order."""
        return tuple(one.piece for one in (*self.then, *self.otherwise))


@dataclass(frozen=True)
class Part:
    """A part of the step."""

    name: str  # of the function that calls the others
    calls: tuple[Call | Case, ...]  # of its functions, in order

    def pieces(self) -> Iterator[Piece]:
        """Its functions, in order."""
        for call in self.calls:
            yield from call.pieces


def lives(
    used: Iterable[tuple[Iterable[str], Sequence[Piece]]], values: Mapping[str, Value]
) -> tuple[dict[str, int], dict[str, int]]:
    """Numbers of the uses that give a value first, and that need it last, by the name under which it is kept.

    Args:
        used: names of values that are needed beside, and functions, in order.
        values: of the step, by name.
    """
    first, last = dict[str, int](), dict[str, int]()
    for number, (needs, pieces) in enumerate(used):
        for piece in pieces:
            for value in piece.kept_here:
                first.setdefault(value.of, number)
        names = (*needs, *(name for piece in pieces for name in piece.needed))
        last |= {values[name].of: number for name in names}
    return first, last


def cut(name: str, items: Iterable[Line | Fork], longest: int = LONGEST) -> Part:
    """A part of the step in functions."""
    made = 0

    def calls(lines: Iterable[Line]) -> Iterator[Call]:
        nonlocal made
        for some in _runs(lines, longest):
            yield Call(Piece(f"{name}_{made}", tuple(some), some[0].each))
            made += 1

    found, waiting = list[Call | Case](), list[Line]()
    for item in items:
        line = _inline(item, longest // 2) if isinstance(item, Fork) else item
        if line is not None:
            waiting.append(line)
        elif isinstance(item, Fork):
            found += calls(waiting)
            waiting = []
            found.append(Case(item.condition, item.needs, tuple(calls(item.then)), tuple(calls(item.otherwise))))
    return Part(name, (*found, *calls(waiting)))


def _runs(lines: Iterable[Line], longest: int) -> Iterator[list[Line]]:
    """Lines of one function after the other."""
    run: list[Line] = []
    length = 0
    for line in lines:
        more = _length([line])
        if run and (line.each != run[0].each or length + more > longest):
            yield run
            run, length = [], 0
        run.append(line)
        length += more
    if run:
        yield run


def _length(lines: Iterable[Line]) -> int:
    """Lines of C that they become, nearly: what is set often is something that has to be taken first."""
    return sum(line.text.count("\n") + (1 if line.sets is None else 2) for line in lines)


def _inline(fork: Fork, most: int) -> Line | None:
    """A short fork as one line; None of one that is long or of each."""
    lines = (*fork.then, *fork.otherwise)
    if len(lines) > most or any(line.each or (line.sets and line.sets not in fork.chosen) for line in lines):
        return None
    inner = {value.name for line in lines for value in line.gives}
    needs = fork.needs.union(*(line.needs for line in lines)) - inner
    text = [f"{C_TYPES[value.kind]} {value.name};" for value in fork.chosen]
    text += [f"if ({fork.condition}) {{", *_indented(fork.then)]
    text += ["} else {", *_indented(fork.otherwise), "}"] if fork.otherwise else ["}"]
    return Line("\n".join(text), fork.chosen, frozenset(needs))


def _indented(lines: Iterable[Line]) -> Iterator[str]:
    for line in lines:
        yield f"  {line.sets.name} = {line.text};" if line.sets else f"  {line.text}"
