"""A sensor's state over a power loss: the newest, an older one's knowledge, or none; never a wrong position."""

import hashlib
import math
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from ramsight import machine
from ramsight.logs import read_log
from ramsight.output import HeldError
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.balance import balance
from ramsight.sensor.kalman import kalman
from ramsight.sensor.persistence import FORMAT, Resumed, StateError, StateFile
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import IS_REFERENCED, REFERENCED_NOW, StartError

from .command import as_command, at_once


@pytest.fixture(scope="module")
def unit():
    """Whose entered positions are sure."""
    boom = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
    return replace(boom, assumptions=boom.assumptions.replace({"stops.entered": 1e-6}))


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


def test_a_resumed_position_is_not_referenced_since_power_up(tmp_path, sensor, unit):
    file, other = StateFile(tmp_path / "boom.state", at(sensor, 0.3)), kalman(unit)
    assert sensor.says(REFERENCED_NOW) == 1.0
    file.save()
    file.save()
    StateFile(file.path, other).resume()
    assert math.isnan(kalman(unit).says(REFERENCED_NOW))
    assert other.step(1000.0, 0.0, 0.0, 313.15).status == Status.OK
    assert (other.says(REFERENCED_NOW), other.state[IS_REFERENCED]) == (0.0, 1.0)
    other.step(1000.02, 0.0, 0.0, 313.15, reference=0.3)
    assert other.says(REFERENCED_NOW) == 1.0
    other.start(None)
    other.step(0.0, 0.0, 0.0, 313.15)
    assert other.says(REFERENCED_NOW) == 0.0
    assert math.isnan(other.says("a reference"))


def test_what_was_learnt_is_resumed_and_tracking_goes_on(tmp_path, trace, sensor, unit):
    log = read_log(trace("boom_asbuilt1_workday").log)
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


@pytest.mark.slow
def test_wherever_a_write_is_torn_the_position_is_right_or_unknown(tmp_path, sensor, unit):
    path, other = tmp_path / "boom.state", kalman(unit)
    contents = [b""]
    for position in (0.1, 0.4, 0.6, 0.2):
        at(sensor, position)
        StateFile(path, sensor).save()
        contents.append(path.read_bytes())
    assert {len(content) for content in contents[1:]} == {len(contents[1])}, "both slots exist from the start"
    for (before, after), old, new in zip(pairwise(contents), (None, 0.1, 0.4, 0.6), (0.1, 0.4, 0.6, 0.2), strict=True):
        for cut in range(0, len(after) + 1, 7):
            path.write_bytes(after[:cut] + before[cut:])
            StateFile(path, other).resume()
            now = other.step(0.0, 0.0, 0.0, 313.15)
            if now.status == Status.OK:
                whole = path.read_bytes()
                assert whole in (before, after)
                assert now.position == pytest.approx(old if whole == before else new)
            else:
                assert now.status == Status.NOT_REFERENCED


@pytest.mark.parametrize("cut", ["by size", "erased", "zeroed", "an old copy"])
def test_a_slot_that_is_lost_takes_the_position_with_it(tmp_path, sensor, unit, cut):
    """A power loss while the file grows, or between erasing and writing, leaves the other slot, which may be stale."""
    path, other = tmp_path / "boom.state", kalman(unit)
    at(sensor, 0.1)
    StateFile(path, sensor).save()
    first = path.read_bytes()
    for position in (0.5, 0.6, 0.2):
        at(sensor, position)
        StateFile(path, sensor).save()
    content = path.read_bytes()
    slot = len(content) // 2
    rest = {"by size": b"", "erased": b"\xff" * slot, "zeroed": bytes(slot), "an old copy": first[slot:]}[cut]
    lower = [] if cut == "an old copy" else [rest + content[slot:]]
    for damaged in (content[:slot] + rest, *lower):
        path.write_bytes(damaged)
        resumed = StateFile(path, other).resume()
        assert resumed.older or not resumed.found
        assert other.step(0.0, 0.0, 0.0, 313.15).status == Status.NOT_REFERENCED


