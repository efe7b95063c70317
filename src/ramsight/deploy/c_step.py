"""A sensor's step as C: the operations of its graph, by its parts, in functions."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from ramsight.deploy.c_alike import Row, collapsed
from ramsight.deploy.c_cut import LONGEST, cut
from ramsight.deploy.c_function import PLAIN, Term, as_kind, number, result_kinds
from ramsight.deploy.c_functions import Functions, Handed, functions
from ramsight.deploy.c_lines import Scribe
from ramsight.deploy.c_stays import staying
from ramsight.engine.cache import hold, instructions
from ramsight.engine.graph import Graph, graph_of, side_by_side
from ramsight.engine.recursion import Recursion
from ramsight.sensor.virtual_sensor import VirtualSensor

TIME = "time"
"""The input that clocks repeat. The step gets how far they are back. A sum of times stays a double too, or a timer of
samples would end a sample early or late at its limit."""
_LAST_PART = "Status: which of the detectors has spoken; and what the sensor says"

_RESULTS = "Results: what is known from now on"
_HANDED = {"s": "", "in": "_inputs", "out": "_outputs", "w": "_work", "one": "_of_each"}
"""What functions are handed, and what the types of it end with."""


@dataclass(frozen=True)
class WrittenStep:
    """A sensor's step as C."""

    functions: Functions  # of its parts
    titles: Mapping[str, str]  # of the parts, by the names of their functions
    begun: Sequence[str]  # statements that keep what the functions are given
    constants: Mapping[str, float]  # numbers of the machine that it uses, by name
    wide: frozenset[str]  # states that are doubles


def written_step(sensor: VirtualSensor, prefix: str, *, tabled: bool, longest: int = LONGEST) -> WrittenStep:
    """A sensor's step as C."""
    recursion = sensor.recursion
    sections = sensor.sections()
    graph, parts, rows, prepare = _read(recursion, sections)
    values = prepare(sensor.parameters).full().ravel()
    extra = len(values) - len(recursion.parameters)
    names = [f"k_{k}" for k in range(extra)] + [f"k_{identifier_of(name)}" for name in recursion.parameters]
    wide = {one.name for one in sensor.states if one.exact}
    scribe = _Scribe(sensor, prefix, names, frozenset(wide))
    while (
        more := scribe.sums(result_kinds(graph, scribe.read, PLAIN)) - wide
    ):  # what a sum of doubles becomes is a double
        wide |= more
        scribe = _Scribe(sensor, prefix, names, frozenset(wide))
    lines = Scribe(collapsed(graph, parts, rows), scribe.read, scribe.write, PLAIN, {0: 0})
    titles = [*(title for title, *_ in sections), _LAST_PART, _RESULTS]
    names_of = [f"{prefix}_step_{_name_of(title)}" for title in titles]
    cuts = [cut(name, items, longest) for name, items in zip(names_of, lines.parts(len(titles) - 1), strict=True)]
    handed = {name: Handed(f"{prefix}{of}") for name, of in _HANDED.items()}
    if tabled:
        handed["s"] = Handed(prefix, r"\bk_\w")
    written = functions(*staying(cuts, lines.values), handed)
    constants = {n: float(value) for n, value in zip(names, values, strict=True) if n in scribe.used}
    given = _given(sensor)
    begun = [f"w.{place} = {given[name]};" for name, place in written.given.items()]
    return WrittenStep(written, dict(zip(names_of, titles, strict=True)), begun, constants, frozenset(wide))


def _name_of(title: str) -> str:
    """What the functions of a part are called.

    Example:
        >>> _name_of("Input check: what of the sample is possible")
        'input_check'
    """
    return title.partition(":")[0].lower().replace(" ", "_")


def _read(
    recursion: Recursion, sections: Sequence[tuple[str, Any, Any]]
) -> tuple[Graph, list[int], list[Row], ca.Function]:
    """The step's graph, each operation's part, what corresponds in it, and the function of its held values.

    What the parts lead to, and what corresponds, stand behind the step's results while the graph is made; of that only
    what the results need as well, so that the operations are those without it.
    """
    marks = [found for _, found, _ in sections]
    rows: Any = ca.vertcat(*(rows for *_, rows in sections if rows.numel()))
    count = rows.shape[1]
    live = live_marks(graph_of(instructions(_split(recursion, [ca.vec(rows.T), *marks])[0])), 2)
    whole = [row for row in range(rows.shape[0]) if all((2, count * row + one) in live for one in range(count))]
    alike = ca.vec(rows[whole, :].T) if whole else ca.SX(0, 1)
    needed = [mark[sorted(k for of, k in live if of == 3 + n)] for n, mark in enumerate(marks)]
    step, prepare = _split(recursion, [alike, *needed])
    graph, parts = by_section(graph_of(instructions(step)), 3, len(marks))
    at = dict(graph.results)
    found = [tuple(at[2, count * row + one] for one in range(count)) for row in range(len(whole))]
    states = _of_each(recursion.state)
    found += [tuple(at[0, k] for k in row) for row in states if len(row) == count]
    return replace(graph, results=[one for one in graph.results if one[0][0] < 2]), parts, found, prepare


def _of_each(states: Sequence[str]) -> list[Row]:
    """Places of states that several of a kind have, `kind[k].rest`, a row by what they are named besides.

    Example:
        >>> _of_each(["position", "hypotheses[0].weight", "hypotheses[1].weight"])
        [(1, 2)]
    """
    rows: dict[tuple[str, str], list[int]] = defaultdict(list)
    for k, name in enumerate(states):
        if found := re.fullmatch(r"(\w+)\[[0-9]+\](.*)", name):
            rows[found[1], found[2]].append(k)
    return [tuple(row) for row in rows.values()]


