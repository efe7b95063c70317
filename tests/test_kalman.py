"""The self-calibrating sensor: what it must reach, what it must notice, and what must never happen to it."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.judged_errors import turning_for
from ramsight import machine
from ramsight.duty import DriveReport, Duty, Profile, lift_lower, report, simulate
from ramsight.duty.profile import constant
from ramsight.duty.work_day import work_day
from ramsight.logs import read_log, read_truth
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.kalman import Pipe, kalman
from ramsight.sensor.kind import Kind, covariance_of
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.report import report as report_stage
from ramsight.sensor.report.stated import stated
from ramsight.sensor.status import Status
from ramsight.tracking.track_errors import first_stop_contact, stop_visits

BAND = 1.96
CYCLES = [
    "boom_129kN_40C", "boom_258kN_40C", "boom_441kN_40C", "boom_441kN_20C", "boom_441kN_60C", "bucket_48kN_40C",
    "bucket_96kN_40C", "bucket_162kN_40C", "boom_300kN_30C_400rpm", "boom_300kN_30C_800rpm", "boom_300kN_30C_2400rpm",
]  # fmt: skip
WORK_DAYS = ("boom_asbuilt1_workday", "bucket_asbuilt1_workday")


@pytest.fixture(scope="module")
def sensors(units):
    return {name: kalman(unit) for name, unit in units.items()}


@pytest.fixture(scope="module")
def known(units):
    """Sensors of machines whose leakage is known: what is left is the balance's own error."""
    sure = {"machine.leak": 1e-3, "machine.leaks_otherwise": 1e-6, "machine.leak_walk": 0.0}
    return {name: kalman(unit, unit.assumptions.replace(sure)) for name, unit in units.items()}


@pytest.fixture(scope="module")
def tracked(trace, sensors, known):
    """A recorded case tracked from its known start: log, truth interpolated to the log's times, track."""
    cache = {}

    def find(name, *, leakage_known=False):
        if (name, leakage_known) not in cache:
            case = trace(name)
            log, truth = read_log(case.log), read_truth(case.truth)
            sensor = (known if leakage_known else sensors)[case.case["unit"]]
            sensor.start(case.case["x0"])
            track = sensor.track(log)
            position = np.interp(log["time"], truth["time"], truth["position"])
            cache[name, leakage_known] = (case.case["unit"], log, position, track)
        return cache[name, leakage_known]

    return find


@pytest.mark.parametrize("name", CYCLES)
def test_a_machine_that_is_its_data_sheet_is_tracked_within_half_a_millimetre(tracked, units, name):
    unit, log, position, track = tracked(name, leakage_known=True)
    stop = first_stop_contact(log["time"], position, units[unit].cylinder.stroke)
    until = log["time"].values <= (np.inf if stop is None else stop)
    assert np.abs(track["position"].values - position)[until].max() < 0.5e-3


@pytest.mark.parametrize("name", ["boom_441kN_40C_x20", "bucket_162kN_40C_x20"])
def test_twenty_cycles_without_a_reference_stay_within_one_millimetre(tracked, name):
    _, _, position, track = tracked(name, leakage_known=True)
    assert np.abs(track["position"].values - position).max() < 1e-3


@pytest.mark.parametrize("name", ["boom_441kN_40C_x20", "bucket_162kN_40C_x20"])
def test_stops_and_starts_teach_the_leakage_without_a_reference(tracked, name):
    _, log, position, track = tracked(name)
    minute = int(np.searchsorted(log["time"].values, 60.0))
    assert track["leak_factor_std"].values[minute] < 0.75 * track["leak_factor_std"].values[0]
    for k in (minute, -1):
        factor, std = track["leak_factor"].values[k], track["leak_factor_std"].values[k]
        assert abs(factor - 1.0) < 2.0 * std
    error = np.abs(track["position"].values - position)
    assert (error <= 1.96 * track["position_std"].values).all()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "load"), [("boom", 441e3), ("bucket", 162e3)])
