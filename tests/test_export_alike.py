"""What a step does alike for several stands once in its C, cut into functions that give values to each other."""

import re

import casadi as ca
import numpy as np
import pytest

from ramsight.deploy.c_alike import GATHER, TAKE, Collapsed, collapsed
from ramsight.deploy.c_cut import Call, Case, Part, Piece, cut
from ramsight.deploy.c_function import PLAIN, Term
from ramsight.deploy.c_functions import MUCH, Handed, Places, functions
from ramsight.deploy.c_lines import Line, Scribe, Value
from ramsight.deploy.c_stays import staying
from ramsight.deploy.compiler import STRICT, find_compiler, run
from ramsight.engine.cache import instructions
from ramsight.engine.graph import graph_of

COMPILER = find_compiler()
COUNT = 3


def filters(much=40, by_each=False, of_first=0.0, of_old=0.0):
    """Three filters that are fed alike, weighed against each other, and of which the best restarts the last.

    Args:
        much: of what they learn.
        by_each: each learns by a condition of its own, not all by one.
        of_first: how much each learns of what the first one was.
        of_old: how much of what each was before it learned is in what it is after it.
    """
    x, u, on = ca.SX.sym("x", COUNT), ca.SX.sym("u"), ca.SX.sym("on")
    learns = on > 0.5
    fed = [one + 0.1 * ca.tanh(u - one) for one in ca.vertsplit(x)]
    learned = []
    for one in fed:
        value = one
        for k in range(much):
            value = value + 0.01 * ca.sin((k + 1) * value + u)
        value = value + of_first * fed[0]
        learned.append(ca.if_else(one > 0.5 if by_each else learns, value, one))
    best = ca.fmax(ca.fmax(learned[0], learned[1]), learned[2])
    after = [0.5 * (one - best) ** 2 + one + of_old * (old - best) for one, old in zip(learned, fed, strict=True)]
    after[2] = ca.if_else(after[0] > after[1], after[0], after[2])
    return ca.Function("f", [x, ca.vertcat(u, on)], [ca.vertcat(*after), best, ca.vertcat(*learned)])


def rows_of(graph):
    """Rows of the results, the marked ones before the state, and the graph without the marks."""
    at = dict(graph.results)
    rows = [tuple(at[output, one] for one in range(COUNT)) for output in (2, 0)]
    graph.results = [one for one in graph.results if one[0][0] < 2]
    return rows


def compiled(step, tmp, longest):
    """A step as a function of three states and two inputs, by C."""
    scribe = Scribe(
        step,
        lambda argument, k: Term(f"s->x{k}" if argument == 0 else f"u_{k}"),
        lambda output, k, term: f"{'s->x' if output == 0 else 's->best'}{k if output == 0 else ''} = {term.text};",
        PLAIN,
        {0: 0},
    )
    parts = [cut(f"part_{k}", lines, longest) for k, lines in enumerate(scribe.parts(1))]
    written = functions(
        *staying(parts, scribe.values), {"s": Handed("state"), "w": Handed("work"), "one": Handed("of_each")}
    )
    given = " ".join(f"w.{place} = {name};" for name, place in written.given.items())
    program = "\n".join(
        [
            "#include <math.h>\n#include <stdio.h>",
            "typedef double real;\n#define R(x) (x)\n#define SIN sin\n#define TANH tanh\n#define RARELY",
            f"#define EACH {COUNT}",
            "typedef struct { double x0, x1, x2, best; } state;",
            f"typedef struct {{ int none; {' '.join(written.each)} }} of_each;",
            f"typedef struct {{ int none; {' '.join(written.work)} of_each each[EACH]; }} work;",
            *written.headers,
            *written.texts.values(),
            "int main(void) { state kept, *s = &kept; double u_0, u_1; work w;",
            'while (scanf("%lf %lf %lf %lf %lf", &s->x0, &s->x1, &s->x2, &u_0, &u_1) == 5) {',
            given,
            *written.calls,
            'printf("%.17g %.17g %.17g %.17g\\n", s->x0, s->x1, s->x2, s->best); } return 0; }',
        ]
    )
    (tmp / "f.c").write_text(program)
    run([COMPILER, *STRICT, "f.c", "-lm", "-o", "f"], tmp)
    return tmp / "f", written


