"""The watch as a graph says of a drive, sample by sample, what Python's watch says."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from ramsight.control.repeats import runs
from ramsight.control.repeats_graph import runs_of
from ramsight.control.watch import DriveWatch, Verdict
from ramsight.control.watch_graph import WatchGraph
from ramsight.duty import DriveReport
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live_drive import LiveDrive
from ramsight.engine.recursion import Recursion, replay
from ramsight.units import RPM

from .test_watch import BOOM, DRIVES, FAULTS, SERVO, WARM, commands

VERDICTS = [one for one in Verdict if one is not Verdict.OBEYS]
TAKES = ("arrived", "speed", "torque", "commanded", "begins")


def recursion_of(unit, response, period):
    watch = WatchGraph(unit, response, period)
    x = {name: ca.SX.sym(name) for name in watch.initial}
    u = {name: ca.SX.sym(name) for name in TAKES}
    s = dict(x)
    watch.begin(s, u["begins"])
    said = watch.look(s, u["arrived"], u["speed"], u["torque"], u["commanded"])
    out = [*(said[one] for one in VERDICTS), watch.declared.pending, *(v for v, _ in watch.declared.underway)]
    names = tuple(f"out_{k}" for k in range(len(out)))
    new = ca.vertcat(*(s[name] for name in x))
    graph = Recursion(
        tuple(x), TAKES, (), names, ca.vertcat(*x.values()), ca.vertcat(*u.values()), ca.SX.sym("p", 0), new,
        ca.vertcat(*out),
    )  # fmt: skip
    return graph, np.array(list(watch.initial.values()))


def held_to(response, period, asked, *, does=lambda k, w: w, says=lambda k, r: r, unit=BOOM, how=None, begins=()):
    """Both watches over one drive; what they said."""
    watch, drive = DriveWatch(unit, response, period), LiveDrive(response, period, how or DriveReport(seed=3))
    speed, before, rows, expected = 0.0, 0.0, [], []
    for k, command in enumerate(asked):
        report = drive.report(period * k, speed, 20.0, WARM)
        changed = None if report is None else says(k, report)
        if k in begins:
            watch.begin()
        said = watch.missed() if changed is None else watch.look(changed)
        expected.append((said, watch.pending, [value for value, _ in watch.underway]))
        values = (np.nan, np.nan) if changed is None else (changed.motor_speed, changed.motor_torque)
        rows.append((float(changed is not None), *values, before, float(k in begins)))
        watch.command(command)
        before, speed = command, drive.follow(does(k, command))
    graph, state = recursion_of(unit, response, period)
    found = replay(graph, np.array(rows), np.zeros(0), state)
    count = len(VERDICTS)
    for k, (said, pending, underway) in enumerate(expected):
        verdicts = [one for one, holds in zip(VERDICTS, found[k, :count], strict=True) if holds]
        assert verdicts == ([] if said is Verdict.OBEYS else [said]), k
        if response.lag > 0.0:
            assert found[k, count] == pytest.approx(pending, abs=1e-9)
            np.testing.assert_allclose(found[k, count + 1 :], underway, atol=1e-12)
    return {said for said, _, _ in expected}


@pytest.mark.parametrize("unit", [BOOM, SERVO], ids=["ideal", "servo"])
@pytest.mark.parametrize("name", [*DRIVES, "both"])
def test_a_drive_as_it_is_declared(name, unit):
    response, period = {**DRIVES, "both": (DriveResponse(0.05, 0.03, 10.0, 1, 300.0), 0.02)}[name]
    held_to(response, period, commands(int(200.0 / period), period), unit=unit)


@pytest.mark.parametrize("name", DRIVES)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_drive_with_a_fault(name, fault):
    response, period = DRIVES[name]
    ramp = [min(2.0 * max(k - 100, 0), 300.0) for k in range(400)]
    said = held_to(response, period, ramp, **FAULTS[fault], begins=(260, 330))
    assert any(one.stops for one in said)


def test_reports_that_repeat_are_learned_and_told():
    """Hours of work with noise, coarse torques and gaps; then torque and speed that are stuck."""
    response = replace(IDEAL, speed_noise=RPM)
    noisy = DriveReport(speed_noise=RPM, seed=5)
    asked = [200.0 if k % 400 > 100 else 0.0 for k in range(40_000)]
    asked += [200.0] * 300

    def says(k, report, kept=[]):  # noqa: B006
        if k % 977 == 0:
            return replace(report, motor_torque=float("nan"))
        if k > 40_150:
            kept = [*kept, report]
            return replace(report, motor_speed=200.0)
        return replace(report, motor_torque=0.25 * round(report.motor_torque / 0.25))

    assert Verdict.STUCK in held_to(response, 0.02, asked, says=says, how=noisy)
    stuck = {"says": lambda k, r: replace(r, motor_torque=20.0) if k > 40_150 else r}
    assert Verdict.TORQUE_STUCK in held_to(response, 0.02, asked, how=noisy, **stuck)
    declared = replace(response, torque_repeats=0.05)
    assert Verdict.TORQUE_STUCK in held_to(
        declared, 0.02, asked[-1000:], how=noisy, says=lambda k, r: r if k < 500 else replace(r, motor_torque=20.0)
    )


def test_a_servo_at_its_limit_and_one_that_stalls():
    def says(k, report):
        if k > 200:
            return replace(report, motor_speed=0.0 if k > 260 else 60.0, motor_torque=SERVO.drive.max_torque)
        return report

    asked = [min(1.0 * k, 150.0) for k in range(500)]
    said = held_to(IDEAL, 0.02, asked, says=says, unit=SERVO)
    assert {Verdict.AT_LIMIT, Verdict.STALLED} <= said


def test_a_late_drive_is_slow():
    ramp = [4.0 * k for k in range(50)] + [200.0] * 30
    late = DriveResponse(report_delay=0.08)
    drive, reports, speed = LiveDrive(late, 0.02, DriveReport(seed=3)), [], 0.0
    for k, command in enumerate(ramp):
        reports.append(drive.report(0.02 * k, speed, 20.0, WARM))
        speed = drive.follow(command)
    assert Verdict.SLOW in held_to(DriveResponse(report_delay=0.04), 0.02, ramp, says=lambda k, _: reports[k])


def test_runs_are_those_of_numbers():
    share = ca.SX.sym("share")
    graph = ca.Function("runs", [share], [runs_of(share, 0.02)])
    for one in (0.001, 0.05, 0.2, 0.5, 0.9, 0.99):
        assert float(graph(one)) == runs(one, 0.02)
