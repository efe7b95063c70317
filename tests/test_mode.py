"""The table of modes: it says for every mode and every sample where it leads, and the sensor does what it says."""

import re
from pathlib import Path

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ramsight.sensor.contacts.mode import FREE, HELD, TRANSITIONS, Mode, is_in, next_mode

CONDITIONS = sorted({row.when for row in TRANSITIONS} - {"otherwise"})
DOCS = Path(__file__).parent.parent / "docs"


def by_the_table(mode, conditions):
    """The first row that fits, read as a person would."""
    return next(
        row.after for row in TRANSITIONS if mode in row.before and (row.when == "otherwise" or conditions[row.when])
    )


@given(mode=st.sampled_from(Mode), true=st.sets(st.sampled_from(CONDITIONS)))
def test_the_next_mode_is_that_of_the_first_row_that_fits(mode, true):
    conditions = {name: name in true for name in CONDITIONS}
    numbers = {name: ca.DM(float(value)) for name, value in conditions.items()}
    assert float(next_mode(ca.DM(float(mode)), numbers)) == by_the_table(mode, conditions)


@pytest.mark.parametrize("mode", Mode)
def test_every_mode_has_an_end_of_its_rows_and_can_be_reached_and_left(mode):
    assert any(mode in row.before and row.when == "otherwise" for row in TRANSITIONS)
    assert any(row.after is mode for row in TRANSITIONS)
    assert any(mode in row.before and row.after is not mode for row in TRANSITIONS)


def test_no_row_is_behind_one_that_always_fits():
    for k, row in enumerate(TRANSITIONS):
        done = {mode for above in TRANSITIONS[:k] if above.when == "otherwise" for mode in above.before}
        assert not done.intersection(row.before), row


def test_a_held_piston_is_let_go_before_it_is_free():
    for mode in HELD:
        after = {row.after for row in TRANSITIONS if mode in row.before}
        assert after <= {*HELD, Mode.LEAVING}
    assert set(FREE) | set(HELD) | {Mode.LEAVING} == set(Mode)


@pytest.mark.parametrize("mode", Mode)
def test_a_mode_is_in_what_it_is_in(mode):
    assert bool(is_in(ca.DM(float(mode)), HELD)) == (mode in HELD)
    assert mode.text


def test_a_missing_condition_is_an_error():
    with pytest.raises(KeyError, match="released"):
        next_mode(ca.DM(0.0), {name: 0.0 for name in CONDITIONS if name != "released"})


def test_the_page_has_the_table():
    page = (DOCS / "explanation" / "contacts.md").read_text()
    rows = re.findall(r"^\| \d+ \| (.*?) \| (.*?) \| (.*?) \|$", page, re.MULTILINE)
    groups = {(*FREE, *HELD, Mode.LEAVING): "any", (*FREE, Mode.LEAVING): "free, `LEAVING`", HELD: "held", FREE: "free"}
    expected = [
        (groups.get(row.before) or ", ".join(f"`{m.name}`" for m in row.before), row.when, f"`{row.after.name}`")
        for row in TRANSITIONS
    ]
    assert rows == expected
