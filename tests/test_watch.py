"""The watch on a drive: a drive as declared is left alone, and one that does otherwise is told by what it does."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from evaluation.live_watch import DriveWatch
from ramsight.control.drive_watch import Verdict
from ramsight.control.repeats import runs
from ramsight.control.thresholds import NOTICING_TIME
from ramsight.duty import DriveReport
from ramsight.duty.drive_response import IDEAL, DriveResponse
from ramsight.duty.live import Reported
from ramsight.duty.live_drive import LiveDrive
from ramsight.engine.recursion import replay
from ramsight.plant.drive import ServoDrive
from ramsight.units import RPM

from .plant_bench import UNITS

WARM, MISSED = 313.15, (0.0, np.nan, np.nan)
HOW = DriveReport(seed=3)
BOOM = UNITS["mining-loader boom"]
SERVO = replace(BOOM, drive=ServoDrive("drive", 0.008, 0.8, 16.0, 50.0))
DRIVES = {
    "ideal": (IDEAL, 0.02),
    **{f"{n} samples": (DriveResponse(report_delay=0.02 * n), 0.02) for n in (1, 2, 3, 5)},
    "5 samples either way": (DriveResponse(command_delay=0.1, report_delay=0.1), 0.02),
    "10 Hz": (DriveResponse(bandwidth=10.0, order=2), 0.02),
    "slow motor": (DriveResponse(acceleration=150.0), 0.02),
    "100 ms": (IDEAL, 0.1),
    "lost": (DriveResponse(lost=0.05), 0.02),
}


def commands(count, period, seed=0):
    """Ramps of a motor up and down, with rests between them, as moves have them [rad/s]."""
    random, found, speed = np.random.default_rng(seed), [], 0.0
    while len(found) < count:
        goal, slope = random.choice([0.0, 1.0]) * random.uniform(-250.0, 250.0), random.uniform(50.0, 600.0)
        ramp = np.arange(speed, goal, np.sign(goal - speed) * slope * period) if goal != speed else []
        found += [*ramp, *[goal] * int(random.uniform(0.2, 3.0) / period)]
        speed = goal
    return [float(value) for value in found[:count]]


def watched(response, period, asked, *, declared=None, does=lambda k, w: w, says=lambda k, r: r, unit=BOOM, how=HOW):
    """What the watch says of a drive, sample by sample, given what the motor and the report make of it.

    What the drive does hangs on the commands alone, so that the watch goes over all samples at once.
    """
    drive, rows, speed, until_now = LiveDrive(response, period, how), [], 0.0, 0.0
    for k, command in enumerate(asked):
        report = drive.report(period * k, speed, 20.0, WARM)
        changed = None if report is None else says(k, report)
        arrived = MISSED if changed is None else (1.0, changed.motor_speed, changed.motor_torque)
        rows.append((*arrived, until_now, 0.0))
        until_now, speed = command, drive.follow(does(k, command))
    live = DriveWatch(unit, declared or response, period)._live
    state = np.array([live.state[name] for name in live.recursion.state])
    wrong = replay(live.recursion, np.array(rows), live.parameters, state)[:, :-1] != 0.0
    verdicts = [*(Verdict[name.upper()] for name in live.recursion.outputs[:-1]), Verdict.OBEYS]
    return [verdicts[k] for k in np.where(wrong.any(axis=1), wrong.argmax(axis=1), len(verdicts) - 1)]


def test_a_sample_at_a_time_the_watch_says_what_it_says_of_all_of_them():
    response, period = DRIVES["lost"]
    asked = [*commands(300, period), *[100.0] * 60, *[0.0] * 40]
    watch, drive, speed, said = DriveWatch(BOOM, response, period), LiveDrive(response, period, HOW), 0.0, []
    for k, command in enumerate(asked):
        report = drive.report(period * k, speed, 20.0, WARM)
        said.append(watch.missed() if report is None else watch.look(report))
        watch.command(command)
        speed = drive.follow(0.0 if k >= 300 else command)
    assert said == watched(response, period, asked, does=lambda k, w: 0.0 if k >= 300 else w)
    assert {Verdict.OBEYS, Verdict.DISOBEYS} <= set(said)


@pytest.mark.parametrize("name", DRIVES)
def test_a_drive_as_it_is_declared_is_left_alone(name):
    response, period = DRIVES[name]
    assert set(watched(response, period, commands(int(600.0 / period), period))) == {Verdict.OBEYS}


def stuck(k, report, kept=[]):  # noqa: B006
    kept[:] = kept if k > 200 else [report]
    return replace(report, motor_speed=kept[0].motor_speed) if k >= 200 else report


FAULTS = {
    "stands": {"does": lambda k, w: 0.0 if k >= 200 else w},
    "turns the other way": {"does": lambda k, w: -w if k >= 200 else w},
    "half as fast": {"does": lambda k, w: 0.5 * w if k >= 200 else w},
    "says the other sign": {"says": lambda k, r: replace(r, motor_speed=-r.motor_speed) if k >= 200 else r},
    "says half": {"says": lambda k, r: replace(r, motor_speed=0.5 * r.motor_speed) if k >= 200 else r},
    "stuck": {"says": stuck},
    "silent": {"says": lambda k, r: None if k >= 200 else r},
}


@pytest.mark.parametrize("name", ["ideal", "3 samples", "5 samples either way", "10 Hz", "lost"])
@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_no_such_drive_is_noticed_in_time(name, fault):
    response, period = DRIVES[name]
    ramp = [min(2.0 * max(k - 100, 0), 300.0) for k in range(260)]
    said = watched(response, period, ramp, **FAULTS[fault])
    first = next(k for k, verdict in enumerate(said) if verdict.stops)
    latency = response.lag + (runs(response.lost, period) * period if response.lost else 0.0)
    assert 200 <= first <= 200 + (0.5 * latency + latency + 2 * NOTICING_TIME) / period
    expected = {"stuck": Verdict.STUCK, "silent": Verdict.SILENT}.get(fault, Verdict.DISOBEYS)
    assert said[first] is expected


def test_a_drive_that_is_later_than_declared_is_slow_and_one_that_is_much_later_does_not_obey():
    ramp = [4.0 * k for k in range(50)] + [200.0] * 30
    declared = DriveResponse(report_delay=0.04)
    late = watched(DriveResponse(report_delay=0.08), 0.02, ramp, declared=declared)
    assert set(late) == {Verdict.OBEYS, Verdict.SLOW}
    assert late[-1] is Verdict.OBEYS, "it has caught up"
    assert Verdict.DISOBEYS in watched(DriveResponse(report_delay=0.2), 0.02, ramp, declared=declared)
    undeclared = watched(DriveResponse(report_delay=0.02), 0.02, ramp)
    assert not any(verdict.stops for verdict in undeclared), "one sample of delay is no reason to stop"


def torques(values, watch, speed=100.0):
    watch.begin()
    for _ in range(40):
        watch.command(speed)
        watch.look(Reported(0.0, speed, 20.0 + next(NOISE), WARM))
    said = []
    for value in values:
        watch.command(speed)
        said.append(watch.look(Reported(0.0, speed, value, WARM)))
    return said


NOISE = itertools.cycle(np.random.default_rng(1).normal(0.0, 0.5, 997).tolist())


def test_a_torque_that_repeats_more_often_than_declared_is_stuck_and_a_coarse_one_is_not():
    watch = DriveWatch(BOOM, DriveResponse(torque_repeats=0.05), 0.02)
    said = torques([20.0] * 10, watch)
    assert said.index(Verdict.TORQUE_STUCK) == runs(0.05, 0.02) == 7
    coarse = DriveWatch(BOOM, DriveResponse(torque_repeats=0.5), 0.02)
    assert Verdict.TORQUE_STUCK not in torques([20.0] * 20, coarse)
    standing = torques([20.0] * 40, DriveWatch(BOOM, DriveResponse(torque_repeats=0.05), 0.02), speed=0.0)
    assert set(standing) == {Verdict.OBEYS}, "a motor that stands may have a torque that does"


def test_how_often_a_torque_repeats_is_learned_from_repeats_that_ended():
    fresh = DriveWatch(BOOM, IDEAL, 0.02)
    for k in range(400):
        fresh.command(100.0)
        said = fresh.look(Reported(0.0, 100.0, float(k // 5), WARM))
    assert said is Verdict.OBEYS
    assert Verdict.TORQUE_STUCK not in torques([5.0] * 40, fresh), "a coarse one often repeats"
    fine = DriveWatch(BOOM, IDEAL, 0.02)
    for _ in range(10):
        torques([], fine)
    assert Verdict.TORQUE_STUCK in torques([20.0] * 9, fine)


def test_a_servo_gives_way_to_its_load_as_its_own_torque_says():
    """The load comes within 50 ms: the speed falls by 25 rad/s and comes back, by the servo's own law."""
    watch, plain = DriveWatch(SERVO, IDEAL, 0.02), DriveWatch(BOOM, IDEAL, 0.02)
    integral, speed, said = 0.0, 100.0, []
    for k in range(100):
        load, steps = 40.0 * min(max(k - 50, 0) / 2.5, 1.0), 200
        for _ in range(steps):
            error = 100.0 - speed
            torque = min(max(0.8 * error + integral, -50.0), 50.0)
            integral += 0.02 / steps * (16.0 * error)
            speed += 0.02 / steps * (torque - load) / 0.008
        report = Reported(0.02 * k, speed, torque, WARM)
        said.append((watch.look(report), plain.look(report), speed))
        for one in (watch, plain):
            one.command(100.0)
    assert min(now for *_, now in said[10:]) < 85.0
    assert {verdict for verdict, *_ in said[10:]} == {Verdict.OBEYS}
    assert {verdict for _, verdict, _ in said[10:]} - {Verdict.OBEYS}


