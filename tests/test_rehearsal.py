"""Rehearsals: duties that are planned end where they should, and what is simulated passes through the other verbs."""

import re

import numpy as np
import pytest

import ramsight
from ramsight.duty import DriveReport, lift_lower, report, simulate
from ramsight.duty.commissioning_duty import commissioning, leak_test_duty, usual_loads, usual_speed
from ramsight.duty.plan import Plan
from ramsight.duty.profile import trapezoid_moves
from ramsight.output import write_dataset
from ramsight.plant.limits import limits_of

from .command import at_once

RPM = np.pi / 30.0
UNITS = {
    "boom": ("mining-loader", "boom"), "bucket": ("mining-loader", "bucket"), "forklift": ("forklift-mast", "lift"),
    "press": ("press", "ram"), "double rod": ("eha-test-bench", "axis"), "pilot check": ("eha-single-rod", "axis"),
}  # fmt: skip
WORN = ramsight.AsBuilt(leak=1.2, displacement=0.997, stiffness=0.8, friction=1.3)


@pytest.fixture(scope="module")
def units():
    return {name: ramsight.build(*where) for name, where in UNITS.items()}


@pytest.mark.parametrize("name", UNITS)
def test_a_planned_move_ends_where_it_should(units, name):
    unit = WORN.apply(units[name])
    stroke, lifted = unit.cylinder.stroke, unit.lift_sign > 0.0
    plan = Plan(unit, 0.4 * limits_of(unit).load, 313.15, 0.3 * stroke if lifted else 0.7 * stroke)
    wanted, rests = [], []
    plan.rest(1.0)
    for share, speed in ((0.7, 1.0), (0.4, 0.5), (0.42, 1.0)):
        plan.go(share * stroke, speed * usual_speed(unit), ramp=0.5)
        wanted.append(share * stroke)
        rests.append(plan.time)
    run = simulate(unit, plan.duty())
    there = np.interp(rests, run["time"], run["position"])
    height = there if lifted else stroke - there
    np.testing.assert_allclose(height, wanted, atol=0.02 * stroke)


def test_a_load_is_put_on_at_rest_and_a_lift_that_only_leaks_is_refused(units):
    plan = Plan(units["boom"], 200e3, 313.15, 0.1)
    plan.go(0.3, 100.0, ramp=0.5)
    plan.put_on(400e3)
    plan.put_on(400e3)
    duty = plan.duty()
    changing = np.linspace(0.0, duty.duration, 2000)
    moved = np.gradient(duty.load(changing)) != 0.0
    assert moved.any()
    assert (duty.motor_speed(changing)[moved] == 0.0).all()
    assert float(duty.load(duty.duration)) == 400e3
    with pytest.raises(ramsight.DescriptionError, match=r"does not lift 400 kN.*rpm and more"):
        plan.go(0.5, 1.1 * plan.leakage, ramp=0.5)


def test_lift_lower_cycles_are_trapezoids_and_change_their_load_at_rest(units):
    unit = units["bucket"]
    duty = lift_lower(unit, 96e3, 313.15, cycles=2, hold=2.0)
    plain = trapezoid_moves([(-50 * np.pi, 2.0), (50 * np.pi, 2.0)] * 2, ramp=0.8, before=1.0, rest=1.5)
    np.testing.assert_array_equal(duty.motor_speed.time, plain.time)
    np.testing.assert_allclose(duty.motor_speed.value, plain.value)
    several = lift_lower(unit, [96e3, 48e3], 313.15, hold=2.0)
    assert several.load.value.tolist() == [96e3, 96e3, 48e3]
    assert float(several.motor_speed(several.load.time[1])) == 0.0


@pytest.mark.parametrize("name", ["boom", "press"])
def test_visits_reach_the_stops(units, name):
    unit = units[name]
    run = simulate(unit, lift_lower(unit, 0.3 * limits_of(unit).load, 313.15, visits=2, hold=1.0))
    assert float(run["position"].min()) < 0.0
    assert float(run["position"].max()) > unit.cylinder.stroke


@pytest.mark.parametrize("name", UNITS)
def test_the_leak_test_duty_is_a_leak_test_in_every_circuit(units, name):
    unit = units[name]
    made = WORN.apply(unit)
    found = ramsight.leak_test(unit, report(simulate(made, leak_test_duty(made, usual_loads(unit), 313.15))))
    assert len(found.stretches) == 2
    assert found.factor == pytest.approx(WORN.leak, abs=0.025)
    assert abs(found.factor - WORN.leak) < 1.96 * found.std


def test_commissioning_lifts_each_load_both_ways_and_meets_both_stops(units):
    unit = units["forklift"]
    run = simulate(unit, commissioning(unit, [10e3, 30e3], 313.15))
    assert float(run["position"].min()) < 0.0
    assert float(run["position"].max()) > unit.cylinder.stroke
    for load in (10e3, 30e3):
        at = np.abs(run["load"].values - load) < 1.0
        assert run["velocity"].values[at].max() > 0.05
        assert run["velocity"].values[at].min() < -0.05


