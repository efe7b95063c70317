"""Tables, sheets, messages and frames that are laid out as people's tools write them: read, or the reason is said."""

import re
import warnings

import numpy as np
import pytest

from ramsight.errors import LogError, LogWarning
from ramsight.logs import read_log
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text

from . import log_bench
from .log_bench import (
    OIL,
    RPM,
    SPEED,
    TIME,
    TORQUE,
    N,
    is_the_drive,
    lines_of,
    mapped,
    parquet,
    pdo_map,
    roles,
    written,
    xlsx,
)

ROWS = list(zip(TIME.tolist(), SPEED.tolist(), TORQUE.tolist(), OIL.tolist(), strict=True))
NAMES = ("Time [s]", *log_bench.NAMES)


# ---- tables of text


def test_the_header_under_annotations_of_influxdb(tmp_path):
    head = ["#group,false,false,true,false,false,false", "#datatype,string,long,dateTime:RFC3339,double,double,double"]
    head += ["#default,_result,,,,,", ",result,table,_time,motor_speed_rpm,motor_torque_nm,oil_temp_c"]
    rows = [f",,0,2026-03-12T09:15:{at:06.3f}Z,{n},{m},{c}" for at, n, m, c in ROWS]
    log, text = mapped(tmp_path, written(tmp_path, "\n".join([*head, *rows]) + "\n", "log.csv"))
    assert "header_line = 4" in text
    is_the_drive(log)


@pytest.mark.parametrize(
    "after",
    [
        ["", "[Statistics]", "Samples: 200"], ["//END"], ["[End]"], ["", "(end of data)"], ["; checksum 77"],
        ["---- end of recording ----"],
    ],
)  # fmt: skip
def test_what_stands_below_the_table_is_left_out(tmp_path, after):
    file = written(tmp_path, "\n".join([*lines_of(), *after]) + "\n", "log.csv")
    with pytest.warns(LogWarning, match="from this line on stand no rows, a summary perhaps"):
        log, _ = mapped(tmp_path, file)
    is_the_drive(log)


@pytest.mark.parametrize("words", [("Min", "Max"), ("Minimum:", "Maximum:"), ("Mittelwert", "Faktor")])
def test_rows_of_a_summary_above_the_samples_are_none(tmp_path, words):
    header, *rows = lines_of(";")
    above = [f"{words[0]};-1500;11;40", f"{words[1]};1500;13;40"]
    log, text = mapped(tmp_path, written(tmp_path, "\n".join([header, *above, *rows]) + "\n", "log.csv"))
    assert "first_row = 4" in text
    is_the_drive(log)


def test_a_blank_line_between_header_and_rows(tmp_path):
    header, *rows = lines_of()
    log, _ = mapped(tmp_path, written(tmp_path, "\n".join([header, "", *rows]) + "\n", "log.csv"))
    is_the_drive(log)


def test_an_oscilloscope_that_numbers_its_channels(tmp_path):
    _, *rows = lines_of()
    file = written(tmp_path, "\n".join(["x-axis,1,2,3", "second,rpm,N m,degC", *rows]) + "\n", "log.csv")
    found = inspect_log(file)
    assert [(one.name, one.unit, one.samples) for one in found.channels] == [
        ("1", "rpm", N), ("2", "N m", N), ("3", "degC", N)
    ]  # fmt: skip
    assert found.clock.timed.channel == "x-axis"


@pytest.mark.parametrize("name", ["log.csv", "log.parquet"])
@pytest.mark.parametrize("is_mixed", [True, False])
def test_series_one_below_the_other_are_refused_with_the_reason(tmp_path, name, is_mixed):
    rows = [(series, at, row[place]) for place, series in enumerate(("speed", "torque"), 1) for at, *row in
            ((one[0], *one) for one in ROWS)]  # fmt: skip
    rows = sorted(rows, key=lambda row: row[1]) if is_mixed else rows
    if name == "log.csv":
        text = "\n".join(["Series;Time;Value", *(f"{series};{at};{value}" for series, at, value in rows)])
        written(tmp_path, text + "\n", name)
    else:
        parquet(tmp_path / name, dict(zip(("Series", "Time", "Value"), zip(*rows, strict=True), strict=True)))
    words = r"there is a row for each value of a series \(speed, torque\), one below the other: write a column for each"
    with pytest.warns(LogWarning, match=words):
        inspect_log(tmp_path / name)
    mapping = roles('channel = "Value", unit = "rpm"', 'channel = "Value", unit = "N m"', time="Time")
    with pytest.raises(LogError, match=words):
        read_log(tmp_path / name, written(tmp_path, mapping))