def limited(speeds, torque):
    watch, said = DriveWatch(SERVO, IDEAL, 0.02), []
    for k, speed in enumerate(speeds):
        said.append(watch.look(Reported(0.02 * k, speed, torque + 0.1 * (k % 2), WARM)))
        watch.command(200.0)
    return said


def test_a_drive_at_its_torque_limit_is_told_from_one_that_does_not_obey():
    behind = limited([1.5 * k for k in range(100)], 49.9)
    assert Verdict.AT_LIMIT in behind
    assert not any(verdict.stops for verdict in behind)
    assert any(verdict is Verdict.DISOBEYS for verdict in limited([1.5 * k for k in range(100)], 30.0))
    jammed = limited([0.0] * 100, 49.9)
    assert jammed.index(Verdict.STALLED) * 0.02 == pytest.approx(1.0, abs=0.05)
    assert not any(verdict.stops for verdict in jammed[: jammed.index(Verdict.STALLED)])


@pytest.mark.parametrize("response", [IDEAL, DRIVES["5 samples either way"][0], DRIVES["10 Hz"][0]])
def test_what_is_pending_is_the_angle_that_reports_will_still_show(response):
    watch, drive = DriveWatch(BOOM, response, 0.02), LiveDrive(response, 0.02, DriveReport(torque_noise=0.0))
    asked = [*commands(100, 0.02), *[0.0] * 60]
    shown, pending, speed = [], [], 0.0
    for k, command in enumerate(asked):
        report = drive.report(0.02 * k, speed, 0.0, WARM)
        watch.look(report)
        shown.append(report.motor_speed)
        pending.append(watch.pending)
        watch.command(command)
        speed = drive.follow(command)
    # What was commanded before a sample, and only that, is on its way there.
    for k in (40, 80):
        way = 0.02 * (sum(asked[:k]) - 0.5 * asked[k - 1] - sum(shown[:k]) - 0.5 * shown[k])
        assert pending[k] == pytest.approx(way, abs=0.02 * 0.06 * k)
    assert pending[-1] == pytest.approx(0.0, abs=1e-6)
    assert (max(abs(angle) for angle in pending) > 1.0) == (response is not IDEAL)


