"""What a drive reports held against itself: counter and speed, power and torque; detection, false alarms, exports."""

import math
import struct
from dataclasses import dataclass, replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

import ramsight
from ramsight import machine
from ramsight.deploy.encoder.frame import Frame
from ramsight.deploy.encoder.listening import Listener
from ramsight.duty import report, simulate
from ramsight.duty.drive_report import PowerReport, ShaftReport, declared_power, declared_report, declared_shaft
from ramsight.duty.faults import Fault, inject
from ramsight.duty.work_day import work_day
from ramsight.engine.typed_state import column, leaf, symbols
from ramsight.errors import DescriptionError
from ramsight.logs import read_log
from ramsight.output import write_table
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.limits import Limits, limits_of
from ramsight.sensor.checks.disagreement import Sums, compared, sure
from ramsight.sensor.checks.drive_check import DriveChecks, DriveState, check_drive
from ramsight.sensor.inputs.intake import IntakeState
from ramsight.sensor.inputs.sample import (
    DC_POWER,
    SHAFT_ANGLE,
    CounterState,
    Raw,
    SampleState,
    declared_inputs,
    plain_sample,
)
from ramsight.sensor.kalman import kalman
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.report.detectors import CONTRADICTIONS
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import MEMORY_TIME
from ramsight.sensor.virtual_sensor import Report, close

from .encoder_bus import bus_map
from .log_bench import roles, written
from .sensor_bench import Fed, Stepped

SHAFT, POWER = {"shaft.std": math.radians(0.05)}, {"power.std": 0.005}
LOADER = machine.load_machine("mining-loader")
PLAIN = build(LOADER.unit("boom"), "boom")
BOOM = replace(PLAIN, assumptions=PLAIN.assumptions.replace({**SHAFT, **POWER}))
AT, LONG = 120.0, 10.0
SPEED_FAULTS = {"gain": 1.3, "offset": 10.0, "sign": 0.0, "stuck": 0.0}


@pytest.fixture(scope="module")
def day():
    """A day of a machine that is not its data sheet, with all that its drive reports."""
    real = AsBuilt(leak=1.1).apply(PLAIN)
    run = simulate(real, work_day(real, (100e3, 350e3), 313.15, duration=180.0, visit_every=40.0, seed=3))
    return run, report(run, declared_report(BOOM, 3))


@pytest.fixture(scope="module")
def sensors():
    """By what they are given."""
    sets = {"both": {**SHAFT, **POWER}, "counter": SHAFT, "power": POWER}
    return {name: kalman(PLAIN, PLAIN.assumptions.replace(keys)) for name, keys in sets.items()}


def tracked(sensor, run, log):
    sensor.start(float(run["position"][0]))
    track = sensor.track(log)
    return track, track["status"].values, np.abs(track["position"].values - run["position"].values)


def turning(log):
    """A time at which the motor turns fast and goes on for long."""
    time, speed = log["time"].values, np.abs(log["motor_speed"].values)
    runs = np.convolve(speed > 50.0, np.ones(100), "valid") == 100
    return float(time[np.flatnonzero(runs & (time[: len(runs)] > AT))[0]])


def test_a_day_without_faults_raises_nothing(day, sensors):
    for sensor in sensors.values():
        _, status, _ = tracked(sensor, *day)
        assert not np.isin(status, CONTRADICTIONS).any()


def test_without_either_the_sensor_is_what_it_was(day):
    assert declared_inputs(PLAIN.assumptions) == ()
    assert kalman(PLAIN).optional == ()
    assert DriveChecks().unless_contradicted(3.0) == 3.0


def test_signals_that_are_missing_check_nothing(day, sensors):
    run, log = day
    none = np.full(log.sizes["time"], np.nan)
    track, status, _ = tracked(sensors["both"], run, log.assign(shaft_angle=("time", none), dc_power=("time", none)))
    plain, _, _ = tracked(kalman(PLAIN), run, log)
    assert np.allclose(track["position"], plain["position"], atol=1e-9)
    assert not np.isin(status, CONTRADICTIONS).any()


