"""A sensor's state over a power loss: the newest, an older one's knowledge, or none; never a wrong position."""

import subprocess
import sys

import numpy as np
import pytest

from ramsight import machine
from ramsight.logs import read_drive_log
from ramsight.plant.ddh import build
from ramsight.sensor.balance import balance
from ramsight.sensor.kalman import kalman
from ramsight.sensor.keeping import StateError, StateFile
from ramsight.sensor.status import Status


@pytest.fixture(scope="module")
def unit():
    return build("boom", machine.load("mining-loader").unit("boom"))


@pytest.fixture
def sensor(unit):
    return kalman(unit)


def at(sensor, position):
    sensor.start(position)
    sensor.step(0.0, 0.0, 0.0, 313.15)
    return sensor


def test_the_newest_of_many_states_is_resumed(tmp_path, sensor, unit):
    file = StateFile(tmp_path / "boom.state", sensor)
    for position in (0.1, 0.2, 0.3, 0.4, 0.5):
        at(sensor, position)
        file.save()
    other = kalman(unit)
    resumed = StateFile(tmp_path / "boom.state", other).resume()
    assert (resumed.found, resumed.older) == (True, False)
    now = other.step(1000.0, 0.0, 0.0, 313.15)
    assert now.position == pytest.approx(0.5)
    assert now.status == Status.OK


def test_what_was_learnt_is_resumed_and_tracking_goes_on(tmp_path, trace, sensor, unit):
    log = read_drive_log(trace("boom_asbuilt1_workday").log)
    half = log.sizes["time"] // 2
    while abs(log["motor_speed"].values[half]) > 0.1:
        half += 1
    sensor.start(0.1)
    whole = sensor.track(log)["position"].values
    sensor.start(0.1)
    sensor.track(log.isel(time=slice(half)))
    StateFile(tmp_path / "s", sensor).save()
    other = kalman(unit)
    StateFile(tmp_path / "s", other).resume()
    rest = other.track(log.isel(time=slice(half, None)))
    assert np.abs(rest["position"].values - whole[half:]).max() < 1e-3
    assert rest["leak_factor"].values[-1] == pytest.approx(1.15, rel=0.03)


def test_wherever_a_write_is_torn_the_position_is_right_or_unknown(tmp_path, sensor, unit):
    path = tmp_path / "boom.state"
    file = StateFile(path, sensor)
    at(sensor, 0.1)
    file.save()
    one = path.read_bytes()
    at(sensor, 0.4)
    file.save()
    two = path.read_bytes()
    at(sensor, 0.6)
    file.save()
    three = path.read_bytes()
    slot = len(one)
    assert len(two) == len(three) == 2 * slot
    other = kalman(unit)
    for cut in range(0, slot + 1, 7):
        path.write_bytes(three[:cut] + two[cut:])  # the third save went over the first
        resumed = StateFile(path, other).resume()
        assert resumed.found
        now = other.step(0.0, 0.0, 0.0, 313.15)
        if cut >= slot:
            assert now.position == pytest.approx(0.6)
        elif now.status != Status.NOT_REFERENCED:  # not a byte had changed yet
            assert now.position == pytest.approx(0.4)
            assert three[:cut] + two[cut:] == two
    for cut in range(0, slot, 7):
        path.write_bytes(two[: slot + cut])  # the second save was the first to make its slot
        StateFile(path, other).resume()
        now = other.step(0.0, 0.0, 0.0, 313.15)
        assert now.status == Status.NOT_REFERENCED if cut else now.position == pytest.approx(0.1)
        path.write_bytes(one[:cut])
        assert not StateFile(path, other).resume().found
        assert other.step(0.0, 0.0, 0.0, 313.15).status == Status.NOT_REFERENCED


def test_any_flipped_byte_is_noticed(tmp_path, sensor, unit):
    path = tmp_path / "boom.state"
    at(sensor, 0.3)
    StateFile(path, sensor).save()
    whole = path.read_bytes()
    other = kalman(unit)
    for place in range(0, len(whole), 11):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1 :])
        try:
            found = StateFile(path, other).resume().found
        except StateError:
            continue
        assert not found
        assert other.step(0.0, 0.0, 0.0, 313.15).status == Status.NOT_REFERENCED


def test_a_state_saved_in_motion_is_less_certain(tmp_path, trace, sensor, unit):
    log = read_drive_log(trace("boom_258kN_40C").log)
    sensor.start(0.1)
    moving = int(np.searchsorted(log["time"].values, 6.0))
    before = sensor.track(log.isel(time=slice(moving)))["position_std"].values[-1]
    StateFile(tmp_path / "s", sensor).save()
    other = kalman(unit)
    StateFile(tmp_path / "s", other).resume()
    assert other.step(0.0, 0.0, 0.0, 313.15).std > before + 10e-3


def test_states_of_others_and_of_the_future_are_refused(tmp_path, sensor, unit):
    path = tmp_path / "boom.state"
    StateFile(path, sensor).save()
    bucket = kalman(build("bucket", machine.load("mining-loader").unit("bucket")))
    with pytest.raises(StateError, match="another sensor or machine"):
        StateFile(path, bucket).resume()
    newer = bytearray(path.read_bytes())
    newer[16] += 1
    path.write_bytes(bytes(newer))
    with pytest.raises(StateError, match="newer"):
        StateFile(path, sensor).resume()
    with pytest.raises(StateError, match="kalman"):
        StateFile(path, balance(unit))


def ramsight(*words, cwd):
    command = [sys.executable, "-m", "ramsight", *words]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=120, check=False)


def test_the_command_resumes_where_it_stopped(tmp_path, trace):
    log = str(trace("boom_258kN_40C").log)
    words = ("track", "mining-loader", log, "--unit", "boom", "--state", "boom.state")
    first = ramsight(*words, "--start", "100 mm", cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    ended = first.stdout.split("mm at first, ")[1].split(" mm")[0]
    second = ramsight(*words, cwd=tmp_path)
    assert "boom.state: resumed" in second.stdout
    assert f"position {ended} mm at first" in second.stdout
    (tmp_path / "boom.state").write_bytes(b"rubbish")
    third = ramsight(*words, cwd=tmp_path)
    assert third.returncode == 2
    assert "boom.state: is there already, and is no state of a sensor" in third.stderr
    assert (tmp_path / "boom.state").read_bytes() == b"rubbish"
    (tmp_path / "boom.state").write_bytes(b"")
    fourth = ramsight(*words, cwd=tmp_path)
    assert fourth.returncode == 0
    assert "no state to resume" in fourth.stdout
    assert "not referenced" in fourth.stdout


def test_a_sensor_that_cannot_find_the_piston_has_to_be_told(tmp_path, trace):
    log = str(trace("boom_258kN_40C").log)
    told = ramsight("track", "mining-loader", log, "--unit", "boom", "--sensor", "balance", cwd=tmp_path)
    assert told.returncode == 2
    assert "--start" in told.stderr
    assert len(told.stderr.strip().splitlines()) == 1
