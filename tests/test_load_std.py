"""How well a load is known: a machine that is not its data sheet, at steady work and at that of a loader."""

import numpy as np
import pytest

from ramsight.duty import report, simulate
from ramsight.duty.drive_report import declared_report
from ramsight.duty.loader_work import loader_work
from ramsight.duty.work_day import work_day
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.as_built import AsBuilt
from ramsight.sensor.kalman import kalman

LOADS = {"boom": (100e3, 370e3), "bucket": (20e3, 140e3)}  # N


@pytest.mark.parametrize("kind", ["steady", pytest.param("loader", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["boom", "bucket"])
def test_the_band_of_a_load_holds_and_is_no_wider_than_twice_its_errors(units, name, kind):
    unit, seed = units[name], 3
    if kind == "steady":
        duty = work_day(unit, LOADS[name], 310.0, duration=120.0, seed=seed)
    else:
        duty = loader_work(unit, f"loader-{name}", 310.0, duration=120.0, seed=seed)
    run = simulate(AsBuilt(leak=1.2, stiffness=0.8, friction=1.3).apply(unit), duty)
    log = report(run, declared_report(unit, seed))
    log["motor_torque"] *= 1.025
    sensor = kalman(unit)
    sensor.start(None)
    track = sensor.track(log)
    error, std = track["load"].values - run["load"].values, track["load_std"].values
    position, age = run["position"].values, track["load_age"].values
    between = (position > 5e-3) & (position < unit.cylinder.stroke - 5e-3)
    inside = np.abs(error) <= TWO_SIDED_95 * std
    moves, rests = between & (age == 0.0), between & (age > 0.0)
    assert inside[moves].mean() > 0.93
    assert inside[rests].mean() > 0.93
    assert np.sqrt(np.mean(std[moves] ** 2)) < 2.0 * np.sqrt(np.mean(error[moves] ** 2))
    still = np.abs(log["motor_speed"].values) < 0.1
    assert age[still].max() > 0.9
    assert np.diff(age)[still[1:] & (age[1:] > 0.1)] == pytest.approx(0.02, abs=1e-6), "as long as it is hidden"
