"""Switches, end stops and statuses: what resets a sensor, and when it says that it does not know."""

import numpy as np
import pytest
import xarray

from ramsight.duty import DriveReport, Duty, lift_lower, report, simulate
from ramsight.duty.profile import constant, trapezoid_moves
from ramsight.plant.steady import derive
from ramsight.sensor.status import Status
from reproduction.bench import benches
from reproduction.references import ProximitySwitch, with_stop, with_switches

pytestmark = pytest.mark.slow

RPM = np.pi / 30.0


@pytest.fixture(scope="module")
def bench():
    return benches()


def moves(unit, position, time):
    log = xarray.Dataset(
        {
            "motor_speed": ("time", np.zeros(len(time))), "motor_torque": ("time", np.zeros(len(time))),
            "oil_temperature": ("time", np.full(len(time), 313.15)), "position": ("time", position),
        },
        coords={"time": time},
    )  # fmt: skip
    return log.drop_vars("position"), log


def test_a_switch_closes_below_and_opens_above_its_hysteresis():
    time = np.linspace(0.0, 2.0, 2001)
    position = 0.1 + 0.01 * np.cos(np.pi * time)  # falls from 110 to 90 mm and rises again
    switch = ProximitySwitch(0.1, hysteresis=2e-3, response_time=0.0)
    closes, opens = switch.edges(time, position)
    assert np.interp(closes, time, position) == pytest.approx(0.1, abs=1e-6)
    assert np.interp(opens, time, position) == pytest.approx(0.102, abs=1e-6)


def test_a_rod_that_trembles_within_the_hysteresis_moves_no_switch():
    time = np.linspace(0.0, 2.0, 2001)
    position = 0.1005 + 0.0004 * np.sin(20.0 * time)
    assert not len(ProximitySwitch(0.1, hysteresis=1e-3).edges(time, position))


def test_a_switch_answers_after_its_response_time_at_the_next_sample():
    time = np.arange(0.0, 2.0, 0.02)
    log, run = moves("boom", 0.2 - 0.1 * time, time)
    reference = with_switches(log, run, [ProximitySwitch(0.1, response_time=0.03)])["reference"].values
    (sample,) = np.flatnonzero(np.isfinite(reference))
    assert time[sample] == pytest.approx(1.04)
    assert reference[sample] == pytest.approx(0.1005)


@pytest.mark.parametrize("kind", ["table", "balance"])
def test_a_reference_sets_the_position(bench, kind):
    boom = bench["boom"]
    run = simulate(boom.unit, lift_lower(boom.unit, 300e3, 313.15))
    log = report(run, DriveReport(seed=1))
    known = np.full(log.sizes["time"], np.nan)
    known[500] = 0.4
    sensor = boom.sensors[kind]
    sensor.start(0.14)
    plain = sensor.track(log)["position"].values
    sensor.start(0.14)
    told = sensor.track(log.assign(reference=("time", known)))["position"].values
    assert np.array_equal(told[:500], plain[:500])
    assert told[500] == 0.4
    assert np.diff(told)[500:].sum() == pytest.approx(np.diff(plain)[500:].sum(), abs=1e-3)


@pytest.mark.parametrize("kind", ["table", "balance"])
def test_a_step_takes_a_reference_as_a_log_does(bench, kind):
    sensor = bench["boom"].sensors[kind]
    sensor.start(0.1)
    assert sensor.step(0.0, 0.0, 0.0, 313.15).position == 0.1
    assert sensor.step(0.02, 0.0, 0.0, 313.15, reference=float("nan")).position == 0.1
    assert sensor.step(0.04, 0.0, 0.0, 313.15, reference=0.3).position == 0.3
    assert sensor.step(0.06, 0.0, 0.0, 313.15).position == pytest.approx(0.3)


@pytest.mark.parametrize("unit", ["boom", "bucket"])
@pytest.mark.parametrize("load", ["light", "high"])
def test_the_end_stop_shows_in_the_torque_and_nowhere_else(bench, unit, load):
    one = bench[unit]
    run = simulate(one.unit, one.closed_cycle(one.loads[load], 0.02, 0.4, extra=1.5))
    log = with_stop(report(run, DriveReport(seed=2)), one.unit.lift_sign, one.lowered_end)
    seen = np.isfinite(log["reference"].values)
    assert seen.any()
    assert np.abs(run["position"].values[seen] - one.lowered_end).max() < 3e-3
    away = simulate(one.unit, one.closed_cycle(one.loads[load], 0.1, 0.4))
    log = with_stop(report(away, DriveReport(seed=2)), one.unit.lift_sign, one.lowered_end)
    assert not np.isfinite(log["reference"].values).any()


def statuses(bench, kind, load, celsius, **changes):
    duty = lift_lower(bench.unit, load, celsius + 273.15, start_position=bench.at(0.5), **changes)
    run = simulate(bench.unit, duty)
    return bench.track(run, bench.sensors[kind]).status, run


@pytest.mark.parametrize("unit", ["boom", "bucket"])
@pytest.mark.parametrize("kind", ["table", "balance"])
@pytest.mark.parametrize("load", ["light", "medium", "high"])
@pytest.mark.parametrize("celsius", [20.0, 40.0, 70.0])
def test_within_its_range_a_sensor_raises_no_alarm(bench, unit, kind, load, celsius):
    status, _ = statuses(bench[unit], kind, bench[unit].loads[load], celsius, hold=0.5)
    assert (status == Status.OK).all()


@pytest.mark.parametrize("celsius", [12.0, 78.0])
def test_the_table_says_when_the_oil_is_outside_it(bench, celsius):
    status, _ = statuses(bench["boom"], "table", 300e3, celsius, hold=0.5)
    assert (status == Status.OUTSIDE_TEMPERATURE).all()


def test_the_table_says_when_the_torque_is_outside_it(bench):
    boom = bench["boom"]
    up = 1500.0 * RPM
    pulled = Duty(trapezoid_moves([(up, 1.0)], ramp=0.5, before=0.5, rest=0.5), constant(-150e3), constant(313.15), 0.3)
    run = simulate(boom.unit, pulled)
    status = boom.track(run, boom.sensors["table"]).status
    moving = run["motor_speed"].values > 0.9 * up
    assert (status[moving] == Status.OUTSIDE_TORQUE).all()
    assert (status[run["motor_speed"].values == 0.0] == Status.OK).all()


@pytest.mark.parametrize("unit", ["boom", "bucket"])
@pytest.mark.parametrize("kind", ["table", "balance"])
def test_an_open_relief_valve_loses_the_position_until_a_reference_comes(bench, unit, kind):
    one = bench[unit]
    status, run = statuses(one, kind, 1.02 * derive(one.unit).load_at_relief, 40.0)
    speed = one.unit.lift_sign * run["motor_speed"].values
    lifting = speed > 0.9 * speed.max()
    assert (status[lifting] != Status.OK).all()
    assert status[-1] == Status.POSITION_LOST
    log = report(run, DriveReport(seed=1))
    known = np.full(log.sizes["time"], np.nan)
    known[-20] = run["position"].values[-20]
    sensor = one.sensors[kind]
    sensor.start(float(run["position"][0]))
    tracked = sensor.track(log.assign(reference=("time", known)))
    assert tracked["status"].values[-21] == Status.POSITION_LOST
    assert tracked["status"].values[-1] != Status.POSITION_LOST
