"""Logs as measurement programs write them: LabVIEW, MATLAB, Excel, TwinCAT Scope and recorders of ROS 2."""

import datetime
import struct

import h5py
import numpy as np
import pytest

from ramsight.errors import LogError, LogWarning
from ramsight.logs import read_log
from ramsight.logs.inspect import inspect_log

from . import log_bench
from .log_bench import COLUMNS, NAMES, OIL, SPEED, TIME, TORQUE, N, is_the_drive, mapped, roles, tdms, written, xlsx

# ---- TDMS


BEGINS = np.datetime64("2026-11-26T06:00:00", "us")
WAVE = {"wf_increment": 0.02, "wf_start_offset": 0.0, "wf_start_time": BEGINS}


@pytest.mark.parametrize(
    ("clock", "properties"),
    [({}, WAVE), ({"Time [s]": TIME}, None), ({"Time": BEGINS + (1e6 * TIME).astype("timedelta64[us]")}, None)],
    ids=["waveforms", "times", "stamps"],
)
def test_tdms_with_a_clock(tmp_path, clock, properties):
    is_the_drive(mapped(tmp_path, tdms(tmp_path / "log.tdms", clock | COLUMNS, properties))[0])


def test_tdms_without_a_clock_says_so(tmp_path):
    file = tdms(tmp_path / "log.tdms", COLUMNS)
    assert all("has no clock" in one.note for one in inspect_log(file).channels)
    with pytest.raises(LogError, match=r"column n_ist \[1/min\]: has no clock"):
        read_log(file, written(tmp_path, roles(*NAMES)))


# ---- MATLAB


