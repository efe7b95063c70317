"""Leakage measured against the closed safety valve, on a log of another plant and on our own with known wear."""

from dataclasses import replace

import numpy as np
import pytest

from ramsight import machine
from ramsight.calibration.leakage import LeakTestError, leak_test, leak_test_summary
from ramsight.duty import DriveReport, Duty, report, simulate
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.logs import read_drive_log
from ramsight.plant.ddh import build

RPM = np.pi / 30
UNITS = {name: build(name, unit) for name, unit in machine.load("mining-loader").units.items()}


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
    found = leak_test(UNITS["boom"], read_drive_log(case.log))
    assert found.factor == pytest.approx(case.case["asbuilt"]["leak"], rel=0.02)
    assert len(found.stretches) == 2
    assert 0.0 < found.std < 0.05


@pytest.mark.parametrize("factor", [0.75, 1.0, 1.25, 1.6])
@pytest.mark.parametrize(("name", "load"), [("boom", 441e3), ("bucket", 150e3)])
@pytest.mark.parametrize("celsius", [15.0, 40.0, 55.0])
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


def test_a_slow_lift_is_not_taken_for_a_leak_test():
    unit = UNITS["boom"]
    # 30 kN take 12 bar: 60 and 90 rpm lift them, slowly.
    with pytest.raises(LeakTestError, match="slow lift"):
        leak_test(unit, log_of(unit, [(60, 4.0), (90, 4.0)], 30e3, 313.15))


def test_a_log_without_a_leak_test_says_so(trace):
    with pytest.raises(LeakTestError, match="no leak test"):
        leak_test(UNITS["boom"], read_drive_log(trace("boom_441kN_40C").log))


def test_the_summary_says_what_the_figure_depends_on(trace):
    text = leak_test_summary(leak_test(UNITS["boom"], read_drive_log(trace("boom_asbuilt1_leaktest").log)))
    assert "leak factor 1.1" in text
    assert "60 rpm" in text
    assert "100 rpm" in text
