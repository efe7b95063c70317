"""The lines of a step's C, each with the values that it gives and needs: what can be cut into functions."""

from __future__ import annotations

import heapq
import re
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca

from ramsight.deploy.c_alike import GATHER, TAKE, Collapsed
from ramsight.deploy.c_function import Dialect, Term, as_kind, moved_inputs, truth, written_if
from ramsight.engine.branches import Branch, schedule

C_TYPES = {"real": "real", "wide": "wide", "flag": "int"}
"""C types of the kinds of values."""
_GIVEN = re.compile(r"[ux]_\w+")  # inputs and relative times, which the step works out first
_WITHOUT_LINE = (ca.OP_INPUT, ca.OP_CONST, TAKE)


@dataclass(frozen=True)
class Value:
    """A value of the step."""

    name: str  # in C
    kind: str  # `real`, `wide` or `flag`
    of: str  # the name under which it is kept; of what is taken of one, the name of each
    # the number of the one that it is of; None of what all have in common, -1 of a value of each
    one: int | None = None


@dataclass(frozen=True)
class Line:
    """A statement."""

    text: str  # of one that sets a value that is kept, the expression
    gives: tuple[Value, ...] = ()  # values that it declares
    needs: frozenset[str] = frozenset()  # names of the values that it needs
    each: bool = False  # whether it is one of each
    sets: Value | None = None  # the value that is kept, which it sets

    @property
    def lines(self) -> tuple[Line, ...]:
        """It alone."""
        return (self,)

    def reduced(self, taken: Collection[str]) -> Line | None:
        """The same; None if it gives or sets something, and nothing of that is taken."""
        gives = self.gives if self.sets is None else (self.sets,)
        return self if not gives or any(value.of in taken for value in gives) else None


@dataclass(frozen=True)
class Fork:
    """Lines that wait for a condition."""

    condition: str
    needs: frozenset[str]  # names of the values in it
    # then, otherwise: lines of either case; the last set what is chosen
    then: tuple[Line, ...]
    otherwise: tuple[Line, ...] = ()
    chosen: tuple[Value, ...] = ()

    @property
    def lines(self) -> tuple[Line, ...]:
        """Those of both cases."""
        return (*self.then, *self.otherwise)

    def reduced(self, taken: Collection[str]) -> Fork | None:
        """The same without lines of which nothing is taken; None if none is left."""
        then, otherwise = (
            tuple(line for line in case if line.reduced(taken) is not None) for case in (self.then, self.otherwise)
        )
        chosen = tuple(value for value in self.chosen if value.of in taken)
        return replace(self, then=then, otherwise=otherwise, chosen=chosen) if then or otherwise else None