def _split(recursion: Recursion, marks: Sequence[Any]) -> tuple[ca.Function, ca.Function]:
    graph = recursion.graph
    everything = [graph.next_state, graph.output, *marks]
    both, q, prepare = hold(ca.densify(ca.vertcat(*everything)), graph.p)
    parts = ca.vertsplit(both, [0, *np.cumsum([part.numel() for part in everything]).tolist()])
    names = ["x_new", "out", *(f"part_{k}" for k in range(len(marks)))]
    inputs = [graph.x, graph.u, q]
    return ca.Function("step", inputs, parts, ["x", "u", "q"], names, {"cse": True}), prepare


def field_of(state: str) -> str:
    """The name of a state in C: ``hypotheses[2].leakage`` is `hypotheses_2_leakage` there.

    Example:
        >>> field_of("hypotheses[2].covariance[leakage,lag]")
        'hypotheses_2_covariance_leakage_lag'
    """
    return identifier_of(state.replace("]", ""))


def repeated(sensor: VirtualSensor) -> dict[str, str]:
    """States that are what an input was, of which only the change counts, by the names of the inputs.

    They are doubles, and the step gets the change.
    """
    return {one.name: one.exact for one in sensor.states if one.exact in sensor.further}


def _given(sensor: VirtualSensor) -> dict[str, str]:
    """What the step works out first, by name: its inputs, and how far back clocks and repeated ones are; now is 0."""
    same, changing = repeated(sensor), set(repeated(sensor).values())
    found = {f"u_{name}": f"in->{name}" for name in sensor.recursion.inputs if name not in changing}
    found |= {f"u_{name}": f"in->{name} == in->{name} ? R(0.0) : (real)NAN" for name in changing}
    found |= {
        "u_time": "clocked ? 0.0 : (wide)NAN",
        "u_reference": "referenced ? s->reference : R(0.0)",
        "u_reference_known": "(real)referenced",
    }
    for one in sensor.states:
        field = field_of(one.name)
        if one.exact == TIME:
            found[f"x_{field}"] = f"s->{field} - in->time"
        if one.name in same:
            found[f"x_{field}"] = f"(real)(s->{field} - in->{same[one.name]})"
    return found


class _Scribe:
    """How a step reads and writes states, inputs, constants and outputs; keeps what it came across."""

    def __init__(self, sensor: VirtualSensor, prefix: str, constants: list[str], wide: frozenset[str]) -> None:
        self._recursion, self._prefix, self._constants, self._wide = sensor.recursion, prefix, constants, wide
        self._clocks = {one.name for one in sensor.states if one.exact == TIME}
        self._repeated = repeated(sensor)
        self.used: set[str] = set()

    def sums(self, kinds: Mapping[tuple[int, int], str]) -> set[str]:
        """States that become a double, by the kinds of the step's results."""
        own = {self._recursion.state[k] for (argument, k), kind in kinds.items() if argument == 0 and kind == "wide"}
        return own - self._clocks - self._repeated.keys()

    def read(self, argument: int, k: int) -> Term:
        if argument == 1:
            name = self._recursion.inputs[k]
            return Term(f"u_{name}", "wide" if name == "time" else "real")
        if argument == 2:
            self.used.add(self._constants[k])
            return Term(self._constants[k])
        name = self._recursion.state[k]
        field, relative = field_of(name), name in self._clocks or name in self._repeated
        kind = "wide" if name in self._wide and name not in self._repeated else "real"
        return Term(f"x_{field}" if relative else f"s->{field}", kind)

    def write(self, argument: int, k: int, term: Term) -> str:
        if argument == 1:
            name = self._recursion.outputs[k]
            value = f"({self._prefix}_status){term.text}" if name == "status" else number(term)
            return f"out->{name} = {value};"
        name = self._recursion.state[k]
        field = field_of(name)
        if name in self._clocks:
            return f"if ({term.text} == 0) s->{field} = in->time;"
        if name in self._repeated:
            return f"if ({term.text} == 0) s->{field} = in->{self._repeated[name]};"
        return f"s->{field} = {as_kind('wide', term) if name in self._wide else number(term)};"


def identifier_of(name: str) -> str:
    """A name as C and FMI can have it."""
    return "".join(c if c.isalnum() else "_" for c in name)


def live_marks(graph: Graph, first: int) -> set[tuple[int, int]]:
    """Elements of a function's marks that its results need as well.

    Returns:
        Their places, output and element.
    """
    marks = [(place, node) for place, node in graph.results if place[0] >= first]
    needed = replace(graph, results=[one for one in graph.results if one[0][0] < first]).live()
    return {place for place, node in marks if node in needed}


def by_section(graph: Graph, first: int, count: int) -> tuple[Graph, list[int]]:
    """A graph whose operations stand by the parts of the step that they belong to, without the marks.

    An operation belongs to the first mark that needs it; what no mark needs comes last. What an operation needs belongs
    to the same part or to one before, so that the order is one in which all of it can be done.

    Args:
        graph: of a function whose outputs from `first` on are marks: what each part of the step leads to.

    Returns:
        The graph, and of each operation the number of its part, 0 to `count`.
    """
    parts = [count] * len(graph.nodes)
    for mark in reversed(range(count)):
        leads = replace(graph, results=[one for one in graph.results if one[0][0] == first + mark])
        for node in leads.live():
            parts[node] = mark
    order = side_by_side(graph, parts)
    results = [one for one in graph.results if one[0][0] < first]
    return replace(graph, results=results).reordered(order), [parts[k] for k in order]
