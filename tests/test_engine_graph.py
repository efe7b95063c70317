"""What an SX function becomes before it is machine code or C: shared inverses, choices, branches."""

import inspect
import itertools
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight import machine
from ramsight.engine import branches, packing
from ramsight.engine.branches import Branch, schedule
from ramsight.engine.cache import generated_module, instructions
from ramsight.engine.graph import SELECT, graph_of, side_by_side
from ramsight.engine.packing import packed
from ramsight.engine.writes import writes
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.belief.bank import Bank
from ramsight.sensor.kalman import kalman

x, y, z = (ca.SX.sym(name) for name in "xyz")


def graph(*results):
    return graph_of(instructions(ca.Function("f", [x, y, z], list(results))))


def codes(found):
    return [node.code for node in found.nodes]


def much(value, times=branches._LEAST):
    """Something that takes many operations."""
    for k in range(times):
        value = value * value + (k + 0.1)
    return value


NOT_X = ca.logic_not(x)


@pytest.mark.parametrize(
    ("results", "counts"),
    [
        ((x / z, y / z, 1.0 / z), {ca.OP_INV: 1, ca.OP_MUL: 2, ca.OP_DIV: 0}),
        ((x / z, y * z), {ca.OP_DIV: 1}),
        ((ca.if_else(NOT_X, y, z), ca.if_else(NOT_X, y, 0.0)), {SELECT: 2, ca.OP_NOT: 0, ca.OP_IF_ELSE_ZERO: 0}),
        ((ca.if_else(x > 0, y, ca.if_else(z > 0, y, y)), x), {SELECT: 0}),
    ],
    ids=["divided by more than once", "divided once", "by what a condition is not", "a value and itself"],
)
def test_divisions_and_choices_are_as_few_as_they_can_be(results, counts):
    found = codes(graph(*results))
    assert {code: found.count(code) for code in counts} == counts


def test_chains_that_do_not_need_each_other_stand_side_by_side():
    """Each step of a chain takes longer than a processor looks ahead, so the chains take turns."""

    def chain(value):
        for _ in range(4):
            value = ca.exp(ca.exp(ca.exp(value)))
        return value

    one = graph(chain(x), chain(y), chain(z))
    order = side_by_side(one)
    found = one.reordered(order)
    assert sorted(order) == list(range(len(one.nodes)))
    assert all(source < k for k, node in enumerate(found.nodes) for source in node.sources)

    def of(place):
        while found.nodes[place].sources:
            (place,) = found.nodes[place].sources
        return found.nodes[place].place[0]

    chains = [of(k) for k, node in enumerate(found.nodes) if node.code == ca.OP_EXP]
    turns = sum(a != b for a, b in itertools.pairwise(chains))
    assert turns > 8, "one chain after the other takes two turns"
    assert [of(k) for _, k in found.results] == [0, 1, 2]


def test_parts_stay_together_however_long_they_take():
    found = graph(ca.exp(x), y + z)
    parts = [1 if node.code == ca.OP_EXP else 0 for node in found.nodes]
    assert side_by_side(found, parts)[-1] == parts.index(1)


def test_a_constant_divisor_becomes_a_factor_unless_it_is_zero():
    found = graph(x / 3.0)
    assert ca.OP_DIV not in codes(found)
    assert [node.value for node in found.nodes if node.code == ca.OP_CONST] == [1.0 / 3.0]


def branches_of(*results):
    return [item for item in schedule(graph(*results)) if isinstance(item, Branch)]


def test_what_only_one_case_needs_is_a_branch_if_it_is_much():
    (found,) = branches_of(ca.if_else(x > 0, much(y), y + z))
    assert len(found.then) >= branches._LEAST
    assert len(found.chosen) == 1
    assert not branches_of(ca.if_else(x > 0, much(y, 5), y + z))


def test_what_something_else_needs_too_is_in_no_branch():
    value = much(y)
    assert not branches_of(ca.if_else(x > 0, value, z), value)


def test_choices_of_one_condition_are_one_branch_and_those_behind_them_another():
    positive = x > 0
    first = ca.if_else(positive, much(y), y + z)
    second = ca.if_else(positive, much(z), y - z)
    assert len(branches_of(first, second)) == 1
    assert len(branches_of(first, ca.if_else(positive, much(first + z), y - z))) == 2


