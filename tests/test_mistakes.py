"""Gross mistakes in how a log is read: named by what the whole of it contradicts; its track is invalid."""

import warnings

import numpy as np
import pytest
import xarray

import ramsight
from ramsight import Status
from ramsight.errors import LogWarning
from ramsight.logs import write_log
from ramsight.sensor.status import is_invalid
from ramsight.tracking import mistakes
from ramsight.tracking.mistakes import Explanations, evidence, visits
from ramsight.tracking.pressed import STAYS, Press, Pressed, pressing_sides
from ramsight.tracking.watched import EXAMINED, Watch

from .command import as_command, at_once

RPM = np.pi / 30.0
DAYS = {("mining-loader", "boom"): "300 kN", ("mining-loader", "bucket"): "90 kN"}


@pytest.fixture(scope="module")
def days():
    """A work day of eight minutes of each unit."""
    found = {}
    for (machine, unit), load in DAYS.items():
        loader = ramsight.load_machine(machine)
        run = ramsight.simulate(loader, "work-day", unit=unit, load=[load], duration="8 min", seed=5)
        found[unit] = ramsight.drive_report(run, loader, unit=unit)
    return found


def swapped(log):
    """Speed in rpm and torque in N m, each in the other's column."""
    speed, torque = ("time", log.motor_torque.values * RPM), ("time", log.motor_speed.values / RPM)
    return log.assign(motor_speed=speed, motor_torque=torque)


def reversed_(log):
    return log.assign(motor_torque=-log.motor_torque, motor_speed=-log.motor_speed)


WRONG = {
    "rad/s": (lambda log: log.assign(motor_speed=log.motor_speed * RPM), "speed", "the speed is in rad/s"),
    "half": (lambda log: log.assign(motor_torque=log.motor_torque * 0.5), "torque", "the torque is 0.5 times"),
    "double": (lambda log: log.assign(motor_torque=log.motor_torque * 2.0), "torque", "the torque is 2 times"),
    "swapped": (swapped, "torque", "speed and torque are exchanged"),
    "reversed": (reversed_, "torque", "the signs of speed and torque are both reversed"),
}


def found_in(log, unit, machine="mining-loader"):
    seen = Explanations(ramsight.build(machine, unit=unit))
    for first in range(0, log.sizes["time"], 10_000):
        seen.take(log.isel(time=slice(first, first + 10_000)))
    return seen.mistake


@pytest.mark.parametrize("unit", ["boom", "bucket"])
def test_nothing_is_said_of_a_day_as_it_was(days, unit):
    assert found_in(days[unit], unit) is None


@pytest.mark.parametrize("unit", ["boom", "bucket"])
@pytest.mark.parametrize("wrong", WRONG)
def test_a_gross_mistake_is_named(days, unit, wrong):
    change, role, words = WRONG[wrong]
    found = found_in(change(days[unit]), unit)
    assert found is not None
    assert (found.role, found.text.startswith(words)) == (role, True), found
    assert 0.5 < found.probability <= 1.0


@pytest.mark.parametrize("unit", ["boom", "bucket"])
@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_said_of_a_short_part_of_a_right_log(days, unit, seed):
    """A part of which nobody knows whether the motor could have turned faster contradicts nothing."""
    random, time = np.random.default_rng(seed), days[unit].time.values
    for duration in np.exp(random.uniform(np.log(1.0), np.log(60.0), 12)):
        start = random.uniform(time[0], time[-1] - duration)
        part = days[unit].isel(time=(time >= start) & (time < start + duration))
        assert found_in(part, unit) is None, (start, duration)