@pytest.mark.parametrize("kind", SPEED_FAULTS)
def test_a_wrong_speed_is_named_and_lived_with(kind, day, sensors):
    run, log = day
    at = turning(log)
    faulty = inject(log, Fault(kind, at, at + LONG, "motor_speed", SPEED_FAULTS[kind]))
    track, status, error = tracked(sensors["both"], run, faulty)
    time = log["time"].values
    during = (time >= at + 0.5) & (time <= at + LONG)
    assert error[time >= at].max() < 6e-3
    if kind != "stuck":  # a speed that stands still is right for a while
        assert (status[during] == Status.SPEED_WRONG).mean() > 0.5
        early = status[(time >= at) & (time <= at + 0.2)]
        assert np.isin(early, (Status.SPEED_WRONG, Status.SPEED_CONTRADICTED)).any()
    if kind == "gain":
        assert np.median(track["speed_over_counter"].values[during]) == pytest.approx(1.3, abs=0.1)


def test_a_counter_that_is_wrong_is_named_and_the_speed_is_used(day, sensors):
    run, log = day
    at = turning(log)
    stuck = inject(log, Fault("stuck", at, at + LONG, "shaft_angle"))
    _, status, error = tracked(sensors["both"], run, stuck)
    during = (log["time"].values >= at + 1.0) & (log["time"].values <= at + LONG)
    assert (status[during] == Status.COUNTER_WRONG).mean() > 0.5
    assert error[log["time"].values >= at].max() < 10e-3


def test_without_power_nothing_tells_which_is_wrong(day, sensors):
    run, log = day
    at, time = turning(log), log["time"].values
    faulty = inject(log, Fault("gain", at, at + LONG, "motor_speed", 1.3))
    reference = np.full(len(time), np.nan)
    places = [int(np.searchsorted(time, at + LONG + after)) for after in (12.0, 14.0, 16.0)]
    reference[places] = run["position"].values[places]
    _, status, _ = tracked(sensors["counter"], run, faulty.assign(reference=("time", reference)))
    assert Status.SPEED_CONTRADICTED in status[(time >= at) & (time <= at + 0.2)]
    between = (time > at + 0.2) & (time < time[places[0]])
    assert not (status[between] == Status.OK).any(), "until a reference nobody knows how wrong it was"
    assert np.median(status[places[2] + 1 : places[2] + 200]) <= Status.REFERENCE_DUE, "three references end it"


@pytest.mark.parametrize(
    ("kind", "size"), [("gain", 1.3), ("gain", 0.7), ("offset", 10.0), ("offset", -10.0), ("sign", 0.0)]
)
def test_a_wrong_torque_is_contradicted(kind, size, day, sensors):
    run, log = day
    at = turning(log)
    time = log["time"].values
    faulty = inject(log, Fault(kind, at, at + LONG, "motor_torque", size))
    for name in ("both", "power"):
        _, status, _ = tracked(sensors[name], run, faulty)
        assert Status.TORQUE_CONTRADICTED in status[(time >= at) & (time <= at + 1.0)]
        assert (status[(time >= at) & (time <= at + LONG)] == Status.OK).sum() * 0.02 < 1.0


def test_a_speed_without_counter_is_contradicted_by_the_power(day, sensors):
    run, log = day
    at = turning(log)
    _, status, _ = tracked(sensors["power"], run, inject(log, Fault("sign", at, at + LONG, "motor_speed")))
    time = log["time"].values
    assert Status.TORQUE_CONTRADICTED in status[(time >= at) & (time <= at + 0.5)]


def test_a_speed_that_is_missing_is_the_counters(day, sensors):
    run, log = day
    at, time = turning(log), log["time"].values
    missing = inject(log, Fault("nan", at, at + 5.0, "motor_speed"))
    _, status, error = tracked(sensors["counter"], run, missing)
    _, _, usual = tracked(sensors["counter"], run, log)
    during = (time >= at) & (time <= at + 5.0)
    assert (status[during] == Status.SPEED_WRONG).mean() > 0.95
    assert (error - usual)[during].max() < 0.5e-3
    neither = inject(missing, Fault("nan", at, at + 5.0, "shaft_angle"))
    _, status, _ = tracked(sensors["counter"], run, neither)
    assert (status[during] == Status.INPUT_LOST).all()