def test_a_branch_has_no_part_of_another_one():
    """What is chosen beside others, and asked for in one case of a longer branch alone, is not worked out for all."""
    positive, long = x > 0, much(z)
    beside = ca.if_else(positive, ca.exp(long), z)
    longer = ca.if_else(y > 0, much(x, 2 * branches._LEAST), beside)
    inner, outer = sorted(branches_of(ca.if_else(positive, long, z), longer), key=lambda one: len(one.then))
    assert len(inner.then) >= branches._LEAST
    assert len(inner.chosen) == 2
    assert not outer.otherwise


def test_choices_of_two_parts_are_two_branches():
    positive = x > 0
    whole = graph(ca.if_else(positive, much(y), y + z), ca.if_else(positive, much(z), y - z))
    chosen = [k for k in range(len(whole.nodes)) if whole.nodes[k].code == SELECT]
    parts = [int(k >= max(chosen)) for k in range(len(whole.nodes))]
    assert len([item for item in schedule(whole, parts) if isinstance(item, Branch)]) == 2
    assert len([item for item in schedule(whole) if isinstance(item, Branch)]) == 1


def test_a_step_that_is_undone_is_no_branch():
    assert not branches_of(ca.if_else(x > 0, y, much(y)))


def test_the_order_has_everything_behind_what_it_needs():
    results = [ca.if_else(x > 0, much(y), y + z), ca.if_else(y > 0, much(z) + much(x), ca.sin(z))]
    whole = graph(*results)
    done = set()
    for item in schedule(whole):
        places = [*item.then, *item.otherwise, *item.chosen] if isinstance(item, Branch) else [item]
        assert not isinstance(item, Branch) or item.condition in done
        for place in places:
            assert done | set(places) >= set(whole.nodes[place].sources)
            assert place not in done
        done |= set(places)
    assert done == set(range(len(whole.nodes)))


@pytest.mark.parametrize("condition", [1.0, -1.0, np.nan])
def test_machine_code_with_branches_gives_what_the_graph_gives(condition):
    # much() overflows where it is not chosen
    grows = much(y, 20) / z
    result = ca.vertcat(
        ca.if_else(x > 0, ca.sqrt(much(ca.sin(y)) ** 2) * 0 + y / z, z),
        ca.if_else(x > 0, z, ca.tanh(grows) + much(ca.cos(z), 70) * 0),
    )
    function = ca.Function("f", [ca.vertcat(x, y, z)], [result], ["a"], ["b"])
    module = generated_module({"branching": function}, {}, "")
    given, out = np.array([condition, 0.3, -0.7]), np.empty(2)
    module.branching(given, out)
    np.testing.assert_allclose(out, function(given).full().ravel(), rtol=1e-12)


def test_a_sample_without_contact_does_nothing_of_what_a_contact_does():
    recursion = kalman(build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))).recursion
    whole = graph_of(instructions(recursion.function()))
    branches = [item for item in schedule(whole) if isinstance(item, Branch)]
    contact = sum(len(item.then) for item in branches if len(item.chosen) > 100)
    assert contact > 0.15 * len(whole.nodes)
    iterations = max(len(item.then) for item in branches if len(item.chosen) <= 100)
    assert iterations > 0.05 * len(whole.nodes), "further iterations of the balance, where a valve was taken for open"


def always(recursion):
    """Operations of every sample."""
    made = recursion.graph
    step = ca.Function("f", [made.x, made.u, made.p], [made.next_state, made.output], {"cse": True})
    whole = graph_of(instructions(step))
    return [item for item in schedule(whole) if not isinstance(item, Branch)]


def test_a_usual_sample_does_nothing_of_what_a_measurement_does(monkeypatch):
    """No more than where the graph has none: what only a contact or a reference needs is in their branch."""
    unit, measured = build_ddh("boom", machine.load_machine("mining-loader").unit("boom")), Bank.placed
    make = inspect.unwrap(kalman)  # not the one that was made before
    usual = len(always(make(unit).recursion))
    monkeypatch.setattr(Bank, "placed", lambda self, m, *of: measured(self, replace(m, use=ca.SX(0)), *of))
    assert usual < 1.02 * len(always(make(unit).recursion))


