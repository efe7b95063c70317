"""C from an SX function: one elementary operation, one line, with conditions as flags and `if_else` as `c ? a : b`.

A `Dialect` states how each operation is written; `PLAIN` is C99 on scalars. What NaN, comparisons, minimum and maximum
mean is what they mean in the engine (engine/llvm.py). Around it stand templates, lists of lines and tables.
"""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from string import Template

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ramsight._version import __version__
from ramsight.engine.branches import Branch, choice, schedule
from ramsight.engine.cache import instructions
from ramsight.engine.graph import SELECT, Graph, Node, graph_of, side_by_side


@dataclass(frozen=True)
class Term:
    """A piece of an expression."""

    text: str  # safe as an operand
    kind: str = "real"  # `real`; `wide`, a double even where reals are floats; or `flag`, an int that is 0 or 1
    exact: str | None = None  # of a number, its text as a double


@dataclass(frozen=True)
class Dialect:
    """How operations are written."""

    types: dict[str, str]  # the C type of each kind
    constant: Callable[[float], Term]  # a number's text
    express: Callable[[int, Sequence[Term]], Term]  # code and operands to a term
    branches: bool = False  # whether what is seldom needed may wait in an `if`; not where a value is of several runs


def statements(
    function: ca.Function, read: Callable[[int, int], Term], write: Callable[[int, int, Term], str], dialect: Dialect
) -> list[str]:
    """The lines of a function's body.

    Args:
        write: the statement that gives an output's element its value; all stand behind everything that is read.
    """
    graph = graph_of(instructions(function))
    graph = graph.reordered(side_by_side(graph))
    terms: dict[int, Term] = {}

    def line(k: int) -> list[str]:
        node = graph.nodes[k]
        if node.code == ca.OP_INPUT:
            terms[k] = read(*node.place)
        elif node.code == ca.OP_CONST:
            terms[k] = dialect.constant(node.value)
        else:
            made = dialect.express(node.code, [terms[s] for s in node.sources])
            terms[k] = Term(f"{made.kind[0]}{k}", made.kind)
            return [f"const {dialect.types[made.kind]} {terms[k].text} = {made.text};"]
        return []

    def branch(item: Branch) -> list[str]:
        bodies = [[text for k in nodes for text in line(k)] for nodes in (item.then, item.otherwise)]
        declared = []
        for k, values in item.chosen.items():
            made = dialect.express(graph.nodes[k].code, [terms[s] for s in graph.nodes[k].sources])
            terms[k] = Term(f"{made.kind[0]}{k}", made.kind)
            declared.append(f"{dialect.types[made.kind]} {terms[k].text};")
            for body, value in zip(bodies, values, strict=True):
                body.append(f"{terms[k].text} = {'0' if value is None else as_kind(made.kind, terms[value])};")
        then, otherwise = ([f"  {text}" for text in body] for body in bodies)
        return [*declared, f"if ({truth(terms[item.condition])}) {{", *then, "} else {", *otherwise, "}"]

    items = schedule(graph) if dialect.branches else range(len(graph.nodes))
    lines = [text for item in items for text in (branch(item) if isinstance(item, Branch) else line(item))]
    return lines + [write(*place, terms[node]) for place, node in graph.results]


def result_kinds(graph: Graph, read: Callable[[int, int], Term], dialect: Dialect) -> dict[tuple[int, int], str]:
    """Kinds of a function's results, without the text of their statements."""
    terms: list[Term] = []
    for node in graph.nodes:
        if node.code == ca.OP_INPUT:
            terms.append(read(*node.place))
        elif node.code == ca.OP_CONST:
            terms.append(dialect.constant(node.value))
        else:
            terms.append(Term("x", dialect.express(node.code, [terms[s] for s in node.sources]).kind))
    return {place: terms[node].kind for place, node in graph.results}


