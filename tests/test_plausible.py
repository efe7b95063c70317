"""A wrong unit or sign looks healthy sample by sample; against the machine it is noticed."""

import re
import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from ramsight.api.abilities import abilities
from ramsight.errors import LogWarning
from ramsight.logs import open_log, read_log, write_log
from ramsight.logs.mapped import standard_map
from ramsight.machine import load_machine
from ramsight.plant.build import build
from ramsight.tracking.plausible import _signs, reportable
from ramsight.tracking.pressed import Pressed
from ramsight.tracking.watched import watched

from .command import as_command
from .log_bench import roles, written

RPM = np.pi / 30.0


def warned(log, unit, channel_map=None):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LogWarning)
        list(watched([log], unit, "day.csv", channel_map))
    return [str(one.message) for one in caught]


def test_nothing_is_said_of_a_log_that_fits(traces, units):
    for trace in traces:
        unit = units["bucket" if "bucket" in trace.name else "boom"]
        assert warned(read_log(trace.log), unit) == []


@pytest.mark.parametrize(("share", "warns"), [(1.05, False), (1.2, True)])
def test_a_speed_that_is_somewhat_above_the_highest_is_noticed(trace, units, share, warns):
    log = read_log(trace("boom_441kN_40C").log)
    faster = share * units["boom"].max_speed / float(np.abs(log["motor_speed"]).max())
    log["motor_speed"] = log["motor_speed"] * faster
    said = [one for one in warned(log, units["boom"]) if "turns up to" in one]
    assert bool(said) == warns