def said(program, samples):
    import subprocess

    rows = "\n".join(" ".join(map(repr, sample)) for sample in samples.tolist())
    done = subprocess.run([program], input=rows, capture_output=True, text=True, check=True)
    return np.array([line.split() for line in done.stdout.splitlines()], dtype=float)


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
@pytest.mark.parametrize("longest", [1, 3, 200])
@pytest.mark.parametrize(("shuffled", "by_each"), [(False, False), (True, False), (False, True)])
def test_c_of_functions_says_what_the_graph_says_whatever_is_taken_for_alike(tmp_path, longest, shuffled, by_each):
    """Which operations are one is a matter of size alone: with rows in a wrong order the results are the same."""
    function = filters(by_each=by_each)
    graph = graph_of(instructions(function))
    rows = rows_of(graph)
    if shuffled:
        rows = [(row[2], row[0], row[1]) for row in rows[::-1]]
    step = collapsed(graph, [0] * len(graph.nodes), rows)
    samples = np.random.default_rng(1).normal(size=(200, 5))
    program, written = compiled(step, tmp_path, longest)
    expected = [np.concatenate([one.full().ravel() for one in function(s[:3], s[3:])[:2]]) for s in samples]
    np.testing.assert_allclose(said(program, samples), expected, rtol=0, atol=1e-13)
    text = "\n".join(written.texts.values())
    assert ("k < EACH" in text) == bool(step.each)
    assert text.count("static ") > (20 if longest < 200 else 2)
    assert ("if (w->" in text) == (not by_each), "a branch is taken for all of them"
    cases = re.findall(r"^  if [^{]*{(.*?)^  }", text, flags=re.MULTILINE | re.DOTALL)
    waits = [re.findall(r"(part_\d+_\d+)\(", case) for case in cases]
    much = {name for names in waits if len(names) >= MUCH for name in names}
    assert set(re.findall(r"static RARELY void (\w+)", text)) == much, "much that waits for a condition is kept short"
    assert bool(much) == (longest < 200 and not by_each)


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
@pytest.mark.parametrize("longest", [3, 60, 200])
@pytest.mark.parametrize(
    ("more", "copied"),
    [({}, 0), ({"of_first": 0.3}, None), ({"of_old": 0.3}, 1), ({"of_first": 0.3, "of_old": 0.3}, 1)],
)
def test_what_a_case_leaves_as_it_was_is_copied_only_where_the_old_one_is_needed(tmp_path, longest, more, copied):
    """What each was before it learned is needed after it, or when the first one has learned already."""
    function = filters(**more)
    graph = graph_of(instructions(function))
    step = collapsed(graph, [0] * len(graph.nodes), rows_of(graph))
    samples = np.random.default_rng(2).normal(size=(100, 5))
    program, written = compiled(step, tmp_path, longest)
    expected = [np.concatenate([one.full().ravel() for one in function(s[:3], s[3:])[:2]]) for s in samples]
    np.testing.assert_allclose(said(program, samples), expected, rtol=0, atol=1e-13)
    text = "\n".join(written.texts.values())
    if copied is not None:
        assert len(re.findall(r"^  } else {\n.*each\[k\]", text, flags=re.MULTILINE)) == copied


@pytest.mark.parametrize("turned", [False, True])
def test_a_case_that_needs_the_old_value_after_the_new_one_is_set_gets_a_place_for_it(turned):
    """Two values that change places: the first may not be written where the second is still taken from."""
    names = ("f1", "r1", "r2", "r3", "r4")
    values = {name: Value(name, {"f": "flag", "r": "real"}[name[0]], name) for name in names}
    old, other, new, newer = (values[name] for name in names[1:])
    first = Piece("first", (Line("const real r1 = 1.0, r2 = 2.0;", (old, other)),), each=False)
    crossed = [Line("r2", needs=frozenset({"r2"}), sets=new), Line("r1", needs=frozenset({"r1"}), sets=newer)]
    kept = (Line("r1", needs=frozenset({"r1"}), sets=new), Line("r2", needs=frozenset({"r2"}), sets=newer))
    comes = Call(Piece("comes", tuple(crossed[::-1] if turned else crossed), each=False))
    case = Case("f1", frozenset({"f1"}), (comes,), (Call(Piece("stays", kept, each=False)),))
    last = Piece("last", (Line("use(r3, r4);", needs=frozenset({"r3", "r4"})),), each=False)
    (part,), placed = staying([Part("part", (Call(first), case, Call(last)))], values)
    # One of the two is set last, and may have its place.
    assert [placed["r3"].of, placed["r4"].of] == (["r1", "r4"] if turned else ["r3", "r2"])
    found = part.calls[1]
    assert [line.sets.of for line in found.otherwise[0].piece.lines] == [("r4" if turned else "r3")]
    assert found.condition == "f1"


