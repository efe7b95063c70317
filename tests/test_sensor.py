"""The sensors on logs of a plant that is not ours, and what a sensor may and may not know."""

import copy

import numpy as np
import pytest
import xarray

from ramsight.calibration.sensors import sensor_for
from ramsight.duty import DriveReport, lift_lower, report, simulate
from ramsight.errors import UnknownNameError
from ramsight.logs import read_log, read_truth
from ramsight.tracking.track_errors import first_stop_contact, position_errors

PAPER_CYCLES = [
    "boom_129kN_40C", "boom_258kN_40C", "boom_441kN_40C", "boom_441kN_20C", "boom_441kN_60C",
    "boom_300kN_30C_400rpm", "boom_300kN_30C_800rpm", "boom_300kN_30C_2400rpm", "bucket_48kN_40C",
    "bucket_96kN_40C", "bucket_162kN_40C",
]  # fmt: skip


@pytest.fixture(scope="module")
def sensors(units):
    return {(name, kind): sensor_for(unit, kind) for name, unit in units.items() for kind in ("balance", "table")}


def errors_of(sensor, case, stroke):
    log, truth = read_log(case.log), read_truth(case.truth)
    sensor.start(case.case["x0"])
    tracked = sensor.track(log)
    time, position = truth["time"].values, truth["position"].values
    until = first_stop_contact(time, position, stroke)
    return position_errors(log["time"].values, tracked["position"].values, time, position, until=until)


@pytest.mark.parametrize(
    ("name", "limit"),
    [*((name, 0.5e-3) for name in PAPER_CYCLES), ("boom_441kN_40C_x20", 1e-3), ("bucket_162kN_40C_x20", 1e-3)],
)
def test_balance_stays_within_half_a_millimetre_on_the_reference_cycles_and_within_one_on_twenty(
    trace, sensors, units, name, limit
):
    case = trace(name)
    unit = case.case["unit"]
    assert errors_of(sensors[unit, "balance"], case, units[unit].cylinder.stroke).largest < limit


@pytest.mark.parametrize(("name", "paper"), [("boom_441kN_40C", 5e-3), ("bucket_162kN_40C", 10e-3)])
def test_the_papers_table_has_the_papers_error(trace, sensors, units, name, paper):
    case = trace(name)
    unit = case.case["unit"]
    errors = errors_of(sensors[unit, "table"], case, units[unit].cylinder.stroke)
    assert 0.5 * paper < errors.final < paper