def test_what_was_learnt_outlives_a_lost_slot(tmp_path, sensor, unit):
    path, other = tmp_path / "boom.state", kalman(unit)
    at(sensor, 0.1)
    sensor.state = {**sensor.state, "hypotheses[0].leakage": 1.25}
    StateFile(path, sensor).save()
    content = path.read_bytes()
    for damaged in (content[: len(content) // 2], bytes(len(content) // 2) + content[len(content) // 2 :]):
        path.write_bytes(damaged)
        assert StateFile(path, other).resume().older
        assert other.state["hypotheses[0].leakage"] == 1.25


def test_states_that_know_the_machine_are_states(sensor):
    known = sensor.learned
    assert len(known) == 5 * (8 + 36 + 1)  # of each hypothesis: what is not the position, its covariance, its weight
    assert {"position", "hypotheses[0].position", "load.load", "intake.time"}.isdisjoint(known)


def test_the_position_can_be_taken_off_the_disk(tmp_path, sensor, unit):
    path, other = tmp_path / "boom.state", kalman(unit)
    at(sensor, 0.3)
    StateFile(path, sensor).save()
    StateFile(path, sensor).forget_position()
    assert sensor.state["position"] == pytest.approx(0.3)
    assert StateFile(path, other).resume().found
    assert other.step(0.0, 0.0, 0.0, 313.15).status == Status.NOT_REFERENCED


def test_any_flipped_byte_is_noticed(tmp_path, sensor, unit):
    path = tmp_path / "boom.state"
    at(sensor, 0.3)
    StateFile(path, sensor).save()
    whole = path.read_bytes()
    other = kalman(unit)
    for place in range(0, len(whole), 11):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1 :])
        assert StateFile(path, other).resume().older
        assert other.step(0.0, 0.0, 0.0, 313.15).status == Status.NOT_REFERENCED


