"""Logs of every kind, written by the libraries of their formats, read into the same drive log."""

import gzip
import importlib
import json
import math
import re
import warnings
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

import ramsight
from ramsight.cli import app
from ramsight.errors import LogError, LogWarning, OutputError, RamsightError
from ramsight.logs import load_map, mdf_file, open_log, read_log, write_log
from ramsight.logs.can_field import Field, big_endian, little_endian
from ramsight.logs.channels import FURTHER, PRESSURES, READINGS
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text
from ramsight.output import open_dataset, write_dataset
from ramsight.output.cells import Coded, decimals_of
from ramsight.output.table_file import open_table, write_table
from ramsight.sensor.status import Status

from . import log_bench
from .log_bench import RPM, parquet, roles, written

DBC = Path(__file__).parent / "can" / "drive.dbc"
N = 200
TIME = np.arange(N) * 0.01
SPEED = np.round(1500.0 * np.sin(TIME * 3.0))
TORQUE = np.round(16.0 * (12.5 + np.cos(TIME * 5.0))) / 16.0
TEMPERATURE = np.round(40.0 + TIME)
MAP = roles("MotorSpeed", "MotorTorque", "OilTemperature")


def same(log, time=TIME, speed=SPEED, torque=TORQUE, temperature=TEMPERATURE, atol=1e-9):
    np.testing.assert_allclose(log.time, time, atol=atol)
    np.testing.assert_allclose(log.motor_speed, speed * RPM, atol=atol)
    np.testing.assert_allclose(log.motor_torque, torque, atol=atol)
    np.testing.assert_allclose(log.oil_temperature, temperature + 273.15, atol=atol)


def test_a_german_csv_with_preamble_units_and_another_alphabet(tmp_path):
    rows = zip(TIME * 1e3, SPEED, -TORQUE / 0.35, TEMPERATURE, strict=True)
    lines = ["Messung 7;Bühler", "", "Zeit;n_ist;M_ist;T_Öl;Bemerkung", "[ms];[1/min];[%];[°C];"]
    lines += [f"{t:.0f};{n:.1f};{m:.9f};{c:.1f};ok".replace(".", ",") for t, n, m, c in rows]
    data = "\r\n".join(lines).encode("cp1252")
    (tmp_path / "tag.csv.gz").write_bytes(gzip.compress(data))
    found = inspect_log(tmp_path / "tag.csv.gz")
    text = map_text(found)
    assert "header_line = 3" in text
    assert 'encoding = "cp1252"' in text
    assert (found.clock.timed.channel, found.clock.timed.unit) == ("Zeit", "ms")
    roles = {one.role: (one.name, one.unit, one.samples) for one in found.channels if one.role}
    assert roles == {
        "speed": ("n_ist", "1/min", N), "torque": ("M_ist", "%", N), "temperature": ("T_Öl", "°C", N)
    }  # fmt: skip
    with pytest.raises(RamsightError, match="rated"):  # nobody knows what 100 % is
        read_log(tmp_path / "tag.csv.gz", written(tmp_path, text))
    text = text.replace("# rated =", "rated =").replace("sign = 1", "sign = -1", 2).replace("sign = -1", "sign = 1", 1)
    same(read_log(tmp_path / "tag.csv.gz", written(tmp_path, text)))


@pytest.mark.parametrize(
    ("column", "unit"),
    [("torque_pct", "percent"), ("Moment_Proz", "percent"), ("torque_permille", "permille"), ("6077h", "permille"),
     ("drive.0x6077", "permille"), ("Torque actual value 6077h", "permille")],
)  # fmt: skip
def test_a_torque_that_is_a_share_is_proposed_as_one_and_asks_what_of(column, unit, tmp_path):
    file = written(
        tmp_path, f"time_s,motor_speed_rpm,{column},oil_temp_c\n0,100,12.5,40\n0.02,100,-12.5,40\n", "log.csv"
    )
    text = map_text(inspect_log(file))
    assert f'channel = "{column}"\nunit = "{unit}"\n# rated = "35 N m"  # needed: what 100 % is: object 6076h' in text
    assert "scale * number + offset" in text
    log = read_log(file, written(tmp_path, text.replace("# rated =", "rated =")))
    share = 0.01 if unit == "percent" else 0.001
    np.testing.assert_allclose(log.motor_torque, [12.5 * share * 35.0, -12.5 * share * 35.0])


