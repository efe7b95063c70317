"""Contacts: found where the piston stands, not where a load rises, and let go of."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from ramsight.duty import report
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.limits import limits_of
from ramsight.sensor.contacts.contact_release import way_gone
from ramsight.sensor.contacts.mode import Mode
from ramsight.sensor.kalman import kalman

from .plant_bench import CIRCUITS, UNITS
from .sensor_bench import begin, changing, load_observer, lowered, moves, observers, quiet

LOADER = ["mining-loader boom", "mining-loader bucket"]


def watched(name, run, log):
    """What a watch says of a run whose start it knows."""
    observer = observers(name, watches=True)
    begin(observer, float(run["position"][0]))
    return observer.track(log)


@lru_cache
def into_a_stop(name, end, share=0.3, back=2.0, stiffness=1.0):
    """Into a stop, pressed for a while, and back, which may be left out: the run and its log."""
    unit = UNITS[name]
    lifts = 1.0 if end == "up" else -1.0
    start = lowered(unit, (0.85 if end == "up" else 0.15) * unit.cylinder.stroke)
    way = 0.18 * unit.cylinder.stroke / (0.25 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (1.0, 0.0), (1.4, 0.25), (1.8 + way, 0.25), (2.2 + way, 0.0), (3.0 + way, 0.0)]
    if back:
        corners += [(3.4 + way, -0.25), (3.4 + way + back, -0.25), (3.8 + way + back, 0.0)]
    load = share * limits_of(unit).load
    return moves(AsBuilt(stiffness=stiffness).apply(unit), [(t, lifts * v) for t, v in corners], load, start)


def stands_from(run, unit):
    """When the piston has come to a stop [s]."""
    depth = np.maximum(run["position"].values - unit.cylinder.stroke, -run["position"].values)
    return float(run["time"].values[np.argmax(depth > 0.0)])


@pytest.mark.parametrize("name", LOADER)
@pytest.mark.parametrize("end", ["up", "down"])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_stop_is_found_within_three_tenths_of_a_second(name, end, seed):
    unit = UNITS[name]
    run, _ = into_a_stop(name, end)
    log = report(run, quiet(unit, seed=seed, share=0.003))
    said, contact = watched(name, run, log), stands_from(run, unit)
    found = run["time"].values[said["found"] > 0.0]
    assert 1 <= found.size <= 2, "once, and perhaps again when the oil decompresses on the way back"
    assert 0.0 <= found[0] - contact < 0.33, "0.3 s and a sample"
    first = int(np.argmax(said["found"]))
    there = 0.0 if run["position"].values[first] < 0.5 * unit.cylinder.stroke else unit.cylinder.stroke
    for k in np.flatnonzero(said["found"]):
        assert said["place"][k] == pytest.approx(there, abs=0.003 * unit.cylinder.stroke)
        assert said["at_top"][k] == (there > 0.0)
        assert said["held"][k] == (k == first), "a piston that leaves is not held"
    before = run["time"].values < contact - 0.05
    assert not said["held"][before].any()
    assert not said["found"][before].any()


@pytest.mark.parametrize("name", LOADER)
@pytest.mark.parametrize("end", ["up", "down"])
def test_a_held_piston_stands_and_is_let_go_when_the_motor_turns_the_other_way(name, end):
    unit = UNITS[name]
    run, log = into_a_stop(name, end)
    said = watched(name, run, log)
    held = said["held"] > 0.0
    first, last = np.flatnonzero(held)[[0, -1]]
    assert held[first : last + 1].all(), "held once and for all"
    assert np.ptp(said["position"][first : last + 1]) < 0.2e-3
    speed, place = run["motor_speed"].values, run["position"].values
    assert np.sign(speed[last + 1]) == -np.sign(speed[first])
    gone = np.abs(place - place[first])
    assert gone[last + 1] < 0.002 * unit.cylinder.stroke, "not before it goes"
    assert (np.abs(said["position"] - place) < 0.006 * unit.cylinder.stroke)[last:].all()
    assert said["released"].sum() == 1.0
    assert said["released"][last + 1] == 1.0
    assert said["state_contact.mode"][last + 1] == Mode.LEAVING
    far = np.abs(said["position"] - said["position"][last]) > 0.02 * unit.cylinder.stroke
    far[: last + 1] = False
    assert far.any()
    assert not (said["state_contact.mode"][far] == Mode.LEAVING).any(), "it has left"
    assert said["position"][-1] == pytest.approx(run["position"].values[-1], abs=0.006 * unit.cylinder.stroke)


@pytest.mark.parametrize("name", LOADER)
def test_pushing_begins_when_the_motor_goes_on_the_same_way_and_builds_up_torque(name):
    unit = UNITS[name]
    run, log = into_a_stop(name, "up")
    said = watched(name, run, log)
    pushing = said["pushing"] > 0.0
    assert pushing.any()
    assert (said["held"][np.flatnonzero(pushing) - 1] > 0.0).all()
    lifting = run["motor_speed"].values * unit.lift_sign > 1.0
    assert lifting[pushing].all()
    begun, last = np.flatnonzero(pushing)[[0, -1]]
    grown = (said["expected"][last] - said["expected"][begun - 1]) * unit.lift_sign
    assert grown > 0.05 * limits_of(unit).torque


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize("grows", ["ramp", "jump"])
@pytest.mark.parametrize("lifts", [1.0, -1.0])
def test_a_load_that_grows_is_no_contact(name, grows, lifts):
    """By 30 % of the largest in half a second, or by 30 % of itself in a tenth, and back, while the piston moves."""
    unit = UNITS[name]
    load, stroke = limits_of(unit).load, unit.cylinder.stroke
    span, least, most = {"ramp": (0.5, 0.3 * load, 0.6 * load), "jump": (0.1, 0.4 * load, 0.52 * load)}[grows]
    loads = [(0.0, least), (1.5, least), (1.5 + span, most), (2.5, most), (2.5 + span, least), (3.8, least)]
    share = min(0.3, 0.5 * stroke / (3.2 * unit.max_speed * unit.travel_per_radian))
    corners = [(0.0, 0.0), (0.3, 0.0), (0.6, lifts * share), (3.8, lifts * share)]
    run, _ = moves(unit, corners, changing(loads), lowered(unit, (0.5 - 0.3 * lifts) * stroke))
    for seed in range(3):
        said = watched(name, run, report(run, quiet(unit, seed=seed, share=0.005)))
        assert not said["found"].any()
        assert not said["held"].any()


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize("speed", [0.02, 0.1, 0.6])
def test_lifting_slowly_or_fast_is_no_contact(name, speed):
    unit = UNITS[name]
    load, stroke = limits_of(unit).load, unit.cylinder.stroke
    span = min(4.0, 0.4 * stroke / (speed * unit.max_speed * unit.travel_per_radian) - 0.3)
    corners = [(0.0, 0.0), (0.5, 0.0), (0.8, speed), (0.8 + span, speed), (1.1 + span, 0.0), (2.0 + span, 0.0)]
    corners += [(2.3 + span, -speed), (2.3 + 2.0 * span, -speed), (2.6 + 2.0 * span, 0.0)]
    run, _ = moves(unit, corners, 0.25 * load, lowered(unit, 0.4 * stroke))
    said = watched(name, run, report(run, quiet(unit, share=0.005)))
    assert not said["found"].any()


@lru_cache
def onto_the_floor():
    """A mast let down onto its lower end, where the pump draws from the tank."""
    unit = UNITS["forklift-mast lift"]
    way = 0.1 * unit.cylinder.stroke / (0.25 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (1.0, 0.0), (1.4, -0.25), (3.0 + way, -0.25), (3.4 + way, 0.0)]
    run, log = moves(unit, corners, 28e3, lowered(unit, 0.1 * unit.cylinder.stroke))
    return unit, run, watched("forklift-mast lift", run, log), stands_from(run, unit)


def test_a_lowered_end_without_a_pump_on_the_other_side_shows_as_an_empty_chamber():
    _, run, said, contact = onto_the_floor()
    found = run["time"].values[said["found"] > 0.0]
    assert found.size == 1
    assert -0.02 <= found[0] - contact < 0.5
    k = int(np.argmax(said["found"]))
    assert said["empty"][k] == 1.0
    assert said["at_top"][k] == 0.0
    assert not said["empty"][run["time"].values < contact - 0.05].any()


def test_a_lowered_end_is_where_the_mast_came_to_stand():
    unit, _, said, _ = onto_the_floor()
    place = said["place"][int(np.argmax(said["found"]))]
    assert place == pytest.approx(0.0, abs=0.005 * unit.cylinder.stroke)


def test_forks_that_are_light_beside_the_noise_are_followed_down():
    """They show three standard deviations of a single torque; over a few tenths of a second that is something."""
    unit = UNITS["forklift-mast lift"]
    noisy = unit.assumptions.model_copy(update={"drive": unit.assumptions.drive.model_copy(update={"torque": 0.02})})
    load = 3.0 * 0.02 * limits_of(unit).load
    start = 0.6 * unit.cylinder.stroke
    corners = [(0.0, 0.0), (0.5, 0.0), (0.8, 0.2), (1.8, 0.2), (2.1, 0.0), (2.5, 0.0), (2.8, -0.3), (5.0, -0.3)]
    run, _ = moves(unit, [*corners, (5.3, 0.0), (6.0, 0.0)], load, start)
    observer = load_observer(unit, watches=True, assumptions=noisy)
    goes = run["motor_speed"].values < -0.1 * unit.max_speed
    followed = 0
    for seed in range(16):
        begin(observer, start)
        said = observer.track(report(run, quiet(unit, seed=seed, share=0.02)))
        off = abs(said["position"][-1] - run["position"].values[-1])
        followed += said["empty"][goes].mean() < 0.05 and not said["found"].any() and off < 0.01 * unit.cylinder.stroke
    assert followed >= 14  # by the noise of half a second some forks are nothing


@pytest.mark.parametrize("name", LOADER)
def test_an_obstacle_that_yields_lets_the_piston_go_on(name):
    """A load as at an obstacle, up to more than the pump has given so far, and away again while the pump pushes."""
    run, log = into_a_stop(name, "up")
    said = watched(name, run, log)
    pushing = np.flatnonzero(said["pushing"] > 0.0)
    yields = log.copy(deep=True)
    k = pushing[len(pushing) // 2]
    calm = float(run["motor_torque"].values[said["found"].argmax() - 25])
    yields["motor_torque"].values[k : k + 20] = calm
    again = watched(name, run, yields)
    assert again["released"][k : k + 5].any()
    assert not said["released"][k : k + 5].any()


@pytest.mark.parametrize("name", CIRCUITS)
def test_a_motor_that_stands_touches_nothing(name):
    unit = UNITS[name]
    corners = [(0.0, 0.0), (6.0, 0.0)]
    load = limits_of(unit).load
    loads = changing([(0.0, 0.3 * load), (2.0, 0.3 * load), (2.2, 0.6 * load), (6.0, 0.6 * load)])
    run, log = moves(unit, corners, loads, lowered(unit, 0.5 * unit.cylinder.stroke))
    said = watched(name, run, log)
    assert not said["found"].any()
    assert not said["held"].any()


DOUBLE = UNITS["eha-test-bench axis"]
HANGS = replace(DOUBLE, lift_sign=-1.0, cylinder=replace(DOUBLE.cylinder, load_sign=-1.0))


@pytest.mark.parametrize("unit", [DOUBLE, HANGS], ids=["extension lifts", "retraction lifts"])
@pytest.mark.parametrize("share", [0.1, 0.6])
def test_a_load_pulls_a_piston_off_its_upper_stop_while_the_motor_stands(unit, share):
    way = 0.18 * unit.cylinder.stroke / (0.25 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (1.0, 0.0), (1.4, 0.25), (1.9 + way, 0.25), (2.3 + way, 0.0), (8.0 + way, 0.0)]
    load = share * limits_of(unit).load
    run, log = moves(unit, corners, load, lowered(unit, 0.85 * unit.cylinder.stroke))
    observer = load_observer(unit, watches=True)
    begin(observer, float(run["position"][0]))
    said = observer.track(log)
    time, place = run["time"].values, run["position"].values
    top = lowered(unit, unit.cylinder.stroke)
    assert said["held"].any()
    assert said["released"].sum() == 1.0
    released = time[int(np.argmax(said["released"]))]
    off = ((top - place) * unit.lift_sign > 0.0) & (time > stands_from(run, unit))
    assert released == pytest.approx(time[int(np.argmax(off))], abs=0.15)
    assert released > 2.3 + way, "the motor stands"
    assert abs(place[-1] - top) > 0.01 * unit.cylinder.stroke
    assert said["position"][-1] == pytest.approx(place[-1], abs=0.003 * unit.cylinder.stroke)
    assert said["load"][-1] == pytest.approx(load, rel=0.03)


@lru_cache
def pressed_and_rested(name, share):
    """Onto the lower stop, pressed, three seconds of rest while the pressures even out, and up: run, log, when up."""
    unit = UNITS[name]
    way = 0.18 * unit.cylinder.stroke / (0.25 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (0.5, 0.0), (0.9, -0.25), (1.3 + way, -0.25), (1.7 + way, 0.0), (4.7 + way, 0.0)]
    corners += [(5.1 + way, 0.25), (6.1 + way, 0.25), (6.5 + way, 0.0)]
    run, log = moves(unit, corners, share * limits_of(unit).load, lowered(unit, 0.15 * unit.cylinder.stroke))
    return run, log, 4.7 + way


@pytest.mark.parametrize("name", ["eha-test-bench axis", "eha-single-rod axis"])
@pytest.mark.parametrize("share", [0.1, 0.3])
def test_a_piston_stays_on_a_stop_that_its_load_presses_it_on(name, share):
    """The load seems to collapse as it comes to stand; the one from before is what would have to pull it off."""
    run, log, up = pressed_and_rested(name, share)
    said = watched(name, run, log)
    held = run["time"].values[said["held"] > 0.0]
    assert held[0] < up - 3.0
    place, time = run["position"].values, run["time"].values
    leaves = time[(np.abs(place - place[time < up][-1]) > 0.1e-3) & (time > up)][0]
    assert held[-1] == pytest.approx(leaves, abs=0.06)
    assert said["position"][-1] == pytest.approx(run["position"].values[-1], abs=0.4e-3)


@pytest.mark.parametrize("name", ["eha-test-bench axis", "eha-single-rod axis"])
def test_a_piston_that_came_down_onto_a_stop_does_not_leave_the_other_one(name):
    """It is believed near the upper end, so unsurely that both ends may be it; which one, the way there tells."""
    unit = UNITS[name]
    run, log, _ = pressed_and_rested(name, 0.3)
    observer = load_observer(unit, watches=True, std=0.3 * unit.cylinder.stroke)
    begin(observer, float(run["position"][0]) + unit.lift_sign * 0.55 * unit.cylinder.stroke)
    said = observer.track(log)
    down = run["time"].values < 4.0
    assert (said["found"][down] > 0.0).sum() == 1
    assert not (said["at_top"] * said["found"])[down].any()
    assert (said["held"][down] > 0.0).any()


@pytest.mark.parametrize("name", ["eha-test-bench axis", "eha-single-rod axis"])
def test_a_piston_does_not_go_through_the_stop_that_the_motor_pulls_it_off(name):
    run, log, _ = pressed_and_rested(name, 0.3)
    said = watched(name, run, log)
    leaves = np.flatnonzero(said["state_contact.mode"] == Mode.LEAVING)
    assert leaves.size > 1
    begins = said["position"][leaves[0]]
    assert said["position"][leaves].min() >= begins - 1e-12


@pytest.mark.parametrize("span", [0.2, 0.4, 0.6])
def test_a_load_that_falls_at_rest_is_no_contact_for_long(span):
    """What the oil gives back hides that the piston sinks; the torque then stays, which no closed volume's does."""
    unit = UNITS["eha-test-bench axis"]
    load, stroke = limits_of(unit).load, unit.cylinder.stroke
    up = 0.1 * stroke / (0.25 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (0.5, 0.0), (0.9, 0.25), (0.9 + up, 0.25), (1.3 + up, 0.0), (5.3 + up, 0.0)]
    loads = changing([(0.0, 0.6 * load), (2.3 + up, 0.6 * load), (2.3 + up + span, 0.15 * load)])
    run, log = moves(unit, corners, loads, lowered(unit, 0.4 * stroke))
    said = watched("eha-test-bench axis", run, log)
    assert said["held"].sum() * 0.02 < 0.8
    assert not said["held"][-50:].any()
    assert not said["evidence"].any(), "and none that says where the piston is"
    assert abs(said["position"][-1] - run["position"].values[-1]) < 0.25e-3


