"""State as frozen dataclasses, kinds of expressions, and constants that know their reason."""

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import casadi as ca
import pytest

from evaluation.page_tables import constant_table
from ramsight.constant import Constant, constants_of
from ramsight.engine.typed_state import (
    chosen,
    column,
    initial_values,
    inlined,
    leaf,
    leaves,
    mapped,
    passed_over,
    symbols,
)
from ramsight.expression import (
    all_of,
    any_of,
    count,
    flag,
    flag_symbol,
    holds,
    negated,
    never,
    scalar,
    scalar_symbol,
    within,
)


@dataclass(frozen=True, kw_only=True)
class Part:
    level: object = leaf("Pa", 2.0)
    by: Mapping = leaf("1", None, learned=lambda key: key == "leak", variance=lambda key: key == "leak,leak")


@dataclass(frozen=True, kw_only=True)
class Whole:
    clock: object = leaf("s", 1.0, always=True, exact="time")
    parts: tuple = ()
    none: object = None
    bank: object = inlined()
    std: object = leaf("m2", 3.0, learned=True, variance=True)


def whole(*levels, bank=5.0):
    def part(level):
        return Part(level=scalar(level), by={"leak": scalar(level + 0.5), ("leak", "leak"): scalar(level + 0.75)})

    return Whole(parts=tuple(part(level) for level in levels), bank=part(bank))


def numbers(tree):
    return [float(ca.evalf(one.value)) for one in leaves(tree)]


NAMES = [
    "clock", "parts[0].level", "parts[0].by.leak", "parts[0].by[leak,leak]", "parts[1].level", "parts[1].by.leak",
    "parts[1].by[leak,leak]", "level", "by.leak", "by[leak,leak]", "std",
]  # fmt: skip


def test_names_are_paths_and_a_part_that_is_none_has_no_state():
    assert [one.name for one in leaves(whole(1.0, 2.0))] == NAMES


def test_first_values_stand_in_the_order_of_the_names():
    tree = whole(10.0, 20.0)
    assert list(initial_values(tree)) == [1.0, 10.0, 10.5, 10.75, 20.0, 20.5, 20.75, 5.0, 5.5, 5.75, 3.0]
    assert column(tree).numel() == len(NAMES)


def test_what_is_declared_of_a_field_is_declared_of_its_states():
    found = {one.name: one for one in leaves(whole(1.0, 2.0))}
    assert [name for name in NAMES if found[name].always] == ["clock"]
    assert [name for name in NAMES if found[name].exact] == ["clock"]
    assert found["clock"].exact == "time"
    assert [name for name in NAMES if found[name].learned] == ["parts[0].by.leak", "parts[1].by.leak", "by.leak", "std"]
    assert [name for name in NAMES if found[name].variance] == [
        "parts[0].by[leak,leak]", "parts[1].by[leak,leak]", "by[leak,leak]", "std",
    ]  # fmt: skip
    assert [found[name].unit for name in ("clock", "level", "by.leak", "std")] == ["s", "Pa", "1", "m2"]


def test_symbols_have_the_names_and_the_shape():
    before = symbols(whole(1.0))
    assert [one.value.name() for one in leaves(before)] == [one.name for one in leaves(before)]
    assert before.none is None
    assert set(before.parts[0].by) == {"leak", ("leak", "leak")}


def test_two_states_of_one_name_are_rejected():
    @dataclass(frozen=True, kw_only=True)
    class Twice:
        level: object = leaf("1")
        inner: object = inlined()

    with pytest.raises(ValueError, match="two states are named level"):
        symbols(Twice(inner=Part(level=scalar(0.0), by={})))


def test_a_change_of_each_state_leaves_the_tree_as_it_was():
    tree = whole(1.0)
    assert numbers(mapped(tree, lambda one: 2.0 * one.value)) == [2.0 * value for value in numbers(tree)]
    assert numbers(tree)[1] == 1.0


@pytest.mark.parametrize(("condition", "level"), [(True, 7.0), (False, 9.0)])
def test_one_of_two_states_is_chosen_as_a_whole(condition, level):
    assert numbers(chosen(flag(condition), whole(7.0), whole(9.0))) == numbers(whole(level))


def test_a_sample_that_is_passed_over_changes_only_what_is_declared_always():
    before, after = whole(7.0), mapped(whole(7.0), lambda one: one.value + 100.0)
    assert numbers(passed_over(flag(False), before, after)) == numbers(after)
    kept = numbers(passed_over(flag(True), before, after))
    assert kept[0] == numbers(after)[0], "the clock"
    assert kept[1:] == numbers(before)[1:]


def test_states_of_other_shape_do_not_pass_for_each_other():
    with pytest.raises(StopIteration):
        chosen(flag(True), whole(1.0, 2.0), whole(1.0))


def test_a_leaf_without_a_first_value_has_to_be_passed():
    with pytest.raises(TypeError, match="by"):
        Part()
    assert numbers(Part(by={})) == [2.0]


# Expressions

X = scalar_symbol("x")
BETWEEN = [(-0.5, False), (0.0, False), (0.5, True), (1.0, False), (1.5, False)]


def at(expression, x):
    return float(ca.Function("at", [X], [ca.SX(expression)])(x))


@pytest.mark.parametrize(("x", "inside"), BETWEEN)
def test_conditions_hold_together_one_by_one_or_not(x, inside):
    both, one = all_of(X > 0.0, X < 1.0), any_of(X <= 0.0, X >= 1.0)
    assert at(both, x=x) == float(inside)
    assert at(one, x=x) == float(not inside)
    assert at(negated(both), x=x) == float(not inside)
    assert at(count(both) + 2.0, x=x) == 2.0 + inside
    assert at(holds(count(both)), x=x) == float(inside)


@pytest.mark.parametrize("plain", [True, False])
def test_plain_conditions_are_conditions(plain):
    assert float(all_of(plain, True)) == float(plain)
    assert float(any_of(plain, False)) == float(plain)
    assert float(all_of(plain)) == float(any_of(plain)) == float(plain)
    assert float(count(plain)) == float(plain)
    assert at(all_of(plain, X > 0.0), x=1.0) == float(plain)


def test_only_a_condition_that_is_false_by_description_never_holds():
    assert never(flag(False))
    assert not never(flag(True))
    assert not never(flag_symbol("y"))
    assert never(all_of(False, X > 0.0)), "the graph has folded it"
    assert not never(any_of(False, X > 0.0))


@pytest.mark.parametrize(("value", "kept"), [(-2.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (3.0, 3.0), (3.1, 3.0)])
def test_a_number_is_kept_between_two_others(value, kept):
    assert float(within(scalar(value), -1.0, 3.0)) == kept


# Constants


def test_a_constant_is_a_number_that_knows_its_unit_and_reason():
    step = Constant(0.06, "rad/s", "half a step of 1 rpm")
    assert step == 0.06
    assert 2.0 * step == 0.12
    assert type(2.0 * step) is float, "what is worked out of it has another reason"
    again = pickle.loads(pickle.dumps(step))
    assert (again, again.unit, again.reason) == (0.06, "rad/s", "half a step of 1 rpm")


def test_a_table_has_the_constants_in_its_order_and_nothing_else():
    table = SimpleNamespace(B=Constant(1e-9, "1", "b"), plain=3.0, A=Constant(2.5, "m", "a"))
    assert list(constants_of(table)) == ["B", "A"]
    assert constant_table(table).splitlines() == [
        "| constant | value | unit | where it comes from |", "|---|---|---|---|", "| `B` | 1e-09 | 1 | b |",
        "| `A` | 2.5 | m | a |",
    ]  # fmt: skip
