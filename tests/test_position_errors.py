"""Errors of an estimate against the truth."""

import math

import numpy as np
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st

from evaluation.judged_errors import judge
from ramsight.errors import RamsightError
from ramsight.logs import read_truth
from ramsight.tracking import first_stop_contact, position_errors
from ramsight.tracking.track_errors import ComparisonError, stop_visits, track_errors

TIME = np.arange(0.0, 10.0, 0.1)
TRUTH = 0.4 + 0.3 * np.sin(TIME)


LATE = np.where(TIME > 5.0, TRUTH + 1.0, TRUTH)
HOLED = np.where((TIME > 0.25) & (TIME < 0.45), np.nan, TRUTH + 0.01)
SPREAD = np.random.default_rng(0).permutation(np.arange(101.0)) / 100.0


@pytest.mark.parametrize(
    ("arguments", "until", "found"),
    [
        ((TIME, TRUTH, TIME, TRUTH), None, {"largest": 0, "p95": 0, "final": 0, "samples": TIME.size, "missing": 0}),
        (([0.25, 0.5], [0.25, 0.5], [0.0, 1.0], [0.0, 1.0]), None, {"largest": 0.0, "samples": 2}),
        ((np.arange(101.0), SPREAD, np.arange(101.0), np.zeros(101)), None, {"largest": 1.0, "p95": 0.95}),
        (([-1.0, 0.5, 3.0], [9.0, 0.1, 9.0], [0.0, 1.0], [0.1, 0.1]), None, {"largest": 0.0, "samples": 1}),
        ((TIME, LATE, TIME, TRUTH), None, {"largest": 1.0}),
        ((TIME, LATE, TIME, TRUTH), 5.0, {"largest": 0.0}),
        ((TIME, LATE, TIME, TRUTH), 99.0, {"final": 1.0}),
        ((TIME, HOLED, TIME, TRUTH), None, {"missing": 2, "samples": TIME.size - 2, "largest": 0.01}),
        ((TIME, np.append(HOLED[:-1], np.nan), TIME, TRUTH), None, {"final": math.nan}),
    ],
    ids=["the truth", "interpolated", "worst twentieth", "outside", "all", "until", "until late", "holes", "no end"],
)
def test_errors_are_those_where_estimate_and_truth_are_known(arguments, until, found):
    errors = position_errors(*arguments, until=until)
    assert {name: getattr(errors, name) for name in found} == pytest.approx(found, abs=1e-12, nan_ok=True)


@given(offset=st.floats(-0.5, 0.5))
def test_a_constant_offset_is_the_error_of_every_kind(offset):
    errors = position_errors(TIME, TRUTH + offset, TIME, TRUTH)
    for value in (errors.largest, errors.p95, errors.final):
        assert value == pytest.approx(abs(offset), abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "until", "part"),
    [
        (([0.0], [0.1], [1.0, 2.0], [0.1, 0.1]), None, "no time in common"),
        (([1.5], [0.1], [1.0, 2.0], [0.1, 0.1]), 1.2, "up to 1.2 s"),
        (([1.0], [np.nan], [1.0, 2.0], [0.1, 0.1]), None, "none of the 1 samples"),
        (([1.0], [0.1], [1.0, 2.0], [0.1, np.nan]), None, "no position at 2 s"),
        (([], [], [1.0, 2.0], [0.1, 0.1]), None, "estimate has no samples"),
        (([1.0], [0.1], [], []), None, "truth has no samples"),
        (([1.0, 2.0], [0.1], [1.0, 2.0], [0.1, 0.1]), None, "do not match"),
        (([1.0, 1.0], [0.1, 0.1], [1.0, 2.0], [0.1, 0.1]), None, "do not increase"),
        (([1.0], [0.1], [1.0, np.nan], [0.1, 0.1]), None, "do not increase"),
    ],
)
def test_what_cannot_be_compared_is_refused_in_one_line(arguments, until, part):
    with pytest.raises(RamsightError) as caught:
        position_errors(*arguments, until=until)
    assert part in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_the_first_touch_of_either_stop_is_found():
    assert first_stop_contact([0.0, 1.0, 2.0], [0.5, 0.0, 0.5], 1.0) == 1.0
    assert first_stop_contact([0.0, 1.0, 2.0], [0.5, 1.0, 0.0], 1.0) == 1.0
    assert first_stop_contact([0.0, 1.0], [0.5, 0.99], 1.0) is None
    assert first_stop_contact([0.0, 1.0], [0.5, 0.99], 1.0, tolerance=0.02) == 1.0
    assert first_stop_contact([3.0], [0.0], 1.0) == 3.0


