"""A control's activities: the table says for each what may follow, and the control does what it says."""

import math
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight import machine
from ramsight.control.activity import (
    ACTIVITIES,
    ANY,
    GOING,
    STOPS,
    TRANSITIONS,
    Activity,
    ActivityState,
    Event,
    after,
    fail,
    follow,
)
from ramsight.control.orders import Reason
from ramsight.control.position import PositionControl
from ramsight.control.thresholds import STOPPING_TIME
from ramsight.duty.live import Reported
from ramsight.expression import flag, scalar
from ramsight.plant.build import build
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .control_bench import number, numbers

BOOM = build(machine.load_machine("mining-loader").unit("boom"), "boom")
DT, WARM = 0.02, 313.15
PAGE = Path(__file__).parent.parent / "docs" / "explanation" / "control-concept.md"


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
    with pytest.raises(ValueError, match="homing: no transition when 'target is near'"):
        follow(ActivityState(), [(Activity.HOMING, Event.NEAR, True)])
    with pytest.raises(ValueError, match="no transition when 'time is over'"):
        follow(ActivityState(), [(None, Event.OVER, True)])


def doing(activity):
    return ActivityState(number=scalar(activity.number))


def leads(activity, event, happens):
    """Where an event leads in the graph, and whether the next sample is a first one."""
    new = follow(doing(activity), [(activity, event, flag(happens))])
    return ACTIVITIES[int(number(new.number))], bool(number(new.begins))


FOLLOWED = [(before, row) for row in TRANSITIONS for before in row.before if row.when is not Event.FAILED]


@pytest.mark.parametrize(("before", "row"), FOLLOWED, ids=lambda one: getattr(one, "name", None))
def test_an_event_of_the_table_leads_there_and_one_that_does_not_happen_nowhere(before, row):
    assert leads(before, row.when, True) == (row.after, True)
    assert leads(before, row.when, False) == (before, False)


@pytest.mark.parametrize("before", Activity)
def test_a_failure_stops_what_goes_and_leaves_a_stop_as_it_is(before):
    new = numbers(fail(doing(before), {Reason.SENSOR: flag(True), Reason.ROD: flag(True)}, scalar(7.0)))
    if before in STOPS:
        assert (float(new.number), float(new.reason)) == (before.number, Reason.NONE)
    else:
        assert (float(new.number), float(new.reason)) == (Activity.STOPPING.number, Reason.SENSOR), "the first counts"
        assert float(new.ramp) == 7.0
    still = numbers(fail(doing(before), {Reason.SENSOR: flag(False)}, scalar(7.0)))
    assert float(still.number) == before.number


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
    assert control.activity is Activity.STOPPING
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
    control.state = control.state | {"motor_speed": speed}
    control.stop("by hand")
    there = Estimate(0.13, 1e-4, 0.0, 2e5, Status.OK)
    speeds = [control.step(there, Reported(k * DT, math.nan, k, WARM)).motor_speed for k in range(8)]
    assert speeds.index(0.0) + 1 == round((STOPPING_TIME - DT) / DT)


def test_a_stop_before_the_first_sample_of_an_order_is_the_order_that_counts():
    control = PositionControl(BOOM)
    control.move_to(0.6)
    assert control.activity is Activity.MOVING
    control.stop("by hand")
    assert control.activity is Activity.STOPPING
    there = Estimate(0.1, 1e-4, 0.0, 2e5, Status.OK)
    done = [control.step(there, Reported(k * DT, 0.0, k, WARM)) for k in range(3)]
    assert {one.motor_speed for one in done} == {0.0}
    assert (done[-1].activity, done[-1].reason) == (Activity.STOPPED, "by hand")
    control.move_to(0.6)
    assert (control.activity, control.reason) == (Activity.MOVING, "")
    control.stop("by hand once more")
    assert control.step(there, Reported(1.0, 0.0, 9.0, WARM)).reason == "by hand once more"


def test_a_target_that_is_given_again_is_gone_to_again():
    control, there = PositionControl(BOOM), Estimate(0.3, 1e-4, 0.0, 2e5, Status.OK)
    control.move_to(0.3)
    for k in range(60):
        activity = control.step(there, Reported(k * DT, 0.0, k, WARM)).activity
    assert activity is Activity.RESTING
    control.move_to(0.3)
    assert control.step(there, Reported(2.0, 0.0, 1.5, WARM)).activity in {Activity.MOVING, Activity.LANDING}
