"""The torque of ramps against the shaft's inertia: a wrong sign shows, a load, a friction or a gain does not."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

from ramsight import machine
from ramsight.duty import report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.faults import Fault, inject
from ramsight.duty.work_day import work_day
from ramsight.logs import read_log
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.sensor import redundancy
from ramsight.sensor.checks.inertia_check import InertiaState
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import ALARM_EVIDENCE

from .sensor_bench import Stepped

ROOT = Path(__file__).parents[1]
LOADER = machine.load_machine("mining-loader")
PLAIN = build(LOADER.unit("boom"), "boom")
ASSUMED = PLAIN.assumptions.replace({"inertia.std": 0.3})
AT, LONG, DT = 20.0, 80.0, 0.02


@pytest.fixture(scope="module")
def day():
    real = AsBuilt(leak=1.1).apply(PLAIN)
    run = simulate(real, work_day(real, (100e3, 350e3), 313.15, duration=260.0, visit_every=40.0, seed=3))
    return run, report(run, declared_report(PLAIN, 3))


@pytest.fixture(scope="module")
def sensor():
    return kalman(PLAIN, ASSUMED)


def told(sensor, run, log):
    sensor.start(float(run["position"][0]))
    track = sensor.track(log)
    return track, track["status"].values


def test_a_day_without_a_fault_raises_nothing(day, sensor):
    track, status = told(sensor, *day)
    assert Status.SIGN_CONTRADICTED not in status
    assert track["sign_reversed"].values.max() < 0.8


@pytest.mark.parametrize("name", ["motor_torque", "motor_speed"])
def test_a_wrong_sign_is_told_and_a_reference_due_after_it(name, day, sensor):
    run, log = day
    track, status = told(sensor, run, inject(log, Fault("sign", AT, AT + LONG, name)))
    time = log["time"].values
    first = time[np.argmax(status == Status.SIGN_CONTRADICTED)]
    assert AT + 1.0 < first < AT + LONG
    assert track["sign_reversed"].values[time < AT].max() < 0.8
    assert Status.SIGN_CONTRADICTED not in status[time > time[-1] - 10.0], "ramps have shown that it is right again"


@pytest.mark.parametrize("gain", [0.7, 1.3])
def test_a_gain_is_no_sign(gain, day, sensor):
    _, status = told(sensor, day[0], inject(day[1], Fault("gain", AT, AT + LONG, "motor_torque", gain)))
    assert Status.SIGN_CONTRADICTED not in status


@pytest.mark.parametrize("trace_name", ["boom_441kN_40C_x20", "boom_asbuilt1_workday"])
def test_on_the_logs_of_an_independent_simulator(trace, trace_name, sensor):
    log = read_log(trace(trace_name).log)
    sensor.start(None)
    assert Status.SIGN_CONTRADICTED not in sensor.track(log)["status"].values
    sensor.start(None)
    wrong = log.assign(motor_torque=-log["motor_torque"])
    status = sensor.track(wrong)["status"].values
    assert log["time"].values[np.argmax(status == Status.SIGN_CONTRADICTED)] < 80.0
    assert Status.SIGN_CONTRADICTED in status


def ramps(load, inertia, sign=1.0):
    """Times, speeds and torques of a shaft that turns one way, faster and slower, under a load over time [N m]."""
    time = np.arange(0.0, 60.0, DT)
    speed = 200.0 + 100.0 * np.clip(2.0 * np.sin(2.0 * np.pi * time / 4.0), -1.0, 1.0)
    acceleration = np.gradient(speed, time)
    return time, speed, sign * (load(time) + inertia * acceleration)


def largest(sensor, columns):
    time, speed, torque = columns
    warm = np.full(time.size, 313.15)
    log = xarray.Dataset(
        {"motor_speed": ("time", speed), "motor_torque": ("time", torque), "oil_temperature": ("time", warm)},
        {"time": time},
    )
    sensor.start(0.1)
    return float(sensor.track(log)["sign_reversed"].values.max())


def test_only_the_sign_counts_whatever_the_load(sensor):
    inertia = float(PLAIN.drive.inertia)
    for load in (lambda t: 0.0 * t, lambda t: 20.0 + 0.0 * t, lambda t: 5.0 + 0.5 * t, lambda t: -10.0 + 0.0 * t):
        assert largest(sensor, ramps(load, inertia)) < 0.05
        assert largest(sensor, ramps(load, inertia, -1.0)) > 1.0
        assert largest(sensor, ramps(load, 0.5 * inertia)) < 0.05
    assert largest(sensor, ramps(lambda t: 20.0 + 3.0 * (t > 30.0), inertia)) < 0.5, "a load that jumps is no sign"


def test_without_a_declared_inertia_nothing_is_looked_at():
    assert InertiaState.initial(PLAIN.assumptions) is None
    assert "sign_reversed" not in kalman(PLAIN).recursion.outputs


def test_ramps_are_what_structure_says_that_they_are():
    found = redundancy.detectable(("inertia",))
    assert found["speed"] == ("torque",)
    assert found["torque"] == ("speed",)


def test_the_page_quotes_what_was_measured(script):
    inertia = script("inertia")
    found = json.loads((ROOT / "results" / "inertia.json").read_text())
    page = "".join(
        (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
        for name in ("explanation/signals", "reference/detectors")
    )
    assert "\n".join(inertia.table(found)) in page
    assert inertia.sentence(found) in page.replace("\n", " ")
    assert inertia.gains(found) in page.replace("\n", " ")
    assert found["in_1000_h"] <= 1.0
    assert f"ratios above {ALARM_EVIDENCE:g}:" in page


def test_it_steps_the_same_without_being_compiled(day, sensor):
    run, log = day
    short = inject(log, Fault("sign", 10.0, 60.0, "motor_torque")).isel(time=slice(0, 1500))
    track, _ = told(sensor, run, short)
    plain = Stepped(sensor)
    sensor.start(float(run["position"][0]))
    plain.state[:] = [sensor.state[name] for name in sensor.recursion.state]
    np.testing.assert_allclose(plain.track(short)["sign_reversed"], track["sign_reversed"].values, atol=1e-6)