def test_what_is_alike_is_one_operation():
    function = filters()
    graph = graph_of(instructions(function))
    step = collapsed(graph, [0] * len(graph.nodes), rows_of(graph))
    codes = [node.code for node in step.graph.nodes]
    assert codes.count(ca.OP_SIN) == 40
    assert [node.code for node in graph.nodes].count(ca.OP_SIN) == COUNT * 40
    assert 1 <= codes.count(GATHER) < 4
    assert codes.count(TAKE) >= COUNT
    assert all(source < k for k, node in enumerate(step.graph.nodes) for source in node.sources)


def test_operations_of_different_parts_or_kinds_stay_apart():
    x = ca.SX.sym("x", 2)
    function = ca.Function("f", [x], [ca.vertcat(ca.sin(x[0]) + 1.0, ca.cos(x[1]) + 1.0)])
    graph = graph_of(instructions(function))
    row = tuple(node for _, node in graph.results)
    graph.results = [((0, 0), graph.nodes[row[0]].sources[0]), ((0, 1), row[1])]
    step = collapsed(graph, [0] * len(graph.nodes), [row])
    assert not any(node.code in (ca.OP_SIN, ca.OP_COS) for k, node in enumerate(step.graph.nodes) if k in step.each)
    parts = [int(k == row[1]) for k in range(len(graph.nodes))]
    assert not collapsed(graph, parts, [row]).each


def test_a_step_that_has_nothing_alike_stays_as_it_is():
    graph = graph_of(instructions(ca.Function("f", [x := ca.SX.sym("x")], [x * x])))
    assert collapsed(graph, [0, 0], []) == Collapsed(graph, [0, 0])


@pytest.mark.parametrize("more", [{}, {"of_first": 0.3}, {"of_old": 0.3}])
def test_no_value_is_kept_where_another_is_still_needed(more):
    """Played through: each function finds in every place what the last one that gave it left there."""
    graph = graph_of(instructions(filters(**more)))
    step = collapsed(graph, [0] * len(graph.nodes), rows_of(graph))
    scribe = Scribe(step, lambda *at: Term(f"u_{at[0]}_{at[1]}"), lambda *at: "", PLAIN, {})
    parts = [cut(f"part_{k}", lines, 2) for k, lines in enumerate(scribe.parts(1))]
    parts, values = staying(parts, scribe.values)
    places, holds = Places.of(parts, values), {}
    inputs = [value for name, value in values.items() if name.startswith("u_")]
    holds |= {_place(places, value): value.of for value in inputs if value.of in places.slots}
    played = 0
    for part in parts:
        for call in part.calls:
            cases = [[call]] if isinstance(call, Call) else [call.then, call.otherwise]
            before, after = dict(holds), []
            for case in cases:
                holds = dict(before)
                for piece in (one.piece for one in case):
                    for name in piece.needed:
                        value = values[name]
                        assert holds[_place(places, value)] == value.of
                        played += 1
                    for value in piece.kept_here:
                        if value.of in places.slots:
                            holds[_place(places, value)] = value.of
                after.append(holds)
            holds = {place: of for place, of in after[0].items() if all(one.get(place) == of for one in after)}
    assert played > 100


def test_a_function_takes_what_it_needs_before_it_keeps_anything_in_its_place():
    one, two, three = (Value(name, "real", name) for name in ("r1", "r2", "r3"))
    first = Piece("first", (Line("const real r1 = 1.0;", (one,)),), each=False)
    needs = Line("const real r3 = r1;", (three,), frozenset({"r1"}))
    second = Piece("second", (Line("2.0", sets=two), needs), each=False)
    third = Piece("third", (Line("use(r2, r3);", needs=frozenset({"r2", "r3"})),), each=False)
    part = Part("part", (Call(first), Call(second), Call(third)))
    text = functions([part], {one.name: one for one in (one, two, three)}, {"w": Handed("work")}).texts["part"]
    lines = [line.strip() for line in text.partition("second(")[2].splitlines()]
    assert lines[1:3] == ["const real r1 = w->reals[0];", "w->reals[0] = 2.0;"], "r1 is needed last where r2 begins"


def _place(places, value):
    return (value.one is not None, places.slots[value.of])
