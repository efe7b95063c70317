"""References that a loop takes by itself: when they are due, and only where they may be taken."""

import numpy as np
import pytest

from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.planning import Visit
from ramsight.closed_loop.referencing import LoopSettings, Referencing, felt
from ramsight.plant.limits import limits_of
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .plant_bench import UNITS

AXIS = UNITS["eha-test-bench axis"]
STROKE = AXIS.cylinder.stroke
BOTH = {"axis": (Visit(lifted=False), Visit(lifted=True))}
WORK = (0.3, 0.7, 0.4, 0.8, 0.2, 0.6, 0.5, 0.9, 0.1, 0.7, 0.3, 0.6)  # shares of the stroke


def worked(renewing, work=WORK):
    """A loop that goes from target to target until it has stopped; and how many it reached."""
    load = 0.4 * limits_of(AXIS).load
    loop, reached = UnitLoop(AXIS, AXIS, 0.5 * STROKE, load, LoopSettings(known=True, referencing=renewing)), 0
    for share in work:
        loop.go({"axis": share * STROKE})
        if loop.stopped:
            break
        reached += 1
    return loop, reached


def test_work_goes_on_where_references_may_be_taken_and_ends_where_not():
    loop, reached = worked(Referencing(BOTH))
    assert reached == len(WORK)
    assert 1 <= len(loop.visited) <= 6
    assert abs(loop.now.position["axis"] - WORK[-1] * STROKE) < 0.02 * STROKE
    alone, fewer = worked(None)
    assert fewer < len(WORK)
    assert alone.reasons["axis"] == Status.TOO_UNCERTAIN.text
    assert alone.visited == []


def test_no_rod_goes_to_a_stop_that_is_not_among_those_that_may_be_visited():
    loop, _ = worked(Referencing({"axis": (Visit(lifted=False),)}), WORK[:5])
    assert {visit.lifted for *_, visit in loop.visited} == {False}
    highest = max(loop.records["axis"].position)
    assert (STROKE - highest if AXIS.lift_sign > 0.0 else highest) > 0.01 * STROKE
    other, _ = worked(Referencing({"boom": (Visit(lifted=False),)}), WORK[:2])
    assert other.visited == []


def test_a_smaller_limit_asks_for_more_references():
    often, _ = worked(Referencing(BOTH, 0.5e-3), WORK[:9])
    seldom, _ = worked(Referencing(BOTH, 10e-3), WORK[:9])
    assert len(often.visited) > len(seldom.visited)


def test_how_much_work_is_left_until_a_reference_is_due():
    loop, _ = worked(Referencing(BOTH), ())
    places = [0.7 * STROKE, 0.3 * STROKE]
    left = loop.reference_due("axis", places)
    assert 0.0 < left < 60.0
    std = max(one.position_std for one in loop.records["axis"].estimate)
    assert std < 0.01 * STROKE
    for place in places * 3:
        loop._go({"axis": place})
    due = next(k for k, one in enumerate(loop.records["axis"].estimate) if one.status is Status.REFERENCE_DUE)
    assert loop.time[due] < 3.0 * left + 3.0, "what is predicted is a lower limit of what is not known"
    assert loop.reference_due("axis", places) == 0.0
    assert loop.take_references({"axis": places[0]}) >= 1
    assert loop.reference_due("axis", places) > 0.0


def test_a_sensor_that_still_asks_gets_another_of_the_references_that_are_allowed(monkeypatch):
    loop, _ = worked(Referencing(BOTH), ())
    monkeypatch.setattr("ramsight.closed_loop.driven.ASKS", frozenset(Status))
    loop.records["axis"].estimate[-1] = Estimate(0.1, 1.0, 0.0, 1e4, Status.REFERENCE_DUE)
    monkeypatch.setattr("ramsight.closed_loop.referencing.ASKS", frozenset(Status))
    assert loop.reference_due("axis", [0.5 * STROKE]) == 0.0, "it asks, whatever its standard deviation"
    assert loop.take_references({"axis": 0.5 * STROKE}) == 2
    assert {visit.lifted for *_, visit in loop.visited} == {False, True}


def test_the_load_is_the_one_that_was_felt_in_motion():
    def said(velocity, load):
        return Estimate(0.1, 1e-3, velocity, load, Status.OK)

    assert felt([said(0.02, 5e3), said(-0.02, 7e3), said(0.03, 6e3), said(0.0, 1.0)]) == 6e3
    assert felt([said(0.0, 2.0), said(0.0, 1.0)]) == 1.0
    assert felt([said(0.1, 9e3)] + [said(0.0, 3.0)] * 1500) == 3.0, "too long ago"


@pytest.mark.parametrize("turns", [0.05, np.nan])
def test_a_planned_visit_may_begin_elsewhere_and_takes_no_other_on_the_way(turns):
    loop, _ = worked(Referencing(BOTH), WORK[:1])
    before = len(loop.visited)
    loop.calibrate("axis", Visit(lifted=False, turns=turns))
    assert len(loop.visited) == before + 1
    assert not loop.stopped
