"""What a Dataset holds as Python users have it: dates, durations, units of its own, and what is no number at all."""

import copy
import pickle
import warnings

import numpy as np
import pytest
import xarray

import ramsight
from ramsight.api.arguments import in_si

RPM = 2.0 * np.pi / 60.0


@pytest.fixture
def sensor():
    sensor = ramsight.sensor_for("mining-loader", unit="boom")
    sensor.start(0.1)
    return sensor


def log(**changed):
    values = {"motor_speed": np.full(5, 100.0), "motor_torque": np.full(5, 20.0), "oil_temperature": np.full(5, 313.15)}
    known = {name: ("time", value) for name, value in values.items()}
    return xarray.Dataset({**known, **changed}, coords={"time": 0.02 * np.arange(5)})


def last(sensor, one):
    sensor.start(0.1)
    return float(sensor.track(one)["position"].values[-1])


@pytest.mark.parametrize("form", ["datetime64[ms]", "datetime64[ns]", "timedelta64[ms]", "timedelta64[us]"])
def test_dates_and_durations_are_seconds(sensor, form):
    times = (20 * np.arange(5)).astype("timedelta64[ms]").astype(form.replace("datetime", "timedelta"))
    if form.startswith("date"):
        times = np.datetime64("2026-11-27T12:00").astype(form) + times
    assert last(sensor, log().assign_coords(time=times)) == pytest.approx(last(sensor, log()), abs=1e-9)


def test_a_unit_that_a_variable_says_it_has_is_read(sensor):
    said = {
        "motor_speed": ("time", np.full(5, 100.0 / RPM), {"units": "rpm"}),
        "motor_torque": ("time", np.full(5, 0.02), {"units": "kN m"}),
        "oil_temperature": ("time", np.full(5, 40.0), {"units": "degC"}),
    }
    times = xarray.Variable("time", 20.0 * np.arange(5), {"units": "ms"})
    assert last(sensor, log(**said).assign_coords(time=times)) == pytest.approx(last(sensor, log()), abs=1e-12)
    again = in_si(log(**said), "log", ("motor_speed",))
    assert again["oil_temperature"].attrs["units"] == "K"


def test_what_is_in_si_is_handed_on_as_it_is():
    one = log()
    assert in_si(one, "log", ("time", "motor_speed")) is one


@pytest.mark.parametrize(
    ("changed", "error", "says"),
    [
        ({"motor_speed": ("time", np.zeros(5, complex))}, ramsight.LogError, "motor_speed.*no number"),
        ({"motor_torque": ("time", list("abcde"))}, ramsight.LogError, "motor_torque.*no number"),
        ({"motor_torque": ("time", np.array(["a"] * 5, object))}, ramsight.LogError, "motor_torque.*no number"),
        ({"motor_speed": ("time", np.zeros(5), {"units": "bar"})}, ramsight.DescriptionError, "an angular speed"),
        ({"motor_speed": ("time", np.zeros(5), {"units": "lbf^in"})}, ramsight.DescriptionError, "an angular speed"),
        ({"motor_speed": (("time", "k"), np.zeros((5, 2)))}, ramsight.DescriptionError, "over time alone"),
    ],
)
def test_what_cannot_be_read_is_refused_in_one_line(sensor, changed, error, says):
    with pytest.raises(error, match=says):
        sensor.track(log(**changed))


@pytest.mark.parametrize("passed", [None, [1, 2], 3.0])
def test_what_is_no_dataset_is_refused(sensor, passed):
    with pytest.raises(ramsight.DescriptionError, match="no Dataset"):
        sensor.track(passed)


def test_a_number_that_no_float_holds_is_judged_as_any_impossible_one(sensor):
    now = sensor.step(time=0.0, motor_speed=10**400, motor_torque=0.0, oil_temperature=313.15)
    assert now.status >= 10
    with pytest.raises(ramsight.StartError, match="outside the stroke"):
        sensor.start(10**400)


@pytest.mark.parametrize("made", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_goes_on_from_what_is_known_and_is_its_own(sensor, made):
    sensor.track(log())
    other = made(sensor)
    assert other.state == sensor.state
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ways = [float(one.track(log())["position"].values[-1]) for one in (sensor, other)]
    assert ways[0] == ways[1]
    other.start(0.3)
    assert sensor.state["position"] == ways[0]


def test_a_sensor_that_was_pickled_says_which_parts_its_step_has(sensor):
    other = pickle.loads(pickle.dumps(sensor))
    titles, again = ([title for title, _, _ in one.sections()] for one in (sensor, other))
    assert titles == again
    shapes = ([(marks.shape, rows.shape) for _, marks, rows in one.sections()] for one in (sensor, other))
    assert len({tuple(one) for one in shapes}) == 1
