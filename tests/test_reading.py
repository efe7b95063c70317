"""An occasional absolute position: one declaration, and all that follows from it: sensor, logs, exports, advice."""

import math
from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.api.commissioning import _mending
from ramsight.deploy.fmeda import fmeda_table
from ramsight.duty.live_further import LiveFurther
from ramsight.duty.reading_report import ReadingReport, declared_readings
from ramsight.logs import read_log
from ramsight.logs.channels import FURTHER, READINGS
from ramsight.logs.mapped import SI
from ramsight.plant.build import build
from ramsight.sensor.inputs.sample import MEASURED, declared_inputs
from ramsight.sensor.report.detectors import DETECTORS

from .log_bench import roles, written

NAME = "absolute_position"
HOW = {"std": "2 mm", "offset": "1 mm", "delay": "100 ms", "wrong": "2 %", "every": "10 s"}
DECLARED = machine.load_machine("mining-loader").replace(
    {f"units.boom.assumptions.{NAME}.{key}": text for key, text in HOW.items()}
)


@pytest.fixture(scope="module")
def worked():
    """Six minutes of work of a boom that leaks 30 % more than described, with its log."""
    run = ramsight.simulate(
        DECLARED, "work-day", unit="boom", load="200 kN", as_built=ramsight.AsBuilt(leak=1.3), duration="6 min"
    )
    return run, ramsight.drive_report(run, DECLARED, unit="boom", seed=3)


# One declaration


@pytest.mark.parametrize("channel", FURTHER, ids=lambda one: one.name)
def test_what_is_declared_once_is_known_everywhere(channel):
    assumed = getattr(machine.load_machine("mining-loader").unit("boom").assumptions, channel.declared)
    assert assumed.std == 0.0, "nothing is taken that a machine does not declare"
    boom = build(machine.load_machine("mining-loader"), "boom")
    boom = replace(boom, assumptions=boom.assumptions.replace({f"{channel.declared}.std": 0.01}))
    assert channel.name in declared_inputs(boom.assumptions)
    assert MEASURED[channel.name] == (channel.units, channel.long_name)
    assert SI[channel.name] == channel.units
    assert channel.name in {row.split(",")[1] for row in fmeda_table(boom).splitlines()}
    live = LiveFurther(boom, 0.02).sample(0.2, 100.0, 20.0, (1e7, 1e6))
    assert channel.name in live, "what is declared is simulated"
    if channel.advice:
        plain = build(machine.load_machine("mining-loader"), "boom")
        assert f"{channel.advice} (assumptions.{channel.declared})" in _mending(plain, plain, None)
        assert channel.advice not in " ".join(_mending(boom, boom, None))
    if channel.is_reading:
        assert any(channel.name in one.signals for one in DETECTORS)


# What is reported of a run


def test_readings_come_late_off_and_sometimes_wrong():
    time = np.arange(0.0, 2000.0, 0.02)
    true = 0.25 + 0.2 * np.sin(time)
    how = ReadingReport(offset=3e-3, noise=1e-3, delay=0.5, wrong=0.1, every=2.0, stroke=0.5, seed=1)
    shown = how.reported(time, true)
    there = np.flatnonzero(np.isfinite(shown))
    assert time[there].tolist() == pytest.approx(list(np.arange(2.0, 2000.0, 2.0)))
    error = shown[there] - (0.25 + 0.2 * np.sin(time[there] - 0.5))
    right = np.abs(error) < 0.01
    assert 1.0 - right.mean() == pytest.approx(0.1, abs=0.03)
    assert error[right].mean() == pytest.approx(3e-3, abs=0.2e-3)
    assert error[right].std() == pytest.approx(1e-3, rel=0.1)
    again = how.reported(time, true)
    assert np.array_equal(shown, again, equal_nan=True)
    assert not np.array_equal(shown, replace(how, seed=2).reported(time, true), equal_nan=True)


