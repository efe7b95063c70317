"""Sensor files: what is saved comes back, and nothing else is taken for a sensor."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ramsight import cli, machine
from ramsight.calibration.sensor_file import SensorFileError, load, save, table_hash
from ramsight.calibration.sensors import sensor_for
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.table import MovementTable, table

COLD_TO_HOT = np.array([293.15, 313.15])


@pytest.fixture(scope="module")
def movement():
    lift, lower = np.linspace(1.0, 80.0, 5), np.linspace(-2.0, 60.0, 4)
    return MovementTable(
        "boom",
        157.0,
        COLD_TO_HOT,
        lift,
        np.linspace(1.3e-4, 1.1e-4, 10).reshape(2, 5),
        lower,
        np.linspace(1.3e-4, 1.5e-4, 8).reshape(2, 4),
        1.0,
        relief_torque=79.0,
    )


@pytest.fixture
def file(movement, tmp_path):
    path = tmp_path / "boom.sensor"
    save(movement, path)
    return path


def rewritten(file, change):
    """The file with its members changed by ``change(name, data)``."""
    with zipfile.ZipFile(file) as packed:
        members = {name: packed.read(name) for name in packed.namelist()}
    with zipfile.ZipFile(file, "w") as packed:
        for name, data in members.items():
            new = change(name, data)
            if new is not None:
                packed.writestr(name, new)
    return file


def test_what_is_saved_comes_back(movement, file):
    again = load(file)
    assert table_hash(again) == table_hash(movement)
    for name in ("temperature", "lift_torque", "lift", "lower_torque", "lower"):
        assert np.array_equal(getattr(again, name), getattr(movement, name))
    assert (again.unit, again.motor_speed, again.lift_sign, again.relief_torque) == ("boom", 157.0, 1.0, 79.0)


def test_a_table_whose_relief_valve_never_opened_comes_back(movement, tmp_path):
    save(replace(movement, relief_torque=float("inf")), tmp_path / "boom.sensor")
    assert load(tmp_path / "boom.sensor").relief_torque == float("inf")


def test_the_same_sensor_gives_the_same_bytes(movement, file, tmp_path):
    save(movement, tmp_path / "again.sensor")
    assert (tmp_path / "again.sensor").read_bytes() == file.read_bytes()


@pytest.mark.parametrize(
    "change",
    [
        lambda name, data: None if name == "lift.npy" else data,
        lambda name, data: None if name == "sensor.toml" else data,
        lambda name, data: data.replace(b"format = 1", b"format = true"),
        lambda name, data: data.replace(b"format = 1", b"format = 2"),
        lambda name, data: data.replace(b'kind = "table"', b'kind = "oracle"'),
        lambda name, data: data.replace(b"157.0", b"158.0"),
        lambda name, data: data.replace(b"157.0", b"nan"),
        lambda name, data: data[:-8] if name == "lower.npy" else data,
        lambda name, data: b"" if name == "sensor.toml" else data,
        lambda name, data: data.replace(b"format", b"\xff\xfe") if name == "sensor.toml" else data,
    ],
)
def test_a_file_that_was_tampered_with_or_is_newer_is_refused_in_one_line(file, change):
    with pytest.raises(SensorFileError, match=r"boom\.sensor") as error:
        load(rewritten(file, change))
    assert "\n" not in str(error.value)
    is_newer = b"format = 2" in (change("sensor.toml", b"format = 1") or b"")
    assert ("format 2 was written by a newer ramsight" in str(error.value)) is is_newer


def test_pickled_objects_are_never_loaded(file):
    content = io.BytesIO()
    np.save(content, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(SensorFileError, match="damaged"):
        load(rewritten(file, lambda name, data: content.getvalue() if name == "lift.npy" else data))


@given(st.data())
def test_a_byte_that_changed_is_noticed_or_does_not_matter(movement, tmp_path_factory, data):
    path = tmp_path_factory.mktemp("flipped") / "boom.sensor"
    save(movement, path)
    whole = bytearray(path.read_bytes())
    place = data.draw(st.integers(0, len(whole) - 1))
    whole[place] ^= data.draw(st.integers(1, 255))
    path.write_bytes(whole)
    try:
        again = load(path)
    except SensorFileError:
        return
    assert table_hash(again) == table_hash(movement)


@pytest.mark.parametrize("content", [b"", b"PK", b"time_s,motor_speed_rpm\n0,1\n"])
def test_other_files_are_no_sensors(tmp_path, content):
    path = tmp_path / "boom.sensor"
    path.write_bytes(content)
    with pytest.raises(SensorFileError, match="is damaged or no sensor file"):
        load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SensorFileError, match=r"gone\.sensor: cannot be read: No such file"):
        load(tmp_path / "gone.sensor")


def test_a_sensor_of_another_unit_is_refused(file):
    bucket = build_ddh("bucket", machine.load_machine("mining-loader").unit("bucket"))
    with pytest.raises(SensorFileError, match="calibrated for unit 'boom', not for 'bucket'"):
        sensor_for(bucket, str(file))


def test_a_loaded_sensor_is_the_same_sensor(file, movement):
    boom = build_ddh("boom", machine.load_machine("mining-loader").unit("boom"))
    loaded, made = sensor_for(boom, str(file)), table(movement)
    assert np.array_equal(loaded.parameters, made.parameters)


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr("sys.argv", ["ramsight", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        cli.main()
    captured = capsys.readouterr()
    return end.value.code, captured.out, captured.err


def test_the_command_line_calibrates_and_tracks_with_the_file(trace, tmp_path, monkeypatch, capsys):
    sensor, case, figure = tmp_path / "boom.sensor", trace("boom_441kN_40C"), tmp_path / "boom.svg"
    calibrate = ["calibrate", "mining-loader", "--unit", "boom", "--out", sensor, "--figure", figure]
    code, out, err = run(monkeypatch, capsys, *calibrate)
    assert (code, err) == (0, "")
    assert "boom.sensor: written" in out
    assert out.endswith("boom.svg: written\n")
    drawn = figure.read_text()
    for words in (
        "boom: calibrated at 1500 rpm",
        "motor torque [N m]",
        "movement [mm/rev]",
        "20 °C",
        "70 °C",
        "lowering",
    ):
        assert f"<!-- {words} -->" in drawn
    track = ["track", "mining-loader", case.log, "--unit", "boom", "--start", "100 mm", "--truth", case.truth]
    code, with_file, err = run(monkeypatch, capsys, *track, "--sensor", sensor)
    assert (code, err) == (0, "")
    _, with_table, _ = run(monkeypatch, capsys, *track, "--sensor", "table")
    assert with_file == with_table


def test_the_command_line_refuses_a_damaged_sensor_in_one_line(trace, tmp_path, monkeypatch, capsys):
    bad = tmp_path / "bad.sensor"
    bad.write_bytes(b"not a sensor")
    arguments = ["track", "mining-loader", trace("boom_441kN_40C").log, "--unit", "boom", "--start", "100 mm"]
    code, _, err = run(monkeypatch, capsys, *arguments, "--sensor", bad)
    assert code == 2
    assert err.count("\n") == 1
    assert "bad.sensor: is damaged or no sensor file" in err