def test_a_torque_without_a_unit_may_be_a_share(tmp_path):
    file = written(tmp_path, "time_s,motor_speed_rpm,M_ist,oil_temp_c\n0,100,12.5,40\n0.02,100,-12.5,40\n", "log.csv")
    assert '# rated = "35 N m"  # what 100 % is, if the unit is percent' in map_text(inspect_log(file))


def test_a_column_with_its_own_rate_holds_its_value(tmp_path):
    text = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n0,100,,40\n1,,5,\n2,200,,\n3,,6,\n60,,7,\n"
    file = written(tmp_path, text, "log.csv")
    raw = read_log(file)
    assert np.isnan(raw.motor_speed).sum() == 3
    found = inspect_log(file)
    assert 'empty = "no sample"' in map_text(found)
    text = map_text(found).replace('base = "speed"', 'base = "torque"').replace("sign = 1", 'sign = 1\nhold = "2 s"')
    sparse = read_log(file, written(tmp_path, re.sub(r"hold = .*# it comes.*", "", text)))
    assert sparse.time.values.tolist() == [1.0, 3.0, 60.0]
    np.testing.assert_allclose(sparse.motor_speed / RPM, [100, 200, np.nan])  # 58 s is too long to hold
    np.testing.assert_allclose(sparse.oil_temperature, [313.15, np.nan, np.nan])


def test_a_log_with_faults_is_passed_on(tmp_path):
    text = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c,reference_m\n0,1,2,40,\n,nan,,3276.7,0.1\n"
    text += "0.02,inf,3, ,nan\n0.02,4,-1e999,40,\n0,5,6,40,\n"
    log = read_log(written(tmp_path, text, "log.csv"))
    np.testing.assert_array_equal(log.time, [0, np.nan, 0.02, 0.02, 0])
    np.testing.assert_allclose(log.motor_speed / RPM, [1, np.nan, np.nan, 4, 5])
    np.testing.assert_array_equal(log.motor_torque, [2, np.nan, 3, np.nan, 6])
    np.testing.assert_array_equal(log.reference, [np.nan, 0.1, np.nan, np.nan, np.nan])
    with pytest.raises(LogError, match=r"column time: is missing in sample 2"):
        read_log(tmp_path / "log.csv", strict=True)
    back = "time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c\n1,0,0,40\n0,0,0,40\n"
    with pytest.raises(LogError, match=r"time goes backwards in sample 2: 0.0 after 1.0"):
        read_log(written(tmp_path, back, "log.csv"), strict=True)
    write_log(log, tmp_path / "again.csv")
    xarray.testing.assert_allclose(read_log(tmp_path / "again.csv"), log)


@pytest.mark.parametrize("kind", ["timestamp", "duration", "float"])
def test_parquet_by_its_own_library(tmp_path, kind):
    pa = importlib.import_module("pyarrow")
    ticks = np.round(TIME * 1e6).astype(np.int64)
    clock = {
        "timestamp": pa.array(ticks + 1_700_000_000_000_000, pa.timestamp("us", tz="UTC")),
        "duration": pa.array(ticks, pa.duration("us")),
        "float": pa.array(TIME * 1e3),
    }[kind]
    torque = pa.array([None if k == 3 else v for k, v in enumerate(TORQUE)])
    columns = {"Time": clock, "speed": pa.array(SPEED.astype(np.int32)), "torque_nm": torque, "oil_temp": TEMPERATURE}
    parquet(tmp_path / "log.parquet", {**columns, "note": ["x"] * N}, row_group_size=64)
    unit = "ms" if kind == "float" else "s"
    oil, time = 'channel = "oil_temp", unit = "degC"', f'channel = "Time", unit = "{unit}"'
    text = roles('channel = "speed", unit = "rpm"', "torque_nm", oil, time=time)
    log = read_log(tmp_path / "log.parquet", written(tmp_path, text))
    same(log, torque=np.where(np.arange(N) == 3, np.nan, TORQUE))
    found = inspect_log(tmp_path / "log.parquet")
    assert {one.name: one.note for one in found.channels}["note"] == "text"
    assert found.of("torque").missing == 1
    with pytest.raises(LogError, match="column note: holds string"):
        read_log(tmp_path / "log.parquet", written(tmp_path, text.replace("oil_temp", "note")))


