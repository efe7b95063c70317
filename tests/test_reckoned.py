"""A sensor that counts from a reference on: how far it may be off, and what it does with impossible inputs."""

import math

import numpy as np
import pytest

from ramsight.duty import report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.work_day import work_day
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.as_built import AsBuilt
from ramsight.sensor.reckoned import reckoned
from ramsight.sensor.status import Status

WARM = 313.15


@pytest.fixture(scope="module")
def days(boom):
    """Days of machines that are not their data sheet: the log, the true position, the start."""
    found = []
    for seed in range(4):
        random = np.random.default_rng(seed)
        real = AsBuilt(leak=random.uniform(0.8, 1.2), displacement=random.uniform(0.995, 1.005)).apply(boom)
        duty = work_day(boom, (100e3, 370e3), WARM, duration=180.0, seed=seed)
        run = simulate(real, duty)
        found.append((report(run, declared_report(boom, seed)), run["position"].values, duty.start_position))
    return found


def still(sensor, time, **other):
    return sensor.step(time=time, **({"motor_speed": 0.0, "motor_torque": 0.0, "oil_temperature": WARM} | other))


def test_without_a_reference_it_has_no_position(boom):
    sensor = reckoned(boom)
    before = still(sensor, 0.0)
    assert before.status is Status.NOT_REFERENCED
    assert all(math.isnan(sensor.says(name)) for name in ("position", "position_std", "position_low", "position_high"))
    now = still(sensor, 0.02, reference=0.25)
    assert now.position == 0.25
    assert now.status is Status.OK
    assert now.position_std < 2.5e-3


@pytest.mark.parametrize("place", [-0.1, -4.1, 1.1, 5.1])
def test_a_reference_where_no_piston_can_be_is_refused(boom, place):
    """Within four standard deviations of the stroke's ends it is taken."""
    far, stroke = boom.assumptions.stops.reference, boom.cylinder.stroke
    reference = place * far if place < 0.0 else stroke + (place - 1.0) * far
    sensor = reckoned(boom)
    sensor.start(0.2)
    before = still(sensor, 0.0)
    now = still(sensor, 0.02, reference=reference)
    if place in (-0.1, 1.1):
        assert now.position == reference
        assert now.status is Status.OK
    else:
        assert now.position == pytest.approx(before.position, abs=1e-4)
        assert now.status is Status.REFERENCE_REFUSED
        assert now.position_std >= before.position_std


def test_what_it_is_off_by_is_within_what_it_says(boom, days):
    sensor, inside, total = reckoned(boom), 0, 0
    for log, position, start in days:
        sensor.start(start)
        track = sensor.track(log)
        error = np.abs(track["position"].values - position)
        assert (error <= TWO_SIDED_95 * track["position_std"].values).mean() > 0.9
        inside += int((error <= TWO_SIDED_95 * track["position_std"].values).sum())
        total += len(error)
        low, high = track["position_low"].values, track["position_high"].values
        assert ((low <= track["position"].values) & (track["position"].values <= high)).all()
        assert error.max() > 2e-3, "a machine that leaks otherwise is somewhere else in the end"
    assert inside / total > 0.95


def test_a_reference_ends_what_has_added_up(boom, days):
    log, position, start = days[0]
    sensor = reckoned(boom)
    sensor.start(start)
    alone = sensor.track(log)
    places = np.arange(1000, len(position), 1000)
    reference = np.full(len(position), np.nan)
    reference[places] = position[places]
    sensor.start(start)
    helped = sensor.track(log.assign(reference=("time", reference)))
    assert np.abs(helped["position"].values - position)[places].max() < 1e-12
    assert helped["position_std"].values[places].max() < 2e-3
    assert helped["position_std"].values.mean() < 0.6 * alone["position_std"].values.mean()
    assert (helped["status"].values == Status.OK).mean() > (alone["status"].values == Status.OK).mean()


def test_a_way_and_the_way_back_cancel_what_is_unknown_of_the_displacement(boom):
    sensor = reckoned(boom)
    sensor.start(0.2)
    places = []
    for k in range(800):
        now = sensor.step(0.02 * k, 60.0 if k < 400 else -60.0, 40.0, WARM)
        places.append((now.position, sensor.state["by_displacement"], now.position_std))
    (far, by_far, std), (back, by_back, _) = places[399], places[-1]
    assert by_far > far - 0.2 > 0.03, "leakage takes a part of the way"
    assert abs(by_back) < 0.5 * abs(by_far)
    assert std > boom.assumptions.machine.displacement * by_far
    assert back < far


@pytest.mark.parametrize(
    ("bad", "status"),
    [
        ({"motor_speed": math.nan}, Status.INPUT_LOST), ({"motor_torque": math.nan}, Status.INPUT_LOST),
        ({"motor_speed": 1e4}, Status.IMPLAUSIBLE_SPEED), ({"oil_temperature": math.nan}, Status.TEMPERATURE_LOST),
    ],
)  # fmt: skip
def test_an_input_that_cannot_be_is_said_and_leaves_no_mark(boom, bad, status):
    sensor = reckoned(boom)
    sensor.start(0.2)
    for k in range(20):
        before = still(sensor, 0.02 * k)
    now = still(sensor, 0.4, **bad)
    assert now.status is status
    assert now.position == pytest.approx(before.position, abs=1e-4)
    after = still(sensor, 0.42)
    assert after.position == pytest.approx(before.position, abs=1e-4)
    assert math.isfinite(after.position_std)


def test_an_end_stops_the_position_and_not_what_is_unknown(boom):
    sensor = reckoned(boom)
    sensor.start(boom.cylinder.stroke - 0.01)
    found = [sensor.step(0.02 * k, 100.0, 40.0, WARM) for k in range(300)]
    assert found[-1].position == boom.cylinder.stroke
    back = [sensor.step(6.0 + 0.02 * k, -100.0, 40.0, WARM) for k in range(100)]
    assert back[-1].position < boom.cylinder.stroke - 0.01
    assert back[-1].position_std >= found[-1].position_std * 0.99
