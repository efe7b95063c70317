"""Work of a wheel loader's cylinder: shares of time, loads and ends as measured, and what a sensor makes of it."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import ramsight
from ramsight.cli import app
from ramsight.duty.loader_work import USES, loader_work
from ramsight.machine import load_machine
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.study.datasheet.studied_duties import Work

LOADER = load_machine("mining-loader")
UNITS = {name: build(LOADER.unit(name), name) for name in ("boom", "bucket")}
WARM = 313.15  # K


def sampled(kind, seed, duration=1500.0):
    unit = UNITS[kind.removeprefix("loader-")]
    duty = loader_work(unit, kind, WARM, duration=duration, seed=seed)
    time = np.arange(0.0, duty.duration, 0.02)
    return duty.motor_speed(time), duty.load(time) / limits_of(unit).load


@pytest.mark.parametrize(
    ("kind", "turns", "quantiles"),
    [("loader-boom", 0.63, (0.05, 0.23, 0.60)), ("loader-bucket", 0.72, (0.02, 0.18, 0.52))],
)
def test_times_and_loads_are_distributed_as_at_work(kind, turns, quantiles):
    speeds, loads = (np.concatenate(one) for one in zip(*(sampled(kind, seed) for seed in range(3)), strict=True))
    assert (np.abs(speeds) > 1.0).mean() == pytest.approx(turns, abs=0.1)
    assert np.percentile(loads, (5, 50, 95)) == pytest.approx(quantiles, abs=0.08)
    assert 0.0 < (loads < 0.0).mean() < 0.06
    fast = loads - np.convolve(loads, np.ones(50) / 50, mode="same")  # faster than a second
    assert 0.02 < fast.std() < 0.09
    assert loads.min() >= -0.1 - 1e-9
    assert loads.max() <= 0.75 + 1e-9


def test_the_same_seed_gives_the_same_work_and_another_one_another():
    unit = UNITS["boom"]
    one, same, other = (loader_work(unit, "loader-boom", WARM, duration=60.0, seed=seed) for seed in (3, 3, 4))
    time = np.linspace(0.0, 60.0, 500)
    assert (one.load(time) == same.load(time)).all()
    assert (one.motor_speed(time) == same.motor_speed(time)).all()
    assert (one.load(time) != other.load(time)).any()


@pytest.fixture(scope="module", params=["boom", pytest.param("bucket", marks=pytest.mark.slow)])
def worked(request):
    unit = UNITS[request.param]
    run = ramsight.simulate(LOADER, f"loader-{request.param}", unit=request.param, duration="5 min", seed=1)
    return request.param, unit, run


def test_a_boom_meets_no_end_and_a_bucket_one_now_and_then(worked):
    name, unit, run = worked
    position, stroke = run["position"].values, unit.cylinder.stroke
    at_end = (position < 1e-4) | (position > stroke - 1e-4)
    visits = int((np.diff(at_end.astype(int)) > 0).sum())
    assert visits == 0 if name == "boom" else visits >= 4


def test_no_digging_load_is_taken_for_an_end(worked):
    """Before any end was met there is no position, and none that is known is wrong and ok."""
    name, unit, run = worked
    sensor = ramsight.sensor_for(LOADER, unit=name)
    sensor.start(None)
    track = sensor.track(ramsight.drive_report(run))
    position, known = run["position"].values, (track["status"].values < 30) | (track["status"].values >= 40)
    if name == "boom":
        assert not known.any()
    error = np.abs(track["position"].values - position)
    assert not (known & (error > 0.02 * unit.cylinder.stroke)).any()
    assert not (known & (error > track["position_bound"].values)).any()


@pytest.mark.parametrize("kind", USES)
def test_a_study_and_the_command_have_it(kind, tmp_path):
    Work(kind).check()
    unit = UNITS[kind.removeprefix("loader-")]
    duty = Work(kind, duration=60.0).duty(unit, unit, WARM, 0.0, 1)
    assert duty.duration > 60.0
    log = Path(tmp_path, "log.csv")
    words = ["simulate", "mining-loader", "--unit", kind.removeprefix("loader-"), "--duty", kind, "--duration", "40 s"]
    done = CliRunner().invoke(app, [*words, "--seed", "2", "--log", str(log)])
    assert done.exit_code == 0, done.output
    assert log.stat().st_size > 10_000