def moved_inputs(
    graph: Graph, written: Mapping[tuple[int, int], tuple[int, int, bool]], kept: Mapping[int, int]
) -> set[int]:
    """Inputs that are results elsewhere than where they stand: they may be written over before they are read.

    Args:
        written: results that are a new value or what stood in their place (`written_if`).
    """
    values = {written[place][1] if place in written else node for place, node in graph.results}
    return {k for k in values if graph.nodes[k].code == ca.OP_INPUT and graph.nodes[k].place[0] in kept.values()}


def written_if(graph: Graph, kept: Mapping[int, int]) -> dict[tuple[int, int], tuple[int, int, bool]]:
    """Results that are a new value or what stood in their place already, and are nothing's operand.

    Returns:
        Of their places the condition, the new value, and which way the condition has to be for it.
    """
    used = {source for node in graph.nodes for source in node.sources}
    often = Counter(node for _, node in graph.results)
    found = {}
    for place, node in graph.results:
        chosen = choice(graph, node)
        if chosen is None or node in used or often[node] > 1 or place[0] not in kept:
            continue
        condition, *values = chosen
        before = Node(ca.OP_INPUT, place=(kept[place[0]], place[1]))
        stays = [k is not None and graph.nodes[k] == before for k in values]
        for way, (stay, other) in enumerate(zip(stays, reversed(values), strict=True)):
            if stay and other is not None:
                found[place] = condition, other, way == 1
    return found


def array_function(name: str, function: ca.Function, dialect: Dialect) -> str:
    """An SX function as `static void NAME(inputs, outputs)` on arrays of `real`.

    An output `b_new` is written to the argument `b_`.

    Example:
        >>> x = ca.SX.sym("x", 2)
        >>> print(array_function("least", ca.Function("f", [x], [ca.fmin(x[0], x[1])], ["x"], ["y"]), PLAIN))
        static void least(const real *RESTRICT x, real *RESTRICT y_) {
          const real r2 = x[1] < x[0] ? x[1] : x[0];
          y_[0] = r2;
        }
    """
    ins = function.name_in()
    outs = [out.removesuffix("_new") + "_" for out in function.name_out()]
    arguments = [f"const real *RESTRICT {n}" for n in ins] + [f"real *RESTRICT {n}" for n in outs]
    used: set[int] = set()

    def read(argument: int, k: int) -> Term:
        used.add(argument)
        return Term(f"{ins[argument]}[{k}]")

    def write(argument: int, k: int, term: Term) -> str:
        return f"{outs[argument]}[{k}] = {number(term)};"

    body = statements(function, read, write, dialect)
    body = [f"(void){name};" for k, name in enumerate(ins) if k not in used] + body
    return "\n".join([f"static void {name}({', '.join(arguments)}) {{", *(f"  {line}" for line in body), "}"])


def literal(value: float) -> str:
    """A number in C."""
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return "NAN" if math.isnan(value) else repr(float(value))


def number(term: Term) -> str:
    """A term as a real."""
    return term.text if term.kind == "real" else f"(real){term.text}"


def truth(term: Term) -> str:
    """A term as a condition."""
    return term.text if term.kind == "flag" else f"({term.text} != 0)"


# NaN: a maximum or minimum has it if its first operand has; it differs from nothing, and it is true.
_REAL = {
    ca.OP_MUL: "{0} * {1}", ca.OP_DIV: "{0} / {1}", ca.OP_INV: "R(1.0) / {0}", ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "R(2.0) * {0}", ca.OP_SQRT: "SQRT({0})", ca.OP_EXP: "EXP({0})", ca.OP_LOG: "LOG({0})",
    ca.OP_TANH: "TANH({0})", ca.OP_POW: "POW({0}, {1})", ca.OP_CONSTPOW: "POW({0}, {1})", ca.OP_SIN: "SIN({0})",
    ca.OP_COS: "COS({0})", ca.OP_ATAN2: "ATAN2({0}, {1})", ca.OP_FLOOR: "FLOOR({0})", ca.OP_CEIL: "CEIL({0})",
    ca.OP_SIGN: "(real)(({0} > 0) - ({0} < 0))",
}  # fmt: skip
_ALIKE = {
    ca.OP_ASSIGN: "{0}", ca.OP_NEG: "-{0}", ca.OP_ADD: "{0} + {1}", ca.OP_SUB: "{0} - {1}",
    ca.OP_FMIN: "{1} < {0} ? {1} : {0}", ca.OP_FMAX: "{1} > {0} ? {1} : {0}",
}  # fmt: skip
_COMPARED = {
    ca.OP_LT: "{0} < {1}", ca.OP_LE: "{0} <= {1}", ca.OP_EQ: "{0} == {1}", ca.OP_NE: "{0} < {1} || {0} > {1}",
}  # fmt: skip
_LOGICAL = {ca.OP_NOT: "!{0}", ca.OP_AND: "{0} && {1}", ca.OP_OR: "{0} || {1}"}


