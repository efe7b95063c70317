"""What two units of one machine say of their common oil and voltage: each fault is named, and none without one."""

import math
from pathlib import Path

import numpy as np
import pytest
import xarray
from typer.testing import CliRunner

import ramsight
from ramsight.cli.verbs import app
from ramsight.errors import DescriptionError, LogError, MissingColumnError
from ramsight.output import write_table
from ramsight.sensor.checks.disagreement import sure
from ramsight.tracking.sharing import OIL, SHARED, VOLTAGE, Agreement, Allowed

PAGE = (Path(__file__).parents[1] / "docs" / "reference" / "detectors.md").read_text(encoding="utf-8")
H, LASTS = 0.02, 600.0


def machine(seed=0, *, oil=0.0, voltage=1.0):
    """Two drives on one battery for ten minutes, within what is usual; and what is wrong with the second one."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, LASTS, H)
    count = len(time)

    def noise(size):
        return size * random.standard_normal(count)

    speeds = [150.0 * np.sin(2.0 * np.pi * time / period) for period in (23.0, 31.0)]
    torques = [40.0 + 10.0 * np.sin(2.0 * np.pi * time / 17.0), np.full(count, 25.0)]
    powers = [speed * torque + 200.0 for speed, torque in zip(speeds, torques, strict=True)]
    link = 96.0 - 0.4e-3 * sum(powers)
    temperature = 300.0 + 20.0 * time / LASTS
    drives = []
    for k in range(2):
        wrong = k == 1
        drives.append(xarray.Dataset({
            "oil_temperature": ("time", temperature + 1.5 * k + (oil if wrong else 0.0) + noise(0.2)),
            "dc_voltage": ("time", link * (voltage if wrong else 1.0) * (1.0 + 0.007 * k) + noise(0.3)),
            "dc_power": ("time", powers[k] + noise(30.0)),
        }, coords={"time": time}))  # fmt: skip
    return tuple(drives)


def said(seed=0, **wrong):
    return ramsight.check_shared(*machine(seed, **wrong))


@pytest.mark.parametrize("seed", range(3))
def test_two_healthy_drives_agree(seed):
    found = said(seed)
    assert found.alerts == []
    assert [one.name for one in found.looked_at] == ["oil_temperature", "dc_voltage"]
    for one in SHARED:
        reach = np.abs(found.checks[f"{one.name}_apart"]) / found.checks[f"{one.name}_allowed"]
        assert float(reach[10:].max()) < 0.7
    assert found.text.count("agrees") == 2


def test_offsets_and_gains_as_they_are_declared_raise_nothing():
    """Five hours of thirty machines."""
    for seed in range(30):
        oil, voltage = np.random.default_rng([seed, 9]).standard_normal(2)
        drawn = {"oil": OIL.allowed.offset * oil - 1.5, "voltage": (1.0 + VOLTAGE.allowed.gain * voltage) / 1.007}
        assert said(seed, **drawn).alerts == []


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("oil_temperature", {"oil": 20.0}), ("oil_temperature", {"oil": -20.0}), ("dc_voltage", {"voltage": 1.15})],
)
def test_what_is_wrong_is_named_and_nothing_else(name, wrong):
    found = said(1, **wrong)
    assert {what for *_, what in found.alerts} == {name}
    begins, ends, _ = found.alerts[0]
    assert 0.0 <= begins <= ends <= LASTS
    assert f"{name} contradicts" in found.text


def test_the_threshold_leaves_one_false_alarm_in_a_thousand_hours():
    """Noise that is as declared, and an offset as large as is declared once, stays inside; k is the Gaussian's."""
    assert math.erfc(sure(1.0) / math.sqrt(2.0)) == pytest.approx(1.0 / 3.6e6, rel=1e-6)
    assert math.erfc(sure(60.0) / math.sqrt(2.0)) == pytest.approx(60.0 / 3.6e6, rel=1e-6)
    time = np.arange(0.0, 1000.0, H)
    for shared in SHARED:
        allowed = Allowed(noise=1.0)
        noise = np.random.default_rng(3).standard_normal(len(time))
        apart, may, alarm = Agreement(shared, allowed).replay(np.column_stack([time, noise, np.zeros(len(time))])).T
        late = time > 5.0 * shared.memory
        # A level that is all noise is unseen between samples, too: half a sample of each of its steps.
        assert 0.5 / math.sqrt(2.0) < np.std(apart[late] / may[late]) * sure(shared.memory) < 1.2
        assert not alarm.any()


@pytest.mark.parametrize(("offset", "alarms"), [(0.9, False), (1.1, True)])
def test_what_lasts_is_allowed_up_to_the_threshold(offset, alarms):
    time = np.arange(0.0, 60.0, H)
    shift = offset * sure(VOLTAGE.memory) * 2.0
    rows = np.column_stack([time, np.full(len(time), 90.0 + shift), np.full(len(time), 90.0)])
    assert Agreement(VOLTAGE, Allowed(noise=0.0, offset=2.0)).replay(rows)[-1, 2] == alarms


def test_an_alarm_is_over_when_both_agree_again():
    first, second = machine(4)
    there = (second["time"] > 100.0) & (second["time"] < 200.0)
    found = ramsight.check_shared(first, second.assign(dc_voltage=second["dc_voltage"] + 30.0 * there))
    ((begins, ends, name),) = found.alerts
    assert name == "dc_voltage"
    assert 100.0 < begins < 101.5
    assert 200.0 < ends < 205.0