@pytest.fixture(scope="module")
def with_pressures(day):
    """A machine with pressure sensors of 1 bar; the day as its drive reports it."""
    run, _ = day
    unit = replace(PLAIN, assumptions=PLAIN.assumptions.replace({"pressure.std": 1e5}))
    return kalman(unit), report(run, declared_report(unit, 3))


@pytest.mark.parametrize(("kind", "size"), [("gain", 1.3), ("gain", 0.7), ("offset", 15.0), ("sign", 0.0)])
def test_a_wrong_torque_contradicts_the_pressures(kind, size, day, with_pressures):
    sensor, log = with_pressures
    at, time = turning(log), log["time"].values
    during = (time >= at) & (time <= at + LONG)
    track, status, _ = tracked(sensor, day[0], inject(log, Fault(kind, at, at + LONG, "motor_torque", size)))
    assert Status.TORQUE_CONTRADICTED in status[(time >= at) & (time <= at + 4.0)]
    assert status[time > at + LONG + 3.0][0] >= Status.REFERENCE_DUE
    if kind == "offset":
        assert np.median(track["torque_over_pressures"].values[during]) == pytest.approx(15.0, abs=3.0)


def test_pressures_contradict_no_torque_that_is_right(day, with_pressures):
    sensor, log = with_pressures
    _, status, _ = tracked(sensor, day[0], log)
    assert not np.isin(status, CONTRADICTIONS).any()
    none = np.full(log.sizes["time"], np.nan)
    track, status, _ = tracked(sensor, day[0], log.assign(pressure_a=("time", none)))
    assert not np.isin(status, CONTRADICTIONS).any()
    assert (track["torque_over_pressures"].values == 0.0).all()


def test_a_tenth_of_a_percent_shows_in_seconds(day, sensors):
    run, log = day
    slow = log["motor_speed"].values * 0.98
    _, status, _ = tracked(sensors["both"], run, log.assign(motor_speed=("time", slow)))
    first = log["time"].values[np.argmax(np.isin(status, (Status.SPEED_WRONG, Status.SPEED_CONTRADICTED)))]
    assert 0.0 < first < 15.0
    # 0.1 % of 419 rad/s for as long as the sums hold is more than whole revolutions a minute hide.
    assert 2.0 * math.pi / 60.0 * MEMORY_TIME < 1e-3 * 418.9 * MEMORY_TIME


class Pair:
    """Two reports of one level, compared sample by sample by CasADi's own machine."""

    def __init__(self, delay=0.02, lasting=0.0, noise=0.0):
        def write(state, sample, x):
            after, found = compared(
                state, sample, sample.motor_torque - sample.motor_speed, level=sample.motor_speed, delay=delay,
                lasting=lasting, noise=noise,
            )  # fmt: skip
            return after, ca.vertcat(found.by, found.allowed, found.alarm)

        raw = Raw.symbols()
        state = symbols(Fed(intake=SampleState.initial(), inputs={}, piece=Sums()))
        intake, sample = plain_sample(state.intake, raw)
        piece, found = write(state.piece, sample, {})
        after = replace(state, intake=intake, piece=piece)
        self._f = ca.Function("pair", [column(state), ca.vertcat(*raw.inputs)], [column(after), found])
        self.state = np.zeros(column(state).numel())

    def run(self, time, one, other):
        said = []
        for t, a, b in zip(time, one, other, strict=True):
            state, out = self._f(self.state, [t, b, a, 313.15, 0.0, 0.0])
            self.state = np.array(state).ravel()
            said.append(np.array(out).ravel())
        return np.array(said)


TIME = np.arange(0.0, 20.0, 0.02)