def mf4(path):
    fast, slow = np.arange(2 * N) * 0.005, TIME + 0.001
    groups = (
        (fast, np.repeat(SPEED, 2).astype(np.int16), np.zeros(2 * N)),
        (slow, TORQUE, np.zeros(N)),
        ([0.0, 1.0], [40.0, 41.0]),
    )
    names = ("MotorSpeed", "Counter", "MotorTorque", "Counter", "OilTemperature")
    return log_bench.mf4(path, *groups, names=names, units=("1/min", "", "Nm", "", "°C"))


def test_mf4_with_groups_of_different_rates(tmp_path):
    mf4(tmp_path / "log.mf4")
    found = inspect_log(tmp_path / "log.mf4")
    rates = {one.name: round(one.rate) for one in found.channels}
    assert rates == {"MotorSpeed": 200, "0/Counter": 200, "MotorTorque": 100, "1/Counter": 100, "OilTemperature": 1}
    text = map_text(found)
    assert 'base = "torque"' in text
    log = read_log(tmp_path / "log.mf4", written(tmp_path, text))
    same(log, time=TIME + 0.001, temperature=np.where(TIME + 0.001 >= 1.0, 41.0, 40.0))
    for size in (1, 7, 64):
        pieces = list(open_log(tmp_path / "log.mf4", tmp_path / "map.toml", samples=size))
        xarray.testing.assert_identical(xarray.concat(pieces, "time"), log)


def frames(dbc_database):
    can = importlib.import_module("can")
    for k in range(N):
        slow = {"Page": 1, "OilTemperature": TEMPERATURE[k], "TopSwitch": int(k >= 100)}
        heat = [int(TEMPERATURE[k]) + 40 if k != 50 else 0xFF, *[0xFF] * 7]
        drive = {"MotorSpeed": SPEED[k], "MotorTorque": TORQUE[k], "TorqueTarget": 0.0}
        sent = [(385, dbc_database.encode_message("DriveState", drive))]
        if k % 10 == 0:
            pages = ({"Page": 2, "BusVoltage": 48.5}, slow)
            sent += [(641, dbc_database.encode_message("DriveSlow", page)) for page in pages] + [(J1939_ID, heat)]
        for key, data in sent:
            yield can.Message(timestamp=1_700_000_000.0 + TIME[k], arbitration_id=key, data=data, channel=0,
                              is_extended_id=key > 0x7FF)  # fmt: skip


J1939_ID = (2566874366 & 0x1FFFFFFF & ~0xFF) | 0x33  # from another address than the DBC file's