NOISY = DriveResponse(speed_noise=RPM)


def steady(count, seed, tremble=0.0):
    """A motor that turns up and down between times of a steady speed, at which a command may tremble [rad/s]."""
    random, found = np.random.default_rng(seed), []
    while len(found) < count:
        speed = float(random.uniform(50.0, 250.0))
        found += [*np.linspace(0.0, speed, 20), *(speed + tremble * random.standard_normal(150))]
        found += [*np.linspace(speed, 0.0, 20), *[0.0] * 20]
    return [float(value) for value in found[:count]]


@pytest.mark.parametrize("tremble", [0.0, 0.06])
def test_a_speed_that_is_stuck_while_the_motor_keeps_its_speed_is_told_where_it_had_noise(tremble):
    asked = steady(9000, 4, tremble)
    at = next(k for k in range(8400, 9000) if abs(asked[k] - asked[k - 1]) < 0.5 and asked[k] > 50.0) + 60
    said = watched(
        NOISY, 0.02, asked[: at + 60], how=DriveReport(seed=3, speed_noise=RPM),
        says=lambda k, r, kept={}: replace(r, motor_speed=kept.setdefault("now", r.motor_speed)) if k >= at else r,
    )  # fmt: skip
    first = next(k for k, verdict in enumerate(said) if verdict.stops)
    assert said[first] is Verdict.STUCK
    assert 0 < first - at <= 22, "19 repeats are rare; some more until that is known"