def test_a_lasting_difference_is_summed_up_over_the_memory():
    said = Pair().run(TIME, np.full(1000, 3.0), np.full(1000, 2.0))
    assert said[-1, 0] == pytest.approx(MEMORY_TIME, rel=0.02)
    at = int(1.0 / 0.02)
    assert said[at, 0] == pytest.approx(MEMORY_TIME * (1.0 - math.exp(-1.0 / MEMORY_TIME)), rel=0.02)


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 2**31), st.floats(0.0, 1.0), st.floats(1e-3, 200.0),
)  # fmt: skip
def test_a_delay_within_what_is_declared_is_never_an_alarm(seed, share, size):
    """Whatever the level does in ramps and steps."""
    random = np.random.default_rng(seed)
    corners = np.concatenate([[0.0], np.cumsum(random.uniform(0.02, 3.0, 30))])
    values = random.uniform(-size, size, 31)
    delay = 0.04  # s, two samples
    level = np.interp(TIME, corners, values)
    late = np.interp(TIME - share * delay, corners, values)
    # The sum goes by samples, and a difference of samples is what it is.
    assert not Pair(delay).run(TIME, late, level)[:, 2].any()


def test_the_bound_grows_by_what_is_declared_and_an_alarm_ends_at_half_of_it():
    quiet, loud = (Pair(noise=noise).run(TIME, np.full(1000, 2.0), np.full(1000, 2.0))[-1, 1] for noise in (0.0, 5.0))
    assert quiet == pytest.approx(0.0, abs=1e-6)
    assert loud == pytest.approx(sure(MEMORY_TIME) * 5.0 * 0.02 * math.sqrt(MEMORY_TIME / 2.0 / 0.02), rel=0.05)
    pair = Pair(lasting=0.1)
    apart_by = np.where(TIME < 10.0, 1.0, 0.0)
    said = pair.run(TIME, apart_by, np.zeros(1000))
    assert said[400, 2] == 1.0
    assert np.count_nonzero(np.diff(said[:, 2]) > 0.0) == 1, "one alarm begins once"
    ends = np.flatnonzero(said[:, 2])[-1]
    assert abs(said[ends + 1, 0]) <= 0.5 * said[ends + 1, 1] < abs(said[ends, 0]) * 1.03


def test_a_counter_counts_what_the_shaft_turns():
    shaft = ShaftReport(step=0.0, first=1.0)
    time = np.linspace(0.0, 2.0, 201)
    assert shaft.reported(time, 3.0 * time)[-1] == pytest.approx(1.0 + 6.0)
    stepped = ShaftReport(step=0.5).reported(time, 3.0 * time)
    assert np.allclose(stepped / 0.5, np.round(stepped / 0.5))


def test_a_power_is_what_goes_through_the_shaft_and_what_is_lost():
    drive = PowerReport(standby=10.0, copper=0.5, iron=0.1, step=0.0)
    gives, takes = drive.reported(np.array([100.0, -100.0]), np.array([20.0, 20.0]))
    assert gives + takes == pytest.approx(2.0 * (10.0 + 0.5 * 400.0 + 0.1 * 100.0)), "losses have no sign"
    assert gives - takes == pytest.approx(2.0 * 2000.0)


def test_what_is_declared_is_what_is_rehearsed():
    assert declared_shaft(PLAIN) is None
    assert declared_power(PLAIN, 1) is None
    assert declared_shaft(BOOM).step == pytest.approx(math.sqrt(12.0) * math.radians(0.05))
    one, again, other = (declared_power(BOOM, seed) for seed in (1, 1, 2))
    assert one == again != other
    limits = limits_of(BOOM)
    sure = replace(BOOM, assumptions=BOOM.assumptions.replace({"power.losses": 0.01, "power.gain": 0.001}))
    drive = declared_power(sure, 1)
    assert drive.copper * limits.torque**2 == pytest.approx(0.05 * limits.torque * limits.max_speed, rel=0.05)
    assert drive.iron * limits.max_speed == pytest.approx(0.03 * limits.torque * limits.max_speed, rel=0.05)
    assert drive.gain == pytest.approx(1.0, abs=0.005)