@pytest.mark.parametrize(
    ("name", "column", "leap", "least", "most"),
    [
        ("oil_temperature", "oil_temperature", lambda value: value + 20.0, 45.0, 55.0),
        ("dc_voltage", "dc_voltage", lambda value: 1.1 * value, 0.8, 1.3),
    ],
)
def test_a_leap_is_found_as_soon_as_the_page_says(name, column, leap, least, most):
    first, second = machine(9)
    late = second["time"] > 200.0
    leapt = second.assign({column: leap(second[column]).where(late, second[column])})
    begins, _, what = ramsight.check_shared(first, leapt).alerts[0]
    assert what == name
    assert least < begins - 200.0 < most


def test_a_thermometer_that_is_missing_is_the_other_units():
    first, second = machine(5)
    gone = (first["time"] > 50.0) & (first["time"] < 80.0)
    found = ramsight.check_shared(first.assign(oil_temperature=first["oil_temperature"].where(~gone)), second)
    at = gone.values
    np.testing.assert_array_equal(found.first["oil_temperature"].values[at], second["oil_temperature"].values[at])
    np.testing.assert_array_equal(found.first["oil_temperature"].values[~at], first["oil_temperature"].values[~at])
    assert found.alerts == []
    none = ramsight.check_shared(first.drop_vars("oil_temperature"), second)
    np.testing.assert_array_equal(none.first["oil_temperature"], second["oil_temperature"])
    assert "oil_temperature (both thermometers): not in both" in none.text


def test_step_by_step_it_says_what_it_says_of_a_log():
    first, second = machine(6, voltage=1.1)
    rows = np.column_stack([first["time"], first["dc_voltage"], second["dc_voltage"]])[:500]
    rows[100:120, 1] = np.nan
    live = Agreement(VOLTAGE)
    np.testing.assert_array_equal([live.step(*row) for row in rows], Agreement(VOLTAGE).replay(rows)[:, 2] > 0.0)


def test_what_one_does_not_say_counts_for_nothing():
    time = np.arange(0.0, 30.0, H)
    rows = np.column_stack([time, np.full(len(time), 97.0), np.full(len(time), 96.0)])
    rows[500:, 2] = np.nan
    apart, may, _ = Agreement(VOLTAGE).replay(rows).T
    forgotten = math.exp(-H / VOLTAGE.memory)
    np.testing.assert_allclose(apart[500:], apart[499] * forgotten ** np.arange(1, len(time) - 499), rtol=1e-9)
    assert np.all(np.diff(may[500:]) < 0.0)


def test_logs_on_other_times_are_compared_at_the_firsts():
    first, second = machine(7)
    found = ramsight.check_shared(first, second.isel(time=slice(1000, None, 3)))
    assert found.alerts == []
    assert len(found.checks["time"]) == len(first["time"])


def test_what_cannot_be_compared_is_refused():
    first, second = machine(8)
    with pytest.raises(LogError, match="nothing that the first log has"):
        ramsight.check_shared(first[["dc_power"]], second)
    with pytest.raises(LogError, match="no oil_temperature at the times"):
        ramsight.check_shared(first, second.assign_coords(time=second["time"] + 1e6))
    with pytest.raises(MissingColumnError):
        ramsight.check_shared(first, second.drop_vars("time"))
    with pytest.raises(DescriptionError, match="allowed"):
        ramsight.check_shared(first, second, allowed={"oil": Allowed(1.0)})


def test_the_voltage_of_a_log_is_there_to_be_compared(tmp_path):
    text = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c,dc_voltage_v,dc_current_a\n"
    (tmp_path / "log.csv").write_text(text + "".join(f"{0.02 * k},0,0,40,96,{k}\n" for k in range(100)))
    log = ramsight.read_log(tmp_path / "log.csv")
    assert log["dc_voltage"].attrs["units"] == "V"
    np.testing.assert_allclose(log["dc_power"], 96.0 * np.arange(100))
    assert [one.name for one in ramsight.check_shared(log, log).looked_at] == ["oil_temperature", "dc_voltage"]


def written(path, log):
    """A log as the verb reads it, with voltage and current of the link."""
    count = len(log["time"])
    write_table({
        "time_s": log["time"].values, "motor_speed_rpm": np.zeros(count), "motor_torque_nm": np.zeros(count),
        "oil_temperature_c": log["oil_temperature"].values - 273.15, "dc_voltage_v": log["dc_voltage"].values,
        "dc_current_a": (log["dc_power"] / log["dc_voltage"]).values,
    }, path)  # fmt: skip


def test_the_verb_says_what_the_function_says(tmp_path):
    first, second = (one.isel(time=slice(0, 3000)) for one in machine(10, voltage=1.15))
    written(tmp_path / "boom.csv", first)
    written(tmp_path / "bucket.csv", second)
    verb = ["logs", "shared", str(tmp_path / "boom.csv"), str(tmp_path / "bucket.csv")]
    done = CliRunner().invoke(app, verb)
    assert done.exit_code == 0, done.output
    assert done.output.strip() == ramsight.check_shared(first, second).text
    assert "dc_voltage (both DC links): contradicts" in done.output
    assert "oil_temperature (both thermometers): agrees" in done.output
