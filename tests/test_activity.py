"""A control's activities: the table says for each what may follow, and the control does what it says."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight import machine
from ramsight.control.activity import ANY, GOING, STOPS, TRANSITIONS, Activity, Event, after
from ramsight.control.position import PositionControl
from ramsight.control.resting import Resting
from ramsight.control.stopping import STOPPING_TIME, Stopping
from ramsight.duty.live import Reported
from ramsight.plant.build import build_unit
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

BOOM = build_unit("boom", machine.load("mining-loader").unit("boom"))
DT, WARM = 0.02, 313.15
PAGE = Path(__file__).parent.parent / "docs" / "control.md"


@pytest.mark.parametrize("activity", Activity)
def test_every_activity_can_be_reached_and_left(activity):
    assert any(row.after is activity for row in TRANSITIONS)
    assert any(activity in row.before and row.after is not activity for row in TRANSITIONS)


def test_an_event_leads_from_an_activity_to_one_other():
    pairs = [(before, row.when) for row in TRANSITIONS for before in row.before]
    assert len(pairs) == len(set(pairs))
    assert {row.when for row in TRANSITIONS} == set(Event)
    assert set(GOING) | set(STOPS) == set(ANY) == set(Activity)


def test_what_is_not_in_the_table_is_refused():
    with pytest.raises(ValueError, match="resting: no transition when 'target is near'"):
        after(Activity.RESTING, Event.NEAR)
    with pytest.raises(ValueError, match="nothing follows 'time is over'"):
        PositionControl(BOOM)._doing.leave(Event.OVER)
    control = PositionControl(BOOM)
    with pytest.raises(ValueError, match="not in the table"):
        control._become(Event.FAILED, Resting(control.actuation))


STATUS = st.sampled_from([Status.OK, Status.OK, Status.REFERENCE_DUE, Status.INPUT_LOST])
ASKED = st.sampled_from([None, None, "move", "home", "leak test", "stop"])


@settings(max_examples=40, deadline=None)
@given(steps=st.lists(st.tuples(ASKED, STATUS, st.integers(1, 40)), min_size=3, max_size=12), seed=st.integers(0, 9))
def test_whatever_happens_the_control_goes_by_the_table(steps, seed):
    """A crude rod follows the commands; every change from sample to sample is one or two rows of the table."""
    control, x, speed, k = PositionControl(BOOM), 0.1 + 0.05 * seed, 0.0, 0
    rows = {(before, row.after) for row in TRANSITIONS for before in row.before}
    double = {(a, d) for a, b in rows for c, d in rows if b is c}
    for asked, status, count in steps:
        begun = control.activity
        if asked == "move":
            control.move_to(0.3)
        elif asked == "home":
            control.home()
        elif asked == "leak test":
            control.leak_test()
        elif asked == "stop":
            control.stop("by hand")
        assert control.activity is begun or (begun, control.activity) in rows
        for _ in range(count):
            k += 1
            before = control.activity
            there = Estimate(x, 1e-4, 0.0, 2e5, status)
            speed = control.step(there, Reported(k * DT, speed, 20.0 + k % 7, WARM)).motor_speed
            x = min(max(x + 0.135e-3 * speed * DT, 0.0), 0.7)
            assert control.activity is before or (before, control.activity) in rows | double
        assert (control.activity in STOPS) <= bool(control.reason)


def test_a_stop_takes_the_time_that_is_stated_and_ends_in_the_sample_in_which_the_motor_is_told_to_stand():
    control = PositionControl(BOOM)
    control.move_to(0.6)
    speed = 0.0
    for k in range(60):
        speed = control.step(
            Estimate(0.1 + 4e-4 * k, 1e-4, 0.0, 2e5, Status.OK), Reported(k * DT, speed, k, WARM)
        ).motor_speed
    control.stop("by hand")
    assert isinstance(control._doing, Stopping)
    count = 0
    while control.activity is Activity.STOPPING:
        speed = control.step(
            Estimate(0.13, 1e-4, 0.0, 2e5, Status.OK), Reported(2.0 + count * DT, speed, count, WARM)
        ).motor_speed
        count += 1
    assert count == round((STOPPING_TIME - DT) / DT)
    assert speed == 0.0
    assert control.reason == "by hand"


def test_the_page_has_the_table():
    rows = re.findall(r"^\| \d+ \| (.*?) \| (.*?) \| (`.*?`) \|$", PAGE.read_text(), re.MULTILINE)
    groups = {ANY: "any", GOING: "any but the stops"}
    expected = [
        (
            groups.get(row.before) or ", ".join(f"`{one.name}`" for one in row.before),
            row.when.value,
            f"`{row.after.name}`",
        )
        for row in TRANSITIONS
    ]
    assert rows == expected


@pytest.mark.parametrize("speed", [0.1, 33.3, 100.0, 123.456, 417.9])
def test_a_stop_from_any_speed_takes_no_sample_more(speed):
    control = PositionControl(BOOM)
    control._speed = speed
    control.stop("by hand")
    there = Estimate(0.13, 1e-4, 0.0, 2e5, Status.OK)
    speeds = [control.step(there, Reported(k * DT, speed, k, WARM)).motor_speed for k in range(8)]
    assert speeds.index(0.0) + 1 == round((STOPPING_TIME - DT) / DT)
