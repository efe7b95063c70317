"""The user's path with logs of other kinds: look in, save the map, track. Run as commands."""

import gzip
import importlib
from pathlib import Path

import numpy as np
import pytest
import xarray

from ramsight.calibration.sensors import sensor_for
from ramsight.errors import LogError
from ramsight.logs import open_log, read_log, write_log
from ramsight.logs.inspect import inspect_log
from ramsight.tracking.pieces import track_pieces

from .command import as_command, at_once, refused
from .log_bench import pdo_map, roles, written

DBC = Path(__file__).parent / "can" / "drive.dbc"


def track(log, *more, cwd):
    options = ("--unit", "boom", "--start", "100 mm", "--sensor", "balance")
    return at_once("track", "mining-loader", log, *options, *more, cwd=cwd)


@pytest.fixture(scope="module")
def blf(trace, tmp_path_factory):
    """The recorded log as a drive's CAN frames."""
    can, cantools = importlib.import_module("can"), importlib.import_module("cantools")
    folder, database = tmp_path_factory.mktemp("blf"), cantools.database.load_file(DBC)
    log = read_log(trace("boom_258kN_40C").log)
    speed, torque = log.motor_speed.values * 60 / (2 * np.pi), log.motor_torque.values
    with can.BLFWriter(folder / "day.blf") as logger:
        for k, time in enumerate(log.time.values):
            slow = {"Page": 1, "OilTemperature": round(float(log.oil_temperature[k]) - 273.15), "TopSwitch": 0}
            state = {"MotorSpeed": speed[k], "MotorTorque": torque[k], "TorqueTarget": 0.0}
            sent = [(641, "DriveSlow", slow)] if k % 50 == 0 else []
            for number, name, values in [*sent, (385, "DriveState", state)]:
                data = database.encode_message(name, values)
                logger.on_message_received(
                    can.Message(timestamp=1.7e9 + time, arbitration_id=number, data=data, is_extended_id=False)
                )
    return folder / "day.blf"


