"""A sensor of the angle of the body that a cylinder turns: geometry, logs, the sensor, exports."""

import math
from dataclasses import replace

import numpy as np
import pytest

import ramsight
from evaluation.judged_errors import judge
from ramsight import machine
from ramsight.duty import DriveReport, report, simulate
from ramsight.duty.reading_report import LinkReport, declared_link
from ramsight.duty.work_day import work_day
from ramsight.errors import DescriptionError
from ramsight.plant.build import build
from ramsight.plant.linkage import build_mechanism, joints
from ramsight.plant.linkage.lever import lever
from ramsight.sensor.kalman import kalman

LOADER = machine.load_machine("mining-loader")
BOOM = build(LOADER, "boom")
STD = math.radians(0.2)
WITH = BOOM.assumptions.replace({"link_angle.std": STD})


@pytest.fixture(scope="module")
def sensor():
    return kalman(BOOM, WITH)


@pytest.fixture(scope="module")
def leaky():
    """Six minutes of work with no stop at all, on a machine that leaks 30 % more than its data sheet says."""
    real = BOOM.mapped(lambda part: replace(part, leak_factor=1.3) if hasattr(part, "leak_factor") else part)
    return simulate(real, work_day(real, (100e3, 350e3), 313.15, duration=360.0, visit_every=1e9, seed=5))


def log_of(run, **how):
    link = LinkReport(BOOM.lever, noise=STD, seed=3, **how)
    return report(run, DriveReport(seed=3, link=link))


def within(track, run):
    return np.abs(track["position"].values - run["position"].values)


@pytest.mark.parametrize("position", [0.0, 0.2, 0.45, 0.7])
def test_the_lever_is_the_mechanism(position):
    boom = lever(LOADER.linkage, "boom")
    angle = joints(build_mechanism(LOADER.linkage), np.array([position, 0.2]))[0]
    assert boom.angle(position) == pytest.approx(angle, abs=1e-12)
    assert boom.position(angle) == pytest.approx(position, abs=1e-12)
    near = (boom.position(angle + 1e-6) - boom.position(angle - 1e-6)) / 2e-6
    assert boom.slope(angle) == pytest.approx(near, rel=1e-6)


def test_a_body_that_other_cylinders_move_too_has_no_lever():
    assert lever(LOADER.linkage, "bucket") is None
    assert lever(None, "boom") is None
    mast = machine.load_machine("forklift-mast")
    assert all(lever(mast.linkage, name) is None for name in mast.units)


def test_a_declared_angle_without_a_lever_is_refused():
    bucket = build(LOADER, "bucket")
    with pytest.raises(DescriptionError, match=r"units\.bucket\.assumptions\.link_angle\.std.*mechanism"):
        kalman(bucket, WITH)


def test_an_angle_holds_the_position_of_a_worn_machine_that_meets_no_stop(leaky, sensor):
    log = log_of(leaky, offset=math.radians(0.1))
    alone = kalman(BOOM)
    for one in (alone, sensor):
        one.start(float(leaky["position"][0]))
    free, held = alone.track(log), sensor.track(log)
    assert within(free, leaky)[:15_000].max() > 10e-3
    found = judge(held, log["motor_speed"].values, leaky["position"].values, BOOM.cylinder.stroke, after=0)
    assert found.p95 < 3e-3
    assert found.coverage > 0.9
    assert found.wrong_and_ok < 0.005
    assert found.ok > 0.9
    assert float(held["leak_factor"][-1]) == pytest.approx(1.3, abs=0.05)


def test_an_angle_finds_a_position_that_nobody_knows(leaky, sensor):
    sensor.start(None)
    track = sensor.track(log_of(leaky))
    assert within(track, leaky)[3000:].max() < 5e-3
    assert int(track["status"][-1]) in (0, 1)


def test_an_offset_is_learned_from_references(leaky, sensor):
    offset = math.radians(0.4)
    log = log_of(leaky, offset=offset)
    reference = np.full(log.sizes["time"], np.nan)
    reference[2000::3000] = leaky["position"].values[2000::3000]
    sensor.start(float(leaky["position"][0]))
    sensor.track(log.assign(reference=("time", reference)))
    assert sensor.state["hypotheses[0].angle_offset"] == pytest.approx(offset, abs=math.radians(0.08))


def test_an_angle_that_is_stuck_convinces_nobody(leaky, sensor):
    log = log_of(leaky)
    stuck = log["link_angle"].values.copy()
    stuck[6000:] = stuck[6000]
    sensor.start(float(leaky["position"][0]))
    track = sensor.track(log.assign(link_angle=("time", stuck)))
    off = within(track, leaky)[6000:]
    bound = 4.0 * track["position_std"].values[6000:]
    assert ((off > np.maximum(bound, 1e-3)) & (track["status"].values[6000:] == 0)).mean() < 0.005
    assert off.max() < 30e-3


def test_no_angle_is_no_measurement(leaky, sensor):
    log = log_of(leaky).isel(time=slice(0, 3000))
    alone = kalman(BOOM)
    for one in (alone, sensor):
        one.start(float(leaky["position"][0]))
    none, plain = sensor.track(log.assign(link_angle=("time", np.full(3000, np.nan)))), alone.track(log)
    assert np.allclose(none["position"], plain["position"], atol=1e-9)
    assert np.allclose(none["position_std"], plain["position_std"], atol=1e-6)


def test_a_lagging_angle_is_moved_on(leaky):
    late = kalman(BOOM, WITH.replace({"link_angle.lag": 0.3}))
    log = log_of(leaky, lag=0.3)
    errors = []
    for one in (late, kalman(BOOM, WITH)):
        one.start(float(leaky["position"][0]))
        errors.append(float(np.sqrt((within(one.track(log), leaky) ** 2).mean())))
    assert errors[0] < 0.8 * errors[1]


def test_a_declared_angle_is_rehearsed_and_used(tmp_path):
    text = ramsight.load_machine("mining-loader")
    assert declared_link(build(text, "boom"), 1) is None
    declared = replace(BOOM, assumptions=WITH)
    run = ramsight.simulate(declared, load="200 kN")
    first, again = (ramsight.drive_report(run, declared, seed=4) for _ in range(2))
    assert first["link_angle"].values.tolist() == again["link_angle"].values.tolist()
    assert "link_angle" not in ramsight.drive_report(run, seed=4)
    track = ramsight.track(declared, first, truth=run)
    assert track.attrs["error_largest"] < 10e-3