def test_an_offset_is_drawn_from_what_is_declared():
    boom = build(DECLARED, "boom")
    found = [declared_readings(boom, seed)[READINGS[0]] for seed in range(200)]
    assert np.std([one.offset for one in found]) == pytest.approx(1e-3, rel=0.15)
    assert {one.every for one in found} == {10.0}
    assert declared_readings(build(machine.load_machine("mining-loader"), "boom"), 1) == {}


# The sensor


def test_a_position_is_known_from_the_first_reading_on(worked):
    run, log = worked
    track = ramsight.track(DECLARED, log, unit="boom")
    error = np.abs(track["position"].values - run["position"].values)
    known = np.isfinite(error)
    assert log["time"].values[known][0] == pytest.approx(10.0, abs=0.03)
    assert known.mean() > 0.96
    assert (error <= track["position_high"].values - track["position"].values)[known].mean() > 0.9
    assert np.percentile(error[known], 95) < 6e-3
    ok = track["status"].values == 0
    assert ok.mean() > 0.6
    assert not (ok & (error > 4.0 * track["position_std"].values) & (error > 1e-3)).any()


def test_no_reading_is_no_measurement(worked):
    _, log = worked
    log = log.isel(time=slice(0, 2000))
    plain, declared = (ramsight.sensor_for(one, unit="boom") for one in ("mining-loader", DECLARED))
    tracks = []
    for sensor, seen in ((plain, log.drop_vars(NAME)), (declared, log.assign({NAME: log[NAME] * math.nan}))):
        sensor.start(position=0.1)
        tracks.append(sensor.track(seen))
    assert np.allclose(tracks[0]["position"], tracks[1]["position"], atol=1e-9)
    assert np.allclose(tracks[0]["position_std"], tracks[1]["position_std"], atol=1e-9)


def test_a_wrong_reading_is_refused_and_said(worked):
    _, log = worked
    seen = log[NAME].values.copy()
    seen[:] = math.nan
    seen[500:3000:500], seen[3000] = 0.1, 0.4
    still = log.isel(time=slice(0, 3500)).assign({NAME: ("time", seen[:3500])})
    still = still.assign(motor_speed=0.0 * still["motor_speed"], motor_torque=0.0 * still["motor_torque"] + 1.0)
    track = ramsight.track(DECLARED, still, unit="boom")
    assert track["position"].values[2999] == pytest.approx(0.1, abs=2e-3)
    assert track["position"].values[3001] == pytest.approx(0.1, abs=2e-3)
    assert ramsight.Status(int(track["status"][3001])) is ramsight.Status.REFERENCE_REFUSED


def test_what_readings_share_is_never_averaged_away():
    sensor = ramsight.sensor_for(DECLARED, unit="boom")
    for k in range(3000):
        reading = 0.2 if k % 50 == 49 else math.nan
        now = sensor.step(time=0.02 * k, motor_speed=0.0, motor_torque=0.0, oil_temperature=313.15, **{NAME: reading})
    assert now.position == pytest.approx(0.2, abs=1e-4)
    assert 1e-3 < now.position_std < 4e-3, "60 readings, each with the same offset of 1 mm (std)"


# Logs


def test_a_mapped_reading_counts_once_at_the_sample_that_comes_with_it_or_after_it(tmp_path):
    rows = "".join(f"{0.02 * k:.2f},1500,12.5,40,{'123' if k == 7 else ''}\n" for k in range(20))
    file = written(tmp_path, f"t,n,M,T,laser\n{rows}", "log.csv")
    keys = ('channel = "n", unit = "rpm"', 'channel = "M", unit = "N m"', 'channel = "T", unit = "degC"')
    more = {"time": 'channel = "t", unit = "s"', NAME: 'channel = "laser", unit = "mm", offset = 2.0'}
    found = read_log(file, written(tmp_path, roles(*keys, **more)))[NAME].values
    assert np.flatnonzero(np.isfinite(found)).tolist() == [7]
    assert found[7] == pytest.approx(0.125)