@pytest.mark.parametrize("place", [0, 16, 17, 20, 24, 56])
def test_a_damaged_head_of_one_slot_does_not_refuse_the_other(tmp_path, sensor, unit, place):
    path = tmp_path / "boom.state"
    at(sensor, 0.3)
    StateFile(path, sensor).save()
    whole, other = path.read_bytes(), kalman(unit)
    for start in (0, len(whole) // 2):
        damaged = bytearray(whole)
        damaged[start + place] ^= 0x42
        path.write_bytes(damaged)
        assert StateFile(path, other).resume().older


@pytest.mark.parametrize(
    ("name", "value"),
    [("position", math.nan), ("position", 5.0), ("position_variance", -1e-6), ("position_variance", math.inf),
     ("hypotheses[0].leakage", math.nan), ("position_known", 7.0), ("report.velocity", -math.inf),
     ("report.velocity", 1e300),
     ("hypotheses[0].leakage", -1e31), ("hypotheses[2].covariance[compliance,compliance]", -1e-9)],
)  # fmt: skip
def test_a_state_that_cannot_be_is_not_resumed_even_with_a_good_checksum(tmp_path, sensor, unit, name, value):
    path, other = tmp_path / "boom.state", kalman(unit)
    file = StateFile(path, sensor)
    at(sensor, 0.3)
    file.save()
    content = path.read_bytes()
    newest = file._packed(2, {**sensor.state, name: value})
    path.write_bytes(content[: len(newest)] + newest)
    assert StateFile(path, other).resume().older
    assert other.step(0.0, 0.0, 0.0, 313.15).status == Status.NOT_REFERENCED
    with pytest.raises(ValueError, match=re.escape(name)):
        other.state = {**sensor.state, name: value}


@pytest.mark.parametrize("make", [kalman, balance])
@pytest.mark.parametrize("position", [math.nan, math.inf, -math.inf, -0.01, 0.75, 5.0])
def test_a_start_that_cannot_be_is_refused(unit, make, position):
    sensor = make(unit)
    sensor.start(0.2)
    with pytest.raises(StartError, match=r"0 to 0\.7 m"):
        sensor.start(position)
    assert sensor.state["position"] == 0.2, "as it was"


@pytest.mark.parametrize("std", [math.nan, math.inf, -1e-3, 0.8])
def test_a_standard_deviation_that_cannot_be_is_refused(sensor, std):
    with pytest.raises(StartError, match="standard deviation"):
        sensor.start(0.2, std)


@pytest.mark.parametrize(
    "name", ["position", "report.velocity", "position_variance", "hypotheses[0].leakage", "report.position"]
)
def test_a_value_that_is_no_number_never_has_a_usable_status(sensor, name):
    at(sensor, 0.3)
    sensor._state[sensor.recursion.state.index(name)] = math.nan
    for k in range(1, 20):
        now = sensor.step(0.02 * k, 10.0, 20.0, 313.15)
        assert now.status.validity == "invalid" or all(
            map(math.isfinite, (now.position, now.position_std, now.velocity))
        )


def test_a_reference_that_is_no_number_is_none(sensor):
    at(sensor, 0.3)
    now = sensor.step(0.02, 0.0, 0.0, 313.15, math.inf)
    assert now.position == pytest.approx(0.3)
    assert now.status == Status.OK


def test_a_state_saved_in_motion_is_less_certain(tmp_path, trace, sensor, unit):
    log = read_log(trace("boom_258kN_40C").log)
    sensor.start(0.1)
    moving = int(np.searchsorted(log["time"].values, 6.0))
    before = sensor.track(log.isel(time=slice(moving)))["position_std"].values[-1]
    StateFile(tmp_path / "s", sensor).save()
    other = kalman(unit)
    StateFile(tmp_path / "s", other).resume()
    assert other.step(0.0, 0.0, 0.0, 313.15).position_std > before + 10e-3


def test_states_of_others_and_of_the_future_are_refused(tmp_path, sensor, unit):
    path = tmp_path / "boom.state"
    StateFile(path, sensor).save()
    bucket = kalman(build_ddh("bucket", machine.load_machine("mining-loader").unit("bucket")))
    with pytest.raises(StateError, match="another sensor or machine"):
        StateFile(path, bucket).resume()
    newer = bytearray(path.read_bytes())
    for slot in (0, len(newer) // 2):
        newer[slot + 16] += 1
    path.write_bytes(bytes(newer))
    with pytest.raises(StateError, match="newer"):
        StateFile(path, sensor).resume()
    with pytest.raises(StateError, match="kalman"):
        StateFile(path, balance(unit))


@pytest.mark.parametrize("saved", ["unit left", "", "unit right "])
def test_a_state_of_a_cylinder_with_the_same_numbers_is_refused(tmp_path, sensor, unit, saved):
    path = tmp_path / "boom.state"
    StateFile(path, at(sensor, 0.1), saved).save()
    with pytest.raises(StateError, match="another unit or node"):
        StateFile(path, kalman(unit), "unit right").resume()


def test_slots_of_two_files_are_no_pair(tmp_path, sensor, unit):
    """Two files of one cylinder: the random number that is made with each tells their slots apart."""
    contents = []
    for name, position in (("one", 0.1), ("other", 0.5)):
        for _ in range(3):
            StateFile(tmp_path / name, at(sensor, position)).save()
        contents.append((tmp_path / name).read_bytes())
    half, mixed, other = len(contents[0]) // 2, tmp_path / "mixed", kalman(unit)
    for one, two in (contents, reversed(contents)):
        mixed.write_bytes(one[:half] + two[half:])
        assert StateFile(mixed, other).resume().older
        assert other.step(0.0, 0.0, 0.0, 313.15).status == Status.NOT_REFERENCED


def test_a_file_that_was_exchanged_while_it_is_followed_is_written_as_a_new_one(tmp_path, sensor, unit):
    path, twin, other = tmp_path / "boom.state", tmp_path / "twin.state", kalman(unit)
    file = StateFile(path, at(sensor, 0.2))
    file.save()
    file.save()
    StateFile(twin, at(other, 0.6)).save()
    StateFile(twin, other).save()
    path.write_bytes(twin.read_bytes())
    file.save()
    assert StateFile(path, other).resume() == Resumed(found=True, older=False)
    assert other.step(0.0, 0.0, 0.0, 313.15).position == pytest.approx(0.2)


def test_a_state_of_the_format_before_says_nothing_of_the_position(tmp_path, sensor, unit):
    path, other = tmp_path / "boom.state", kalman(unit)
    StateFile(path, at(sensor, 0.2)).save()
    content = bytearray(path.read_bytes())
    half = len(content) // 2
    for start in (0, half):
        content[start + 16] = FORMAT - 1
        content[start + half - 32 : start + half] = hashlib.sha256(content[start : start + half - 32]).digest()
    path.write_bytes(bytes(content))
    assert not StateFile(path, other).resume().found


@pytest.mark.posix
def test_what_another_has_is_neither_read_nor_written_nor_removed(tmp_path, sensor, unit):
    path, other = tmp_path / "boom.state", kalman(unit)
    file = StateFile(path, at(sensor, 0.2))
    file.hold()
    file.save()
    content = path.read_bytes()
    link, hard = tmp_path / "link.state", tmp_path / "hard.state"
    link.symlink_to(path)
    os.link(path, hard)
    for name in (path, link, hard):
        late = StateFile(name, other)
        for use in (late.hold, late.save, late.forget_position, late.resume):
            with pytest.raises(HeldError, match=f"{name.name}: another program"):
                use()
        late.discard()
    assert path.read_bytes() == content
    file.release()
    assert StateFile(link, other).resume().found


@pytest.mark.posix
@pytest.mark.slow
def test_two_commands_do_not_share_a_state_file(tmp_path, trace):
    """One is killed and the other goes on; one that is stopped still has the file."""
    log = str(trace("boom_258kN_40C").log)
    words = [sys.executable, "-m", "ramsight", "track", "mining-loader", "-", "--unit", "boom", "--state", "boom.state"]
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path / "boom.state")], stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout.readline() == "held\n"
    words[5] = log
    try:
        for stopped in (False, True):
            if stopped:
                holder.send_signal(signal.SIGSTOP)
            late = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
            assert late.returncode == 2
            assert late.stderr.strip() == (
                f"error: boom.state: another program (process {holder.pid}) has it; end that, or give another file"
            )
    finally:
        holder.kill()
        holder.communicate()
    late = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert late.returncode == 0, late.stderr