def test_fifty_cycles_stay_within_five_millimetres(units, sensors, name, load):
    run = simulate(units[name], lift_lower(units[name], load, 313.15, cycles=50))
    sensors[name].start(float(run["position"][0]))
    track = sensors[name].track(report(run, DriveReport(seed=3)))
    assert np.abs(track["position"].values - run["position"].values).max() < 5e-3


def judged(log, position, stroke):
    """Where a work day is judged: after the third visit to a stop, from half a second after the motor has started."""
    time = log["time"].values
    third = stop_visits(time, position, stroke)[2]
    return (time > third + 1.0) & (turning_for(time, log["motor_speed"]) > 0.5)


@pytest.mark.parametrize("name", WORK_DAYS)
def test_a_machine_that_is_not_its_data_sheet_is_learnt_from_its_stops(tracked, trace, units, name):
    unit, log, position, track = tracked(name)
    error = np.abs(track["position"].values - position)[judged(log, position, units[unit].cylinder.stroke)]
    assert np.percentile(error, 95.0) < 3e-3
    assert error.max() < 8e-3
    built = trace(name).case["asbuilt"]
    assert track["leak_factor"].values[-1] == pytest.approx(built["leak"], rel=0.03)
    assert track["displacement_factor"].values[-1] == pytest.approx(built["displacement"], abs=3e-3)
    assert track["compliance_factor"].values[-1] == pytest.approx(1.2e9 / built["beta"], rel=0.05)


def test_the_band_holds_what_it_says(tracked):
    inside, wrong, samples = 0, 0, 0
    for name in WORK_DAYS:
        _, log, position, track = tracked(name)
        error, std = np.abs(track["position"].values - position), track["position_std"].values
        inside += int((error <= BAND * std).sum())
        wrong += int(((track["status"].values == Status.OK) & (error > 4.0 * std)).sum())
        samples += log.sizes["time"]
    assert inside / samples >= 0.93
    assert wrong <= 0.005 * samples


OTHERS = {
    "boom": AsBuilt(leak=1.22, displacement=1.004, stiffness=0.7, friction=0.7),
    "bucket": AsBuilt(leak=0.8, displacement=0.996, stiffness=1.3, friction=1.4),
}


@pytest.mark.parametrize("name", ["boom", "bucket"])
def test_other_machines_with_other_instruments_are_learnt_too(units, sensors, name):
    unit, loads = units[name], {"boom": (100e3, 370e3), "bucket": (20e3, 140e3)}[name]
    duty = work_day(unit, loads, 308.15, duration=500.0, seed=5)
    run = simulate(OTHERS[name].apply(unit), duty)
    log = report(run, DriveReport(seed=5))
    log["motor_torque"] *= 1.02
    log["oil_temperature"] += 2.5
    sensors[name].start(duty.start_position)
    track = sensors[name].track(log)
    error = np.abs(track["position"].values - run["position"].values)
    error = error[judged(log, run["position"].values, unit.cylinder.stroke)]
    assert np.percentile(error, 95.0) < 4e-3
    assert error.max() < 8e-3