def _express(code: int, operands: Sequence[Term]) -> Term:
    if code == ca.OP_ASSIGN:
        return operands[0]
    if code in _LOGICAL:
        return Term(_LOGICAL[code].format(*map(truth, operands)), "flag")
    if code in _COMPARED:
        kind = _widest(operands)
        return Term(_COMPARED[code].format(*(as_kind(kind, term) for term in operands)), "flag")
    if code in _REAL:
        return Term(_REAL[code].format(*map(number, operands)))
    if code == ca.OP_FABS:
        return Term(f"{'fabs' if operands[0].kind == 'wide' else 'ABS'}({operands[0].text})", _widest(operands))
    if code in _ALIKE:
        kind = _widest(operands)
        return Term(_ALIKE[code].format(*(as_kind(kind, term) for term in operands)), kind)
    if code in (SELECT, ca.OP_IF_ELSE_ZERO):
        condition, *values = operands
        if len(values) == 2 and all(term.kind == "flag" for term in values):
            return Term(f"{truth(condition)} ? {values[0].text} : {values[1].text}", "flag")
        kind = _widest(values)
        texts = [as_kind(kind, term) for term in values] + ["0"] * (2 - len(values))
        return Term(f"{truth(condition)} ? {texts[0]} : {texts[1]}", kind)
    raise NotImplementedError(f"CasADi's operation {code} has no C yet")


def _widest(terms: Sequence[Term]) -> str:
    return "wide" if any(term.kind == "wide" for term in terms) else "real"


def as_kind(kind: str, term: Term) -> str:
    """A term as another kind."""
    if kind == "wide" and term.exact is not None:
        return term.exact
    return term.text if term.kind == kind else f"({kind}){term.text}"


PLAIN = Dialect(
    types={"real": "real", "wide": "wide", "flag": "int"},
    constant=lambda value: Term(f"R({literal(value)})", exact=f"({literal(value)})"),
    express=_express,
    branches=True,
)
"""C99 on scalars; needs `real`, `wide`, `R()` and `SQRT`, `EXP`, ... of that type."""


def template(file: str, /, **values: object) -> str:
    """A file of `deploy/c`, or a path in `deploy`, with the places `${...}` filled in."""
    return Template(asset(file if "/" in file else f"c/{file}")).substitute({k: str(v) for k, v in values.items()})


def asset(path: str) -> str:
    """Text of a file in `deploy`, as it is."""
    return (resources.files("ramsight.deploy") / path).read_text(encoding="utf-8")


def headings(prefix: str, machine: str, title: str) -> dict[str, object]:
    """What every template of a header or body is filled with."""
    return {"p": prefix, "P": prefix.upper(), "version": __version__, "machine": machine, "title": title}


def indented(statements: Iterable[str], indent: int = 2) -> str:
    r"""Statements, a line each.

    Example:
        >>> indented(["a = 1;", "b = 2;"])
        '  a = 1;\n  b = 2;'
    """
    return textwrap.indent("\n".join(statements), " " * indent)


def golden_table(name: str, values: NDArray[np.float64]) -> str:
    """Golden samples as an array of `GOLDEN` rows, shape (samples, columns)."""
    body = ",\n".join(f"  {{{', '.join(map(literal, row))}}}" for row in values.tolist())
    return f"static const double {name}[GOLDEN][{values.shape[1]}] = {{\n{body}\n}};\n"