def test_gain_and_losses_are_learned(day, sensors):
    run, log = day
    tracked(sensors["both"], run, log)
    drive, assumed = declared_power(BOOM, 3), BOOM.assumptions.power
    limits = limits_of(BOOM)
    losses = drive.copper * limits.torque / limits.max_speed / assumed.copper
    state = sensors["both"].state
    assert 1.0 + state["drive.power.off.gain"] == pytest.approx(drive.gain, abs=0.015)
    assert 1.0 + state["drive.power.off.copper"] == pytest.approx(drive.gain * losses, abs=0.1)
    assert 1.0 + state["drive.power.off.iron"] == pytest.approx(drive.gain * losses, abs=0.15)
    assert state["drive.power.covariance[gain,gain]"] < (0.5 * assumed.gain) ** 2


def test_after_a_night_the_drive_is_no_less_known_than_a_new_one(day, sensors):
    run, log = day
    tracked(sensors["both"], run, log)
    last = float(log["time"][-1])
    night = log.isel(time=slice(-1, None)).squeeze()
    for hour in range(1, 30):
        for k in range(3):
            sensors["both"].step(last + 3600.0 * hour + 0.02 * k, 0.0, 0.0, 313.15)
    for k in range(20_000):
        sensors["both"].step(last + 3600.0 * 30 + 0.4 * k, 0.0, 0.0, 313.15, dc_power=float(night["dc_power"]))
    state, assumed = sensors["both"].state, BOOM.assumptions.power
    assert assumed.gain**2 * 0.5 < state["drive.power.covariance[gain,gain]"] <= assumed.gain**2 * (1.0 + 1e-9)
    assert state["drive.power.covariance[copper,copper]"] <= assumed.losses**2 * (1.0 + 1e-9)
    names = ("gain", "copper", "iron")
    pairs = [[sorted((i, j), key=names.index) for j in names] for i in names]
    values = np.array([[state["drive.power.covariance[{},{}]".format(*pair)] for pair in row] for row in pairs])
    assert (np.linalg.eigvalsh(values) > -1e-12).all()


def test_a_drive_report_has_what_the_unit_declares():
    run = ramsight.simulate(BOOM, load="200 kN")
    log = ramsight.drive_report(run, BOOM, seed=4)
    assert {"shaft_angle", "dc_power"} <= set(log)
    at_start = float(run["position"][0])
    assert ramsight.track(BOOM, log, truth=run, start=at_start).attrs["error_largest"] < 5e-3


def test_an_encoder_hears_the_counter_beside_the_speed(tmp_path):
    objects = {0x185: ("606Ch", "6077h"), 0x285: ("6064h",)}
    angle = f'shaft_angle = {{channel = "6064h", unit = "rad", scale = {2.0 * math.pi / 4096}}}\n'
    listener = Listener(bus_map(tmp_path, *((key, *names) for key, names in objects.items()), more=angle))
    assert listener.identifiers == {0x185, 0x285}
    listener.take(Frame(0x285, struct.pack("<i", -8192), 1.0), 1.0, 1.0)
    assert listener.sample(1.0) is None, "a counter alone is no sample"
    listener.take(Frame(0x185, struct.pack("<ih", 1500, 100), 1.0), 1.0, 1.0)
    sample = listener.sample(1.0)
    assert sample.further["shaft_angle"] == pytest.approx(-4.0 * math.pi)
    listener.take(Frame(0x185, struct.pack("<ih", 1500, 100), 9.0), 9.0, 9.0)
    assert math.isnan(listener.sample(9.0).further["shaft_angle"]), "too old"