@pytest.mark.parametrize("name", LOADER)
@pytest.mark.parametrize("span", [0.06, 0.1])
def test_a_load_that_falls_while_it_is_lowered_is_no_end_as_long_as_it_drives_the_motor(name, span):
    """It falls to a third before the end, which the piston reaches later; there the motor drives the pump."""
    unit = UNITS[name]
    load, stroke = limits_of(unit).load, unit.cylinder.stroke
    speed = 0.25 * unit.max_speed * unit.travel_per_radian
    falls, ends = 1.4 + 0.04 * stroke / speed, 5.4 + 0.1 * stroke / speed
    corners = [(0.0, 0.0), (1.0, 0.0), (1.4, -0.25), (ends, -0.25), (ends + 0.4, 0.0)]
    loads = changing([(0.0, 0.7 * load), (falls, 0.7 * load), (falls + span, 0.22 * load)])
    run, log = moves(unit, corners, loads, lowered(unit, 0.1 * stroke))
    said = watched(name, run, log)
    touched, shown = stands_from(run, unit), run["time"].values[said["evidence"] > 0.0]
    assert touched > falls + span + 0.1
    assert shown.size >= 1, "the end shows where it is"
    assert shown[0] > touched


@pytest.mark.parametrize("name", ["eha-test-bench axis", "eha-single-rod axis"])
@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_stop_that_a_piston_sinks_onto_holds_it_and_says_nothing_of_its_place(name, share):
    """A piston may sink onto the ground as well: only a press tells an end."""
    unit = UNITS[name]
    stroke, load = unit.cylinder.stroke, share * limits_of(unit).load
    corners = [(0.0, 0.0), (0.5, 0.0), (0.7, 0.1), (0.8, 0.1), (1.0, 0.0), (30.0, 0.0)]
    run, log = moves(unit, corners, load, lowered(unit, 0.02 * stroke))
    assert 1.2 < stands_from(run, unit) < 20.0, "the motor stands by then"
    said = watched(name, run, log)
    touched = int(np.argmax(said["found"]))
    assert said["evidence"].sum() == 0.0
    assert said["held"][touched:].all()
    assert abs(said["position"][-1] - run["position"].values[-1]) < 0.003 * stroke