def mat(path, content, version):
    if version == 5:
        return log_bench.mat(path, content)
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            for inner, one in (value if isinstance(value, dict) else {"": value}).items():
                path_in = f"{name}/{inner}" if inner else name
                data = file.create_dataset(path_in, data=np.atleast_2d(one), chunks=True, compression=3)
                data.attrs["MATLAB_class"] = np.bytes_("double")
        text = file.create_dataset("comment", data=np.array([[72], [105]], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
    return path


@pytest.mark.parametrize("version", [5, 7.3])
@pytest.mark.parametrize("is_struct", [False, True])
def test_vectors_of_matlab(tmp_path, version, is_struct):
    content = {"t": TIME, "n_rpm": SPEED, "M_nm": TORQUE, "T_oil_c": OIL}
    file = mat(tmp_path / "log.mat", {"log": content} if is_struct else content, version)
    names = {one.name for one in inspect_log(file).channels}
    assert names == {f"log.{name}" if is_struct else name for name in ("n_rpm", "M_nm", "T_oil_c")}
    where = "log." if is_struct else ""
    is_the_drive(read_log(file, written(tmp_path, roles(f"{where}n_rpm", f"{where}M_nm", f"{where}T_oil_c"))))


def test_the_map_names_the_clock_of_a_matlab_file_and_columns_of_a_matrix(tmp_path):
    file = mat(tmp_path / "log.mat", {"x": 1e3 * TIME, "data": np.column_stack([SPEED, TORQUE, OIL])}, 5)
    keys = [f'channel = "data[{k}]", unit = "{unit}"' for k, unit in enumerate(("rpm", "N m", "degC"), 1)]
    is_the_drive(read_log(file, written(tmp_path, roles(*keys, time='channel = "x", unit = "ms"'))))


def test_a_matlab_file_without_vectors_says_what_to_write(tmp_path):
    with pytest.raises(LogError, match=r"has no vectors of numbers: .*write vectors"):
        inspect_log(mat(tmp_path / "log.mat", {"comment": "nothing"}, 5))


def test_a_part_that_is_missing_in_a_matlab_file_is_no_row_of_zeros(tmp_path):
    with h5py.File(tmp_path / "log.mat", "w", userblock_size=512) as file:
        file.create_dataset("t", data=np.atleast_2d(TIME))
        part = file.create_dataset("n_rpm", (1, N), "f8", chunks=(1, N // 2))
        part[0, : N // 2] = 1500.0
    with pytest.raises(LogError, match="parts of n_rpm are missing"):
        inspect_log(tmp_path / "log.mat")


# ---- Excel


def rows_of(first, clock):
    table = np.column_stack(list(COLUMNS.values())).tolist()
    return [[first, *COLUMNS], *([time, *row] for time, row in zip(clock, table, strict=True))]


def test_a_sheet_of_excel(tmp_path):
    file = xlsx(tmp_path / "log.xlsx", [["a test"], [], *rows_of("Time [s]", TIME.tolist())])
    is_the_drive(mapped(tmp_path, file)[0])


def test_a_sheet_with_dates_and_the_longest_of_several(tmp_path):
    begins = datetime.datetime(2026, 11, 26, 6)
    clock = [begins + datetime.timedelta(milliseconds=20 * k) for k in range(N)]
    file = xlsx(tmp_path / "log.xlsx", rows_of("Time", clock), {"notes": [["by", "somebody"]]})
    with pytest.warns(LogWarning, match="sheet 'drive' is read, not 'notes'"):
        is_the_drive(mapped(tmp_path, file)[0])


def test_a_wrong_cell_of_excel_is_named_with_its_row(tmp_path):
    rows = rows_of("Time [s]", TIME.tolist())
    rows[10][2] = "broken"
    file = xlsx(tmp_path / "log.xlsx", rows)
    with pytest.raises(LogError, match=r"log\.xlsx, line 11, column M_ist \[Nm\]: is not a number: 'broken'"):
        read_log(file, written(tmp_path, roles(*NAMES, time="Time [s]")))


def test_an_empty_sheet_is_refused(tmp_path):
    with pytest.raises(LogError, match="has no sheet with rows"):
        inspect_log(xlsx(tmp_path / "log.xlsx", []))


# ---- TwinCAT Scope


def scope(path, separator="\t", step=20.0, grouped=False, start=0.0):
    """One column of times before each channel, or one before all."""
    mark = "," if separator != "," else "."
    names, values = ["n_ist", "M_ist", "T_oil"], [SPEED, TORQUE, OIL]
    units = ["1/min", "Nm", "degC"]

    def text(number):
        return f"{number:.6f}".replace(".", mark) if not float(number).is_integer() else f"{number:.0f}"

    def line(key, cells):
        return [key, *cells] if grouped else [one for cell in cells for one in (key, cell)]

    rows = [
        ["Name", "YT Scope"], ["File", "c.svdx"], ["Starttime of export", "134087976000000000"], [""],
        line("Name", names), line("SampleTime[ms]", ["20"] * 3), line("Unit", units), [""],
    ]  # fmt: skip
    for k in range(N):
        cells = [text(one[k]) for one in values]
        rows.append(line(text(start + step * k), cells))
    path.write_text("\r\n".join(separator.join(row) for row in [*rows, ["EOF"], [""]]), encoding="latin-1")
    return path


@pytest.mark.parametrize("separator", ["\t", ";", ","])
@pytest.mark.parametrize("grouped", [False, True])
def test_an_export_of_twincat_scope(tmp_path, separator, grouped):
    is_the_drive(mapped(tmp_path, scope(tmp_path / "log.csv", separator, grouped=grouped))[0])


def test_an_export_with_full_time_stamps(tmp_path):
    file = scope(tmp_path / "log.csv", step=200000.0, start=134087976000000000.0)
    is_the_drive(mapped(tmp_path, file)[0])


def test_a_damaged_row_of_an_export_is_refused_with_its_line(tmp_path):
    file = scope(tmp_path / "log.csv")
    lines = file.read_text().splitlines()
    lines[20] = lines[20].rpartition("\t")[0] + "\tx,y"
    file.write_text("\n".join(lines))
    with pytest.raises(LogError, match="line 21: is no row of numbers"):
        inspect_log(file)


# ---- MCAP


def mcap(path, encoding, schema_encoding, schema, messages, name="drive"):
    """Messages of one topic, a billion seconds after the beginning of time."""
    stamped = [("/drive", 1e9 + time, data) for time, data in messages]
    return log_bench.mcap(path, stamped, schema, encoding, schema_encoding, name)


@pytest.mark.parametrize("name", ["demo_msgs/msg/Drive", "drive_state"])
def test_messages_of_ros_2(tmp_path, name):
    pytest.importorskip("mcap_ros2")
    schema = b"float64 motor_speed_rpm\nfloat64 motor_torque_nm\nfloat64 oil_temperature_c\nstring note\n"
    messages = [
        (t, b"\x00\x01\x00\x00" + struct.pack("<ddd", *row) + struct.pack("<I", 3) + b"ok\0")
        for t, *row in zip(TIME, SPEED, TORQUE, OIL, strict=True)
    ]
    file = mcap(tmp_path / "log.mcap", "cdr", "ros2msg", schema, messages, name)
    assert {one.name for one in inspect_log(file).channels} == {
        "motor_speed_rpm", "motor_torque_nm", "oil_temperature_c"
    }  # fmt: skip
    is_the_drive(read_log(file))


def test_messages_of_protobuf(tmp_path):
    pytest.importorskip("mcap_protobuf")
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    inner = descriptor_pb2.FileDescriptorProto(name="drive.proto", package="demo", syntax="proto3")
    kind = inner.message_type.add(name="Drive")
    for number, name in enumerate(("motor_speed_rpm", "motor_torque_nm", "oil_temperature_c"), 1):
        kind.field.add(name=name, number=number, type=1, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(inner)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.Drive"))
    schema = descriptor_pb2.FileDescriptorSet(file=[inner]).SerializeToString()
    messages = [
        (t, made(motor_speed_rpm=n, motor_torque_nm=m, oil_temperature_c=c).SerializeToString())
        for t, n, m, c in zip(TIME, SPEED, TORQUE, OIL, strict=True)
    ]
    file = mcap(tmp_path / "log.mcap", "protobuf", "protobuf", schema, messages, "demo.Drive")
    is_the_drive(read_log(file))


def test_a_damaged_message_is_refused_with_its_time(tmp_path):
    pytest.importorskip("mcap_ros2")
    schema = b"float64 motor_speed_rpm\nfloat64 motor_torque_nm\nfloat64 oil_temperature_c\n"
    messages = [(0.0, b"\x00\x01\x00\x00" + struct.pack("<ddd", 1.0, 2.0, 40.0)), (0.02, b"\x00\x01\x00\x00\x01")]
    file = mcap(tmp_path / "log.mcap", "cdr", "ros2msg", schema, messages, "demo_msgs/msg/Drive")
    with pytest.raises(LogError, match=r"column /drive: a message at 1e\+09 s"):
        read_log(file)


@pytest.mark.parametrize("end", [".tdms", ".mat", ".xlsx"])
def test_what_is_no_such_file_is_refused_in_one_line(tmp_path, end):
    pytest.importorskip({".tdms": "nptdms", ".mat": "scipy", ".xlsx": "openpyxl"}[end])
    file = tmp_path / f"log{end}"
    for content in (b"", b"nothing of the kind", bytes(2000)):
        file.write_bytes(content)
        with pytest.raises(LogError) as caught:
            inspect_log(file)
        assert str(caught.value).startswith(str(file))
        assert len(str(caught.value).splitlines()) == 1