def test_a_counter_that_overflows_raises_nothing_and_one_that_leaps_is_wrong(day, sensors):
    run, log = day
    at = turning(log)
    time, angle = log["time"].values, log["shaft_angle"].values
    once = np.where(time < at, angle, angle - 2**32 * 2.0 * math.pi / 4096)
    _, status, error = tracked(sensors["both"], run, log.assign(shaft_angle=("time", once)))
    assert not np.isin(status, CONTRADICTIONS).any()
    wild = np.where(time < at, angle, np.random.default_rng(1).uniform(-1e6, 1e6, time.size))
    for name in ("both", "counter"):
        _, status, error = tracked(sensors[name], run, log.assign(shaft_angle=("time", wild)))
        late = time > at + 0.2
        assert (status[late] == Status.COUNTER_WRONG).mean() > 0.2
        assert not np.isin(status[late], (Status.OK, Status.SPEED_CONTRADICTED)).any()
        assert error[late].max() < 10e-3


def test_voltage_and_current_of_the_link_are_its_power(tmp_path, day):
    log = day[1].isel(time=slice(0, 50))
    columns = {"time_s": log["time"].values, "motor_speed_rpm": log["motor_speed"].values * 30.0 / math.pi,
               "motor_torque_nm": log["motor_torque"].values, "oil_temperature_c": np.full(50, 40.0),
               "dc_voltage_v": np.full(50, 96.0), "dc_current_a": log["dc_power"].values / 96.0}  # fmt: skip
    write_table(columns, tmp_path / "log.parquet")
    assert np.allclose(read_log(tmp_path / "log.parquet")["dc_power"], log["dc_power"])
    assert np.all(read_log(tmp_path / "log.parquet")["dc_voltage"] == 96.0), "two drives have it in common"
    text = roles("motor_speed_rpm", "motor_torque_nm", time="time_s")
    voltage = 'dc_voltage = {channel = "dc_voltage_v", unit = "V"}\n'
    current = 'dc_current = {channel = "dc_current_a", unit = "A", sign = -1}\n'
    both = written(tmp_path, text + voltage + current)
    assert np.allclose(read_log(tmp_path / "log.parquet", both)["dc_power"], -log["dc_power"])
    for wrong in (voltage, current, voltage + current + 'dc_power = {channel = "dc_current_a", unit = "W"}\n'):
        with pytest.raises(DescriptionError, match="dc_"):
            read_log(tmp_path / "log.parquet", written(tmp_path, text + wrong))


def test_the_encoder_multiplies_two_objects(tmp_path):
    voltage = 'dc_voltage = {channel = "6079h", hold = "200 ms"}\n'
    current = 'dc_current = {channel = "6078h", rated = "300 A"}\n'
    frames = ((0x185, "606Ch", "4602h:0Ch"), (0x285, "6079h", "6078h"))
    listener = Listener(bus_map(tmp_path, *frames, torque='channel = "4602h:0Ch"', more=voltage + current))
    assert listener.take(Frame(0x285, struct.pack("<Ih", 96_000, 250)), 0.0, 0.0)
    said = []
    for k in range(2):
        assert listener.take(Frame(0x185, struct.pack("<ih", 1500, 160)), 0.15 * k, 0.15 * k)
        said.append(listener.sample(0.15 * k).further["dc_power"])
        listener.take(Frame(0x285, struct.pack("<Ih", 96_000, -100)), 0.15 * k, 0.15 * k)
    assert said == pytest.approx([96.0 * 75.0, -96.0 * 30.0])
    assert listener.take(Frame(0x185, struct.pack("<ih", 1500, 160)), 0.5, 0.5)
    assert math.isnan(listener.sample(0.5).further["dc_power"]), "a voltage that is too old makes no power"


OTHER = Path(__file__).parent / "traces" / "drive_dc.csv"
"""A motor, its inverter and its control as motulator simulates them (evaluation/drive_dc.py)."""


@dataclass(frozen=True, kw_only=True)
class Driven:
    """What the checks of a drive keep, and their inputs."""

    position: object = leaf("m")
    intake: object
    drive: object


