"""Logs as loggers, spreadsheets and scripts write them: inspect lists them, and its proposal reads them."""

import importlib
import re

import numpy as np
import pytest

from ramsight.errors import DescriptionError, LogError, UnknownNameError
from ramsight.logs import open_log, read_log
from ramsight.logs.channel_map import load_map
from ramsight.logs.clock_going import SinceFirst
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text
from ramsight.logs.stamps import stamp_seconds

from .log_bench import HEADER, pdo_map, roles, written

N = 300
TIME = np.arange(N) * 0.01
SPEED = np.round(1500.0 * np.sin(TIME), 1)


def rows(row, comma=False):
    """Rows by a template of time, hundredths, seconds, milliseconds since 1970, a clock over midnight, and speed."""
    lines = [
        row.format(t=k / 100, k=k, s=k // 100, h=k % 100, n=SPEED[k], ms=1763700000000 + 10 * k,
                   day="23:59:59" if k < 100 else f"00:00:0{k // 100 - 1}")
        for k in range(N)
    ]  # fmt: skip
    return "".join(lines).replace(".", ",") if comma else "".join(lines)


HEAD = "speed_rpm,torque_nm,oil_temp_c\n"
FORMS = {
    "ISO date and time": f"timestamp,{HEAD}" + rows("2025-11-21T06:30:0{s}.{h:02d}Z,{n},12.5,40.1\n"),
    "date and time with an offset": f"Date/Time,{HEAD}" + rows("2025-11-21 06:30:0{s}.{h:02d}+02:00,{n},12.5,40.1\n"),
    "German columns of date and time": "Datum;Uhrzeit;n_ist [1/min];M_ist [Nm];T_Öl [°C]\n"
    + rows("21|11|2025;06:30:0{s}.{h:02d};{n};12.5;40.1\n", comma=True).replace("|", "."),
    "minutes and seconds": f"Time,{HEAD}" + rows("59:5{s}.{h:02d},{n},12.5,40.1\n"),
    "over midnight": f"Time,{HEAD}" + rows("{day}.{h:02d},{n},12.5,40.1\n"),
    "French": "Temps (s);Vitesse (tr/min);Couple (N·m);Température huile (°C)\n"
    + rows("{t:.2f};{n};12.5;40.1\n", comma=True),
    "decimal commas in quotes": '"time_s","speed_rpm","torque_nm","oil_temp_c"\n'
    + rows('"{t:.2f}";"{n}";"12.5";"40.1"\n', comma=True).replace(";", ","),
    "three rows of header": "time,n_act,M_act,oil_temp\ns,1/min,Nm,°C\nclock,drive,drive,tank\n"
    + rows("{t:.2f},{n},12.5,40.1\n"),
    "index of pandas": f",time_s,{HEAD}" + rows("{k},{t:.2f},{n},12.5,40.1\n"),
    "no number in some cells": "time_s,speed_rpm,torque_nm,oil_temp_c,state\n"
    + rows("{t:.2f},{n},12.5,40.1,N/A\n").replace("40.1,N/A", "N/A,N/A", 5),
    "separator at the end of rows": "time_s;speed_rpm;torque_nm;oil_temp_c\n" + rows("{t:.2f};{n};12.5;40.1;\n"),
    "header of NumPy": f"# time_s,{HEAD}" + rows("{t:.2f},{n},12.5,40.1\n"),
    "epoch in ms": f"time,{HEAD}" + rows("{ms},{n},12.5,40.1\n"),
    "epoch in ns": f"time,{HEAD}" + rows("{ms}000000,{n},12.5,40.1\n"),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_what_inspect_proposes_reads_the_log(tmp_path, form):
    (tmp_path / "log.csv").write_text(FORMS[form])
    (tmp_path / "map.toml").write_text(map_text(inspect_log(tmp_path / "log.csv")))
    log = read_log(tmp_path / "log.csv", tmp_path / "map.toml")
    np.testing.assert_allclose(log.time - log.time[0], TIME, atol=1e-6)
    np.testing.assert_allclose(log.motor_speed, SPEED * 2 * np.pi / 60, atol=1e-9)
    assert log.motor_torque.values.tolist() == [12.5] * N
    known = log.oil_temperature.values[np.isfinite(log.oil_temperature.values)]
    np.testing.assert_allclose(known, 313.25)
    assert len(known) == (N - 5 if form == "no number in some cells" else N)


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ("time_s,a\n0,1\n1,x\n", r"a: text: is not a number: 'x' \(line 3\)"),
        ('time_s,a\n0,"1,234.5"\n', r"a: text: .*thousands separators are not read.* \(line 2\)"),
        ("time_s,a,a\n0,1,2\n", r"a: not read: its name is there more than once"),
        ("time_s,a\n" + "0,1\n" * 500 + "1,ERR\n", r"a: not read: line 502, column a: is not a number: 'ERR'"),
        ("time_s,a\n0,2025-11-21\n", r"a: date or time: not the clock \(line 2\)"),
        ("just some text\nand more of it\n", r"just some text: text: is not a number: 'and more of it' \(line 2\)"),
    ],
)
def test_inspect_lists_what_it_cannot_read_with_line_and_reason(tmp_path, text, note):
    (tmp_path / "log.csv").write_text(text)
    found = inspect_log(tmp_path / "log.csv")
    assert any(re.fullmatch(note, f"{one.name}: {one.note}") for one in found.channels)


