"""A control that is taken over by hand, kept from pushing, cut from its power, and planned for."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.planning import Knowledge, Leg, Visit, due, expected, plan
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.control.activity import Activity
from ramsight.control.actuation import Actuation
from ramsight.control.orders import Reason
from ramsight.control.position import PositionControl
from ramsight.control.trajectory import Limits
from ramsight.plant.limits import limits_of
from ramsight.sensor.persistence import forgotten
from ramsight.sensor.status import Status

from .plant_bench import UNITS

DT = 0.02
BOOM, RAM = UNITS["mining-loader boom"], UNITS["press ram"]


def loop_of(unit, share=0.4, **setting):
    start, load = share * unit.cylinder.stroke, 0.3 * limits_of(unit).load
    return UnitLoop(unit, unit, start, load, LoopSettings(known=True, **setting))


def velocities(loop, unit, since):
    """True velocity of the rod, averaged over a tenth of a second [m/s]."""
    places = np.array(loop.records[unit.name].position[since:])
    return (places[5:] - places[:-5]) / (5 * DT)


@pytest.mark.parametrize("unit", [BOOM, RAM], ids=["valve", "pump"])
def test_a_hand_takes_over_and_gives_back_without_a_bump(unit):
    loop, control = loop_of(unit), None
    control = loop.controls[unit.name]
    wide = 0.4 * control.limits.speed
    loop.send({unit.name: 0.8 * unit.cylinder.stroke})
    loop.rest(2.0)
    before = len(loop.time)
    goes = velocities(loop, unit, before - 20).mean()
    control.steer(goes)
    loop.rest(1.0)
    assert control.activity is Activity.MANUAL
    control.steer(wide)
    loop.rest(1.5)
    assert velocities(loop, unit, -20).mean() == pytest.approx(wide, rel=0.1)
    target = loop.now.position[unit.name] + 0.1 * unit.cylinder.stroke
    loop.send({unit.name: target})
    loop.rest(0.4)
    acceleration = np.diff(velocities(loop, unit, before - 10)) / DT
    assert np.abs(acceleration).max() < 3.0 * control.limits.acceleration, "a bump is several times as much"
    loop.wait()
    assert not loop.stopped
    assert loop.now.position[unit.name] == pytest.approx(target, abs=1e-3)


def test_a_hand_is_slow_before_an_end_stop_and_holds_at_rest():
    loop = loop_of(BOOM, 0.85)
    control = loop.controls["boom"]
    control.steer(1.0)
    loop.rest(2.0)
    assert velocities(loop, BOOM, -20).mean() == pytest.approx(control.limits.speed, rel=0.1)
    while loop.now.position["boom"] < BOOM.cylinder.stroke - 0.9 * control.limits.landing_zone:
        loop.step()
    loop.rest(0.5)
    assert velocities(loop, BOOM, -10).mean() < 1.2 * control.limits.landing_speed
    control.steer(0.0)
    loop.rest(1.0)
    assert loop.now.motor_speed["boom"] == 0.0
    assert control.activity is Activity.MANUAL
    assert not control.done


def test_without_a_position_a_hand_may_go_slowly():
    loop = UnitLoop(BOOM, BOOM, 0.3, 0.3 * limits_of(BOOM).load)
    control = loop.controls["boom"]
    assert loop.records["boom"].estimate[-1].status is Status.NOT_REFERENCED
    control.steer(1.0)
    loop.rest(2.0)
    slow = control.tuning.homing_share * control.limits.speed
    assert velocities(loop, BOOM, -20).mean() == pytest.approx(slow, rel=0.2)


def test_a_load_beyond_the_largest_force_is_not_pushed():
    full = limits_of(BOOM).load
    loop = loop_of(BOOM, limits={"boom": Limits.of(BOOM, force=0.5 * full)})
    loop.send({"boom": 0.6})
    loop.rest(2.0)
    loop.load(0.6 * full, 0.3)
    at = loop.now.position["boom"]
    loop.rest(3.0)
    assert loop.stopped
    assert loop.reasons["boom"] == Reason.FORCE.text
    assert abs(loop.now.position["boom"] - at) < 0.01
    loop.go({"boom": 0.2})
    assert not loop.stopped, "what the load helps is allowed"


@pytest.mark.parametrize("unit", [BOOM, RAM], ids=["valve", "pump"])
def test_after_a_power_cut_nothing_moves_by_itself_and_a_reference_is_asked_for(unit):
    """The motor stops at once, the sensor comes back from a slot that says that the piston moved."""
    name, stroke = unit.name, unit.cylinder.stroke
    loop = loop_of(unit)
    loop.send({name: (0.4 + 0.4 * unit.lift_sign) * stroke})
    loop.rest(2.0)
    place = loop.now.position[name]
    loop.motor_fault = lambda _, speed: 0.0
    loop.controls[name] = PositionControl(unit)  # power-up: everything anew
    loop.sensors[name].state = forgotten(loop.sensors[name], loop.sensors[name].state)
    loop.rest(1.0)
    loop.motor_fault = None
    assert loop.records[name].command[-1] == 0.0
    sinks = abs(loop.now.position[name] - place)
    assert sinks < (5e-3 if loop.controls[name].holding.stands else 0.02 * stroke)
    loop.rest(2.0)
    estimate = loop.records[name].estimate[-1]
    assert estimate.status is Status.NOT_REFERENCED
    if loop.controls[name].holding.stands:
        assert loop.now.motor_speed[name] == 0.0
    loop.controls[name].move_to(0.5 * stroke)
    loop.rest(0.5)
    assert loop.stopped
    assert loop.reasons[name] == Status.NOT_REFERENCED.text
    loop.home(name)
    assert not loop.stopped
    loop.go({name: 0.5 * stroke})
    assert loop.now.position[name] == pytest.approx(0.5 * stroke, abs=0.01 * stroke)


def knowledge(leak=0.16, displacement=0.006):
    control = PositionControl(BOOM)
    by = Actuation.of(BOOM)
    return Knowledge(by, np.diag([3e-4, leak, displacement]) ** 2), control


def test_a_move_makes_a_position_uncertain_by_what_may_leak_and_by_its_way():
    known, _ = knowledge(leak=0.1, displacement=0.0)
    leg = Leg(0.28, 2e5, 0.028)
    leaks = known.by.leakage(2e5) * known.by.holding.travel_per_radian(2e5) * leg.time
    assert known.after(leg).std == pytest.approx(math.hypot(0.1 * leaks, 3e-4), rel=0.05)
    slow = Leg(0.28, 2e5, 0.007)
    assert known.after(slow).std > 3.5 * known.after(leg).std
    known, _ = knowledge(leak=0.0)
    assert known.after(leg).std == pytest.approx(math.hypot(0.006 * 0.28, 3e-4), rel=0.1)


def test_a_reference_after_a_way_tells_what_leaked_on_it():
    known, _ = knowledge(displacement=1e-6)
    told = known.after(Leg(0.3, 2e5, 0.007)).referenced()
    less = known.after(Leg(0.3, 2e5, 0.028)).referenced()
    leaks = [math.sqrt(one.covariance[1, 1]) for one in (told, less, known)]
    assert leaks[0] < 0.5 * leaks[1] < 0.5 * leaks[2]
    eigenvalues = np.linalg.eigvalsh(told.covariance)
    assert eigenvalues.min() > 0.0


def test_the_quickest_visits_that_bring_nearly_all_are_planned_and_none_if_nothing_is_gained():
    known, control = knowledge()
    work = [(0.5, 2e5), (0.2, 2e5), (0.6, 2e5)]
    low, top, slow = Visit(False), Visit(True), Visit(True, slow=True)
    by = {way: expected(known, control, 0.0, 2e5, work, way) for way in ((), (low,), (top,), (top, low), (slow, low))}
    assert by[low,].std == pytest.approx(by[()].std, rel=0.01), "who stands on the lowered stop learns nothing there"
    assert by[slow, low].std < by[top, low].std < 0.5 * by[()].std
    assert by[slow, low].cost > by[top, low].cost > by[top,].cost
    best = plan(known, control, 0.0, 2e5, work, [low, top, slow])
    least = min(one.std for one in by.values())
    assert best.visits
    assert best.std <= least + 0.11 * (by[()].std - least)
    light = plan(known, control, 0.0, 8e4, work, [low, top, slow])
    assert low not in light.visits[:1], "an empty boom is no reason to stay where it is"
    sure, _ = knowledge(leak=1e-3, displacement=1e-5)
    assert plan(sure, control, 0.3, 2e5, work, [low, top, slow], 1).visits == ()


def test_a_reference_is_due_sooner_if_less_is_known_or_more_is_asked():
    known, control = knowledge()
    sure, _ = knowledge(leak=0.01, displacement=0.0005)
    work = [(0.5, 2e5), (0.2, 2e5)]
    soon, late = due(known, control, 0.3, work, 3e-3), due(sure, control, 0.3, work, 3e-3)
    assert 0.0 < soon < late
    assert due(known, control, 0.3, work, 1e-4) == 0.0
    assert due(known, control, 0.3, work, 10.0, longest=100.0) >= 100.0
    assert due(known, control, 0.3, [(0.3, 2e5)], 1.0, longest=50.0) == 50.0


def test_what_is_predicted_is_near_what_the_sensor_then_says():
    """Where no load is assumed to change at rest, which the plan leaves out."""
    loop = loop_of(replace(BOOM, assumptions=BOOM.assumptions.replace({"machine.unseen_load": 0.01})))
    for lifted in (False, True):
        loop.home("boom", lifted=lifted)
    load, control = 0.3 * limits_of(BOOM).load, loop.controls["boom"]
    known = Knowledge.of(loop.sensors["boom"], control)
    place = loop.records["boom"].estimate[-1].position
    for target in (0.35, 0.15):
        known = known.after(Leg(target - place, load, control.limits.speed))
        loop.go({"boom": target})
        place = target
        # The sensor adds a band around what it believes.
        assert 0.4 < known.std / loop.records["boom"].estimate[-1].position_std < 1.1


def test_a_planned_visit_is_made():
    loop = loop_of(BOOM)
    loop.calibrate("boom", Visit(lifted=False, slow=True, turns=0.05))
    assert not loop.stopped
    assert loop.now.position["boom"] == pytest.approx(0.0, abs=2e-3)
    moved = [one.velocity for one in loop.records["boom"].estimate[-500:]]
    assert min(moved) > -0.5 * loop.controls["boom"].limits.speed
