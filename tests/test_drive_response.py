"""A drive that is not perfect: how it follows its commands, how late it reports, and what of that is lost."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.duty import DriveReport
from ramsight.duty.drive_response import Delay, DriveResponse, Follower
from ramsight.duty.live_drive import LiveDrive
from ramsight.errors import DescriptionError
from ramsight.plant.drive import ServoDrive

from .plant_bench import UNITS

DT, WARM = 0.02, 313.15
BOOM = UNITS["mining-loader boom"]


def followed(response, commands):
    drive = Follower(response, DT)
    return np.array([drive.step(float(command)) for command in commands])


def test_a_drive_of_which_nothing_is_said_does_as_it_is_told():
    commands = np.random.default_rng(0).normal(0.0, 100.0, 50)
    assert followed(DriveResponse(), commands).tolist() == commands.tolist()


@pytest.mark.parametrize("order", [1, 2])
def test_the_loop_is_the_exact_solution_of_its_equation(order):
    commands = 100.0 * np.sin(0.3 * np.arange(1, 60))
    found = followed(DriveResponse(bandwidth=5.0, order=order), commands)
    natural, damping, parts = 2.0 * np.pi * 5.0, np.sqrt(0.5), 4000
    speed, rate, before, expected, h = 0.0, 0.0, 0.0, [], DT / parts
    for command in commands:
        for k in range(parts):
            asked = before + (command - before) * (k + 0.5) / parts
            if order == 1:
                speed += h * natural * (asked - speed)
            else:
                rate += h * (natural**2 * (asked - speed) - 2.0 * damping * natural * rate)
                speed += h * rate
        before = command
        expected.append(speed)
    assert np.abs(found - expected).max() < 0.01


@pytest.mark.parametrize("order", [1, 2])
def test_the_bandwidth_is_where_the_amplitude_is_down_by_three_decibels(order):
    time = DT / 20 * np.arange(1, 20000)
    drive = Follower(DriveResponse(bandwidth=3.0, order=order), DT / 20)
    speeds = np.array([drive.step(w) for w in np.sin(2.0 * np.pi * 3.0 * time)])
    assert np.abs(speeds[10000:]).max() == pytest.approx(np.sqrt(0.5), rel=2e-3)


@settings(max_examples=30)
@given(delay=st.floats(0.0, 0.2), bandwidth=st.floats(2.0, 100.0), order=st.sampled_from([1, 2]))
def test_the_lag_is_what_a_steady_change_is_behind_by(delay, bandwidth, order):
    response = DriveResponse(command_delay=delay, bandwidth=bandwidth, order=order)
    ramp = 50.0 * DT * np.arange(1, 200)
    assert (ramp[-1] - followed(response, ramp)[-1]) / 50.0 == pytest.approx(response.lag, abs=1e-4)


def test_an_acceleration_is_limited_and_what_is_missing_is_made_up():
    found = followed(DriveResponse(acceleration=500.0, bandwidth=20.0, order=2), [100.0] * 60)
    assert np.abs(np.diff(found)).max() <= 500.0 * DT + 1e-9
    assert found[5] == pytest.approx(60.0)
    assert found[-1] == pytest.approx(100.0, abs=0.01)


@settings(max_examples=30)
@given(delay=st.floats(0.0, 0.3))
def test_a_delay_moves_what_is_straight(delay):
    late = Delay(delay, DT, 0.0)
    found = [late.step(DT * k) for k in range(1, 40)][-1]
    assert found == pytest.approx(39 * DT - delay, abs=1e-9)


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"command_delay": -0.1}, "command_delay"), ({"report_delay": np.nan}, "report_delay"),
        ({"bandwidth": 0.0}, "bandwidth"), ({"acceleration": -1.0}, "acceleration"), ({"order": 3}, "order"),
        ({"lost": 1.0}, "lost"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name(wrong, named):
    with pytest.raises(DescriptionError, match=named):
        DriveResponse(**wrong)


def test_what_is_lost_is_a_share_and_the_seed_decides_which():
    def arrived(seed):
        drive = LiveDrive(DriveResponse(lost=0.1), DT, DriveReport(seed=seed))
        return [drive.report(DT * k, 0.0, 0.0, WARM) is not None for k in range(2000)]

    assert arrived(1) == arrived(1)
    assert arrived(1) != arrived(2)
    assert np.mean(arrived(1)) == pytest.approx(0.9, abs=0.02)
    assert arrived(1)[0]


def test_a_command_that_is_lost_leaves_the_last_one():
    drive = LiveDrive(DriveResponse(lost=0.3), DT, DriveReport())
    found = [drive.follow(float(k)) for k in range(1, 200)]
    kept = [now for before, now in pairwise(found) if now == before]
    assert 0.2 < len(kept) / len(found) < 0.4
    assert all(speed <= k for k, speed in enumerate(found, 1))


def loop(response, unit=BOOM):
    found = UnitLoop(unit, unit, 0.2, 200e3, LoopSettings(known=True, drive=response))
    found.send({"boom": 0.25})
    return found


def test_plant_and_report_in_the_loop_are_behind_the_control():
    run = loop(DriveResponse(command_delay=0.04, report_delay=0.06))
    asked = []
    for _ in range(5):
        asked.append(run._commands["boom"].motor_speed)
        run.step()
    record = run.records["boom"]
    assert asked[1] > 0.0
    assert record.command == [0.0, 0.0, 0.0, *asked[:3]]
    assert [r.motor_speed for r in record.reported[:5]] == [0.0] * 5
    quick = loop(DriveResponse())
    quick.rest(0.1)
    assert quick.records["boom"].reported[2].motor_speed == pytest.approx(asked[1], abs=0.1)


def test_a_report_that_is_lost_is_no_sample_of_the_sensor():
    run = loop(DriveResponse(lost=0.3))
    run.rest(0.5)
    record = run.records["boom"]
    lost = [k for k in range(1, len(run.time)) if record.reported[k].time == record.reported[k - 1].time]
    assert 3 < len(lost) < 14
    assert all(record.estimate[k] is record.estimate[k - 1] for k in lost)
    arrived = [k for k in range(len(run.time)) if k not in lost]
    assert all(record.reported[k].time == run.time[k] for k in arrived)


@pytest.mark.slow
def test_the_record_of_a_servo_has_its_command_and_the_report_its_speed():
    slow = replace(BOOM, drive=ServoDrive("drive", 0.008, 0.8, 16.0, 90.0))
    run = loop(DriveResponse(), slow)
    run.rest(0.12)
    record = run.records["boom"]
    assert record.command[-1] > run.now.motor_speed["boom"] + 1.0
    assert record.reported[-1].motor_speed == pytest.approx(run.now.motor_speed["boom"], abs=0.1)


def test_a_motor_that_does_otherwise_than_its_command():
    run = loop(DriveResponse())
    run.motor_fault = lambda _, speed: -speed
    run.rest(0.1)
    assert run.now.motor_speed["boom"] < 0.0 < run._commands["boom"].motor_speed
