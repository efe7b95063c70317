"""Sensorless position control: the way to a target, the controller by itself, and the loop around the whole loader."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ramsight import machine
from ramsight.closed_loop.driven import together
from ramsight.closed_loop.loop import ClosedLoop
from ramsight.closed_loop.planning import learned_covariance, learned_factors
from ramsight.closed_loop.referencing import Feedback, LoopSettings
from ramsight.control.activity import Activity
from ramsight.control.block import position_block
from ramsight.control.position import PositionControl
from ramsight.control.sensing import Trust, may_home, trust
from ramsight.control.thresholds import STOPPING_TIME
from ramsight.control.trajectory import Limits
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.linked_duty import simulate_linked
from ramsight.duty.live import LiveMachine, Reported
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.linked import build_linked
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .control_bench import Way

LOADER = build_linked(machine.load_machine("mining-loader"))
BOOM, BUCKET = LOADER.units
START = {"boom": 0.2, "bucket": 0.25}
DT = 0.02


def loop(**changes):
    return ClosedLoop(LOADER, LOADER, START, LoopSettings(known=True, **changes), payload=3000.0)


def off(run, targets):
    return max(abs(run.now.position[name] - x) for name, x in targets.items())


@pytest.mark.parametrize(
    ("start", "target"), [(0.1, 0.6), (0.6, 0.1), (0.3, 0.301), (0.4, 0.0), (0.3, 0.7), (0.2, 0.2)]
)
def test_a_trajectory_keeps_its_limits_and_arrives(start, target):
    limits = Limits(0.05, 0.08, 0.008, 0.03)
    way = Way(limits, 0.7, DT)
    way.begin(start)
    places, speeds = [start], [0.0]
    for _ in range(3000):
        way.step(target, limits.speed)
        places.append(way.position)
        speeds.append(way.velocity)
    assert way.stands
    assert way.position == target
    assert np.abs(speeds).max() <= limits.speed + 1e-12
    assert np.abs(np.diff(speeds)).max() <= 2.0 * limits.acceleration * DT + 1e-12
    assert min(start, target) - 1e-12 <= min(places) <= max(places) <= max(start, target) + 1e-12
    near = [abs(v) for x, v in zip(places, speeds, strict=True) if (x < 0.02 and v < 0) or (x > 0.68 and v > 0)]
    assert max(near, default=0.0) <= limits.landing_speed + limits.acceleration * DT


def stepped(limits, start, target, speed=math.inf, stroke=0.7, period=DT, velocity=0.0):
    """Positions of a trajectory, sample by sample, until it stands."""
    way = Way(limits, stroke, period)
    way.begin(start, velocity)
    places = [way.position]
    while not (way.stands and len(places) > 1):
        way.step(target, min(speed, limits.speed))
        places.append(way.position)
    return np.array(places)


@pytest.mark.parametrize(("start", "target"), [(0.1, 0.6), (0.6, 0.1), (0.3, 0.31), (0.4, 0.0), (0.2, 0.7)])
@pytest.mark.parametrize("smoothing", [0.1, 0.2, 0.6])
def test_a_smoothed_trajectory_keeps_its_jerk_and_stays_slow_before_an_end_stop(start, target, smoothing):
    limits = Limits(0.05, 0.08, 0.008, 0.03, jerk=2.0 * 0.08 / smoothing)
    places = stepped(limits, start, target)
    velocity, acceleration, jerk = (np.diff(places, k) / DT**k for k in (1, 2, 3))
    assert places[-1] == pytest.approx(target, abs=1e-12)
    assert np.abs(velocity).max() <= limits.speed + 1e-9
    assert np.abs(acceleration).max() <= limits.acceleration * (1.0 + DT / smoothing) + 1e-9
    assert np.abs(jerk).max() <= 1.15 * limits.jerk  # the last step to the target is not of the profile
    to_stop = 0.7 - places[1:] if target > start else places[1:]
    assert (
        np.abs(velocity[to_stop < limits.landing_zone - 1e-9]).max(initial=0.0)
        <= limits.landing_speed + limits.acceleration * DT
    )
    assert (np.diff(places) * np.sign(target - start) >= -1e-12).all()


def test_the_time_of_a_way_is_that_of_its_profile():
    limits = Limits(0.05, 0.08, 0.008, 0.0, jerk=0.8)
    for way in (0.001, 0.02, 0.3):
        assert (len(stepped(limits, 0.2, 0.2 + way)) - 1) * DT == pytest.approx(limits.time(way), abs=5 * DT)
    assert limits.time(0.5) == pytest.approx(0.5 / 0.05 + 0.05 / 0.08 + limits.smoothing)


def test_a_trajectory_goes_on_as_fast_as_it_begins():
    limits = Limits(0.05, 0.08, 0.008, 0.03, jerk=0.8)
    places = stepped(limits, 0.2, 0.5, velocity=0.03)
    assert places[0] == pytest.approx(0.2)
    assert (places[1] - places[0]) / DT == pytest.approx(0.03, abs=limits.acceleration * DT)
    back = stepped(limits, 0.2, 0.1, velocity=0.03)
    assert back.max() > 0.2
    assert np.abs(np.diff(back, 2)).max() / DT**2 <= limits.acceleration * 1.1 + 1e-9


def test_controls_of_equal_units_share_their_graph_and_nothing_else():
    block = position_block(BOOM)
    assert position_block(replace(BOOM)) is block
    others = position_block(BOOM, period=0.1), position_block(BUCKET), position_block(BOOM, response=DriveResponse(0.1))
    assert all(other.recursion is not block.recursion for other in others)
    one, other = PositionControl(BOOM), PositionControl(BOOM)
    one.move_to(0.6)
    one.step(Estimate(0.1, 1e-4, 0.0, 2e5, Status.OK), Reported(0.0, 0.0, 20.0, 313.15))
    assert (one.activity, other.activity) == (Activity.MOVING, Activity.RESTING)
    assert one.state != other.state


def test_what_is_sent_together_is_on_one_way():
    ways = {"boom": (Limits(0.03, 0.05, 0.004, 0.0, jerk=0.5), 0.3), "bucket": (Limits(0.09, 0.2, 0.01, 0.0, 2.0), 0.1)}
    shared = together(ways)
    done = []
    for name, (limits, way) in ways.items():
        here = limits.at(*shared[name])
        assert here.smoothing == pytest.approx(limits.smoothing)
        assert here.speed <= limits.speed
        assert here.acceleration <= limits.acceleration
        done.append(stepped(here, 0.2, 0.2 + way) - 0.2)
    count = min(map(len, done))
    share = [one[:count] / way for one, (_, way) in zip(done, ways.values(), strict=True)]
    assert abs(len(done[0]) - len(done[1])) <= 2
    assert np.abs(share[0] - share[1]).max() < 2e-3
    assert together({"boom": (ways["boom"][0], 0.0)}) == {"boom": (0.03, 0.05)}


def test_every_status_is_judged():
    stops = {status for status in Status if trust(status) is Trust.NONE}
    assert all(status in stops for status in Status if status.validity in {"invalid", "not referenced"})
    assert stops - {s for s in Status if s.validity in {"invalid", "not referenced"}} == {
        Status.POSITION_LOST,
        Status.FAULT_PASSED,
    }
    assert trust(Status.OK) is Trust.FULL
    assert all(may_home(status) for status in Status if status not in stops)
    assert may_home(Status.NOT_REFERENCED)
    assert not may_home(Status.INPUT_LOST)


def drive(control, estimates, reports=None):
    """Step a control through estimates, its drive obedient."""
    commands, speed = [], 0.0
    for k, estimate in enumerate(estimates):
        reported = Reported(k * DT, speed, 20.0, 313.15) if reports is None else reports(k, speed)
        command = control.step(estimate, reported)
        speed = command.motor_speed
        commands.append(command)
    return commands


def here(x, status=Status.OK):
    return Estimate(x, 1e-4, 0.0, 2e5, status)


@pytest.mark.parametrize("status", [s for s in Status if trust(s) is Trust.NONE])
def test_a_control_stops_in_time_and_says_why(status):
    control = PositionControl(BOOM)
    control.move_to(0.6)
    way = [here(0.1 + 0.02 * k * DT) for k in range(100)]
    commands = drive(control, way + [here(0.2, status)] * 15)
    assert commands[99].motor_speed > 50.0
    first = next(k for k, c in enumerate(commands) if c.activity is Activity.STOPPING)
    standing = next(k for k, c in enumerate(commands) if k > first and c.motor_speed == 0.0)
    assert first == 100
    assert (standing - first + 1) * DT <= min(STOPPING_TIME + DT, 0.3)
    assert commands[-1].activity is Activity.STOPPED
    assert commands[-1].reason == status.text
    control.move_to(0.3)
    assert drive(control, [here(0.2)])[0].activity is Activity.MOVING


def test_uncertainty_slows_and_silence_is_no_trust():
    fast, slow = PositionControl(BUCKET), PositionControl(BUCKET)
    for control in (fast, slow):
        control.move_to(0.45)
    at_full = drive(fast, [here(0.1 + 0.03 * k * DT) for k in range(60)])[-1]
    at_half = drive(slow, [here(0.1 + 0.03 * k * DT, Status.REFERENCE_DUE) for k in range(60)])[-1]
    assert 0.3 < at_half.motor_speed / at_full.motor_speed < 0.75
    assert at_half.reason == Status.REFERENCE_DUE.text
    nothing = replace(here(0.1), position=math.nan)
    assert drive(fast, [nothing])[0].activity is Activity.STOPPING


@pytest.mark.parametrize("given", [math.nan, math.inf])
def test_a_visit_needs_no_position_from_a_sensor_that_says_it_has_none(given):
    """None from a sensor that says it knows stops a visit all the same."""
    unknown = replace(here(0.1, Status.NOT_REFERENCED), position=given, position_std=math.nan)
    for status in (Status.NOT_REFERENCED, Status.OK):
        control = PositionControl(BUCKET)
        control.home(lifted=True)
        commands = drive(control, [replace(unknown, status=status)] * 60)
        goes_on = status is Status.NOT_REFERENCED
        assert commands[-1].activity is (Activity.HOMING if goes_on else Activity.STOPPED)
        if goes_on:
            assert 0.0 < abs(commands[-1].motor_speed) <= BUCKET.max_speed
        control.move_to(0.3)
        assert drive(control, [unknown])[-1].activity is not Activity.MOVING


@pytest.mark.parametrize(
    ("reports", "why"),
    [
        (lambda k, w: Reported(k * DT, 0.3 * w, 20.0, 313.15), "as commanded"),
        # A report that leaps; one that is stuck is in the tests of the watch.
        (lambda k, w: Reported(k * DT, w if k < 30 else 61.0, 20.0, 313.15), "as commanded"),
    ],
)
def test_a_drive_that_does_not_do_as_told_is_noticed(reports, why):
    control = PositionControl(BOOM)
    control.move_to(0.6)
    commands = drive(control, [here(0.1 + 0.02 * max(k - 20, 0) * DT) for k in range(120)], reports)
    assert commands[-1].activity is Activity.STOPPED
    assert why in commands[-1].reason


def test_a_rod_that_stays_behind_and_targets_outside_are_refused():
    control = PositionControl(BOOM)
    control.move_to(0.6)
    assert "from where it should be" in drive(control, [here(0.1)] * 400)[-1].reason
    with pytest.raises(ValueError, match="within the stroke"):
        control.move_to(0.71)


def test_motor_speeds_stay_within_the_drives_range():
    control = PositionControl(BOOM, Limits(1.0, 2.0, 0.1, 0.02))
    control.move_to(0.7)
    commands = drive(control, [here(min(0.01 + 0.05 * k * DT, 0.6)) for k in range(200)])
    assert max(abs(c.motor_speed) for c in commands) <= BOOM.max_speed


@pytest.fixture(scope="module")
def moved():
    run = loop()
    targets = {"boom": 0.32, "bucket": 0.15}
    run.go(targets)
    return run, targets


def test_the_loader_goes_where_it_is_sent(moved):
    run, targets = moved
    assert not run.stopped
    assert off(run, targets) < 2e-3
    for name in run.units:
        record = run.records[name]
        assert abs(record.estimate[-1].position - record.position[-1]) < 1e-3
        assert np.abs(np.diff(record.command)).max() <= run.controls[name].tuning.motor_acceleration * DT + 1e-9


def test_the_loop_is_the_run_that_its_commands_give(moved):
    run, _ = moved
    again = simulate_linked(LOADER, run.duty())
    for name in run.units:
        assert np.abs(again[f"{name}_position"].values - run.records[name].position).max() < 5e-6
    assert abs(again.attrs["energy_residual"]) < 1e-3
    track = run.track("boom")
    assert set(track["status"].values.tolist()) == {0}
    assert track.sizes["time"] == again.sizes["time"]


def test_the_same_seed_gives_the_same_run_and_another_one_does_not():
    runs = [loop(seed=seed) for seed in (3, 3, 4)]
    for run in runs:
        run.send({"boom": 0.22, "bucket": 0.24})
        run.rest(0.6)
    speeds = [run.records["boom"].command for run in runs]
    assert speeds[0] == speeds[1]
    assert speeds[0] != speeds[2]


def test_truth_does_not_reach_sensors_or_controls(moved):
    """A sensor fed with the recorded reports alone says the same again."""
    run, _ = moved
    sensor = run.sensors["bucket"]
    sensor.start(START["bucket"])
    record = run.records["bucket"]
    said = [sensor.step(r.time, r.motor_speed, r.motor_torque, r.oil_temperature).position for r in record.reported]
    assert said == [e.position for e in record.estimate]
    blind = loop(feedback=Feedback.TRUTH)
    blind.sensors["boom"].start(0.35)  # does not matter to who feels the true position
    blind.go({"boom": 0.25})
    assert off(blind, {"boom": 0.25}) < 2e-3


def test_home_references_a_machine_that_does_not_know_where_it_is():
    run = ClosedLoop(LOADER, LOADER, {"boom": 0.06, "bucket": 0.1})
    run.controls["boom"].move_to(0.2)
    run.wait()
    assert run.stopped
    assert run.reasons["boom"] == Status.NOT_REFERENCED.text
    run.home("boom")
    run.home("bucket", lifted=True)
    assert not run.stopped
    assert all(record.estimate[-1].status is Status.OK for record in run.records.values())
    run.go({"boom": 0.1, "bucket": 0.08})
    assert off(run, {"boom": 0.1, "bucket": 0.08}) < 2e-3


def test_a_leak_test_moves_no_rod_and_teaches_the_leakage_of_the_boom():
    actual = replace(LOADER, units=tuple(AsBuilt(leak=1.2).apply(unit) for unit in LOADER.units))
    run = ClosedLoop(actual, LOADER, START, LoopSettings(known=True), payload=5000.0)
    run.go({"boom": 0.21, "bucket": 0.24})
    before = dict(run.now.position)
    run.leak_test()
    assert max(abs(run.now.position[name] - x) for name, x in before.items()) < 0.2e-3
    run.go({"boom": 0.24, "bucket": 0.2})
    assert learned_factors(run.sensors["boom"])[0] == pytest.approx(1.2, rel=0.03)
    # The bucket's other chamber stays open to its pump: what its torque shows is never leakage alone.
    assert learned_covariance(run.sensors["bucket"])[1, 1] > 0.05**2


@pytest.mark.parametrize(
    ("drive", "declared"),
    [
        (DriveResponse(report_delay=0.02), IDEAL),
        (DriveResponse(report_delay=0.1), None),
        (DriveResponse(command_delay=0.06, report_delay=0.04, bandwidth=10.0, order=2, lost=0.02), None),
    ],
    ids=["one sample, undeclared", "five samples", "late, slow and lossy"],
)
def test_the_loader_goes_where_it_is_sent_with_drives_that_are_not_perfect(drive, declared):
    run = loop(drive=drive, declared=declared)
    for targets in ({"boom": 0.28, "bucket": 0.18}, {"boom": 0.23, "bucket": 0.22}):
        run.go(targets)
        assert not run.stopped, run.reasons
        assert off(run, targets) < 1e-3


@pytest.mark.parametrize("delay", [0.0, 0.06])
@pytest.mark.parametrize("stands", [True, False], ids=["motor stands", "speed stuck"])
def test_a_drive_that_fails_in_mid_lift_stops_the_whole_machine_within_the_latency(delay, stands):
    run = loop(drive=DriveResponse(command_delay=delay, report_delay=delay))
    run.send({"boom": 0.5, "bucket": 0.3})
    run.rest(0.4)
    last = run.records["boom"].reported[-1]
    if stands:
        run.motor_fault = lambda unit, speed: 0.0 if unit == "boom" else speed
    else:
        run.fault = lambda unit, now: replace(now, motor_speed=last.motor_speed) if unit == "boom" else now
    run.rest(0.3 + 2.0 * delay)
    assert run.now.motor_speed == {"boom": 0.0, "bucket": 0.0}
    assert run.reasons["boom"] == (
        "the motor does not turn as commanded" if stands else "the reported motor speed is stuck"
    )
    assert run.reasons["bucket"].startswith("boom: ")


@pytest.mark.parametrize("broken", ["motor_torque", "motor_speed", "time"])
def test_a_fault_in_mid_lift_stops_the_whole_machine(broken):
    run = loop()
    run.send({"boom": 0.5, "bucket": 0.3})
    run.rest(2.0)
    last = run.records["boom"].reported[-1]
    value = last.time if broken == "time" else math.nan
    run.fault = lambda unit, now: replace(now, **{broken: value}) if unit == "boom" else now
    run.rest(0.3)
    assert run.now.motor_speed == {"boom": 0.0, "bucket": 0.0}
    assert "invalid" in run.reasons["boom"]
    assert run.reasons["bucket"].startswith("boom: invalid")
    before = dict(run.now.position)
    run.rest(1.0)
    assert max(abs(run.now.position[name] - x) for name, x in before.items()) < 1e-3


def test_a_thermometer_that_breaks_only_slows_it_down():
    run = loop()
    run.fault = lambda unit, now: replace(now, oil_temperature=900.0) if now.time > 1.0 else now
    run.go({"boom": 0.23, "bucket": 0.24})
    assert not run.stopped
    assert "temperature" in run.reasons["boom"]
    assert off(run, {"boom": 0.23, "bucket": 0.24}) < 2e-3


def test_a_force_on_the_tip_reaches_the_live_machine():
    def load(force):
        live = LiveMachine(LOADER, START, {"boom": 313.15, "bucket": 313.15}, 3000.0)
        for _ in range(25):
            now = live.advance({"boom": 0.0, "bucket": 0.0}, 3000.0, force)
        return now.position["boom"]

    free = load((0.0, 0.0))
    assert load((0.0, -50e3)) < free - 1e-4  # pressed down, the boom's oil gives way
    assert load((0.0, 30e3)) > free + 1e-4


def test_a_live_machine_at_rest_stays():
    live = LiveMachine(LOADER, START, {"boom": 313.15, "bucket": 313.15}, 3000.0)
    for _ in range(50):
        now = live.advance({"boom": 0.0, "bucket": 0.0}, 3000.0)
    assert now.time == pytest.approx(1.0)
    assert max(abs(now.position[name] - x) for name, x in START.items()) < 1e-3