def test_a_text_that_changes_beside_columns_is_no_series(tmp_path):
    rows = [f"{','.join(map(str, row))},{'rest' if k < 50 else 'work'}" for k, row in enumerate(ROWS)]
    log, _ = mapped(tmp_path, written(tmp_path, "\n".join([",".join([*NAMES, "Signal"]), *rows]) + "\n", "log.csv"))
    is_the_drive(log)


@pytest.mark.parametrize("changing", ["speed", "torque"])
def test_what_is_logged_on_change_holds_and_the_other_is_the_clock(tmp_path, changing):
    steps = {"speed": np.round(SPEED / 400.0) * 400.0, "torque": np.round(TORQUE * 2.0) / 2.0}
    held = {"speed": SPEED, "torque": TORQUE} | {changing: steps[changing]}
    news = np.concatenate([[True], np.diff(held[changing]) != 0.0])
    rows = []
    for k, at in enumerate(TIME.tolist()):
        cells = {name: str(one[k]) if name != changing or news[k] else "" for name, one in held.items()}
        rows.append(f"{at},{cells['speed']},{cells['torque']},{40.0 if k == 0 else ''}")
    log, text = mapped(tmp_path, written(tmp_path, "\n".join([",".join(NAMES), *rows]) + "\n", "log.csv"))
    other = "torque" if changing == "speed" else "speed"
    assert f'base = "{other}"  # the other comes seldom, or when it changes' in text
    assert len(log.time) == N
    np.testing.assert_allclose(log.motor_speed.values / RPM, held["speed"])
    np.testing.assert_allclose(log.motor_torque.values, held["torque"])
    assert np.isfinite(log.oil_temperature.values).all()


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("Geschwindigkeits-Istwert [min-1]", "speed"), ("MAIN.fbDrive.fActVelo", "speed"),
        ("Velocidad real [rpm]", "speed"), ("Drehmoment-Istwert [Nm]", "torque"), ("effort", "torque"),
    ],
)  # fmt: skip
def test_names_of_drives_are_proposed(tmp_path, name, role):
    header = ",".join(["t", name, "other"])
    found = inspect_log(written(tmp_path, header + "\n0.0,1,2\n0.02,1,2\n", "log.csv"))
    assert [one.role for one in found.channels] == [role, ""]


# ---- Excel


def changed(path, old, new):
    """A book whose first sheet has one text in the place of another."""
    import zipfile

    with zipfile.ZipFile(path) as source:
        parts = {name: source.read(name) for name in source.namelist()}
    sheet = "xl/worksheets/sheet1.xml"
    assert re.search(old, parts[sheet])
    parts[sheet] = re.sub(old, new, parts[sheet])
    with zipfile.ZipFile(path, "w") as target:
        for name, data in parts.items():
            target.writestr(name, data)


def test_a_sheet_that_states_too_small_a_size_is_read_whole(tmp_path):
    file = xlsx(tmp_path / "log.xlsx", [NAMES, *ROWS])
    changed(file, rb'<dimension ref="[^"]*"', b'<dimension ref="A1:C60"')
    log, _ = mapped(tmp_path, file)
    is_the_drive(log)


def test_a_column_under_a_merged_header_has_the_name_of_its_place(tmp_path):
    rows = [("Time", "Drive", None, "Oil"), ("s", "rpm", "Nm", "degC"), *ROWS]
    file = xlsx(tmp_path / "log.xlsx", rows, merged=["B1:C1"])
    names = [(one.name, one.unit, one.samples) for one in inspect_log(file).channels]
    assert names == [("Drive", "rpm", N), ("column 3", "Nm", N), ("Oil", "degC", N)]
    is_the_drive(read_log(file, written(tmp_path, roles("Drive", "column 3", "Oil", time="Time"))))


def test_formulas_without_a_stored_value_are_said(tmp_path):
    file = xlsx(tmp_path / "log.xlsx", [NAMES, *((at, f"=10*{n}", m, c) for at, n, m, c in ROWS)])
    with pytest.warns(LogWarning, match=f"{N} formulas have no stored value, and are read as empty cells: open"):
        inspect_log(file)


# ---- messages


def joint_states(path):
    """Messages of ROS 2's kind of a joint, arriving in bursts, stamped when they were measured."""
    messages = []
    for first in range(0, N, 50):
        fields = (("/torque", "effort", TORQUE), ("/speed", "velocity", SPEED * RPM), ("/oil", "temperature", OIL))
        for topic, field, values in fields:
            for number in range(first, first + 50):
                stamp = {"sec": 1_773_000_000 + int(TIME[number]), "nanosec": round(TIME[number] % 1.0 * 1e9)}
                value = float(values[number])
                content = {"header": {"stamp": stamp}, field: value if field == "temperature" else [value, 0.0]}
                messages.append((topic, 0.02 * (first + 50), content))
    return log_bench.mcap(path, messages, b'{"properties": {}}', name="sensor_msgs/msg/JointState")


