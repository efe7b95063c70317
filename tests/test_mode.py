"""The table of modes: it says for every mode and every sample where it leads, and the sensor does what it says."""

import re
from pathlib import Path
from types import SimpleNamespace

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ramsight.sensor.contacts.contact import _mode
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


@pytest.mark.parametrize(
    ("so", "after"),
    [
        ({}, Mode.RESTING_ON_VALVE),
        ({"shows": 1.0}, Mode.RESTING_ON_PUMP),
        ({"shows": 1.0, "turns": 1.0}, Mode.MOVING),
        ({"turns": 1.0, "relief": 0.01}, Mode.OVER_RELIEF),
        ({"relief": 0.01, "empty": 1.0}, Mode.EMPTY),
        ({"empty": 1.0, "stopped": 1.0, "way": -1.0}, Mode.HELD_RETRACTING),
        ({"empty": 1.0, "stopped": 1.0, "way": 1.0}, Mode.HELD_EXTENDING),
    ],
)
def test_a_free_piston_does_what_is_seen_of_it(so, after):
    seen = {name: ca.SX(so.get(name, 0.0)) for name in ("shows", "turns", "relief", "empty", "stopped", "way")}
    state = SimpleNamespace(mode=ca.SX(float(Mode.MOVING)), left_from=ca.SX(0.0))
    step = SimpleNamespace(
        motion=SimpleNamespace(noise=ca.SX(1e-4)),
        load=SimpleNamespace(empty=seen["empty"]),
        torque=SimpleNamespace(shows=seen["shows"]),
    )
    now = SimpleNamespace(position=ca.SX(0.3), relief=seen["relief"])
    motor = SimpleNamespace(way=seen["way"], turns=seen["turns"])
    found = _mode(state, step, now, ca.SX(0.0), motor, seen["stopped"])
    assert Mode(int(ca.evalf(found))) is after


def test_the_page_has_the_table():
    page = (DOCS / "explanation" / "contacts.md").read_text()
    rows = re.findall(r"^\| \d+ \| (.*?) \| (.*?) \| (.*?) \|$", page, re.MULTILINE)
    groups = {(*FREE, *HELD, Mode.LEAVING): "any", (*FREE, Mode.LEAVING): "free, `LEAVING`", HELD: "held", FREE: "free"}
    expected = [
        (groups.get(row.before) or ", ".join(f"`{m.name}`" for m in row.before), row.when, f"`{row.after.name}`")
        for row in TRANSITIONS
    ]
    assert rows == expected