def other_drive(**wrong):
    """What the checks say of that drive, its columns perhaps changed from 6 s on."""
    limits = Limits(
        1.0, 1.0, 1.0, torque=14.0, side_torque=14.0, largest_torque=14.0, leak_velocity=1e-3, max_speed=157.0
    )
    # 14 N m are 5.7 A peak by 1.5 x 3 x 0.545 N m/A: 3.6 ohm lose 1.5 R i2 = 176 W of them, 8 % of 14 N m x 157 rad/s.
    keys = {**SHAFT, **POWER, "power.copper": 0.08, "power.iron": 0.0, "power.standby": 0.0, "power.losses": 0.3}
    assumed = PLAIN.assumptions.replace(keys)
    model = replace(
        MachineModel.of(PLAIN, assumed), travel_per_radian=1e-3, relief_torque=limits.torque,
        max_speed=limits.max_speed, leak_velocity=limits.leak_velocity,
    )  # fmt: skip
    raw = Raw.symbols((), (SHAFT_ANGLE, DC_POWER))
    first = Driven(intake=IntakeState.initial((), (SHAFT_ANGLE, DC_POWER)), drive=DriveState.initial(assumed))
    state = symbols(first)
    intake, sample = plain_sample(SampleState(
        started=state.intake.started, time=state.intake.time, motor_speed=state.intake.motor_speed, commands={},
    ), raw)  # fmt: skip
    sample = replace(sample, counter=state.intake.counter, last_torque=state.intake.torque.value)
    drive, _, checks = check_drive(state.drive, sample, model)
    kept = replace(
        state.intake, started=intake.started, time=intake.time, motor_speed=intake.motor_speed,
        torque=replace(state.intake.torque, value=raw.motor_torque),
        counter=CounterState(angle=raw.measured[SHAFT_ANGLE], begun=ca.SX(1.0)),
    )  # fmt: skip
    said = {"speed": checks.speed_wrong, "counter": checks.counter_wrong, "torque": checks.torque_wrong}
    more = {f"{name}_wrong": (value, "1") for name, value in {**said, "nobody": checks.undecided}.items()}
    report_ = Report(ca.SX(0.0), 0.0, 0.0, 0.0, ca.SX(0.0), more)
    closed = close("checks", model.table, raw, first, state, replace(state, intake=kept, drive=drive), report_)
    time, rpm, torque, angle, power = np.loadtxt(OTHER, delimiter=",", skiprows=1).T
    columns = {"motor_speed": rpm * math.pi / 30.0, "motor_torque": torque, "dc_power": power}
    columns |= {"shaft_angle": np.radians(angle), "oil_temperature": np.full(time.size, 313.15)}
    for name, change in wrong.items():
        columns[name] = np.where(time < 6.0, columns[name], change(columns[name]))
    log = xarray.Dataset({name: ("time", values) for name, values in columns.items()}, {"time": time})
    found = Stepped(closed).track(log)
    return {name: found[f"{name}_wrong"] > 0.5 for name in (*said, "nobody")}, time


def test_a_drive_that_others_simulate_contradicts_itself_nowhere():
    said, _ = other_drive()
    assert not any(one.any() for one in said.values())


@pytest.mark.parametrize(
    ("channel", "change", "blamed"),
    [
        ("motor_speed", lambda x: 1.3 * x, "speed"),
        ("motor_speed", lambda x: -x, "speed"),
        ("motor_torque", lambda x: 1.3 * x, "torque"),
        ("motor_torque", lambda x: -x, "torque"),
        ("motor_torque", lambda x: x + 3.0, "torque"),
        ("shaft_angle", lambda x: -x, "counter"),
        ("dc_power", lambda x: 1.3 * x, "torque"),
    ],
)
def test_its_faults_are_named(channel, change, blamed):
    said, time = other_drive(**{channel: change})
    assert not any(one[time < 6.0].any() for one in said.values())
    after = {name: one[(time >= 6.0) & (time < 11.0)].mean() for name, one in said.items()}
    assert after[blamed] > 0.3, after
    assert max(share for name, share in after.items() if name not in (blamed, "nobody")) < 0.3, after