def test_numbers_of_lists_are_channels_and_stamps_in_messages_are_times(tmp_path):
    file = joint_states(tmp_path / "log.mcap")
    units = {one.name: one.unit for one in inspect_log(file).channels}
    assert (units["velocity[0]"], units["effort[0]"]) == ("rad/s", "N m")
    oil = 'channel = "temperature", unit = "degC"'
    mapping = roles("velocity[0]", "effort[0]", oil, time="header.stamp")
    is_the_drive(read_log(file, written(tmp_path, mapping)))


# ---- frames


def test_a_length_code_of_can_fd_is_a_number_of_bytes(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    fields = [
        ("CAN_DataFrame.BusChannel", "<u1"), ("CAN_DataFrame.ID", "<u4"), ("CAN_DataFrame.DLC", "<u1"),
        ("CAN_DataFrame.DataBytes", "(64,)u1"),
    ]  # fmt: skip
    frames = np.zeros(3, dtype=fields)
    frames["CAN_DataFrame.ID"], frames["CAN_DataFrame.DLC"] = 0x181, [15, 9, 8]
    mdf = asammdf.MDF(version="4.10")
    mdf.append(
        asammdf.Signal(
            samples=frames, timestamps=np.arange(3.0), name="CAN_DataFrame",
            source=asammdf.Source("CAN1", "CAN1", "", 2, 2), comment="",
        )
    )  # fmt: skip
    mdf.save(tmp_path / "log.mf4", overwrite=True)
    mdf.close()
    from ramsight.logs.source_mdf import mdf_frames

    assert [len(frame.data) for frame in mdf_frames(tmp_path / "log.mf4")] == [64, 12, 8]


DBC = """VERSION ""

BO_ 2364473073 Drive: 8 Unit
 SG_ Speed : 0|16@1- (1,0) [0|0] "rpm" X
 SG_ Torque : 16|16@1- (0.1,0) [0|0] "Nm" X

BA_DEF_  "ProtocolType" STRING ;
BA_DEF_DEF_  "ProtocolType" "";
BA_ "ProtocolType" "J1939";
"""


def j1939(folder, to):
    """Frames of one sender to one or two others, and the map of them."""
    pytest.importorskip("cantools")
    lines = []
    for k, at in enumerate(TIME):
        for place, goal in enumerate(to):
            values = int(SPEED[k]) * (1 - 2 * place), round(10.0 * TORQUE[k])
            data = b"".join(int(value).to_bytes(2, "little", signed=True) for value in values).hex().upper()
            lines.append(f"({1000.0 + at + 1e-3 * place:.6f}) can0 0CEF{goal:02X}31#{data}FFFFFFFF")
    written(folder, DBC.replace("2364473073", str((1 << 31) | 0x0CEF2131)), "drive.dbc")
    text = roles("Drive.Speed", "Drive.Torque") + '[can]\ndbc = "drive.dbc"\nj1939 = true\n'
    return written(folder, "\n".join(lines) + "\n", "log.log"), text


def test_two_destinations_of_one_sender_are_no_channel(tmp_path):
    file, text = j1939(tmp_path, (0x21, 0x22))
    with pytest.raises(
        LogError, match=r"J1939 group EF0000h goes to the addresses 21h, 22h: \[can\] destination = 0x21"
    ):
        read_log(file, written(tmp_path, text))
    log = read_log(file, written(tmp_path, text + "destination = 0x21\n"))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED.astype(int))
    with pytest.warns(LogWarning, match="goes to the addresses"):
        found = map_text(inspect_log(file, dbc=[tmp_path / "drive.dbc"]))
    assert "# destination = 0x21  # needed: frames go to 0x21, 0x22" in found
    one, text = j1939(tmp_path, (0x21,))
    assert len(read_log(one, written(tmp_path, text)).time) == N


def test_identifiers_of_29_bits_are_not_taken_for_11_without_a_word(tmp_path):
    lines = [f"({1000.0 + at:.6f}) can0 00000181#{int(n) & 0xFFFF:04X}0000" for at, n in zip(TIME, SPEED, strict=True)]
    mapping = pdo_map(objects=("606Ch INT16", "6077h"))
    with pytest.warns(LogWarning, match="frames 181h have identifiers of 29 bits here, and 11 in the map"):
        read_log(written(tmp_path, "\n".join(lines) + "\n", "log.log"), written(tmp_path, mapping))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_log(
            written(tmp_path, "\n".join(lines).replace("00000181", "181") + "\n", "log.log"), tmp_path / "map.toml"
        )