def test_a_drive_report_is_off_as_it_is_told(units):
    run = ramsight.simulate(units["boom"], load="300 kN")
    exact = {"speed_step": 0.0, "torque_step": 0.0, "torque_noise": 0.0, "temperature_step": 0.0}
    how = DriveReport(**exact, temperature_noise=0.0, torque_gain=1.03, temperature_offset=3.0)
    log = report(run, how)
    np.testing.assert_allclose(log["motor_torque"], 1.03 * run["motor_torque"])
    np.testing.assert_allclose(log["oil_temperature"], run["oil_temperature"] + 3.0)


TABLE = "time_s,motor_speed_rpm,load_kn\n0,0,129\n1,1500,129\n5,1500,129\n6,0,129\n"


def test_a_table_is_a_duty(units, tmp_path):
    file = tmp_path / "duty.csv"
    file.write_text(TABLE)
    run = ramsight.simulate(units["boom"], file, start="200 mm")
    assert float(run["motor_speed"].max()) == pytest.approx(1500 * RPM)
    assert float(run["position"][0]) == 0.2
    file.write_text(TABLE.replace("load_kn", "load_kn,oil_temperature_c").replace(",129\n", ",129,50\n"))
    assert float(ramsight.simulate(units["boom"], file)["oil_temperature"][0]) == pytest.approx(323.15)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("load_kn", "load", ("load_kn", "found time_s")),
        ("\n0,", "\n0.5,", ("line 2", "begins at 0 s")),
        ("\n5,", "\n1,", ("line 4", "does not increase")),
        ("5,1500", "5,9000", ("line 4", "motor_speed_rpm", "4000 rpm")),
        ("6,0,129", "6,0,heavy", ("line 5", "load_kn", "heavy")),
    ],
)
def test_a_table_that_is_no_duty_names_line_and_column(units, tmp_path, old, new, words):
    file = tmp_path / "duty.csv"
    file.write_text(TABLE.replace(old, new))
    with pytest.raises(ramsight.LogError) as error:
        ramsight.simulate(units["boom"], file)
    assert [word for word in words if word not in str(error.value)] == []


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"kind": "lift-lower"}, ("load", "what is to be lifted")),
        ({"kind": "dig", "load": "1 kN"}, ("duty = 'dig'", "work-day", "a file")),
        ({"kind": "work-day", "cycles": 3}, ("cycles", "not for the duty work-day", "with lift-lower")),
        ({"kind": "leak-test", "load": []}, ("load", "there is none")),
        ({"kind": "work-day", "duration": "1 min", "seed": -1}, ("seed", "-1")),
        ({"kind": "commissioning", "load": ["100 kN", "100"]}, ("load", "unit is missing")),
        ({"kind": "lift-lower", "load": "1 kN", "visits": 1.5}, ("visits", "0 to 100")),
    ],
)
def test_a_duty_that_cannot_be_names_argument_and_choices(units, given, words):
    with pytest.raises(ramsight.DescriptionError) as error:
        ramsight.duty_for(units["boom"], **given)
    assert [word for word in words if word not in str(error.value)] == []


def run(*arguments, cwd):
    done = at_once(*arguments, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("name", ["forklift"])
def test_what_is_rehearsed_passes_through_the_other_verbs(name, tmp_path):
    machine, unit = UNITS[name]
    of = (machine, "log.csv.gz", "--unit", unit)
    run(
        "simulate", machine, "--unit", unit, "--duty", "commissioning", "--leak", 1.2, "--stiffness", 0.8, "--friction",
        1.3, "--displacement", 0.997, "--torque-gain", 1.03, "--temperature-offset", 3, "--log", "log.csv.gz",
        "--truth", "truth.csv.gz", "--figure", "run.png", cwd=tmp_path,
    )  # fmt: skip
    assert (tmp_path / "run.png").stat().st_size > 10_000
    leak = run("leak-test", *of, cwd=tmp_path)
    factor, kelvin, percent = (
        float(re.search(p, leak)[1]) for p in (r"factor (\S+)", r"(\S+) for each K", r"(\S+) for each %")
    )
    assert factor == pytest.approx(
        1.2 + 3.0 * kelvin + 3.0 * percent, abs=0.03
    )  # off as the leak test says it would be
    found = run("identify", *of, "--truth", "truth.csv.gz", cwd=tmp_path)
    assert float(re.search(r"displacement factor +(\S+)", found)[1]) == pytest.approx(0.997, abs=1e-3)
    assert "3 loads both ways" in found
    tracked = run("track", *of, "--truth", "truth.csv.gz", cwd=tmp_path)
    final = float(re.search(r"final (\S+) mm", tracked)[1])
    assert final < 5.0


def test_the_table_of_a_run_is_that_of_its_dataset(tmp_path):
    """The command line writes it without one, for xarray takes a third of a second to be imported."""
    out, whole = tmp_path / "run.csv", tmp_path / "whole.csv"
    at_once("simulate", "mining-loader", "--unit", "boom", "--load", "200 kN", "--out", out)
    write_dataset(ramsight.simulate("mining-loader", unit="boom", load="200 kN"), whole)
    assert out.read_text() == whole.read_text()