@pytest.mark.parametrize("end", ["up", "down"])
def test_a_machine_that_gives_half_as_much_again_finds_its_ends_unless_that_is_thought_impossible(end):
    """The bucket at a stiffness of two thirds: on its end it seems to go on by a third of what is delivered."""
    unit = UNITS["mining-loader bucket"]
    run, log = into_a_stop("mining-loader bucket", end, back=None, stiffness=0.66)
    delays = {}
    for compliance in (0.0, 0.25):
        observer = load_observer(unit, watches=True, compliance=compliance)
        begin(observer, float(run["position"][0]))
        said = observer.track(log)["found"] > 0.0
        delays[compliance] = run["time"].values[np.argmax(said)] - stands_from(run, unit) if said.any() else np.inf
    assert 0.0 <= delays[0.25] < 0.5
    assert delays[0.25] < delays[0.0]


def test_a_piston_goes_no_farther_unseen_than_its_torque_stays_behind():
    """Of a pump that delivers 10 mm in vain, 2 N m at a give of 1 mm/kN and 0.5 mm/rad: 4 mm, and the noise's share."""
    model = SimpleNamespace(travel_per_radian=ca.DM(5e-4))
    step = SimpleNamespace(torque=SimpleNamespace(noise=ca.DM(0.05)), motion=SimpleNamespace(give=ca.DM(1e-6)))

    def gone(pushed, behind):
        return float(way_gone(ca.DM(pushed), ca.DM(behind), step, model))

    assert gone(10e-3, 2.0) == pytest.approx(4.1e-3)
    assert gone(-10e-3, 2.0) == gone(10e-3, 2.0)
    assert gone(1e-3, 2.0) == 1e-3, "no farther than the pump delivers"
    assert gone(10e-3, -3.0) == pytest.approx(0.1e-3), "a torque that is ahead hides its noise alone"


