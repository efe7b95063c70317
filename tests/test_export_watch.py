"""An exported control watches its drive, and compensates for a late one, as the live control does."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ramsight.control.activity import ACTIVITIES, Activity
from ramsight.control.drive_watch import Verdict
from ramsight.control.orders import INPUTS, STOPPED_BY, Ask, Reason
from ramsight.control.position import PositionControl
from ramsight.deploy.golden_control import Recording
from ramsight.deploy.profiles import ControlOptions
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.plant.drive import ServoDrive
from ramsight.plant.limits import limits_of
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import Estimate

from .control_bench import said_by, same
from .plant_bench import UNITS
from .test_export_visits import Both

BOOM, RAM, BUCKET = (UNITS[name] for name in ("mining-loader boom", "press ram", "mining-loader bucket"))
DRIVES = {
    "3 samples late": DriveResponse(report_delay=0.06),
    "5 samples either way": DriveResponse(command_delay=0.1, report_delay=0.1),
    "10 Hz": DriveResponse(bandwidth=10.0, order=2),
    "150 rad/s2": DriveResponse(acceleration=150.0),
    "all": DriveResponse(0.05, 0.03, 10.0, 2, 300.0, lost=0.03, torque_repeats=0.05),
}
REPORTED = list(INPUTS).index("reported")


def limited(unit):
    """The unit with a servo whose torque is a little more than what its load takes."""
    return replace(unit, drive=ServoDrive("drive", unit.drive.inertia, 0.8, 16.0, 0.6 * limits_of(unit).torque))


def made(unit, response=IDEAL):
    return ControlOptions(drive=response).block(unit)


@pytest.mark.parametrize(
    ("name", "unit"),
    [*((name, BOOM) for name in DRIVES), ("all", RAM), ("all", BUCKET), ("5 samples either way", BUCKET)],
    ids=lambda value: value if isinstance(value, str) else value.name,
)
def test_a_late_drive_is_reckoned_with(name, unit):
    block = made(unit, DRIVES[name])
    run = Recording(unit, block, 0.3)
    run.send(0.36, wait=True)
    run.send(0.34, wait=False)
    run.go_on(1.5)
    run.steer(0.3 * block.by.limits.speed, 1.0)
    run.steer(0.0, 0.5)
    run.send(0.1, wait=True)
    run.home(lifted=False)
    run.send(0.05, wait=True)
    run.go_on(1.0)
    assert not run.loop.reasons, run.loop.reasons
    assert (0.0 in run.rows[:, REPORTED]) is (DRIVES[name].lost > 0.0)
    said = same(unit, block, run)
    assert ACTIVITIES[int(said[-1, 1])] is Activity.RESTING


@pytest.mark.parametrize("unit", [BOOM, RAM, pytest.param(BUCKET, marks=pytest.mark.slow)], ids=lambda unit: unit.name)
def test_a_drive_at_its_torque_limit_is_waited_for_and_may_stall_against_a_stop(unit):
    unit = limited(unit)
    block = made(unit)
    run = Recording(unit, block, 0.3, load=0.4)
    run.send(0.5, wait=True)
    run.load(0.6, 0.5)  # as much as the servo carries
    run.send(0.6, wait=False)
    run.go_on(4.0)
    run.home(lifted=True)
    said = same(unit, block, run)
    assert {Reason(int(k)) for k in said[:, 2]} <= {Reason.NONE, Reason.NO_REFERENCE}, "it never stalls"


@pytest.mark.parametrize("ask", [Ask.POSITION, Ask.HOME_LIFTED, Ask.STEER])
def test_a_drive_that_stalls_stops_a_move_and_nothing_that_may_press(ask):
    unit = limited(BOOM)
    both, target = Both(unit, made(unit), watched=True), 0.5 if ask is Ask.POSITION else math.nan
    if ask is Ask.POSITION:
        both.control.move_to(target)
    elif ask is Ask.STEER:
        both.control.steer(0.01)
    else:
        both.control.home(lifted=True)
    here = Estimate(0.3, 1e-3, 0.0, 2e5, Status.OK)
    for _ in range(100):
        asked, reason = both.step(here, ask, target, 0.01, says=(0.0, unit.drive.max_torque))
    assert asked.reason == Verdict.STALLED.value
    assert reason is (Reason.STALLED if ask is Ask.POSITION else Reason.NONE)


def test_a_rod_that_rests_with_a_lost_sensor_is_not_stopped_for_its_drive():
    both = Both(BOOM, made(BOOM), watched=True)
    both.control.move_to(0.3)
    here = Estimate(0.3, 1e-3, 0.0, 2e5, Status.OK)
    for _ in range(60):
        asked, _ = both.step(here, Ask.POSITION, 0.3)
    turns = 100.0, 20.0  # rad/s, N m: of a motor that was told to stand
    for _ in range(10):
        asked, reason = both.step(replace(here, status=Status.INPUT_LOST), Ask.POSITION, 0.3, says=turns)
    assert (asked.activity, reason) == (Activity.RESTING, Reason.NONE)
    asked, reason = both.step(here, Ask.POSITION, 0.3, says=turns)
    assert (asked.activity, reason) == (Activity.STOPPED, Reason.SPEED_STUCK)


def silent(run):
    run.loop.fault = lambda name, report: None


def torque_stuck(run):
    run.loop.fault = lambda name, report: replace(report, motor_torque=20.0)


def speed_stuck(run):
    kept = run.loop.records[run.loop.units[0]].reported[-1].motor_speed
    run.loop.fault = lambda name, report: replace(report, motor_speed=kept)


def half_said(run):
    run.loop.fault = lambda name, report: replace(report, motor_speed=0.5 * report.motor_speed)


def stands(run):
    run.loop.motor_fault = lambda name, speed: 0.0


FAULTS = {
    silent: Reason.SILENT, torque_stuck: Reason.TORQUE_STUCK, speed_stuck: Reason.SPEED_STUCK,
    half_said: Reason.DISOBEYS, stands: Reason.DISOBEYS,
}  # fmt: skip


@pytest.mark.parametrize(
    ("unit", "response"),
    [(BOOM, IDEAL), (BUCKET, IDEAL), (RAM, DRIVES["all"])],
    ids=["boom, ideal", "bucket, ideal", "ram, late and lossy"],
)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_drive_that_does_otherwise_stops_the_cylinder(fault, unit, response):
    block = made(unit, response)
    run = Recording(unit, block, 0.2)
    run.send(0.3, wait=True)
    run.send(0.6, wait=False)
    run.go_on(0.4)
    fault(run)
    run.go_on(3.0)
    said = same(unit, block, run)
    assert ACTIVITIES[int(said[-1, 1])] is Activity.STOPPED
    assert said[-1, 0] == 0.0
    assert Reason(int(said[-1, 2])) is FAULTS[fault]
    assert run.loop.controls[unit.name].reason == Reason(int(said[-1, 2])).text
    run.home(lifted=False, time=0.5)  # whatever is asked for, it looks anew, and stops again
    run.steer(0.5 * block.by.limits.speed, 0.5)
    run.send(0.55, wait=False)
    run.go_on(0.5)
    run.loop.fault = run.loop.motor_fault = None
    run.send(0.5, wait=False)
    run.go_on(1.0)
    assert Reason(int(same(unit, block, run)[-1, 2])) in {Reason.NONE, Reason.SENSOR}, "sent on, it looks anew"


def test_each_verdict_that_stops_has_its_reason():
    assert {verdict for verdict in Verdict if verdict.stops} == set(STOPPED_BY)
    assert all(reason.text == verdict.value for verdict, reason in STOPPED_BY.items())


def test_no_report_before_the_first_moves_nothing():
    for unit in (BOOM, RAM):
        block, response = made(unit, DRIVES["all"]), DRIVES["all"]
        assert PositionControl(unit, response=response).step_unreported().motor_speed == 0.0
        row = dict.fromkeys(INPUTS, math.nan) | {"reported": 0.0, "ask": 1.0, "speed": math.inf}
        said = said_by(block, np.tile([row[name] for name in INPUTS], (5, 1)))
        assert said[0, 0] == 0.0