def test_it_finds_the_position_by_itself(trace, sensors, tracked):
    _, log, position, _ = tracked("boom_asbuilt1_workday")
    sensors["boom"].start(None)
    track = sensors["boom"].track(log)
    status = track["status"].values
    assert (status[: log.sizes["time"] // 20] == Status.NOT_REFERENCED).all()
    known = np.flatnonzero(status != Status.NOT_REFERENCED)[0]
    assert not (status[known:] == Status.NOT_REFERENCED).any()
    assert np.abs(track["position"].values - position)[known] < 1e-3


def test_the_relief_valve_is_told_within_a_fifth_of_a_second(tracked, trace, units):
    _, log, _, track = tracked("boom_relief_536kN")
    truth = read_truth(trace("boom_relief_536kN").truth)
    setting = units["boom"].a.relief.setting + units["boom"].tank_pressure
    turns = np.interp(truth["time"], log["time"], log["motor_speed"]) > 1.0
    opens = truth["time"].values[turns & (truth["pressure_a"].values > 0.999 * setting)][0]
    lowering = log["time"].values[log["motor_speed"].values < -1.0][0]
    after = (log["time"].values > opens + 0.2) & (log["time"].values < lowering)
    assert after.any()
    assert (track["status"].values[after] != Status.OK).all()


def test_slow_turning_against_the_closed_valve_tells_the_leakage(tracked):
    _, _, position, track = tracked("boom_asbuilt1_leaktest")
    assert track["leak_factor"].values[-1] == pytest.approx(1.15, rel=0.02)
    assert np.abs(track["position"].values - position)[-1] < 1e-3


def with_references(log, places):
    reference = np.full(log.sizes["time"], np.nan)
    for time, position in places.items():
        reference[np.searchsorted(log["time"].values, time)] = position
    return log.assign(reference=("time", reference))


def test_a_switch_corrects_position_and_leakage(tracked, sensors):
    _, log, position, plain = tracked("boom_asbuilt1_workday")
    at = [14.0, 29.0, 60.0]
    known = {time: float(np.interp(time, log["time"], position)) for time in at}
    sensors["boom"].start(0.1)
    track = sensors["boom"].track(with_references(log, known))
    k = int(np.searchsorted(log["time"].values, 60.2))
    error = np.abs(track["position"].values - position)
    assert error[k] < 1.5e-3 < np.abs(plain["position"].values - position)[k]
    assert track["leak_factor"].values[k] == pytest.approx(1.15, abs=0.04)
    assert track["leak_factor_std"].values[k] < 0.3 * plain["leak_factor_std"].values[k]


@pytest.mark.parametrize("wrong", [0.55, -0.2, 1.5, float("inf")])
def test_a_reference_that_cannot_be_true_is_refused_and_told(tracked, units, wrong):
    _, log, position, plain = tracked("boom_258kN_40C")
    boom = kalman(units["boom"], units["boom"].assumptions.replace({"stops.entered": 1e-6}))
    boom.start(0.1)
    track = boom.track(with_references(log, {5.0: wrong}))
    k = int(np.searchsorted(log["time"].values, 5.0))
    assert np.abs(track["position"].values - plain["position"].values).max() < 0.1e-3
    if np.isfinite(wrong):
        assert (track["status"].values[k : k + 50] == Status.REFERENCE_REFUSED).all()
    true = with_references(log, {5.0: wrong, 8.0: float(np.interp(8.0, log["time"], position))})
    boom.start(0.1)
    status = boom.track(true)["status"].values
    assert status[int(np.searchsorted(log["time"].values, 8.0))] == Status.OK


def test_a_load_change_at_rest_is_in_the_band_and_then_counted(units, sensors):
    unit = units["boom"]
    speed = Profile([0, 1, 1.5, 4, 4.5, 9, 9.5, 12, 12.5, 14], [0, 0, 150, 150, 0, 0, 150, 150, 0, 0])
    load = Profile([0, 6, 6.5, 14], [150e3, 150e3, 350e3, 350e3])
    run = simulate(unit, Duty(speed, load, constant(313.15), 0.3))
    sensors["boom"].start(0.3)
    track = sensors["boom"].track(report(run, DriveReport(seed=1)))
    time = run["time"].values
    error, std = track["position"].values - run["position"].values, track["position_std"].values
    waits, again = (time > 7.0) & (time < 9.0), time > 10.0
    assert 2e-3 < np.abs(error[waits]).max() < BAND * std[waits].min()
    assert np.abs(error[again]).max() < 0.5e-3


def test_life_and_replay_are_the_same(tracked, sensors):
    _, log, _, track = tracked("bucket_96kN_40C")
    sensors["bucket"].start(0.4)
    columns = [log[name].values for name in ("time", "motor_speed", "motor_torque", "oil_temperature")]
    live = [sensors["bucket"].step(*map(float, row)) for row in zip(*columns, strict=True)]
    assert [e.position for e in live] == track["position"].values.tolist()
    assert [e.position_std for e in live] == track["position_std"].values.tolist()
    assert [int(e.status) for e in live] == track["status"].values.tolist()


def test_samples_may_come_as_they_like(units, known):
    unit = units["boom"]
    run = simulate(unit, lift_lower(unit, 300e3, 313.15, cycles=2), sample_period=1e-3)
    log = report(run, DriveReport(seed=2))
    gaps = np.random.default_rng(4).integers(1, 101, size=len(log["time"]))
    rows = np.cumsum(gaps)
    rows = rows[rows < len(log["time"])]
    known["boom"].start(float(run["position"][rows[0]]))
    track = known["boom"].track(log.isel(time=rows))
    assert np.abs(track["position"].values - run["position"].values[rows]).max() < 1e-3
    assert (track["status"].values < Status.NOT_REFERENCED).all()


def test_the_covariance_stays_a_covariance(tracked, sensors):
    _, log, _, _ = tracked("bucket_asbuilt1_workday")
    sensor = sensors["bucket"]
    sensor.start(0.4)
    for part in np.array_split(np.arange(log.sizes["time"]), 40):
        sensor.track(log.isel(time=part))
        state = sensor.state
        known = [one for one in Quantity if one not in (Quantity.ANGLE_OFFSET, Quantity.WARMER)]
        for kind in Kind:
            rows = [[covariance_of(kind, *sorted((i, j), key=known.index)) for j in known] for i in known]
            matrix = np.array([[state[entry] for entry in row] for row in rows])
            scale = np.sqrt(np.diag(matrix))
            assert np.linalg.eigvalsh(matrix / np.outer(scale, scale)).min() > -1e-6, kind.text


def steady(seconds=12.0, period=0.02, speed=100.0, seed=0):
    """A log of lifting 258 kN at constant speed."""
    time = np.arange(0.0, seconds, period)
    random = np.random.default_rng(seed)
    ramp = np.clip((time - 1.0) / 0.5, 0.0, 1.0)
    torque = np.where(time > 1.0, 40.0, 0.0) + 0.5 * random.standard_normal(len(time))
    return xarray.Dataset(
        {
            "motor_speed": ("time", np.round(ramp * speed, 1)),
            "motor_torque": ("time", np.round(torque * 16.0) / 16.0),
            "oil_temperature": ("time", 313.15 + 0.2 * random.standard_normal(len(time))),
        },
        coords={"time": time},
    )


def status_with(sensor, change):
    log = steady()
    sensor.start(0.2)
    quiet = sensor.track(log)["status"].values
    faulty = change(log.copy(deep=True))
    sensor.start(0.2)
    return quiet, sensor.track(faulty)["status"].values


AFTER = slice(500, 560)


def spoiled(channel, value):
    def change(log):
        log[channel].values[AFTER] = value
        return log

    return change


@pytest.mark.parametrize(
    ("channel", "value", "status"),
    [
        ("motor_speed", np.nan, Status.INPUT_LOST), ("motor_torque", np.nan, Status.INPUT_LOST),
        ("motor_torque", np.inf, Status.INPUT_LOST), ("oil_temperature", np.nan, Status.TEMPERATURE_LOST),
        ("oil_temperature", 20.0, Status.TEMPERATURE_LOST), ("motor_speed", 5000.0, Status.IMPLAUSIBLE_SPEED),
        ("motor_torque", 900.0, Status.IMPLAUSIBLE_TORQUE),
    ],
)  # fmt: skip
def test_an_input_that_cannot_be_is_named_at_once(sensors, channel, value, status):
    quiet, faulty = status_with(sensors["boom"], spoiled(channel, value))
    assert (quiet < Status.OUTSIDE_TORQUE).all()
    assert (faulty[AFTER] == status).all()


def frozen_torque(log):
    log["motor_torque"].values[450:] = log["motor_torque"].values[450]
    return log


def frozen_time(log):
    time = log["time"].values.copy()
    time[AFTER] = time[AFTER.start - 1]
    return log.assign_coords(time=time)


@pytest.mark.parametrize(
    ("change", "where", "status"),
    [(frozen_torque, slice(500, None), Status.INPUT_STUCK), (frozen_time, AFTER, Status.TIME_FROZEN)],
)
def test_a_torque_and_time_that_stand_still_are_noticed(sensors, change, where, status):
    _, faulty = status_with(sensors["boom"], change)
    assert (faulty[where] == status).all()


@pytest.mark.parametrize("gap", [0.2, 5.0, 5000.0])
def test_missing_samples_are_told_and_make_the_position_uncertain(sensors, gap):
    log = steady()
    late = log.assign_coords(time=np.where(log["time"].values > 8.0, log["time"].values + gap, log["time"].values))
    sensors["boom"].start(0.2)
    track = sensors["boom"].track(late)
    k = int(np.flatnonzero(np.diff(late["time"].values) > 0.1)[0]) + 1
    assert track["status"].values[k] >= Status.INPUT_GAP
    assert track["position_std"].values[k] > track["position_std"].values[k - 1]


SPEEDS = st.one_of(st.floats(-450.0, 450.0), st.floats(allow_nan=True, allow_infinity=True))
TORQUES = st.one_of(st.floats(-100.0, 100.0), st.floats(allow_nan=True, allow_infinity=True))
WARMTH = st.one_of(st.floats(250.0, 380.0), st.floats(allow_nan=True, allow_infinity=True))
STEPS = st.one_of(st.floats(-0.05, 0.2), st.floats(-1e6, 1e6), st.just(float("nan")))


@cache
def known_boom():
    unit = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
    return unit, kalman(unit)


@settings(max_examples=150)
@given(st.lists(st.tuples(STEPS, SPEEDS, TORQUES, WARMTH), min_size=1, max_size=40))
def test_nothing_a_drive_may_say_moves_the_position_faster_than_the_piston_can_go(samples):
    unit, sensor = known_boom()
    sensor.start(0.35)
    fastest = 1.1 * unit.max_velocity * (1.0 + 1e-9)
    time, before, clock = 0.0, sensor.step(0.0, 0.0, 0.0, 313.15), 0.0
    for step, speed, torque, warmth in samples:
        time = time + step if np.isfinite(step) else time
        said = time if np.isfinite(step) else float("nan")
        now = sensor.step(said, speed, torque, warmth)
        passed = max(time - clock, 0.0) if np.isfinite(step) else 0.0
        clock = time if np.isfinite(step) else clock
        assert 0.0 <= now.position <= unit.cylinder.stroke
        referenced = now.position_std < 0.8 * before.position_std  # a stop that was recognised, however sure
        assert referenced or abs(now.position - before.position) <= fastest * passed + 1e-12
        assert np.isfinite([now.position_std, now.velocity, now.load]).all()
        if not np.isfinite([said, speed, torque]).all():
            assert now.status.validity == "invalid"
        elif not np.isfinite(warmth):
            assert now.status != Status.OK
        before = now
    assert np.isfinite(list(sensor.state.values())).all()


def test_orifice_leakage_of_a_worn_pump_is_counted(units):
    unit = units["boom"]
    worn = [replace(side, pump=replace(side.pump, orifice_leak=4e-9)) for side in (unit.a, unit.b)]
    built = replace(unit, a=worn[0], b=worn[1])
    run = simulate(built, lift_lower(built, 300e3, 313.15))
    errors = {}
    for name, known in (("told", built), ("not told", unit)):
        sensor = kalman(known)
        sensor.start(float(run["position"][0]))
        track = sensor.track(report(run, DriveReport(seed=1)))
        errors[name] = np.abs(track["position"].values - run["position"].values).max()
    assert errors["told"] < 1e-3 < 2e-3 < errors["not told"]


def test_the_position_has_to_be_within_the_stated_share_of_the_stroke(units, monkeypatch):
    asked = []

    def watched(*given):
        asked.append(given[-2:])
        return stated(*given)

    monkeypatch.setattr(report_stage, "stated", watched)
    pipe = Pipe.of(next(iter(units.values())))
    pipe.passage()
    limit, due = (float(ca.evalf(ca.jacobian(one, pipe.model.stroke))) for one in asked[0])
    assert (limit, due) == (pipe.model.assumed.integrity.limit, pipe.model.assumed.integrity.due)