# Loads, speeds and temperatures beyond those of the reference cycles, on our own plant.
@pytest.mark.parametrize(
    ("unit", "load", "celsius", "rpm", "ramp"),
    [
        ("boom", 20e3, 35.0, 2400.0, 0.8),  # lowering presses the rod side to tens of bar
        ("boom", 60e3, 20.0, 3000.0, 0.5),
        ("boom", 480e3, 55.0, 1500.0, 0.3),
        ("boom", 350e3, 10.0, 900.0, 1.2),
        ("bucket", 10e3, 45.0, 2000.0, 0.6),
        ("bucket", 120e3, 60.0, 1200.0, 0.8),
        ("bucket", 170e3, 25.0, 1000.0, 0.8),
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_balance_follows_other_loads_speeds_and_temperatures(units, sensors, unit, load, celsius, rpm, ramp, seed):
    ddh = units[unit]
    duty = lift_lower(ddh, load, celsius + 273.15, motor_speed=rpm * np.pi / 30, ramp=ramp)
    run = simulate(ddh, duty)
    sensor = sensors[unit, "balance"]
    sensor.start(duty.start_position)
    tracked = sensor.track(report(run, DriveReport(seed=seed)))
    time, truth = run["time"].values, run["position"].values
    until = first_stop_contact(time, truth, ddh.cylinder.stroke)
    assert position_errors(time, tracked["position"].values, time, truth, until=until).largest < 0.7e-3


@pytest.mark.parametrize("period", [0.001, 0.005, 0.05, 0.1])
def test_balance_does_not_mind_the_drives_period(units, sensors, period):
    ddh = units["boom"]
    duty = lift_lower(ddh, 300e3, 313.15)
    run = simulate(ddh, duty, sample_period=period)
    sensor = sensors["boom", "balance"]
    sensor.start(duty.start_position)
    tracked = sensor.track(report(run, DriveReport(seed=3)))
    assert np.abs(tracked["position"] - run["position"]).max() < 1e-3
    assert abs(float(tracked["position"][-1] - run["position"][-1])) < 0.4e-3


@pytest.mark.parametrize("kind", ["balance", "table"])
def test_a_step_at_a_time_is_the_same_as_a_whole_log(trace, sensors, kind):
    log = read_log(trace("boom_129kN_40C").log).isel(time=slice(0, 400))
    sensor = sensors["boom", kind]
    sensor.start(0.1)
    whole = sensor.track(log)
    sensor.start(0.1)
    for k in range(log.sizes["time"]):
        row = log.isel(time=k)
        estimate = sensor.step(
            float(row["time"]), float(row["motor_speed"]), float(row["motor_torque"]), float(row["oil_temperature"])
        )
        assert estimate.position == whole["position"].values[k]


def test_a_step_goes_on_from_whatever_state_it_is_given(sensors):
    """A start, a state that is set and a copy each have a state of their own, and what was said stays until a step."""
    sensor = copy.copy(sensors["boom", "balance"])
    sample = {"motor_speed": 150.0, "motor_torque": 60.0, "oil_temperature": 313.15}
    sensor.start(0.3)
    first = sensor.step(0.0, **sample).position
    kept, other = sensor.state, copy.copy(sensor)
    second = sensor.step(0.02, **sample).position
    assert second != first
    assert other.estimate.position == first
    assert other.step(0.02, **sample).position == second
    sensor.state = kept
    assert sensor.step(0.02, **sample).position == second
    sensor.start(0.4)
    assert sensor.step(0.0, **sample).position == pytest.approx(0.4, abs=1e-3)
    assert other.estimate.position == second


@pytest.mark.parametrize("kind", ["balance", "table"])
def test_a_sensor_cannot_see_the_truth(trace, sensors, kind):
    log = read_log(trace("boom_441kN_40C").log)
    sensor = sensors["boom", kind]
    sensor.start(0.1)
    alone = sensor.track(log)
    spoilt = log.assign(position=("time", np.full(log.sizes["time"], 0.6)), pressure_a=("time", log["time"].values))
    sensor.start(0.1)
    xarray.testing.assert_identical(alone, sensor.track(spoilt))


@pytest.mark.parametrize("kind", ["balance", "table"])
def test_standing_still_for_an_hour_moves_nothing(sensors, kind):
    time = np.arange(0.0, 3600.0, 0.05)
    rng = np.random.default_rng(5)
    log = xarray.Dataset(
        {
            "motor_speed": ("time", np.zeros(len(time))),
            "motor_torque": ("time", 0.5 * rng.standard_normal(len(time))),
            "oil_temperature": ("time", 313.15 + 0.2 * rng.standard_normal(len(time))),
        },
        coords={"time": time},
    )
    sensor = sensors["boom", kind]
    sensor.start(0.3)
    assert np.abs(sensor.track(log)["position"].values - 0.3).max() < 0.05e-3


def test_balance_tells_the_load(trace, sensors):
    sensor = sensors["boom", "balance"]
    sensor.start(0.1)
    log = read_log(trace("boom_258kN_40C").log)
    load = sensor.track(log)["load"].values
    moving = np.abs(log["motor_speed"].values) > 150.0
    assert np.median(load[moving]) == pytest.approx(258e3, rel=0.02)


def test_a_load_near_the_relief_pressure_is_not_called_ok(trace, sensors):
    sensor = sensors["boom", "balance"]
    sensor.start(0.1)
    log = read_log(trace("boom_relief_536kN").log)
    status = sensor.track(log)["status"].values
    lifting = log["motor_speed"].values > 150.0
    assert np.mean(status[lifting] != 0) > 0.9


def test_an_unknown_sensor_is_named_with_those_that_exist(units):
    with pytest.raises(UnknownNameError, match=r"balance.*table"):
        sensor_for(units["boom"], "crystal-ball")
