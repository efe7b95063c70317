"""How much of the time a position may be used, counted piece by piece."""

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from ramsight.sensor.status import Status
from ramsight.tracking.availability import Availability

PERIOD = 0.1


def a_track(bound, status=None, begin=0.0):
    """A track of these bounds [m], ten a second."""
    time = begin + PERIOD * np.arange(len(bound))
    codes = np.zeros(len(bound), dtype=np.int64) if status is None else np.asarray(status)
    return xarray.Dataset(
        {"position_bound": ("time", np.asarray(bound, dtype=float)), "status": ("time", codes)}, coords={"time": time}
    )


def test_a_position_is_available_while_its_bound_is_within_the_limit():
    counted = Availability(5e-3, 0.25)
    counted.append(a_track([1e-3] * 6 + [6e-3] * 4))
    assert (counted.share, counted.alerts) == (0.6, 1)
    assert counted.longest == pytest.approx(0.3)
    assert "available 60.0 % of the time, its bound within 5 mm; 1 alert of more than 0.25 s" in counted.text


@pytest.mark.parametrize(
    ("status", "usable"),
    [(Status.OK, True), (Status.NEAR_RELIEF, True), (Status.NOT_REFERENCED, False), (Status.IMPLAUSIBLE_TORQUE, False)],
)
def test_no_position_is_used_that_the_sensor_takes_back(status, usable):
    counted = Availability(5e-3)
    counted.append(a_track([1e-3] * 10, [int(status)] * 10))
    assert counted.share == float(usable)


def test_an_unknown_bound_is_within_no_limit():
    counted = Availability(5e-3)
    counted.append(a_track([np.nan] * 5))
    counted.append(a_track([1e-3] * 5, begin=0.5).drop_vars("position_bound"))
    assert counted.share == 0.0


def test_what_is_over_before_the_time_to_alert_is_no_alert():
    counted = Availability(5e-3, 1.0)
    counted.append(a_track([1e-3, 9e-3, 9e-3, 1e-3] * 5))
    assert counted.alerts == 0
    assert counted.longest == pytest.approx(0.2)


def test_an_outage_is_one_alert_however_many_pieces_it_lasts():
    counted = Availability(5e-3, 0.25)
    for k in range(4):
        counted.append(a_track([9e-3, 9e-3, 9e-3, 9e-3], begin=0.4 * k))
    assert counted.alerts == 1
    assert counted.longest == pytest.approx(1.5)


def test_every_outage_is_an_alert_of_its_own():
    counted = Availability(5e-3, 0.25)
    counted.append(a_track([1e-3, 9e-3, 9e-3, 9e-3, 9e-3] * 3))
    assert counted.alerts == 3


def alerts_by_hand(usable, time_to_alert):
    """Stretches of samples that are not usable and last longer; a stretch ends with the first usable one."""
    runs = "".join("1" if one else "0" for one in usable).split("1")
    ends = [len(run) * PERIOD for run in runs[:-1]] + [(len(runs[-1]) - 1) * PERIOD]
    return sum(lasts > time_to_alert for run, lasts in zip(runs, ends, strict=True) if run)


@given(usable=st.lists(st.booleans(), min_size=2, max_size=60), cut=st.integers(1, 59))
@settings(max_examples=60)
def test_pieces_count_as_the_whole(usable, cut):
    bounds = np.where(usable, 1e-3, 9e-3)
    whole, pieces = Availability(5e-3, 0.35), Availability(5e-3, 0.35)
    whole.append(a_track(bounds))
    pieces.append(a_track(bounds[:cut]))
    if cut < len(bounds):
        pieces.append(a_track(bounds[cut:], begin=PERIOD * cut))
    assert pieces.share == whole.share
    assert pieces.alerts == whole.alerts == alerts_by_hand(usable, 0.35)
    assert pieces.longest == pytest.approx(whole.longest)
