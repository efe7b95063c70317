"""Leakage measured against the closed safety valve, on a log of another plant and on our own with known wear."""

import re
from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.calibration.identify_record import IdentifyError
from ramsight.calibration.leakage import LeakTestError, leak_test, leak_test_summary
from ramsight.duty import DriveReport, Duty, report, simulate
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.logs import read_log
from ramsight.plant.ddh import build_ddh

from .command import at_once
from .log_bench import own_names

RPM = np.pi / 30
UNITS = {name: build_ddh(name, unit) for name, unit in machine.load_machine("mining-loader").units.items()}


def worn(unit, factor):
    """The unit with more (or less) leakage in both pumps."""
    sides = {
        name: replace(getattr(unit, name), pump=replace(getattr(unit, name).pump, leak_factor=factor)) for name in "ab"
    }
    return replace(unit, **sides)


def log_of(unit, moves, load, kelvin, seed=0):
    speed = trapezoid_moves([(unit.lift_sign * rpm * RPM, hold) for rpm, hold in moves], ramp=0.1, before=0.5, rest=1.0)
    return report(simulate(unit, Duty(speed, constant(load), constant(kelvin), 0.3)), DriveReport(seed=seed))


def test_the_recorded_leak_test_gives_the_machines_leak_factor(trace):
    case = trace("boom_asbuilt1_leaktest")
    found = leak_test(UNITS["boom"], read_log(case.log))
    assert found.factor == pytest.approx(case.case["asbuilt"]["leak"], rel=0.02)
    assert len(found.stretches) == 2
    assert 0.0 < found.std < 0.05
    stated = re.match(r"leak factor (\d\.\d+) ± (\d\.\d+) ", leak_test_summary(found))
    assert [float(number) for number in stated.groups()] == pytest.approx([found.factor, 1.96 * found.std], abs=6e-4)


@pytest.mark.parametrize("factor", [0.75, 1.0, pytest.param(1.25, marks=pytest.mark.slow), 1.6])
@pytest.mark.parametrize(("name", "load"), [("boom", 441e3), ("bucket", 150e3)])
@pytest.mark.parametrize("celsius", [15.0, pytest.param(40.0, marks=pytest.mark.slow), 55.0])
def test_known_wear_is_found(name, load, factor, celsius):
    unit = UNITS[name]
    # Speeds that hold a half and four fifths of the load's pressure on the worn machine.
    side = unit.a if unit.held == "a" else unit.b
    area = unit.cylinder.area_a if unit.held == "a" else unit.cylinder.area_b
    kelvin = celsius + 273.15
    leak = factor * side.pump.leak_coefficient(unit.oil.viscosity(kelvin), unit.oil.density)
    speeds = [share * leak * load / area / side.pump.geared_displacement / RPM for share in (0.5, 0.8)]
    log = log_of(worn(unit, factor), [(rpm, 5.0) for rpm in speeds], load, kelvin, seed=3)
    found = leak_test(unit, log)
    assert abs(found.factor - factor) < 4.0 * found.std + 0.005 * factor
    if celsius > 30.0:  # in cold oil the speeds are a few rpm, and the drive rounds to one
        assert found.factor == pytest.approx(factor, rel=0.02)


def test_a_log_without_a_leak_test_says_so_and_a_slow_lift_is_none(trace):
    unit = UNITS["boom"]
    with pytest.raises(LeakTestError, match="no leak test"):
        leak_test(unit, read_log(trace("boom_441kN_40C").log))
    # 30 kN take 12 bar: 60 and 90 rpm lift them, slowly.
    with pytest.raises(LeakTestError, match="slow lift"):
        leak_test(unit, log_of(unit, [(60, 4.0), (90, 4.0)], 30e3, 313.15))


def test_the_figure_per_kelvin_is_what_a_warmer_oil_would_have_made_of_it_and_is_in_the_summary(trace):
    log = read_log(trace("boom_asbuilt1_leaktest").log)
    found = leak_test(UNITS["boom"], log)
    warmer = leak_test(UNITS["boom"], log.assign(oil_temperature=log["oil_temperature"] + 1.0))
    assert found.per_kelvin < -0.01  # a thinner oil leaks as much with less wear
    assert found.per_kelvin == pytest.approx(warmer.factor - found.factor, rel=0.05)
    text = leak_test_summary(found)
    assert all(said in text for said in ("leak factor 1.1", "60 rpm", "100 rpm")), text


def test_a_log_with_names_of_its_own_takes_a_map(trace, tmp_path):
    case = trace("boom_asbuilt1_leaktest")
    known = leak_test(UNITS["boom"], read_log(case.log))
    file, channel_map = own_names(read_log(case.log), tmp_path)
    found = ramsight.leak_test("mining-loader", file, unit="boom", channel_map=channel_map)
    assert found.factor == pytest.approx(known.factor, abs=1e-3)
    done = at_once("leak-test", "mining-loader", file, "--unit", "boom", "--map", channel_map)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == leak_test_summary(found)


def test_identify_takes_the_log_and_the_measured_position_by_a_map(tmp_path):
    boom = ramsight.build("mining-loader", "boom")
    run = ramsight.simulate(ramsight.AsBuilt(leak=1.2).apply(boom), load="258 kN", cycles=2)
    log = ramsight.drive_report(run)
    file, channel_map = own_names(log, tmp_path, run["position"])
    run.to_dataframe().rename_axis("time_s").rename(columns={"position": "position_m"})[["position_m"]].to_csv(
        tmp_path / "truth.csv"
    )
    known = ramsight.identify(boom, log, run).factors["leak"].value
    for truth in (None, tmp_path / "truth.csv"):
        found = ramsight.identify(boom, file, truth, channel_map=channel_map)
        assert found.factors["leak"].value == pytest.approx(known, abs=1e-3)
    done = at_once("identify", "mining-loader", file, "--unit", "boom", "--map", channel_map, "--truth", "truth.csv",
                   cwd=tmp_path)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "leak factor" in done.stdout
    done = at_once("identify", "mining-loader", file, "--unit", "boom", "--map", channel_map, "--map-out", "m.toml",
                   cwd=tmp_path)  # fmt: skip
    assert done.returncode == 2
    assert "--map-out" in done.stderr


def test_identify_says_that_no_position_was_measured(tmp_path):
    boom = ramsight.build("mining-loader", "boom")
    log = ramsight.drive_report(ramsight.simulate(boom, load="258 kN", cycles=1))
    file, channel_map = own_names(log, tmp_path)
    with pytest.raises(IdentifyError, match="no position was measured"):
        ramsight.identify(boom, file, channel_map=channel_map)