@pytest.mark.slow
def test_a_can_log_is_looked_into_mapped_and_tracked(blf, trace, tmp_path):
    shown = at_once("logs", "inspect", blf, cwd=tmp_path)
    assert "0x181" in shown.stdout
    assert 'dbc = "drive.dbc"' in shown.stdout
    done = as_command("logs", "inspect", blf, "--dbc", DBC, "--out", "map.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    row = next(line for line in done.stdout.splitlines() if "MotorSpeed" in line)
    assert row.split()[:5] == ["DriveState.MotorSpeed", "rpm", "1376", "50", "Hz"]
    assert row.split()[-1] == "speed"
    assert "map.toml: written" in done.stdout
    done = track(
        blf, "--map", "map.toml", "--out", "track.parquet", "--truth", trace("boom_258kN_40C").truth, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split("largest ")[1].split(" mm")[0]) < 0.5
    table = importlib.import_module("pyarrow.parquet").read_table(tmp_path / "track.parquet")
    assert table.column_names == ["time_s", "position_m", "position_std_m", "status"], "this sensor has no bound"
    refused(track(blf, cwd=tmp_path), "day.blf", "channel map", "ramsight logs inspect")


@pytest.mark.parametrize("suffix", [".parquet", ".mf4", ".nc"])
def test_the_track_is_the_same_from_and_into_every_format(trace, boom, tmp_path, suffix):
    log = read_log(trace("boom_258kN_40C").log)
    source = tmp_path / f"log{suffix if suffix != '.nc' else '.csv.gz'}"
    write_log(log, source)
    sensor = sensor_for(boom, "balance")
    sensor.start(0.1)
    expected = sensor.track(log).position.values
    sensor.start(0.1)
    track_pieces(sensor, open_log(source, samples=500), tmp_path / f"track{suffix}")
    if suffix == ".nc":
        with xarray.open_dataset(tmp_path / "track.nc") as track:
            found, attributes = track.position.values, track.position.attrs
        assert attributes["units"] == "m"
    elif suffix == ".parquet":
        table = importlib.import_module("pyarrow.parquet").read_table(tmp_path / "track.parquet")
        found = table["position_m"].to_numpy()
    else:
        with importlib.import_module("asammdf").MDF(tmp_path / "track.mf4") as file:
            found = file.get("position_m").samples
            assert file.get("status").samples[0] == b"ok"
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_pieces_track_like_the_whole(trace, boom):
    sensor = sensor_for(boom, "kalman")
    sensor.start(0.1)
    whole = sensor.track(read_log(trace("boom_258kN_40C").log))
    sensor.start(0.1)
    pieces = [sensor.track(piece) for piece in open_log(trace("boom_258kN_40C").log, samples=100)]
    xarray.testing.assert_identical(xarray.concat(pieces, "time"), whole)


def test_a_log_with_faults_is_tracked_and_they_are_named(trace, tmp_path):
    with gzip.open(trace("boom_258kN_40C").log, "rt") as file:
        lines = file.read().splitlines()
    for row in range(600, 700):
        cells = lines[row].split(",")
        lines[row] = ",".join([cells[0], "", *cells[2:]])
    (tmp_path / "log.csv").write_text("\n".join(lines))
    done = at_once("track", "mining-loader", "log.csv", "--unit", "boom", "--start", "100 mm", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "missing" in done.stdout
    done = as_command("leak-test", "mining-loader", "log.csv", "--unit", "boom", cwd=tmp_path)
    refused(done, "motor_speed", "is missing in sample 600")


def test_a_wrong_map_gets_one_line_and_leaves_nothing(blf, tmp_path):
    rest = "[torque]\nchannel = 'MotorTorque'\n[temperature]\nconstant = '40 degC'\n"
    (tmp_path / "map.toml").write_text(f"[can]\ndbc = '{DBC}'\n[speed]\nchannel = 'Motorspeed'\n{rest}")
    done = track(blf, "--map", "map.toml", "--out", "t.csv", cwd=tmp_path)
    refused(done, "day.blf", "unknown channel 'Motorspeed'", "DriveState.MotorSpeed")
    assert [file.name for file in tmp_path.iterdir()] == ["map.toml"]


def test_a_map_of_another_node_is_told_from_a_log_without_samples(tmp_path):
    (tmp_path / "drive.log").write_text("(1.0) can0 185#64000000FBFF\n(1.1) can0 705#05\n")
    written(tmp_path, pdo_map(0x186, "80 N m"))
    done = at_once("track", "forklift-mast", "drive.log", "--unit", "lift", "--map", "map.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == (
        "error: drive.log: has no samples of 606Ch, 6077h: map.toml names 186h (can.pdo[0].cob_id), the log has 185h, "
        "705h; is it the drive's node-ID?\n"
    )


def test_help_teaches():
    done = at_once("logs", "inspect", "--help")
    assert done.returncode == 0
    assert "Examples: ramsight logs inspect day.mf4 --out map.toml" in " ".join(done.stdout.split())


ASC_HEADER = "date Mon Jan 1 00:00:00.000 am 2024\nbase hex  timestamps absolute\ninternal events logged\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [("log.asc", ""), ("log.asc", ASC_HEADER), ("log.log", ""), ("log.log", "# recorded\n\n"), ("log.log.gz", "\n")],
    ids=["empty ASC", "header alone", "empty candump", "comment alone", "packed line"],
)
def test_a_log_without_a_frame_is_told_from_one_without_a_map(tmp_path, name, text):
    file = written(tmp_path, text, name)
    written(tmp_path, f"{roles('MotorSpeed', 'MotorTorque')}[can]\ndbc = '{DBC}'\n")
    for read in (read_log, lambda path: read_log(path, tmp_path / "map.toml"), inspect_log):
        with pytest.raises(LogError) as caught:
            read(file)
        assert str(caught.value) == f"{file}: holds no CAN frames"
    if name == "log.asc" and text:
        refused(track(name, cwd=tmp_path), "error: log.asc: holds no CAN frames")