def groups_of(*results):
    """What is done at once of what takes long, by kind."""
    whole = graph(*results)
    found = [[codes(whole)[k] for k in group] for group in packed(whole, range(len(whole.nodes)))]
    return [group for group in found if group[0] in packing._KINDS]


def test_what_takes_long_is_done_four_at_once():
    roots = [ca.sqrt(x + k) for k in range(6)]
    assert groups_of(*roots) == [4 * [ca.OP_SQRT], 2 * [ca.OP_SQRT]]
    assert groups_of(x / y, 1.0 / (z + 1.0), y / z) == [[ca.OP_DIV, ca.OP_INV, ca.OP_DIV]]
    assert groups_of(ca.exp(x), ca.log(y)) == [[ca.OP_EXP], [ca.OP_LOG]]


def test_what_waits_for_another_is_not_beside_it():
    assert groups_of(ca.sqrt(ca.sqrt(x) + y)) == [[ca.OP_SQRT], [ca.OP_SQRT]]
    inner = [ca.sqrt(x + k) for k in range(3)]
    assert groups_of(ca.sqrt(inner[0] + z), *inner) == [3 * [ca.OP_SQRT], [ca.OP_SQRT]]


@settings(max_examples=60)
@given(st.lists(st.tuples(st.sampled_from(["+", "/", "sqrt", "exp", "?"]), st.randoms()), min_size=1, max_size=60))
def test_packed_operations_are_the_same_behind_what_they_need(made):
    known = [x, y, z]
    for how, of in made:
        a, b = of.choice(known), of.choice(known)
        new = {
            "+": a + b,
            "/": a / (b + 1.5),
            "sqrt": ca.sqrt(a * a + b),
            "exp": ca.exp(-a),
            "?": ca.if_else(a > b, a, b),
        }
        known.append(new[how])
    whole = graph(*known[3:])
    done = set()
    for group in packed(whole, range(len(whole.nodes))):
        assert len(group) <= packing.AT_ONCE
        assert len({packing._KINDS.get(whole.nodes[k].code, k) for k in group}) == 1
        for k in group:
            assert done.issuperset(whole.nodes[k].sources)
        assert done.isdisjoint(group)
        done.update(group)
    assert done == set(range(len(whole.nodes)))


@pytest.mark.parametrize("count", range(1, 7))
def test_machine_code_of_what_is_done_at_once_is_that_of_each(count):
    """To the last bit what a single one gives, whatever stands beside it."""
    a = ca.SX.sym("a", count)
    some = [ca.sqrt(a), 1.5 / a, 1.0 / (a + 1.0), ca.exp(a), ca.log(a), ca.tanh(a), a**1.7]
    beside = generated_module({"several": ca.Function("f", [a], [ca.vertcat(*some)], ["a"], ["b"])}, {}, "")
    one = ca.Function("f", [a[0]], [ca.vertcat(*(value[0] for value in some))], ["a"], ["b"])
    single = generated_module({"several": one}, {}, "")
    given, out, alone = np.linspace(0.3, 2.1, count), np.empty(len(some) * count), np.empty(len(some))
    beside.several(given, out)
    for k in range(count):
        single.several(given[k : k + 1].copy(), alone)
        np.testing.assert_array_equal(out[k::count], alone)


SEVERAL = 10  # states, more than a condition needs


def stepped(*new):
    """A step of a recursion, of states (s), two conditions (u) and nothing else, as `f(s, u) -> s_new`."""
    return ca.Function("f", [s, u], [ca.vertcat(*new)], ["s", "u"], ["s_new"])


s, u = ca.SX.sym("s", SEVERAL), ca.SX.sym("u", 2)


def written(step, whole=()):
    """How many results are written always, and where each of both conditions holds and where it does not."""
    one = graph_of(instructions(step))
    found = writes(one, {0: 0}, whole)
    return len(found.always), [(len(then.always), len(other.always)) for then, other in found.cases.values()]


