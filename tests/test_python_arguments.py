"""Python takes SI numbers or text with a unit and refuses mistakes in one line; DataFrames are logs."""

import copy
import inspect
import math
import pickle
import xml.dom.minidom
from collections import Counter
from decimal import Decimal

import casadi as ca
import numpy as np
import pandas as pd
import pytest

import ramsight
from ramsight.errors import RamsightError

AsBuilt = ramsight.AsBuilt
SAMPLE = {"time": 0.0, "motor_speed": 0.0, "motor_torque": 0.0, "oil_temperature": 313.15}


@pytest.fixture(scope="module")
def run(boom):
    return ramsight.simulate(boom, load="441 kN", start="120 mm")


@pytest.fixture(scope="module")
def log(run):
    return ramsight.drive_report(run)


def stepped(boom, **inputs):
    sensor = ramsight.sensor_for(boom)
    sensor.start("120 mm")
    return sensor.step(**(SAMPLE | inputs))


MISTAKES = {
    "a leakage below zero": lambda b, r, g: AsBuilt(leak=-1),
    "a leakage that is no number": lambda b, r, g: AsBuilt(leak=math.nan),
    "three times the displacement": lambda b, r, g: AsBuilt(displacement=3),
    "no stiffness": lambda b, r, g: AsBuilt(stiffness=0),
    "friction with the unit of something else": lambda b, r, g: AsBuilt(friction="1.2 mm"),
    "a dictionary for a machine as built": lambda b, r, g: ramsight.simulate(b, load="441 kN", as_built={"leak": 1.2}),
    "a load in kN as a number": lambda b, r, g: ramsight.simulate(b, load=130),
    "a load without a unit": lambda b, r, g: ramsight.simulate(b, load="130"),
    "loads of which one is in kN": lambda b, r, g: ramsight.lift_lower(b, [441e3, 130]),
    "a temperature in °C as a number": lambda b, r, g: ramsight.simulate(b, load="441 kN", oil_temperature=40),
    "a speed in rpm as a number": lambda b, r, g: ramsight.simulate(b, load="441 kN", speed=1500),
    "a start in mm as a number": lambda b, r, g: ramsight.track(b, g, start=120),
    "a start without a unit": lambda b, r, g: ramsight.track(b, g, start="120"),
    "a tolerance below zero": lambda b, r, g: ramsight.simulate(b, load="441 kN", rtol=-1),
    "a tolerance in words": lambda b, r, g: ramsight.simulate(b, load="441 kN", rtol="fine"),
    "a seed below zero": lambda b, r, g: ramsight.drive_report(r, seed=-1),
    "half a seed": lambda b, r, g: ramsight.drive_report(r, seed=1.5),
    "noise below zero": lambda b, r, g: ramsight.drive_report(r, torque_noise=-1),
    "a unit by number": lambda b, r, g: ramsight.build("mining-loader", 3),
    "a machine by number": lambda b, r, g: ramsight.load_machine(5),
    "a built unit where a description is needed": lambda b, r, g: ramsight.Study(b),
    "tolerances without names": lambda b, r, g: ramsight.Study("press", vary=["leakage"]),
    "a log by number": lambda b, r, g: ramsight.read_log(5),
    "a sensor by number": lambda b, r, g: ramsight.track(b, g, sensor=3),
    "a map by number": lambda b, r, g: ramsight.track(b, "x.csv", channel_map=5),
    "a state file by number": lambda b, r, g: ramsight.track(b, g, state=5),
    "a start of a sensor without a unit": lambda b, r, g: ramsight.sensor_for(b).start("120"),
    "a start of a sensor outside the stroke": lambda b, r, g: ramsight.sensor_for(b).start("1200 mm"),
    "a pressure for a speed": lambda b, r, g: stepped(b, motor_speed="1500 bar"),
    "a duration for a torque": lambda b, r, g: stepped(b, motor_torque=np.timedelta64(1, "s")),
    "a duration for a start": lambda b, r, g: ramsight.sensor_for(b).start(np.timedelta64(1, "s")),
    "a number that no float holds": lambda b, r, g: ramsight.simulate(b, load="441 kN", rtol=10**400),
    "a list of units": lambda b, r, g: ramsight.build("mining-loader", ["boom"]),
    "a log to open by number": lambda b, r, g: ramsight.open_log(5),
    "a picture by number": lambda b, r, g: ramsight.draw(b, path=5),
    "a table of faults by number": lambda b, r, g: ramsight.export_fmeda(b, out=5),
    "no time": lambda b, r, g: stepped(b, time=None),
    "an input that there is not": lambda b, r, g: stepped(b, pressur=1.0),
    "a requirement in mm as a number": lambda b, r, g: ramsight.commission(b, g, require=5),
    "a tolerance of a second sensor without a unit": lambda b, r, g: ramsight.compare(b, g, r, tolerance="2"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_refused_in_one_line(boom, run, log, mistake):
    with pytest.raises(RamsightError) as refused:
        MISTAKES[mistake](boom, run, log)
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 250


def test_a_number_of_kn_is_refused_and_neighbours_are_not(boom):
    assert ramsight.lift_lower(boom, "130 N").load(0.0) == 130.0, "who writes the unit means it"
    assert ramsight.lift_lower(boom, 0.0).load(0.0) == 0.0
    assert ramsight.lift_lower(boom, 1000.0).load(0.0) == 1000.0, "a load of 1 MN is more than the valve carries"
    with pytest.raises(ramsight.DescriptionError, match="'441 kN'"):
        ramsight.lift_lower(boom, 441)


def test_a_sensor_takes_text_as_it_takes_numbers(boom):
    text, plain = ramsight.sensor_for(boom), ramsight.sensor_for(boom)
    text.start("120 mm", std="2 mm")
    plain.start(0.12, 0.002)
    for k in range(5):
        said = text.step(f"{20 * k} ms", "1500 rpm", "20 N m", "40 degC")
        assert said == plain.step(0.02 * k, 1500 * math.pi / 30, 20.0, 313.15)
    assert said.position > 0.12
    assert stepped(boom, motor_torque=math.nan).status != ramsight.Status.OK, "what a drive reports the sensor judges"


def frame_of(log):
    """The log as ramsight's columns."""
    return pd.DataFrame(
        {
            "time_s": log["time"].values,
            "motor_speed_rpm": log["motor_speed"].values * 30 / math.pi,
            "motor_torque_nm": log["motor_torque"].values,
            "oil_temperature_c": log["oil_temperature"].values - 273.15,
        }
    )


def test_a_data_frame_is_a_log_by_column_by_index_and_by_map(boom, run, log):
    pytest.importorskip("pyarrow")
    expected = ramsight.track(boom, log, start="120 mm")["position"].values
    frame = frame_of(log)
    for one in (frame, frame.set_index("time_s")):
        track = ramsight.track(boom, one, start="120 mm", truth=frame.assign(position_m=run["position"].values))
        np.testing.assert_allclose(track["position"].values, expected, atol=1e-9)
        assert track.attrs["error_largest"] < 1e-3
    named = frame.rename(columns={"motor_torque_nm": "torque", "motor_speed_rpm": "n"})
    with pytest.raises(ramsight.MissingColumnError, match="DataFrame"):
        ramsight.read_log(named)
    with pytest.raises(RamsightError, match="motor_torque_nm"):
        ramsight.read_log(frame.assign(motor_torque_nm="ten"))


def test_any_frame_that_arrow_takes_is_a_log_with_a_map(log, tmp_path):
    arrow = pytest.importorskip("pyarrow")
    (tmp_path / "map.toml").write_text(
        '[time]\nchannel = "t"\nunit = "s"\n[speed]\nchannel = "n"\nunit = "rpm"\n[torque]\nchannel = "m"\n'
        'unit = "N m"\n[temperature]\nchannel = "oil"\nunit = "degC"\n'
    )
    frame = frame_of(log)
    names = dict(zip(frame.columns, ("t", "n", "m", "oil"), strict=True))
    read = ramsight.read_log(arrow.table(frame.rename(columns=names)), tmp_path / "map.toml")
    np.testing.assert_allclose(read["motor_torque"].values, log["motor_torque"].values)
    np.testing.assert_allclose(read["motor_speed"].values, log["motor_speed"].values, atol=1e-9)


CHEAP = (
    "AsBuilt", "DriveResponse", "LivePlant", "LiveWeighing", "LiveWeighing.step", "Duty", "Profile", "build",
    "casadi_model", "catalogue", "lift_lower",
    "named_faults", "check_shared", "Duty.repeated", "Duty.commanded", "Profile()", "Sensor.step", "Sensor.start",
    "Study.required", "Study.datasheet", "AsBuilt.apply",
)  # fmt: skip


def test_odd_arguments_are_refused_in_one_line_or_have_a_meaning(script, monkeypatch, tmp_path):
    """A few of what `make fuzz` tries of every function."""
    monkeypatch.chdir(tmp_path)
    odd_arguments = script("odd_arguments", "fuzz")
    tried, odd = odd_arguments.prepare(tmp_path), odd_arguments.odd_values()
    functions = {name for name in ramsight.__all__ if inspect.isfunction(getattr(ramsight, name))}
    assert functions <= set(tried), "a new function is tried, too"
    random, counts = np.random.default_rng(68), Counter()
    for name in CHEAP:
        for argument in tried[name].names:
            for kind in random.choice(list(odd), size=4, replace=False):
                found, text = odd_arguments.outcome(tried[name], argument, odd[kind])
                assert found != "crashed", f"{name}({argument}={kind}): {text}"
                counts[found] += 1
    assert counts["refused"] > 5 * counts["read"]


@pytest.mark.parametrize(
    "error",
    [
        ramsight.DescriptionError("is out of range", key="bore", value=3, allowed="1 to 2"),
        ramsight.UnknownNameError("unit", "bom", ["boom"]),
        ramsight.LogError("is no log", file="x.csv", line=3),
        ramsight.MissingColumnError(file="x.csv", missing=["time_s"], found=["t"]),
        ramsight.MissingPackageError("ask for an extra"),
        ramsight.OutputError("cannot be written"),
    ],
)
def test_an_error_of_another_process_is_the_same(error):
    error.others = (ramsight.OutputError("another"),)
    other = pickle.loads(pickle.dumps(error))
    assert type(other) is type(error)
    assert str(other) == str(error)
    assert {**vars(other), "others": ()} == {**vars(error), "others": ()}


def test_the_function_of_a_plant_is_copied_and_goes_to_other_processes(boom):
    model = ramsight.casadi_model(boom)
    for other in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        assert other.parameters == model.parameters
        point = {"x": model.x0(load=1e5), "u": [50.0, 1e5], "slope": 0, "p": model.p0}
        assert float(ca.norm_inf(other(**point)["dx"] - model(**point)["dx"])) == 0.0


def test_a_title_is_escaped_in_a_drawing_and_a_formula_that_is_none_is_refused(log, boom):
    for title in ("\x1b[2J", "a\0b", "\udc80", "<&>"):
        assert xml.dom.minidom.parseString(ramsight.draw("press", title=title))
    track = ramsight.track(boom, log, start="120 mm")
    with pytest.raises(ramsight.DescriptionError, match=r"title.*formula"):
        ramsight.plot(track, title=r"$\bad$")
    assert ramsight.plot(track, title=r"$\Delta p$ of a \udc80")


def test_correlations_and_sensors_of_a_study_are_refused_at_once():
    for wrong in ({"leakage-displacement": "x"}, {"leakage-displacement": 2}, {"a": 0.5}):
        with pytest.raises(RamsightError, match="correlations"):
            ramsight.Study("press", correlations=wrong)
    with pytest.raises(ramsight.UnknownNameError, match="kalman"):
        ramsight.Study("press", sensor="kalmann")


def test_a_log_without_a_piece_is_no_log(boom):
    for nothing in ([], {}):
        with pytest.raises(ramsight.DescriptionError, match="no samples"):
            ramsight.track(boom, nothing, start="120 mm")


def test_an_export_names_what_it_cannot_use(tmp_path):
    for wrong in ({"compiler": "nowhere"}, {"compiler": "a\0b"}, {"fmi": Decimal("sNaN")}, {"fmi": 4}):
        (name,) = wrong
        for export, out in ((ramsight.export_fmu, "x.fmu"), (ramsight.export_ssp, "x.ssp")):
            with pytest.raises(ramsight.DescriptionError, match=f"^{name} = "):
                export("press", out=tmp_path / out, **wrong)
    assert not list(tmp_path.iterdir())