def test_a_table_without_a_clock_is_listed(tmp_path):
    (tmp_path / "log.csv").write_text("a,b\n" + "1,2\n" * 10)
    found = inspect_log(tmp_path / "log.csv")
    assert [(one.name, one.samples) for one in found.channels] == [("a", 10), ("b", 10)]
    assert found.clock.timed.columns == ()
    assert 'time = { channel = "", unit = "s" }  # not found' in map_text(found)


def test_a_clock_that_is_no_time_says_which_line(tmp_path):
    (tmp_path / "log.csv").write_text("Time,n,M\n00:00:01,1,2\n25 o'clock,1,2\n")
    written(tmp_path, roles('channel = "n", unit = "rpm"', 'channel = "M", unit = "N m"', time="Time"))
    with pytest.raises(LogError, match=r"line 3, column Time: is no date or time of day: '25 o'clock'"):
        list(open_log(tmp_path / "log.csv", tmp_path / "map.toml"))


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("1970-01-01T00:00:00Z", 0.0), ("1970-01-01T02:00:00.5+02:00", 0.5), ("02.01.1970 00:00", 86400.0),
        ("1970/01/02", 86400.0), ("01/13/1970 0:00:01", 12 * 86400.0 + 1.0), ("12:00:00 AM", 0.0),
        ("01:02:03,25", 3723.25), ("62:03", 3723.0),
    ],
)  # fmt: skip
def test_dates_and_times_of_day(text, seconds):
    assert stamp_seconds(text) == seconds


@pytest.mark.parametrize("text", ["12", "1:2:3:4", "2025-13-13 00:00", "40.1", "tomorrow"])
def test_what_is_no_date_is_refused(text):
    with pytest.raises(ValueError, match=r".*"):
        stamp_seconds(text)


def test_midnight_between_blocks_is_one_day():
    since = SinceFirst()
    assert since(np.array([86398.0, 86399.0])).tolist() == [0.0, 1.0]
    assert since(np.array([0.0, np.nan, 1.0]))[[0, 2]].tolist() == [2.0, 3.0]


FRAME = [
    ("CAN_DataFrame.BusChannel", "<u1"), ("CAN_DataFrame.ID", "<u4"), ("CAN_DataFrame.IDE", "<u1"),
    ("CAN_DataFrame.DLC", "<u1"), ("CAN_DataFrame.DataLength", "<u1"), ("CAN_DataFrame.DataBytes", "(8,)u1"),
]  # fmt: skip


def test_bus_logging_in_an_mdf_file_is_read_by_a_map_of_frames(tmp_path):
    asammdf = importlib.import_module("asammdf")
    frames = np.zeros(N, dtype=FRAME)
    frames["CAN_DataFrame.BusChannel"], frames["CAN_DataFrame.ID"] = 1, 0x181
    frames["CAN_DataFrame.DLC"] = frames["CAN_DataFrame.DataLength"] = 8
    content = np.zeros((N, 2), dtype="<i4")
    content[:, 0], content[:, 1] = np.round(SPEED), 800
    frames["CAN_DataFrame.DataBytes"] = content.view(np.uint8)
    source = asammdf.Source(
        "CAN", "CAN", "", source_type=asammdf.Source.SOURCE_BUS, bus_type=asammdf.Source.BUS_TYPE_CAN
    )
    with asammdf.MDF(version="4.10") as mdf:
        mdf.append(asammdf.Signal(name="CAN_DataFrame", samples=frames, timestamps=TIME + 5.0, source=source))
        mdf.save(tmp_path / "bus.mf4", overwrite=True, compression=2)
    assert inspect_log(tmp_path / "bus.mf4").frames == {0x181: (N, 8)}
    log = read_log(tmp_path / "bus.mf4", written(tmp_path, pdo_map()))
    np.testing.assert_allclose(log.time, TIME, atol=1e-9)
    np.testing.assert_allclose(log.motor_speed, np.round(SPEED) * 2 * np.pi / 60)
    assert log.motor_torque.values.tolist() == [8.0] * N
    with pytest.raises(LogError, match="CAN frames"):
        read_log(tmp_path / "bus.mf4")


@pytest.mark.parametrize(
    ("line", "said"),
    [("first_row = 3", "first_row = 3: is no line under the header"), ('decimal = ";"', "decimal = ';': is not known")],
)
def test_the_layout_of_a_map_is_checked(tmp_path, line, said):
    with pytest.raises(DescriptionError, match=said):
        load_map(written(tmp_path, f"{roles()}[csv]\nheader_line = 3\n{line}\n"))


def test_a_clock_that_the_table_does_not_have_is_named(tmp_path):
    file = written(tmp_path, f"{HEADER}\n0.0,1,2,40\n", "log.csv")
    with pytest.raises(UnknownNameError, match="tim%_s"):
        read_log(file, written(tmp_path, roles("motor_speed_rpm", "motor_torque_nm", time="tim%_s")))