WRONG = {
    "speed in rad/s taken for rpm": ({"motor_speed": lambda v: v * RPM}, "motor_speed_rpm", "rad/s"),
    "speed in rpm taken for rad/s": ({"motor_speed": lambda v: v / RPM}, "motor_speed_rpm", "rpm"),
    "speed in deg/s taken for rpm": ({"motor_speed": lambda v: v * 6.0}, "motor_speed_rpm", "deg/s"),
    "temperature in degF": ({"oil_temperature": lambda v: 1.8 * v - 0.8 * 273.15 + 32.0}, "oil_temperature_c", "degF"),
    "torque in percent of 30 N m": (
        {"motor_torque": lambda v: v / 0.3}, "motor_torque_nm", "percent of the rated torque",
    ),
    "torque in permille of 60 N m": ({"motor_torque": lambda v: v / 0.06}, "motor_torque_nm", "permille"),
    "torque in mN m": ({"motor_torque": lambda v: v * 1e3}, "motor_torque_nm", "mN m"),
    "torque in kN m": ({"motor_torque": lambda v: v * 1e-3}, "motor_torque_nm", "kN m"),
    "time in ms": ({"time": lambda v: v * 1e3}, "time_s", "ms"),
    "time in us": ({"time": lambda v: v * 1e6}, "time_s", "us"),
    "time in s taken for ms": ({"time": lambda v: v * 1e-3}, "time_s", "1000 times larger"),
    "torque with the other sign": ({"motor_torque": lambda v: -v}, "motor_torque_nm", "sign of speed or torque"),
    "speed with the other sign": ({"motor_speed": lambda v: -v}, "motor_torque_nm", "sign of speed or torque"),
    "both with the other sign": (
        {"motor_torque": lambda v: -v, "motor_speed": lambda v: -v}, "motor_torque_nm", "signs of speed and torque",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", ["boom_441kN_40C", "boom_258kN_40C", "bucket_48kN_40C"])
@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_unit_or_sign_is_named_with_the_one_that_fits(trace, units, case, wrong):
    changes, channel, unit = WRONG[wrong]
    if "percent" in wrong and case.startswith("bucket"):
        pytest.skip("a light load in percent of a small motor's torque is within what the machine can do")
    log = read_log(trace(case).log)
    if wrong == "temperature in degF" and float(log.oil_temperature.mean()) < 301.0:
        pytest.skip("80 degF may be 80 degC")
    for name, change in changes.items():
        log[name] = ("time", change(log[name].values))
    known = None
    if wrong.endswith("rad/s"):
        known = standard_map([])
        known = replace(known, roles={**known.roles, "speed": replace(known.roles["speed"], unit="rad/s")})
    said = warned(log, units[case.split("_")[0]], known)
    assert len(said) == 1
    assert said[0].startswith(f"day.csv, column {channel}: ")
    assert unit in said[0]


def test_channels_are_called_as_in_the_map(trace, units, tmp_path):
    names = written(tmp_path, roles("n", "M", "T", time="t"))
    log = read_log(trace("boom_441kN_40C").log)
    log["motor_speed"] = log.motor_speed * RPM
    assert warned(log, units["boom"], names)[0].startswith("day.csv, column n: ")


def test_a_finding_is_said_once_and_at_the_first_piece(trace, units):
    log = read_log(trace("boom_441kN_40C").log)
    log["motor_speed"] = log.motor_speed * 6.0
    pieces = watched([log, log, log], units["boom"], "day.csv")
    with pytest.warns(LogWarning, match="the motor turns up to 9"):
        next(pieces)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(list(pieces)) == 2


def test_a_log_without_numbers_is_not_judged(units):
    empty = ("time", np.full(10, np.nan))
    columns = dict.fromkeys(("motor_speed", "motor_torque", "oil_temperature"), empty)
    assert warned(xarray.Dataset(columns, coords={"time": empty}), units["boom"]) == []


def test_limits_are_those_of_the_machine(units):
    limits = reportable(units["boom"])
    assert limits.max_speed == pytest.approx(4000 * RPM)
    assert 72.0 < limits.torque < 100.0
    assert (limits.load_sign, reportable(units["bucket"]).load_sign) == (1.0, -1.0)


def test_of_a_load_that_only_resists_no_sign_of_the_torque_is_asked():
    press = build(load_machine("eha-valve-rig").unit("axis"), "axis")
    limits = reportable(press)
    assert limits.load_sign == 0.0
    pushed = dict.fromkeys((1, -1), -50.0 * limits.torque)
    seen = SimpleNamespace(seconds={1: 100.0, -1: 100.0}, torque_seconds=pushed)
    assert _signs(seen, limits) == ""
    assert "reversed" in _signs(seen, replace(limits, load_sign=1.0))


def test_what_a_machine_can_have_says_that_such_a_load_shows_no_end():
    sensors, *_ = abilities("eha-valve-rig")
    assert "need a start or a switch" in sensors.how


def test_track_says_it_and_over_how_many_samples_the_error_is(trace, tmp_path):
    log = read_log(trace("boom_441kN_40C").log)
    log["motor_speed"] = log.motor_speed * RPM
    write_log(log, tmp_path / "log.csv")
    words = ("track", "mining-loader", "log.csv", "--unit", "boom", "--start", "100 mm")
    done = as_command(*words, "--truth", trace("boom_441kN_40C").truth, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = [line for line in done.stderr.splitlines() if not line.endswith("so far")]  # on a slow machine
    assert len(said) == 1
    assert said[0].startswith("warning: log.csv, column motor_speed_rpm: the motor never turns faster than 157 rpm")
    samples = len(next(iter(open_log(tmp_path / "log.csv"))).time)
    # A speed in rpm that is read as rad/s takes the piston out of its cylinder: what is invalid then is counted apart.
    counted = re.search(r"over (\d+) of (\d+) samples", done.stdout)
    assert counted, done.stdout
    invalid = re.search(r"not counted: (\d+) invalid samples", done.stdout)
    apart = 0 if invalid is None else int(invalid[1])
    assert (int(counted[1]) + apart, int(counted[2])) == (samples, samples)


def test_a_wild_sample_makes_no_move(trace, units):
    log = read_log(trace("boom_258kN_40C").log)
    log["motor_speed"].values[500] = 1e300
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        list(watched([log], units["boom"], "day.csv"))


def test_what_is_said_of_absurd_numbers_is_short(trace, units):
    log = read_log(trace("boom_258kN_40C").log)
    log["motor_speed"].values[:] *= 1e300
    log["oil_temperature"].values[:] = 1e300
    with pytest.warns(LogWarning) as said:
        list(watched([log], units["boom"], "day.csv"))
    assert max(len(str(one.message)) for one in said) < 300


@pytest.mark.parametrize(("noise", "said"), [(0.5, False), (0.9, False), (1.6, True), (5.0, True)])
def test_a_torque_that_scatters_by_more_than_the_description_assumes_is_said(units, trace, noise, said):
    """The loader's is 0.5 N m, 0.7 % of 72 N m; steps of the load at rest are no noise."""
    log = read_log(trace("boom_258kN_40C").log).copy(deep=True)
    rng = np.random.default_rng(1)
    rest = log.isel(time=np.zeros(600, dtype=int)).assign_coords(time=log["time"].values[-1] + 0.02 * np.arange(1, 601))
    rest["motor_speed"][:] = 0.0
    rest["motor_torque"][:] = noise * rng.normal(size=600) + np.where(np.arange(600) < 300, 0.0, 40.0)
    found = warned(rest, units["boom"])
    assert bool(found) == said
    if said:
        share = float(re.search(r'torque = "([0-9.]+) %"', found[0])[1])
        assert share == pytest.approx(100.0 * noise / 72.1, rel=0.15, abs=0.1)
        assert "while the motor stands" in found[0]


def test_oil_over_a_relief_valve_is_no_travel():
    """A motor that pushes against an end turns on: the rod goes nowhere meanwhile."""
    boom = build(load_machine("mining-loader"), "boom")
    pressed = Pressed(boom)
    time = np.arange(0.0, 30.0, 0.02)
    torque = np.full(len(time), pressed.sides[1].torque)
    pressed.take(time, np.full(len(time), 100.0), torque, np.full(len(time), 313.15))
    assert pressed.longest == 0.0
    pressed.take(time + 30.0, np.full(len(time), 100.0), 0.5 * torque, np.full(len(time), 313.15))
    assert pressed.longest > 0.5, "half the torque opens nothing"