def test_a_gap_while_the_motor_turns_is_no_move(days):
    log = days["boom"]
    turns = int(np.flatnonzero(log.motor_speed.values > 0.5 * log.motor_speed.values.max())[10])
    late = log.assign_coords(time=log.time.values + 3600.0 * (np.arange(log.sizes["time"]) >= turns))
    watch = Watch(ramsight.build("mining-loader", unit="boom"), "log.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        list(watch.over([late]))
    assert watch.last_word == ""


@pytest.mark.parametrize(("unit", "other"), [("boom", "bucket"), ("bucket", "boom")])
def test_the_log_of_another_machine_is_named(days, unit, other):
    found = found_in(days[unit], other)
    assert found is not None
    assert (found.role, "another machine" in found.text) == ("machine", True)


@pytest.mark.parametrize("unit", ["boom", "bucket"])
def test_a_drive_that_is_a_tenth_off_is_no_mistake(days, unit):
    for factor in (0.9, 1.1):
        log = days[unit].assign(motor_torque=days[unit].motor_torque * factor)
        assert found_in(log, unit) is None


def test_no_log_of_the_traces_is_called_wrong(traces):
    from ramsight.logs import read_log

    for trace in traces:
        unit = "bucket" if "bucket" in trace.name else "boom"
        assert found_in(read_log(trace.log), unit) is None, trace.name


# ---- what it rests on


def lifted(levels, free=200, pressed=40):
    """A motor that extends the rod at 100 rad/s, freely and then at each of these torques [N m]; a stand between."""
    torque, speed = [], []
    for level in levels:
        torque += [0.0] * 20 + [20.0] * free + [level] * pressed
        speed += [0.0] * 20 + [100.0] * (free + pressed)
    return np.arange(len(speed)) * 0.02, np.array(speed), np.array(torque), np.full(len(speed), 313.15)


def test_a_plateau_at_the_end_of_a_free_move_is_a_press(boom):
    asked = pressing_sides(boom)[1].torque
    seen = Pressed(boom)
    seen.take(*lifted([asked, 0.5 * asked]))
    assert [(one.way, round(one.level, 3)) for one in seen.presses] == [(1, 1.0), (1, 0.5)]
    assert 0.0 < seen.presses[0].place < seen.presses[1].place
    per_stroke = boom.travel_per_radian / boom.cylinder.stroke
    assert seen.longest == pytest.approx(100.0 * 200 * 0.02 * per_stroke, rel=0.12)  # less what leaks


def test_a_load_that_is_lifted_all_the_way_is_no_press(boom):
    time, speed, torque, oil = lifted([60.0], free=5, pressed=200)
    torque[20:30] = np.linspace(0.0, 60.0, 10)
    seen = Pressed(boom)
    seen.take(time, speed, torque, oil)
    assert seen.presses == []


@pytest.mark.parametrize(("share", "is_press"), [(STAYS + 0.04, True), (STAYS - 0.04, False)])
def test_a_press_lasts_until_the_motor_stops(boom, share, is_press):
    time, speed, torque, oil = lifted([80.0], pressed=100)
    torque[len(torque) - round((1.0 - share) * 100) :] = 20.0
    seen = Pressed(boom)
    seen.take(time, speed, torque, oil)
    assert bool(seen.presses) == is_press


def test_pieces_give_what_the_whole_log_gives(days, boom):
    columns = [days["boom"][name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")]
    whole, pieces = Pressed(boom), Pressed(boom)
    whole.take(*columns)
    rests = np.flatnonzero(np.abs(columns[1]) < 1e-3)
    cut = int(rests[len(rests) // 2])
    pieces.take(*(column[:cut] for column in columns))
    pieces.take(*(column[cut:] for column in columns))
    assert [one.level for one in pieces.presses] == pytest.approx([one.level for one in whole.presses])


def test_a_wild_sample_and_a_gap_change_nothing(boom):
    time, speed, torque, oil = lifted([80.8])
    speed[100], torque[120], speed[110], torque[130] = 1e300, -1e300, np.nan, np.inf
    seen = Pressed(boom)
    seen.take(np.where(np.arange(len(time)) > 150, time + 3600.0, time), speed, torque, oil)
    assert len(seen.presses) == 1
    assert seen.longest < 1.0


def test_what_has_no_numbers_has_no_mistake(boom):
    empty = np.full(100, np.nan)
    seen = Pressed(boom)
    seen.take(empty, empty, empty, empty)
    assert (seen.presses, seen.speed) == ([], 0.0)
    columns = dict.fromkeys(("motor_speed", "motor_torque", "oil_temperature"), ("time", empty))
    assert found_in(xarray.Dataset(columns, coords={"time": empty}), "boom") is None


@pytest.mark.parametrize(("level", "counts"), [(1.0 - 0.99 * mistakes.STOP, 1), (1.0 - 1.01 * mistakes.STOP, 0)])
def test_only_plateaus_at_the_torque_at_relief_are_ends(level, counts):
    assert len(visits([Press(1, 1.0, 0.5, 0.0), Press(-1, level, -0.5, 0.1)])) == counts


def test_from_an_end_to_itself_the_rod_goes_nowhere_and_to_the_other_by_its_stroke():
    ends = [Press(-1, 1.0, 0.0, 0.0), Press(-1, 1.0, 0.02, 0.0), Press(1, 1.0, 1.02, 0.0), Press(-1, 1.0, 0.02, 0.0)]
    assert [round(off, 9) for off, _ in visits(ends)] == [0.02, 0.0, 0.0]


def test_evidence_grows_with_presses_up_to_what_is_independent(boom):
    scores = []
    for number in range(6):
        seen = Pressed(boom)
        seen.presses = [Press(1, 1.0, 0.0, 0.0), *[Press(-1, 0.5, 0.0, 0.0)] * number]
        scores.append(evidence(seen, 0.5) - evidence(seen))
    steps = np.diff(scores)
    assert (steps[: int(mistakes.INDEPENDENT)] > 1.0).all()
    assert steps[int(mistakes.INDEPENDENT) :] == pytest.approx(0.0, abs=1e-9)


# ---- what a user sees


def test_track_ends_with_the_likeliest_mistake_and_its_positions_are_invalid(days, tmp_path):
    write_log(WRONG["half"][0](days["boom"]), tmp_path / "day.csv")
    words = ["track", "mining-loader", "day.csv", "--unit", "boom", "--out", "track.csv", "--state", "state.json"]
    done = as_command(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    last = done.stdout.splitlines()[-1]
    assert last.startswith("likeliest mistake: the torque is 0.5 times what it should be")
    assert "relief pressure asks for" in last
    assert done.stderr.count("warning:") == 1
    statuses = {line.split(",")[3] for line in (tmp_path / "track.csv").read_text().splitlines()[1:]}
    assert all(status.startswith(("invalid", "not referenced")) for status in statuses), statuses
    assert not (tmp_path / "state.json").exists()
    assert "state.json: left as it was" in done.stdout
    assert at_once(*words, "--strict", cwd=tmp_path).returncode == 1


def test_a_track_in_python_says_it_too_of_pieces_as_well(days):
    log = WRONG["rad/s"][0](days["boom"])
    half = log.sizes["time"] // 2
    pieces = (log.isel(time=part) for part in (slice(None, half), slice(half, None)))
    with pytest.warns(LogWarning, match="rad/s"):  # without a start nothing is taken for a reference
        track = ramsight.track("mining-loader", pieces, unit="boom", start="100 mm", alarm_limit="10 mm")
    assert "rad/s" in track.attrs["mistake"]
    said = track["status"].values != Status.NOT_REFERENCED
    assert is_invalid(track["status"].values[said]).all()
    assert set(track["status"].values[said]) >= {int(Status.IMPLAUSIBLE_SPEED)}
    assert track.attrs["available"] == 0.0
    assert track.sizes["time"] == log.sizes["time"]


def test_a_good_day_has_no_mistake_and_its_track_is_as_the_sensor_says(days):
    with warnings.catch_warnings():
        warnings.simplefilter("error", LogWarning)
        track = ramsight.track("mining-loader", days["boom"], unit="boom")
    assert "mistake" not in track.attrs
    assert (track["status"].values == Status.OK).any()


def test_a_track_without_a_position_is_an_error_where_it_is_strict(tmp_path):
    rows = "".join(f"{0.02 * k:.2f},0,0.5,40\n" for k in range(100))
    (tmp_path / "rest.csv").write_text(f"time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n{rows}")
    words = ["track", "mining-loader", "rest.csv", "--unit", "boom", "--out", "track.csv"]
    for strict, code in (([], 0), (["--strict"], 1)):
        done = at_once(*words, *strict, cwd=tmp_path)
        assert done.returncode == code, done.stderr
        assert ("error: no sample has a position" in done.stderr) == bool(strict)
        assert (tmp_path / "track.csv").read_text().splitlines()[-1].startswith("1.980000,,,not referenced,,,,0")
        assert at_once(*words, *strict, "--start", "100 mm", cwd=tmp_path).returncode == 0


def test_strict_is_for_every_verb_that_reads_a_log_and_has_no_verdict_of_its_own(tmp_path):
    (tmp_path / "cut.csv").write_text("time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n0.0,1,2,40\n0.02,1,2")
    for words in (["logs", "inspect", "cut.csv"], ["logs", "inspect", "cut.csv", "--strict"]):
        done = at_once(*words, cwd=tmp_path)
        assert "breaks off in this line" in done.stderr
        assert done.returncode == ("--strict" in words)
    for verb in ("track", "leak-test", "identify", "compare"):
        assert "--strict" in at_once(verb, "--help", cwd=tmp_path).stdout


@pytest.mark.parametrize(("good", "is_found"), [(EXAMINED - 1, True), (EXAMINED, False)])
def test_mistakes_are_looked_for_in_the_first_pieces(days, boom, good, is_found):
    """Pieces without numbers take their place."""
    day = WRONG["half"][0](days["boom"])
    empty = day.isel(time=slice(0, 10)).where(False)
    watch = Watch(boom, "day.csv")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        assert len(list(watch.over([empty] * int(good) + [day]))) == good + 1
    assert (watch.mistake is not None) == is_found