@dataclass
class Scribe:
    """Writes the operations of a step as lines."""

    step: Collapsed  # its operations
    read: Callable[[int, int], Term]  # the term of an input's element, by argument and nonzero
    write: Callable[[int, int, Term], str]  # the statement that gives an output's element its value
    dialect: Dialect  # how operations are written
    kept: Mapping[int, int]  # of an output the input that it is written over: what stays as it was is not written
    values: dict[str, Value] = field(default_factory=dict)
    terms: dict[int, Term] = field(default_factory=dict)

    def parts(self, count: int) -> list[list[Line | Fork]]:
        """Lines of each part of the step, and those that write its results behind all of them."""
        graph = self.step.graph
        written = written_if(graph, self.kept)
        unneeded = {node for place, node in graph.results if place in written}
        found: list[list[Line | Fork]] = [[] for _ in range(count)]
        for item in _together(self.step, schedule(graph, self.step.parts, self.step.each)):
            if isinstance(item, Branch):
                found[self.step.parts[max(item.chosen)]].append(self._fork(item))
            elif item not in unneeded:
                found[self.step.parts[item]].extend(self._line(item))
        return _without_unneeded([*found, self._results(written)], self.values)

    def _value(self, k: int, kind: str) -> Value:
        each = k in self.step.each
        value = Value(f"{kind[0]}{k}", kind, f"{kind[0]}{k}", -1 if each else None)
        self.values[value.name] = value
        self.terms[k] = Term(value.name, kind)
        return value

    def _needs(self, *terms: Term) -> frozenset[str]:
        for term in terms:
            if term.text not in self.values and _GIVEN.fullmatch(term.text):
                self.values[term.text] = Value(term.text, term.kind, term.text)
        return frozenset(term.text for term in terms if term.text in self.values)

    def _line(self, k: int) -> list[Line]:
        node = self.step.graph.nodes[k]
        if node.code == ca.OP_INPUT:
            self.terms[k] = self.read(*node.place)
        elif node.code == ca.OP_CONST:
            self.terms[k] = self.dialect.constant(node.value)
        elif node.code == TAKE:
            of, one = self.values[self.terms[node.sources[0]].text], int(node.value)
            taken = Value(f"{of.name}_{one}", of.kind, of.name, one)
            self.values[taken.name], self.terms[k] = taken, Term(taken.name, of.kind)
        elif node.code == GATHER:
            return self._gathered(k)
        else:
            operands = [self.terms[s] for s in node.sources]
            made, needs = self.dialect.express(node.code, operands), self._needs(*operands)
            value = self._value(k, made.kind)
            text = f"const {self.dialect.types[made.kind]} {value.name} = {made.text};"
            return [Line(text, (value,), needs, k in self.step.each)]
        return []

    def _gathered(self, k: int) -> list[Line]:
        operands = [self.terms[s] for s in self.step.graph.nodes[k].sources]
        kinds = {term.kind for term in operands}
        kind = kinds.pop() if len(kinds) == 1 else "wide" if "wide" in kinds else "real"
        value = self._value(k, kind)
        places = [Value(f"{value.name}_{one}", kind, value.name, one) for one in range(len(operands))]
        return [
            Line(as_kind(kind, term), needs=self._needs(term), sets=place)
            for place, term in zip(places, operands, strict=True)
        ]

    def _fork(self, item: Branch) -> Fork:
        bodies = [
            [line for k in _together(self.step, nodes) if isinstance(k, int) for line in self._line(k)]
            for nodes in (item.then, item.otherwise)
        ]
        chosen, set_last = [], ([], [])  # type: tuple[list[Value], tuple[list[Line], list[Line]]]
        for k, values in item.chosen.items():
            operands = [self.terms[s] for s in self.step.graph.nodes[k].sources]
            value = self._value(k, self.dialect.express(self.step.graph.nodes[k].code, operands).kind)
            chosen.append(value)
            for body, source in zip(set_last, values, strict=True):
                term = Term("0", value.kind) if source is None else self.terms[source]
                text = as_kind(value.kind, term)
                body.append(Line(text, needs=self._needs(term), each=value.one is not None, sets=value))
        condition = self.terms[item.condition]
        then, otherwise = (
            (*body, *sorted(last, key=lambda line: line.each)) for body, last in zip(bodies, set_last, strict=True)
        )
        return Fork(truth(condition), self._needs(condition), then, otherwise, tuple(chosen))

    def _results(self, written: Mapping[tuple[int, int], tuple[int, int, bool]]) -> list[Line | Fork]:
        graph, found = self.step.graph, list[Line | Fork]()
        for k in sorted(moved_inputs(graph, written, self.kept)):  # may be written over before they are read
            read = self.terms[k]
            needs, value = self._needs(read), self._value(k, read.kind)
            text = f"const {self.dialect.types[read.kind]} {value.name} = {read.text};"
            found.append(Line(text, (value,), needs))
        for place, node in graph.results:
            if place not in written:
                found.append(Line(self.write(*place, self.terms[node]), needs=self._needs(self.terms[node])))
        seldom: dict[tuple[str, frozenset[str]], list[Line]] = defaultdict(list)
        for place, (condition, new, wanted) in written.items():
            term, said = self.terms[condition], truth(self.terms[condition])
            line = Line(self.write(*place, self.terms[new]), needs=self._needs(self.terms[new]))
            seldom[said if wanted else f"!{said}", self._needs(term)].append(line)
        return found + [Fork(said, needs, tuple(lines)) for (said, needs), lines in seldom.items()]


def _without_unneeded(parts: list[list[Line | Fork]], values: Mapping[str, Value]) -> list[list[Line | Fork]]:
    """The parts without lines of which nobody takes anything: what is chosen in a branch may be written elsewhere."""
    while True:
        needs = (item.needs.union(*(line.needs for line in item.lines)) for items in parts for item in items)
        taken = {values[name].of for some in needs for name in some}
        kept = [[one for item in items if (one := item.reduced(taken)) is not None] for items in parts]
        if kept == parts:
            return parts
        parts = kept


def _together(step: Collapsed, items: Sequence[int | Branch]) -> list[int | Branch]:
    """The same items with those of each in long runs, as far as what they need lets them."""
    nodes = step.graph.nodes
    inside = {k: n for n, item in enumerate(items) for k in (item.all() if isinstance(item, Branch) else (item,))}
    needs = [
        {inside[s] for k in (i.all() if isinstance(i, Branch) else (i,)) for s in nodes[k].sources if s in inside} - {n}
        for n, i in enumerate(items)
    ]
    for n, item in enumerate(items):
        if isinstance(item, Branch) and item.condition in inside:
            needs[n].add(inside[item.condition])
    followers: dict[int, list[int]] = defaultdict(list)
    for n, before in enumerate(needs):
        for source in before:
            followers[source].append(n)

    def rank(n: int) -> tuple[int, int]:
        """Part, and 1 for what is of each; what makes no line comes at once."""
        item = items[n]
        if isinstance(item, Branch):
            return step.parts[max(item.chosen)], 0
        if nodes[item].code in _WITHOUT_LINE:
            return -1, 0
        return step.parts[item], int(item in step.each and nodes[item].code != GATHER)

    ready: dict[tuple[int, int], list[int]] = defaultdict(list)
    order: list[int | Branch] = []
    kind = 0

    def put(n: int) -> None:
        heapq.heappush(ready[rank(n)], n)

    for n, before in enumerate(needs):
        if not before:
            put(n)
    while any(ready.values()):
        part = min(place for place, waiting in ready.items() if waiting)[0]
        if part >= 0 and not ready[part, kind]:
            kind = 1 - kind
        n = heapq.heappop(ready[part, kind if part >= 0 else 0])
        order.append(items[n])
        for follower in followers[n]:
            needs[follower].discard(n)
            if not needs[follower]:
                put(follower)
    return order