def test_warm_oil_brings_the_recorded_boom_to_its_lower_stop(trace):
    warm, cold = (read_truth(trace(f"boom_441kN_{degrees}C").truth) for degrees in (60, 20))
    contact = first_stop_contact(warm.time, warm.position, 0.79, tolerance=1e-3)
    assert contact is not None
    assert 15.0 < contact < 27.5
    assert first_stop_contact(cold.time, cold.position, 0.79, tolerance=1e-3) is None


def test_what_is_said_to_be_invalid_is_counted_apart():
    time, truth = np.arange(5.0), np.full(5, 0.2)
    off = truth + np.array([1e-3, -2e-3, 0.0, 0.5, np.nan])
    found = track_errors(time, off, [False, False, False, True, True], time, truth)
    assert found.usable is not None
    assert (found.usable.samples, found.usable.missing) == (3, 2)
    assert found.usable.largest == pytest.approx(2e-3)
    assert (found.invalid, found.set_back) == (1, 0)
    assert found.invalid_largest == pytest.approx(0.5)
    nothing = track_errors(time, off, np.ones(5, bool), time, truth)
    assert nothing.usable is None
    assert nothing.invalid == 4


def test_samples_of_a_clock_that_was_set_back_are_left_out():
    time = np.array([0.0, 1.0, 2.0, 0.5, 1.5, 2.0, 2.5])
    truth_time, truth = np.array([0.0, 3.0]), np.array([0.0, 0.3])
    found = track_errors(time, 0.1 * time, np.zeros(7, bool), truth_time, truth)
    assert found.usable is not None
    assert found.usable.samples == 4
    assert found.set_back == 3  # 0.5, 1.5 and the second 2 s
    with pytest.raises(ComparisonError, match="no time in common"):
        track_errors(time + 10.0, time, np.zeros(7, bool), truth_time, truth)


def test_a_visit_to_a_stop_counts_once_however_long_it_lasts():
    position = [0.3, 0.0, 0.0, 0.001, 0.3, 0.5, 0.499, 0.3, 0.0]
    assert stop_visits(np.arange(9.0), position, 0.5).tolist() == [1.0, 5.0, 8.0]


def test_a_track_is_judged_from_the_visit_on_that_is_asked_for():
    """Three visits to a stop; the error is 3, 2, 1 and 0 mm before the first and after each."""
    time = np.arange(0.0, 80.0, 0.1)
    visit = (time % 20.0 >= 19.0) & (time < 70.0)
    true = np.where(visit, 0.0, 0.2)
    left = np.minimum(time // 20.0, 3.0)
    names = ("position_std", "position_bound")
    data = {"position": ("time", true + 1e-3 * (3.0 - left)), "status": ("time", np.zeros(len(time), dtype=int))}
    data |= {name: ("time", np.full(len(time), 1e-2)) for name in names}
    track = xarray.Dataset(data, coords={"time": time})
    for after, largest in ((1, 2e-3), (2, 1e-3), (3, 0.0)):
        found = judge(track, np.full(len(time), 100.0), true, 0.5, after=after)
        assert found.largest == pytest.approx(largest, abs=1e-12)