def test_a_state_that_stays_is_not_written():
    assert written(stepped(s)) == (0, [])
    assert written(stepped(ca.if_else(u[0] > 0, 2.0 * s, s))) == (0, [(SEVERAL, 0)])
    assert written(stepped(ca.if_else(u[0] > 0, s, 2.0 * s))) == (0, [(0, SEVERAL)])


def test_what_is_chosen_behind_another_choice_is_written_where_both_are_so():
    inner = ca.if_else(u[1] > 0, s + 1.0, s)
    step = stepped(ca.if_else(u[0] > 0, s, inner))
    (outer,) = writes(graph_of(instructions(step)), {0: 0}).cases.values()
    assert not outer[0].cases
    assert not outer[0].always
    (cases,) = outer[1].cases.values()
    assert [len(case.always) for case in cases] == [SEVERAL, 0]


def test_states_that_change_places_are_all_written():
    """What stood elsewhere is a new value."""
    turned = ca.vertcat(s[1:], s[0])
    assert written(stepped(turned)) == (SEVERAL, [])
    assert written(stepped(ca.if_else(u[0] > 0, turned, s))) == (0, [(SEVERAL, 0)])


def test_few_states_are_chosen_and_not_branched_over():
    few = ca.vertcat(ca.if_else(u[0] > 0, 2.0 * s[0], s[0]), s[1:])
    assert written(stepped(few)) == (1, [])


def test_an_output_of_its_own_is_written_whatever_it_is():
    step = ca.Function("f", [s, u], [ca.if_else(u[0] > 0, 2.0 * s, s)], ["s", "u"], ["y"])
    one = graph_of(instructions(step))
    assert len(writes(one, {}).always) == SEVERAL


def nested():
    """A step that keeps, chooses and branches: in the cases of two conditions, with much in one of them."""
    long = ca.vertcat(*(much(s[k]) * 1e-3 + s[k - 1] for k in range(SEVERAL)))
    inner = ca.if_else(u[1] > 0.0, long, ca.vertcat(s[:5], s[5:] + u[0]))
    turned = ca.if_else(u[0] > 0.5, ca.vertcat(s[1:], s[0]), inner)
    return stepped(ca.if_else(ca.logic_and(u[0] < 0.0, u[1] < 0.5), s, turned))


@pytest.mark.parametrize("width", [1, 4, 8])
@pytest.mark.parametrize("seed", range(4))
def test_machine_code_that_writes_over_its_states_gives_what_the_graph_gives(seed, width):
    """Alone, and side by side with runs whose conditions are other ones."""
    step = nested()
    assert any(isinstance(item, Branch) for item in schedule(graph_of(instructions(step))))
    compiled = generated_module({"advance": step}, {}, "", {"advance": width})
    rng = np.random.default_rng(seed)
    for _ in range(100):
        states, given = rng.uniform(-0.5, 0.5, (SEVERAL, width)), rng.uniform(-1.0, 1.0, (2, width))
        expected = np.column_stack([np.asarray(step(states[:, k], given[:, k])).ravel() for k in range(width)])
        if width == 1:
            states, given, expected = states.ravel(), given.ravel(), expected.ravel()
        compiled.advance(states, given)
        np.testing.assert_allclose(states, expected, rtol=1e-12, atol=1e-15)


def test_a_usual_sample_writes_what_it_changes():
    """Of hundreds of states those that only a contact, a reference or a leak that is seen changes stay as they are."""
    recursion = kalman(build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))).recursion
    made = recursion.graph
    step = ca.Function("f", [made.x, made.u, made.p], [made.next_state], {"cse": True})
    one = graph_of(instructions(step))
    inside = {k for item in schedule(one) if isinstance(item, Branch) for k in (*item.then, *item.otherwise)}
    found = writes(one, {0: 0}, inside)
    refused, *_ = sorted(found.cases.values(), key=lambda both: -sum(1 for case in both for _ in case.nodes()))
    taken = max(refused, key=lambda case: len(case.always))
    assert len(found.always) + len(taken.always) < 0.6 * len(recursion.state)
    assert sum(1 for case in taken.cases.values() for one in case for _ in one.nodes()) > 200