@pytest.mark.parametrize("noise", [0.0, 0.3 * RPM, RPM, 2.0 * RPM])
@pytest.mark.parametrize("period", [0.02, 0.1])
def test_a_drive_that_is_noisier_or_less_noisy_than_declared_is_not_stuck(noise, period):
    how = DriveReport(seed=3, speed_noise=noise)
    for tremble in (0.0, 0.06):
        said = watched(NOISY, period, steady(18_000, 5, tremble), how=how)
        assert Verdict.STUCK not in said


def test_a_slow_or_standing_motor_is_not_stuck():
    asked = [*steady(3000, 6), *[0.0] * 3000, *(2.0 + 1e-4 * np.arange(6000)).tolist(), *[2.0] * 3000]
    for noise in (0.0, RPM):
        assert Verdict.STUCK not in watched(NOISY, 0.02, asked, how=DriveReport(seed=3, speed_noise=noise))


@pytest.mark.parametrize("name", ["ideal", "5 samples either way"])
def test_a_speed_that_sleeps_while_the_command_goes_a_little_is_stuck(name):
    response, period = DRIVES[name]
    asked = [100.0 + 0.02 * max(k - 200, 0) for k in range(400)]
    said = watched(response, period, asked, says=lambda k, r: replace(r, motor_speed=100.0) if k > 200 else r)
    first = next(k for k, verdict in enumerate(said) if verdict.stops)
    assert said[first] is Verdict.STUCK
    moved = asked[first - 1 - round(response.lag / period)] - 100.0
    # Two steps beyond the mean of the first four, for four in a row.
    assert moved == pytest.approx(2.0 * response.speed_step + 0.02 * (1.5 + 4), abs=0.03)
    alive = watched(response, period, asked)
    assert not any(verdict.stops for verdict in alive)


def test_a_speed_that_stands_while_the_command_only_trembles_is_not_stuck():
    tremble = 100.0 + np.random.default_rng(2).normal(0.0, 0.06, 5000)
    said = watched(IDEAL, 0.02, tremble.tolist(), says=lambda k, r: replace(r, motor_speed=100.0) if k > 2 else r)
    assert not any(verdict.stops for verdict in said[10:])
    assert np.ptp(tremble) > 2.0 * IDEAL.speed_step


def test_a_drive_that_is_quicker_than_declared_is_left_alone():
    asked = commands(5000, 0.02)
    for declared in (DriveResponse(command_delay=0.1, report_delay=0.1), DriveResponse(bandwidth=2.0)):
        assert set(watched(IDEAL, 0.02, asked, declared=declared)) == {Verdict.OBEYS}


def test_a_stall_is_counted_anew_after_the_motor_has_turned():
    half = [0.0] * 40
    said = limited([*half, *([200.0] * 20), *half], 49.9)
    assert Verdict.STALLED not in said
    assert Verdict.AT_LIMIT in said
