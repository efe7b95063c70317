"""How much of the time a position may be used, counted piece by piece."""

import numpy as np
import pytest
import xarray
from hypothesis import example, given, settings
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


def outages_by_hand(usable):
    """How long each stretch of samples that are not usable lasts; a stretch ends with the first usable one."""
    runs = "".join("1" if one else "0" for one in usable).split("1")
    lengths = [len(run) for run in runs[:-1]] + [max(len(runs[-1]) - 1, 0)]
    return [PERIOD * length for length, run in zip(lengths, runs, strict=True) if run]


@given(usable=st.lists(st.booleans(), min_size=2, max_size=60), cuts=st.sets(st.integers(1, 59), max_size=4))
@example(usable=[False] * 16, cuts={4, 8, 12})
@example(usable=[True, *[False] * 4] * 3, cuts={7})
@settings(max_examples=60)
def test_outages_are_counted_whatever_the_pieces(usable, cuts):
    bounds, counted, begin = np.where(usable, 1e-3, 9e-3), Availability(5e-3, 0.35), 0
    for end in [*sorted(cut for cut in cuts if cut < len(usable)), len(usable)]:
        counted.append(a_track(bounds[begin:end], begin=PERIOD * begin))
        begin = end
    outages = outages_by_hand(usable)
    assert counted.share == pytest.approx(np.mean(usable))
    assert counted.alerts == sum(lasts > 0.35 for lasts in outages)
    assert counted.longest == pytest.approx(max(outages, default=0.0))