HOLDER = """
import sys, time
from ramsight.output import Exclusive
held = Exclusive(sys.argv[1])
held.take()
print("held", flush=True)
time.sleep(600)
"""


@pytest.mark.slow
def test_the_command_resumes_where_it_stopped(tmp_path, trace):
    log = str(trace("boom_258kN_40C").log)
    words = ("track", "mining-loader", log, "--unit", "boom", "--state", "boom.state")
    first = as_command(*words, "--start", "100 mm", cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    ended = first.stdout.split("mm at first, ")[1].split(" mm")[0]
    second = as_command(*words, cwd=tmp_path)
    assert "boom.state: resumed" in second.stdout
    assert f"position {ended} mm at first" in second.stdout
    (tmp_path / "boom.state").write_bytes(b"rubbish")
    third = at_once(*words, cwd=tmp_path)
    assert third.returncode == 2
    assert "boom.state: is there already, and is no state of a sensor" in third.stderr
    assert (tmp_path / "boom.state").read_bytes() == b"rubbish"
    (tmp_path / "boom.state").write_bytes(b"")
    fourth = at_once(*words, cwd=tmp_path)
    assert fourth.returncode == 0
    assert "no state to resume" in fourth.stdout
    assert "not referenced" in fourth.stdout


def test_a_sensor_that_cannot_find_the_piston_has_to_be_told(tmp_path, trace):
    log = str(trace("boom_258kN_40C").log)
    told = at_once("track", "mining-loader", log, "--unit", "boom", "--sensor", "balance", cwd=tmp_path)
    assert told.returncode == 2
    assert "--start" in told.stderr
    assert len(told.stderr.strip().splitlines()) == 1
