"""Whether a fault is over after three references, as the study judges it."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray

from ramsight.duty.faults import Fault
from ramsight.sensor.status import Status

ROOT = Path(__file__).parents[1]
TIME = np.arange(0.0, 100.0, 0.5)
ROWS = np.arange(TIME.size)
FAULT = Fault("offset", 5.0, 10.0, "motor_speed", 10.0)
VISITS = np.array([3.0, 20.0, 30.0, 40.0])  # the first is before the fault


@pytest.fixture
def study(script):
    return script("after_faults")


def track(error=0.0, std=1e-3, status=Status.OK):
    return {
        "position": 0.3 + np.broadcast_to(error, TIME.shape),
        "position_std": np.full(TIME.shape, std),
        "status": np.broadcast_to(int(status), TIME.shape),
    }


def judged(study, faulty, visits=VISITS):
    day = SimpleNamespace(log=xarray.Dataset(coords={"time": TIME}), position=np.full(TIME.shape, 0.3))
    return study.after(day, track(1e-3), faulty, ROWS, FAULT, visits)


def test_what_errs_until_the_third_reference_alone_is_over(study):
    over, worse, wrong = judged(study, track(np.where(TIME < 44.0, 0.1, 1e-3)))
    assert over
    assert worse == pytest.approx(0.0)
    assert wrong == 0.0


@pytest.mark.parametrize("faulty", [track(4e-3), track(1e-3, status=Status.FAULT_PASSED)])
def test_an_error_or_a_status_that_stays_is_not_over(study, faulty):
    over, _, _ = judged(study, faulty)
    assert not over


def test_wrong_and_ok_is_counted(study):
    _, worse, wrong = judged(study, track(np.where(TIME < 72.0, 5e-3, 0.0)))
    assert worse == pytest.approx(4e-3)
    assert wrong == pytest.approx(0.5, abs=0.01)
    assert judged(study, track(5e-3, status=Status.REFERENCE_DUE))[2] == 0.0


def test_a_day_that_ends_before_says_nothing(study):
    assert judged(study, track(), visits=VISITS[:3]) is None
    assert judged(study, track(), visits=np.array([20.0, 30.0, 90.0])) is None