@pytest.mark.parametrize("name", LOADER)
@pytest.mark.parametrize("end", ["up", "down"])
def test_what_leaves_a_stop_is_known_to_two_millimetres(name, end):
    unit = UNITS[name]
    run, _ = into_a_stop(name, end)
    observer = observers(name, watches=True)
    begin(observer, float(run["position"][0]))
    said = observer.track(report(run, quiet(unit, seed=1, share=0.003)))
    assert said["went"].max() < 4e-3


def test_a_torque_that_may_be_late_teaches_less_of_the_compliance():
    """On a stop it rises by 100 N m/s: what it is late by is a tenth of the rise, and looks like softer oil."""
    unit = UNITS["mining-loader bucket"]
    run, _ = into_a_stop("mining-loader bucket", "down")
    log = report(run, quiet(unit, share=0.003)).copy(deep=True)
    log["motor_torque"].values[2:] = log["motor_torque"].values[:-2].copy()
    stated = {}
    for delay in (0.02, 0.04):
        sensor = kalman(unit, unit.assumptions.replace({"drive.delay": delay}))
        sensor.start(float(run["position"][0]))
        last = sensor.track(log).isel(time=-1)
        stated[delay] = float(last["compliance_factor_std"])
        assert abs(float(last["compliance_factor"]) - 1.0) < 1.5 * stated[delay]
    assert stated[0.04] > 1.1 * stated[0.02]