@pytest.mark.parametrize("name", ["log.blf", "log.asc", "log.log", "log.asc.gz", "log.log.gz"])
def test_can_frames_by_a_dbc_file(tmp_path, name):
    can, cantools = importlib.import_module("can"), importlib.import_module("cantools")
    database = cantools.database.load_file(DBC)
    with can.Logger(str(tmp_path / name)) as logger:
        for message in frames(database):
            logger.on_message_received(message)
    text = MAP + f"[can]\ndbc = '{DBC}'\n[[reference]]\nchannel = 'TopSwitch'\nposition = '790 mm'\n"
    log = read_log(tmp_path / name, written(tmp_path, text))
    # the temperature comes after the first torque, so the first sample is without; and holds for ten samples
    held = TEMPERATURE[(np.arange(1, N) - 1) // 10 * 10]
    same(log, TIME[1:], SPEED[1:], TORQUE[1:], held, atol=2e-5)
    assert np.flatnonzero(np.isfinite(log.reference)).tolist() == [100]  # the sample after 101st, which came before it
    assert log.reference.values[100] == 0.79
    heat = text.replace('"OilTemperature"', '"HydraulicFluid.HydraulicOilTemperature"')
    again = read_log(tmp_path / name, written(tmp_path, heat))
    assert np.isnan(again.oil_temperature.values[50:60]).all()  # "not available"
    assert np.isnan(again.oil_temperature).sum() == 10
    pieces = list(open_log(tmp_path / name, tmp_path / "map.toml", samples=33))
    xarray.testing.assert_identical(xarray.concat(pieces, "time"), again)


def test_canopen_frames_by_their_mapping(tmp_path):
    can, canopen = importlib.import_module("can"), importlib.import_module("canopen")
    od = canopen.ObjectDictionary()
    for index, sub, kind in ((0x606C, 0, 4), (0x6077, 0, 3), (0x4602, 12, 3), (0x2010, 1, 3)):
        variable = canopen.objectdictionary.ODVariable(f"{index:X}", index, sub)
        variable.data_type, added = kind, variable
        if sub:
            added = canopen.objectdictionary.ODRecord(f"record {index:X}", index)
            added.add_member(variable)
        od.add_object(added)
    node = canopen.LocalNode(1, od)
    first, second = canopen.pdo.PdoMap(node.tpdo, None, None), canopen.pdo.PdoMap(node.tpdo, None, None)
    first.add_variable(0x606C, 0), first.add_variable(0x6077, 0)
    second.add_variable(0x4602, 12), second.add_variable(0x2010, 1)
    with can.BLFWriter(tmp_path / "log.blf") as logger:
        for k in range(N):
            first[0].raw, first[1].raw = int(SPEED[k]), round(TORQUE[k] / 35.0 * 1000.0)
            second[0].raw, second[1].raw = round(16.0 * TORQUE[k]), round(10.0 * TEMPERATURE[k])
            for cob_id, pdo in ((0x281, second), (0x181, first)):
                logger.on_message_received(
                    can.Message(timestamp=TIME[k], arbitration_id=cob_id, data=bytes(pdo.data), is_extended_id=False)
                )
    oil = 'channel = "2010h:01h", unit = "degC", scale = 0.1'
    text = roles("606Ch", 'channel = "6077h", rated = "35000 mN m"', oil)
    for cob_id, objects in ((0x181, ["606Ch", "6077h"]), (0x281, ["4602h:0Ch", "2010h:01 INT16"])):
        text += f"[[can.pdo]]\ncob_id = {cob_id}\nobjects = {json.dumps(objects)}\n"
    log = read_log(tmp_path / "log.blf", written(tmp_path, text))
    same(log, torque=np.round(TORQUE / 35.0 * 1000.0) * 0.035, atol=1e-6)
    text = 'align = { base = "speed" }\n' + text.replace('"6077h", rated = "35000 mN m"', '"4602h:0Ch"')
    same(read_log(tmp_path / "log.blf", written(tmp_path, text)), atol=1e-6)
    shown = inspect_log(tmp_path / "log.blf")
    assert shown.frames == {0x181: (N, 6), 0x281: (N, 4)}
    assert "# cob_id = 0x181" in map_text(shown)
    with pytest.raises(RamsightError, match="its type has to be said"):
        read_log(tmp_path / "log.blf", written(tmp_path, text.replace(" INT16", "")))


@given(
    data=st.binary(min_size=8, max_size=8), start=st.integers(0, 63), length=st.integers(1, 64), signed=st.booleans()
)
def test_fields_are_what_cantools_makes_of_them(data, start, length, signed):
    cantools = importlib.import_module("cantools")
    frame = np.frombuffer(data, dtype=np.uint8)[None, :]
    for order, place in (("little_endian", little_endian), ("big_endian", big_endian)):
        bits = place(start, length)
        if max(bits) > 63 or len(set(bits)) < length:
            continue
        signal = cantools.database.can.Signal("s", start, length, byte_order=order, is_signed=signed)
        message = cantools.database.can.Message(1, "m", 8, [signal])
        assert int(Field("s", bits, signed).raw(frame)[0]) == message.decode(data)["s"]


def test_a_missing_package_names_its_extra(tmp_path, monkeypatch):
    def absent(name, *rest):
        raise ImportError(name)

    for name in ("log.parquet", "log.mf4", "log.mcap"):
        (tmp_path / name).write_bytes(b"x")
    monkeypatch.setattr(importlib, "import_module", absent)
    monkeypatch.setattr(mdf_file, "find_spec", lambda name: None)
    for name, package in (("log.parquet", "pyarrow"), ("log.mf4", "asammdf"), ("log.mcap", "mcap")):
        with pytest.raises(LogError, match=rf'needs the package {package}: pip install "ramsight\[logs\]"'):
            read_log(tmp_path / name)
    with pytest.raises(OutputError, match=r'"ramsight\[logs\]"'):
        write_table({"time_s": [0.0]}, tmp_path / "new.parquet")
    assert not (tmp_path / "new.parquet").exists()


@pytest.mark.parametrize("name", ["log.parquet", "log.mf4", "log.mcap", "log.blf", "log.asc", "log.log", "log.xyz"])
@pytest.mark.parametrize("data", [b"", b"rubbish\n" * 50, bytes(range(256)) * 8])
def test_rubbish_of_every_kind_gets_one_line(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    text = MAP + (f"[can]\ndbc = '{DBC}'\n" if name.endswith(("blf", "asc", "log")) else "")
    with pytest.raises(RamsightError) as caught:
        read_log(tmp_path / name, written(tmp_path, text))
    assert str(caught.value).splitlines() == [str(caught.value)]
    assert name in str(caught.value)


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet", ".mf4", ".mcap"])
def test_a_drive_log_goes_out_and_comes_back_in_every_format(trace, tmp_path, suffix):
    log = read_log(trace("boom_441kN_40C").log)
    further = {one.name: one for one in FURTHER if one not in PRESSURES}
    for k, name in enumerate(further):
        log[name] = further[name].to_si(20.0 + k + 0.1 * log["motor_torque"])
    for name in ("reference", *(one.name for one in READINGS)):
        log[name] = log.motor_speed * np.nan
        log[name][5] = 0.1
    write_log(log, tmp_path / f"log{suffix}")
    again = read_log(tmp_path / f"log{suffix}")
    assert set(again) == set(log)
    xarray.testing.assert_allclose(again.drop_vars(list(further)), log.drop_vars(list(further)), rtol=1e-12)
    for name, one in further.items():
        np.testing.assert_allclose(again[name], log[name], rtol=1e-9, atol=1e-9 if one.units == "rad" else 1e-6)
        assert again[name].attrs["units"] == one.units
    if suffix == ".csv":
        header, first = (line.split(",") for line in (tmp_path / "log.csv").read_text().splitlines()[:2])
        cells = dict(zip(header, first, strict=True))
        assert float(cells["motor_temperature_c"]) == pytest.approx(float(log["motor_temperature"][0]) - 273.15)
        for name in ("shaft_angle", "link_angle"):
            assert float(cells[f"{name}_deg"]) == pytest.approx(math.degrees(float(log[name][0])))
        assert float(cells["dc_power_w"]) == pytest.approx(float(log["dc_power"][0]))


@pytest.mark.parametrize(
    ("keys", "cell", "expected"),
    [
        ('unit = "deg"', {"shaft_angle": 920.0}, math.radians(920.0)),
        ('unit = "kW"', {"dc_power": 2.5}, 2500.0),
        ('unit = "deg", sign = -1, offset = 5.0', {"link_angle": 20.0}, math.radians(-25.0)),
        ('unit = "degC"', {"motor_temperature": 85.0}, 358.15),
        ('unit = "bar"', {"pressure_a": 200.0}, 200e5),
    ],
)
def test_a_map_names_what_is_measured_beside_the_drive(tmp_path, keys, cell, expected):
    ((name, value),) = cell.items()
    file = written(tmp_path, "t,n,M,T,x\n" + "".join(f"{0.02 * k},1500,12.5,40,{value}\n" for k in range(3)), "log.csv")
    more = {"time": 'channel = "t", unit = "s"', name: f'channel = "x", {keys}'}
    units = (("n", "rpm"), ("M", "N m"), ("T", "degC"))
    log = read_log(file, written(tmp_path, roles(*(f'channel = "{one}", unit = "{of}"' for one, of in units), **more)))
    assert log[name].values == pytest.approx([expected] * 3)


@given(
    values=st.lists(st.floats(-1e12, 1e12) | st.just(math.nan), min_size=1, max_size=20),
    unit=st.sampled_from(["m", "mm", "pa"]),
)
def test_fast_digits_are_those_of_the_format(tmp_path_factory, values, unit):
    name, file = f"x_{unit}", tmp_path_factory.mktemp("digits") / "x.csv"
    write_table({name: np.array(values)}, file)
    decimals = decimals_of(name)
    rounded = np.round(np.array(values), decimals) + 0.0
    assert file.read_text().splitlines()[1:] == ["" if math.isnan(v) else f"{v:.{decimals}f}" for v in rounded]


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mf4", ".mcap"])
def test_pieces_of_a_table_are_the_table(tmp_path, suffix):
    status = Coded(np.array([0, 17, 36] * 40), {0: "ok", 17: "uncertain: gap", 36: "invalid: speed, torque"})
    columns = {"time_s": np.arange(120) * 0.01, "position_m": np.sqrt(np.arange(120.0)), "status": status}
    columns["position_m"][7] = np.nan
    with open_table(tmp_path / f"pieces{suffix}", units={"position_m": "m"}) as table:
        for first in range(0, 120, 50):
            rows = slice(first, first + 50)
            table.append({n: Coded(c.codes[rows], c.words) if n == "status" else c[rows] for n, c in columns.items()})
    if suffix == ".csv":
        write_table(columns, tmp_path / "whole.csv")
        assert (tmp_path / "pieces.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
        assert (tmp_path / "pieces.csv").read_text().splitlines()[3] == '0.020000,1.414214,"invalid: speed, torque"'
    elif suffix == ".parquet":
        table = importlib.import_module("pyarrow.parquet").read_table(tmp_path / "pieces.parquet")
        assert table.schema.field("position_m").metadata == {b"unit": b"m"}
        assert table["status"].to_pylist()[:3] == ["ok", "uncertain: gap", "invalid: speed, torque"]
        assert table["position_m"].null_count == 1
        np.testing.assert_allclose(table["position_m"].to_numpy(), columns["position_m"])
    elif suffix == ".mcap":
        topics = mcap_messages(tmp_path / "pieces.mcap")
        assert topics["/status"][0]["properties"]["status"]["enum"] == list(status.words.values())
        schema, times, messages = topics["/position"]
        assert schema["properties"]["position_m"] == {"type": "number", "unit": "m", "description": "in m"}
        np.testing.assert_allclose(np.array(times) / 1e9, columns["time_s"])
        assert messages[7] == {}
        assert [one["position_m"] for k, one in enumerate(messages) if k != 7] == [
            value for k, value in enumerate(columns["position_m"]) if k != 7
        ]
        words = [one["status"] for one in topics["/status"][2]]
        assert words[:3] == ["ok", "uncertain: gap", "invalid: speed, torque"]
    else:
        with importlib.import_module("asammdf").MDF(tmp_path / "pieces.mf4") as mdf:
            found = mdf.get("status")
            np.testing.assert_allclose(found.timestamps, columns["time_s"])
            assert found.samples[:3].tolist() == [b"ok", b"uncertain: gap", b"invalid: speed, torque"]
            assert mdf.get("position_m").unit == "m"
            np.testing.assert_allclose(mdf.get("position_m").samples, columns["position_m"])
            assert mdf.header.start_time == datetime(1970, 1, 1, tzinfo=UTC)


def mcap_messages(path):
    """Schema, times [ns] and contents of the messages of each topic, as the library's own reader has them."""
    found = {}
    with open(path, "rb") as file:
        for schema, channel, message in importlib.import_module("mcap.reader").make_reader(file).iter_messages():
            _, times, contents = found.setdefault(channel.topic, (json.loads(schema.data), [], []))
            times.append(message.log_time)
            contents.append(json.loads(message.data))
    return found


def test_a_track_as_mcap_has_all_that_the_sensor_says(tmp_path, trace):
    log = read_log(trace("boom_441kN_40C").log)
    write_log(log, tmp_path / "log.mcap")
    verb = ["track", "mining-loader", str(tmp_path / "log.mcap"), "--unit", "boom", "--start", "100 mm"]
    done = CliRunner().invoke(app, [*verb, "--out", str(tmp_path / "track.mcap")])
    assert done.exit_code == 0, done.output
    topics = mcap_messages(tmp_path / "track.mcap")
    assert {"/position", "/velocity", "/load", "/status", "/factors"} <= set(topics)
    track = ramsight.track("mining-loader", log, "100 mm", unit="boom")
    _, times, messages = topics["/position"]
    np.testing.assert_allclose(np.array(times) / 1e9, track["time"].values)
    np.testing.assert_allclose([one["position_m"] for one in messages], track["position"].values, rtol=1e-9)
    assert {one["status"] for one in topics["/status"][2]} <= {status.text for status in Status}


def test_mcap_counts_from_zero(tmp_path):
    with pytest.raises(OutputError, match=r"new\.mcap: a sample at -1 s; MCAP counts from 0 s on"):
        write_table({"time_s": [0.0, -1.0]}, tmp_path / "new.mcap")
    assert list(tmp_path.iterdir()) == []


def test_an_mcap_file_that_breaks_off_is_read_up_to_there(tmp_path, trace):
    log = read_log(trace("boom_441kN_40C").log)
    fields = {"n": {"type": "number", "unit": "rad/s"}, "M": {"type": "integer", "unit": "N m"}}
    messages = [
        ("/drive", 1.7e9 + time, {"n": speed} if k == 3 else {"n": speed, "M": 7, "note": "x"})
        for k, (time, speed) in enumerate(zip(log["time"].values, log["motor_speed"].values, strict=True))
    ]
    path = log_bench.mcap(tmp_path / "log.mcap", messages, {"properties": fields}, chunk_size=4096)
    channel_map = written(tmp_path, roles("n", "M"))
    whole = read_log(path, channel_map)
    np.testing.assert_allclose(whole["motor_speed"].values, log["motor_speed"].values)
    assert np.flatnonzero(np.isnan(whole["motor_torque"].values)).tolist() == [3]
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.warns(LogWarning, match="breaks off"):
        part = read_log(path, channel_map)
    assert 100 < part.sizes["time"] < whole.sizes["time"]
    np.testing.assert_allclose(part["motor_speed"].values, whole["motor_speed"].values[: part.sizes["time"]])
    said = []
    rng = np.random.default_rng(3)
    for _ in range(40):
        bad = bytearray(data)
        for place in rng.integers(0, len(data), 8):
            bad[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(bad)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", LogWarning)
            try:
                read_log(path, channel_map)
            except RamsightError as error:
                said.append(str(error))
    assert len(said) > 30
    assert {len(text.splitlines()) for text in said} == {1}


def test_netcdf_in_pieces_is_netcdf_at_once(tmp_path):
    position, status = np.sqrt(np.arange(50.0)), np.arange(50, dtype=np.int16)
    variables = {"position": ("time", position, {"units": "m"}), "status": ("time", status)}
    time = ("time", np.arange(50) * 0.02, {"units": "s"})
    track = xarray.Dataset(variables, {"time": time}, {"format": 1, "sensor": "balance"})
    write_dataset(track, tmp_path / "whole.nc")
    with open_dataset(tmp_path / "pieces.nc") as writer:
        for first in range(0, 50, 20):
            writer.append(track.isel(time=slice(first, first + 20)))
    with xarray.open_dataset(tmp_path / "whole.nc") as whole, xarray.open_dataset(tmp_path / "pieces.nc") as pieces:
        xarray.testing.assert_identical(pieces.load(), whole.load())


def test_a_map_says_what_it_was_told(tmp_path):
    mf4(tmp_path / "log.mf4")
    text = map_text(inspect_log(tmp_path / "log.mf4"))
    again = map_text(inspect_log(tmp_path / "log.mf4", load_map(written(tmp_path, text))))
    assert again == text


@pytest.mark.parametrize(("sign", "wanted"), [(1, 40.0), (-1, -40.0)])
def test_a_maps_scale_offset_and_sign_are_taken_in_this_order(tmp_path, sign, wanted):
    written(tmp_path, "time_s,n,m,t\n0,100,10,130\n0.01,100,10,130\n", "day.csv")
    text = roles(
        'channel = "n", unit = "rpm", scale = 2.0, offset = 5.0', 'channel = "m", unit = "N m", offset = -2.5',
        f'channel = "t", unit = "degC", scale = 0.5, offset = -25.0, sign = {sign}', time="time_s",
    )  # fmt: skip
    log = read_log(tmp_path / "day.csv", written(tmp_path, text))
    np.testing.assert_allclose(log.motor_speed, 205.0 * RPM)
    np.testing.assert_allclose(log.motor_torque, 7.5)
    np.testing.assert_allclose(log.oil_temperature, wanted + 273.15)
