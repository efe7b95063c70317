"""Logs that mislead: files as people's tools write them, which were read wrongly and without a word."""

import datetime
import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

from ramsight.cli import app
from ramsight.errors import LogError, LogWarning, RamsightError
from ramsight.logs import load_map, read_log
from ramsight.logs.arrival import arrivals
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text

from .command import as_command
from .log_bench import HEADER, OIL, RPM, SPEED, TIME, TORQUE, N, lines_of, mapped, mcap, mf4, pdo_map, roles, written


def tables_of(folder, rows, head=HEADER, name="log.csv"):
    """A table of rows under a header."""
    return written(folder, "\n".join([head, *rows]) + "\n", name)


# ---- clocks that are wrong


def groups(folder, speed_time, torque_time):
    """A file with a group of its own for each channel; the oil's temperature comes seldom."""
    oil = torque_time[::25]
    return mf4(folder / "log.mf4", (speed_time, SPEED), (torque_time, TORQUE), (oil, OIL[: len(oil)]))


@pytest.mark.parametrize(
    ("places", "wrong"), [([100], 5e9), ([100], -5e9), ([100, 101, 102], 900.0), ([100, 101], -0.3), ([0], 77.0)]
)
def test_a_bad_time_stamp_of_a_group_costs_one_sample(tmp_path, places, wrong):
    time = TIME.copy() + 10.0
    time[places] = time[places] + wrong
    file = groups(tmp_path, time, TIME + 10.0)
    with pytest.warns(LogWarning, match=rf"group 0: .*sample {places[0] + 1}: ") as caught:
        log, text = mapped(tmp_path, file)
    assert "hold" not in text
    assert not [one for one in caught if "group 1" in str(one.message)]
    good = np.isfinite(log.motor_speed.values)
    assert N - len(places) - 2 <= good.sum()
    place = np.searchsorted(TIME + 10.0, log.time.values - 1e-9)
    assert np.abs(log.motor_speed.values / RPM - SPEED[place])[good].max() < 1e-6


def test_a_clock_that_goes_back_in_all_groups_is_said_and_what_follows_is_read(tmp_path):
    time = np.where(TIME < 4.0, TIME + 3600.0, TIME)
    with pytest.warns(LogWarning, match=r"time goes back once from 360\d\.\d+ s to 4"):
        log, text = mapped(tmp_path, groups(tmp_path, time, time))
    assert "hold" not in text
    assert np.isfinite(log.motor_speed.values).sum() >= N - 2
    np.testing.assert_allclose(log.motor_torque.values[-90:], TORQUE[-90:])
    np.testing.assert_allclose(log.motor_speed.values[-90:] / RPM, SPEED[-90:])


def test_groups_of_other_rates_go_back_together():
    fast = np.concatenate([np.arange(500) * 0.01 + 100.0, np.arange(500) * 0.01])
    slow = np.concatenate([np.arange(5) + 100.5, np.arange(5) + 0.5])
    found = arrivals({0: fast, 1: slow})
    assert not found[0].wild.any()
    assert (np.diff(found[0].order) >= 0).all()
    place = np.searchsorted(found[1].order, found[0].order, side="right") - 1
    known = place >= 0
    assert np.abs(fast - slow[np.maximum(place, 0)])[known & (np.arange(1000) % 500 > 60)].max() < 1.02


def test_samples_a_little_out_of_order_are_no_bad_time_stamps():
    time = TIME.copy()
    time[[50, 51]] = time[[51, 50]]
    assert not arrivals({0: time})[0].wild.any()


@pytest.mark.parametrize("jump", [1e6, -50.0])
def test_a_bad_time_stamp_in_mcap_costs_one_sample(tmp_path, jump):
    messages = []
    for number, time in enumerate(TIME + 100.0):
        stamp = time + (jump if number == 200 else 0.0)
        messages.append(("/speed", stamp, {"motor_speed_rpm": SPEED[number]}))
        messages.append(("/rest", time, {"motor_torque_nm": TORQUE[number], "oil_temperature_c": 40.0}))
    file = mcap(tmp_path / "log.mcap", messages)
    with pytest.warns(LogWarning, match=r"1 time stamp is not between .* in sample 201: "):
        log = read_log(file)
    assert np.isfinite(log.motor_speed.values).sum() >= N - 2
    np.testing.assert_allclose(log.motor_speed.values[-90:] / RPM, SPEED[-90:])


@pytest.mark.parametrize("end", [".mf4", ".csv"])
def test_a_pause_is_no_reason_to_hold_a_value_longer(tmp_path, end):
    time = np.where(TIME < 4.0, TIME, TIME + 1800.0)
    file = groups(tmp_path, time, time) if end == ".mf4" else tables_of(tmp_path, lines_of(time=time)[1:])
    _, text = mapped(tmp_path, file)
    assert "hold" not in text
    assert {round(one.rate) for one in inspect_log(file).channels if one.role in ("speed", "torque")} == {50}


def test_what_comes_seldom_is_held_for_longer(tmp_path):
    file = tables_of(tmp_path, lines_of(time=100.0 * TIME)[1:])
    assert 'hold = "10 s"  # it comes every 2 s' in map_text(inspect_log(file))


# ---- numbers


HEAD = "Zeit [s];n_ist [1/min];M_ist [Nm];T_Öl [°C]\n"


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0,00;0;1,5;40,1\n0,02;1.500;1,5;40,1\n", r"line 3, column n_ist \[1/min\]: '1\.500' beside .*decimal comma"),
        ("0;1.500;1;40\n1;1.500;1,5;40\n", r"line 2, column n_ist"),
        ("0.00;0;1.5;40.1\n0.02;-1,500;1.5;40.1\n", r"line 3, column n_ist \[1/min\]: '-1,500' beside .*decimal point"),
        ('0,00;0;1,5;40,1\n0,02;"1.500.000";1,5;40,1\n', r"line 3, column n_ist"),
    ],
)
def test_a_number_that_may_be_thousands_is_refused(tmp_path, rows, words):
    file = written(tmp_path, HEAD + rows, "log.csv")
    made = written(tmp_path, roles(temperature="T_Öl [°C]", time="Zeit [s]"))
    with pytest.raises(LogError, match=words):
        read_log(file, made)
    if "1.500;" in rows:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = inspect_log(file)
        assert found.of("speed") is None
        assert any("thousands" in one.note for one in found.channels)


@pytest.mark.parametrize(
    "rows",
    [
        "0.000;1.500;1.250;40.125\n0.020;1.500;1.250;40.125\n",
        "1,000;1,500;1,250;40,125\n1,020;1,500;1,250;40,125\n",
        "0,000;1,500;1,250;40.1\n0,020;1,500;1,250;40.1\n",
        "0,000;1500;1,25;40\n0,020;1500;1,25;40\n",
    ],
)
def test_three_digits_after_a_mark_are_no_thousands_by_themselves(tmp_path, rows):
    log, _ = mapped(tmp_path, written(tmp_path, HEAD + rows, "log.csv"))
    np.testing.assert_allclose(log.motor_torque.values, 1.25)


# ---- CAN frames


DBC = """VERSION ""
NS_ :
BS_:
BU_: Drive
BO_ {drive} DriveState: 8 Drive
 SG_ MotorSpeed : 0|16@1{sign} (1,{offset}) [0|0] "rpm" Vector__XXX
 SG_ MotorTorque : 16|16@1{sign} (0.0625,{torque}) [0|0] "Nm" Vector__XXX
BO_ {oil} Oil: 8 Drive
 SG_ HydOilTemp : 0|8@1+ (1,-40) [0|0] "°C" Vector__XXX
"""
GROUPS = 'BA_DEF_ BO_  "VFrameFormat" ENUM  "StandardCAN","ExtendedCAN","reserved","J1939PG";\n'
J1939 = f'{GROUPS}BA_DEF_DEF_  "VFrameFormat" "J1939PG";\n'
PROTOCOL = 'BA_DEF_  "ProtocolType" STRING ;\nBA_DEF_DEF_  "ProtocolType" "";\nBA_ "ProtocolType" "J1939";\n'
CAN_MAP = roles("MotorSpeed", "MotorTorque", "HydOilTemp") + '[can]\ndbc = "drive.dbc"\n'


def dbc(folder, last=0xFE, sign="-", more=J1939, encoding="utf-8"):
    text = DBC.format(
        drive=0x98FF1000 + last, oil=0x98FEEE00 + last, sign=sign, offset=0 if sign == "-" else -32000,
        torque=0 if sign == "-" else -2000,
    )  # fmt: skip
    return written(folder, text + more, "drive.dbc", encoding)


def frame(time, identifier, data, bus="can0"):
    return f"({time + 1.7e9:.6f}) {bus} {identifier}#{data.hex().upper()}"


def drive_frame(time, speed, torque, identifier="18FF1027", bus="can0"):
    data = round(speed).to_bytes(2, "little", signed=True) + round(torque * 16).to_bytes(2, "little", signed=True)
    return frame(time, identifier, data + bytes(4), bus)


def oil_frame(time, bus="can0"):
    return frame(time, "18FEEE17", bytes([80]) + bytes(7), bus)


def j1939_log(folder, *drives, bus="can0"):
    """Frames of drives: address, and a factor for the speed; each with the bus that it is on."""
    lines = [oil_frame(0.0)]
    for number, time in enumerate(TIME):
        for address, factor, *on in drives:
            lines.append(
                drive_frame(time, factor * SPEED[number], -TORQUE[number], f"18FF10{address:02X}", *(on or [bus]))
            )
        if number % 50 == 0:
            lines.append(oil_frame(time))
    return written(folder, "\n".join(lines) + "\n", "log.log")


def test_signed_signals_of_j1939_keep_their_negative_values(tmp_path):
    dbc(tmp_path)
    log = read_log(j1939_log(tmp_path, (0x27, 1.0)), written(tmp_path, CAN_MAP))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)
    assert np.isfinite(log.motor_torque.values).all()
    assert (log.motor_torque.values < 0).all()


def test_unsigned_signals_of_j1939_keep_their_reserved_range(tmp_path):
    dbc(tmp_path, sign="+")
    lines = [oil_frame(0.0), frame(0.0, "18FF1027", bytes([0, 0xFB, 0xFF, 0xFA, 0, 0, 0, 0]))]
    log = read_log(written(tmp_path, "\n".join(lines), "log.log"), written(tmp_path, CAN_MAP))
    assert np.isnan(log.motor_speed.values).all()
    assert np.isfinite(log.motor_torque.values).all()


def test_two_drives_of_one_kind_are_no_channel(tmp_path):
    dbc(tmp_path)
    file = j1939_log(tmp_path, (0x27, 1.0), (0x28, -0.5))
    with pytest.raises(LogError, match=r"FF1000h comes from the addresses 27h, 28h: \[can\] source = 0x27 or another"):
        read_log(file, written(tmp_path, CAN_MAP))
    with pytest.warns(LogWarning, match="27h, 28h"):
        text = map_text(inspect_log(file, dbc=[tmp_path / "drive.dbc"]), tmp_path)
    assert "# source = [0x27, 0x17]  # needed: J1939 addresses; the drive is one of 0x27, 0x28" in text
    for address, factor in [(0x27, 1.0), (0x28, -0.5)]:
        chosen = text.replace("# source = [0x27", f"source = [0x{address:X}")
        log = read_log(file, written(tmp_path, chosen))
        np.testing.assert_allclose(log.motor_speed.values / RPM, np.round(SPEED * factor))
    with pytest.raises(LogError, match=r"has no samples of .*: .* the log has group FEEE00h from 17h"):
        read_log(file, written(tmp_path, CAN_MAP + "source = 0x28\n"))


def test_an_address_that_cannot_be_is_refused(tmp_path):
    with pytest.raises(RamsightError, match=r"can\.source.*0 to 253"):
        load_map(written(tmp_path, CAN_MAP + "source = 300\n"))


@pytest.mark.parametrize("second", ["can1", "vcan0"])
def test_the_same_frames_on_two_buses_are_no_channel(tmp_path, second):
    dbc(tmp_path)
    file = j1939_log(tmp_path, (0x27, 1.0, "can0"), (0x27, -0.5, second))
    with pytest.raises(LogError, match=r"comes on the buses 0, 1: \[can\] bus = 0 or another"):
        read_log(file, written(tmp_path, CAN_MAP))
    with pytest.warns(LogWarning, match="buses 0, 1"):
        text = map_text(inspect_log(file, dbc=[tmp_path / "drive.dbc"]), tmp_path)
    assert "# bus = 0  # needed: which of 0, 1" in text
    log = read_log(file, written(tmp_path, CAN_MAP + "bus = 0\n"))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)


@pytest.mark.parametrize(
    ("last", "more"), [(0xFE, ""), (0xFE, PROTOCOL), (0x00, PROTOCOL), (0x00, J1939), (0xFE, GROUPS)]
)
def test_a_file_of_j1939_is_known_as_one(tmp_path, last, more):
    dbc(tmp_path, last, more=more)
    log = read_log(j1939_log(tmp_path, (0x27, 1.0)), written(tmp_path, CAN_MAP))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)


def test_the_same_group_from_another_address_is_named_with_the_key_that_reads_it(tmp_path):
    dbc(tmp_path, 0x00, more="")
    file = j1939_log(tmp_path, (0x27, 1.0))
    with pytest.raises(LogError, match=r"18FF1000h \(can\.dbc\).*the log has .*18FF1027h.*\[can\] j1939 = true"):
        read_log(file, written(tmp_path, CAN_MAP))
    log = read_log(file, written(tmp_path, CAN_MAP + "j1939 = true\n"))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)


def test_nodes_of_canopen_are_listed(tmp_path):
    lines = [frame(t, f"18{node}", bytes(8)) for t in (0.0, 0.1) for node in (3, 5)]
    text = map_text(inspect_log(written(tmp_path, "\n".join(lines), "log.log")))
    assert "# cob_id = 0x183  # 0x180 and the drive's node, one of 3, 5" in text


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_units_of_a_dbc_file_are_read_in_its_encoding(tmp_path, encoding):
    dbc(tmp_path, encoding=encoding)
    found = inspect_log(j1939_log(tmp_path, (0x27, 1.0)), dbc=[tmp_path / "drive.dbc"])
    assert found.of("temperature").unit == "°C"


# ---- clocks that are none, and several


def mf4_over(path, master, kind, unit, values=TIME):
    """A file of one group whose master channel is something."""
    return mf4(path, (values, SPEED, TORQUE, OIL), master=(master, kind), master_unit=unit)


MDF_MAP = roles("n_ist", "M_ist", "OilTemp")


@pytest.mark.parametrize(
    ("kind", "unit", "words"),
    [
        (3, "m", "group 0: its master channel x is a distance"),
        (2, "deg", "group 0: its master channel x is an angle"),
        (4, "", "group 0: its master channel x is an index"),
        (1, "mm", "group 0: its master channel x is in mm, and no time"),
        (1, "deg", "group 0: its master channel x is in deg, and no time"),
    ],
)
def test_a_master_channel_that_is_no_time_is_refused(tmp_path, kind, unit, words):
    file = mf4_over(tmp_path / "log.mf4", "x", kind, unit)
    with pytest.raises(LogError, match=words):
        read_log(file, written(tmp_path, MDF_MAP))
    found = inspect_log(file)
    assert found.of("speed") is None
    assert words in {one.note for one in found.channels} or all(words in one.note for one in found.channels)


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1e3), ("s", 1.0), ("", 1.0), ("Sekunden", 1.0)])
def test_a_clock_of_a_group_is_read_in_its_unit(tmp_path, unit, factor):
    file = mf4_over(tmp_path / "log.mf4", "t", 1, unit, TIME * factor)
    np.testing.assert_allclose(read_log(file, written(tmp_path, MDF_MAP)).time, TIME, atol=1e-9)


def several_clocks(folder, names, rate=2.0, offset=0.0):
    rows = [
        f"{t:.3f},{n},{rate * t + offset:.3f},{m},40"
        for t, n, m in zip(TIME.tolist(), SPEED.tolist(), TORQUE.tolist(), strict=True)
    ]
    head = f"{names[0]},n_ist [1/min],{names[1]},M_ist [Nm],T_oil [degC]"
    return written(folder, "\n".join([head, *rows]), "log.csv")


@pytest.mark.parametrize(
    "names", [("Time [s]", "Time.1 [s]"), ("t [s]", "t2 [s]"), ("time_s", "x2 [s]"), ("Zeit", "Zeit (2)")]
)
def test_a_clock_for_each_channel_is_refused(tmp_path, names):
    file = several_clocks(tmp_path, names)
    with pytest.raises(LogError, match="Time: is there more than once: a table has one clock"):
        inspect_log(written(tmp_path, file.read_text().replace(names[1], "Time").replace(names[0], "Time"), "two.csv"))
    with pytest.raises(LogError, match="are clocks that go on otherwise"):
        inspect_log(file)
    made = written(tmp_path, roles(temperature="T_oil [degC]", time=f'channel = "{names[0]}", unit = "s"'))
    with pytest.raises(LogError, match="are clocks that go on otherwise"):
        read_log(file, made)


@pytest.mark.parametrize(("rate", "offset"), [(1.0, 0.0), (1.0, 1.7e9)])
def test_the_same_clock_twice_is_no_second_one(tmp_path, rate, offset):
    log, _ = mapped(tmp_path, several_clocks(tmp_path, ("Time [s]", "Time_2 [s]"), rate, offset))
    np.testing.assert_allclose(log.time, TIME, atol=1e-9)


def test_a_counter_of_hours_is_no_clock(tmp_path):
    log, _ = mapped(tmp_path, several_clocks(tmp_path, ("Time [s]", "runtime [h]"), 0.0, 1234.5))
    assert log.sizes["time"] == N


def test_a_sample_whose_invalidation_bit_is_set_is_missing(tmp_path):
    bits = np.isin(np.arange(N), [3, 90])
    mf4(tmp_path / "log.mf4", (TIME, (SPEED, bits), TORQUE, OIL))
    log, _ = mapped(tmp_path, tmp_path / "log.mf4")
    assert np.flatnonzero(np.isnan(log.motor_speed.values)).tolist() == [3, 90]
    assert np.isfinite(log.motor_torque.values).all()


# ---- frames in text files


PDO_MAP = pdo_map(0x185, "100 N m", 'channel = "606Ch", unit = "rpm"')


def pdo_bytes(k):
    return int(SPEED[k]).to_bytes(4, "little", signed=True) + (100).to_bytes(2, "little") + bytes(2)


@pytest.mark.parametrize(
    "line",
    [
        "   0.000000 CANFD   Start of measurement",
        "   0.000000 CANFD 1 Statistic: D 1 R 0 XD 0 XR 0 E 0 O 0 B 0.1%",
        "   0.000000 CANXL   Start of measurement",
    ],
)
def test_events_of_an_asc_file_are_no_frames(tmp_path, line):
    rows = [
        f"   {t:.6f} CANFD   1 Rx        185                   1 0 8  8 {pdo_bytes(k).hex(' ')}   10 13 303000 e0"
        for k, t in enumerate(TIME)
    ]
    head = f"date Tue Nov 25 06:30:00.000 AM 2025\nbase hex  timestamps absolute\n{line}"
    log = read_log(tables_of(tmp_path, rows, head, "log.asc"), written(tmp_path, PDO_MAP))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)


@pytest.mark.parametrize(
    "form",
    [
        "({t:.6f}) can0 185#{data}_9",
        "({t:.6f}) can0 00000185#{data}",
        "({t:.6f}) can0 185#{data}_F R",
        "({t:.6f})  can0  185   {{9}}  {spaced}",
        "({t:.6f})  can0  00000185   [8]  {spaced}",
    ],
)
def test_candump_in_all_its_spellings(tmp_path, form):
    lines = [
        form.format(t=1.7e9 + t, data=pdo_bytes(k).hex().upper(), spaced=pdo_bytes(k).hex(" "))
        for k, t in enumerate(TIME)
    ]
    lines.insert(3, "(1700000000.040000) can0 45123#81:00:12345678#11223344.556677")  # CAN XL
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "(?s).*frames 185h have identifiers of 29 bits", LogWarning)
        log = read_log(written(tmp_path, "\n".join(lines), "log.log"), written(tmp_path, PDO_MAP))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)


def test_an_extended_identifier_is_not_taken_for_a_short_one_where_both_are_meant(tmp_path):
    more = PDO_MAP + '[[can.pdo]]\ncob_id = 0x187\nobjects = ["2010h:01 INT16"]\n'
    lines = [frame(t, "185", pdo_bytes(k)) for k, t in enumerate(TIME)]
    lines.insert(50, frame(TIME[50], "10000185", bytes(8)))
    log = read_log(written(tmp_path, "\n".join(lines), "log.log"), written(tmp_path, more))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)


# ---- tables with more than a table


COLUMNS = ("Time [s]", "Motor speed [rpm]", "Motor torque [Nm]", "Oil temperature [°C]")


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("before", [[], ["Measurement 7", ""]])
def test_a_header_may_have_line_breaks(tmp_path, separator, before):
    head = separator.join(f'"{name.replace(" [", chr(10) + "[")}"' for name in COLUMNS)
    log, text = mapped(
        tmp_path, written(tmp_path, "\n".join([*before, head, *lines_of(separator, rows=slice(60))[1:]]), "log.csv")
    )
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED[:60])
    assert ("header_line" in text) is bool(before)


@pytest.mark.parametrize(
    "after",
    [
        ["", "Min,-38,-2,40", "Max,0,2,40.3"], [",".join(COLUMNS)], ["", "", "Summary", "samples,60"],
        ["*** end of measurement ***"],
    ],
)  # fmt: skip
@pytest.mark.parametrize("end", ["\n", ""])
def test_a_summary_at_the_end_is_left_out_and_what_stands_before_is_read(tmp_path, after, end):
    lines = [",".join(COLUMNS), *lines_of(",", rows=slice(60))[1:], *after]
    file = written(tmp_path, "\n".join(lines) + end, "log.csv")
    with pytest.warns(LogWarning, match="line 6"):
        found = inspect_log(file)
    assert found.of("speed").samples == 60
    with pytest.warns(LogWarning, match="line 6"):
        log = read_log(file, written(tmp_path, map_text(found)))
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED[:60])


def test_what_is_no_row_between_rows_is_still_refused_and_what_stands_before_is_listed(tmp_path):
    lines = [
        ",".join(COLUMNS), *lines_of(",", rows=slice(60))[1:], ",".join(COLUMNS),
        *lines_of(",", rows=slice(60))[1:],
    ]  # fmt: skip
    file = written(tmp_path, "\n".join(lines) + "\n", "log.csv")
    with pytest.warns(LogWarning, match="only what stands before this is listed: .*line 62"):
        found = inspect_log(file)
    assert found.channels[0].samples == 60
    with pytest.raises(LogError, match="line 62"):
        read_log(file, written(tmp_path, map_text(found)))


LABVIEW = [
    "LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t.",
    "Multi_Headings\tNo", "Date\t2025/11/21", "Time\t06:30:00.123", "***End_of_Header***", "", "Channels\t3",
    "Samples\t60\t60\t60", "Date\t2025/11/21\t2025/11/21\t2025/11/21", "X0\t0.0\t0.0\t0.0",
    "Delta_X\t0.02\t0.02\t0.02", "***End_of_Header***",
]  # fmt: skip


@pytest.mark.parametrize(
    ("before", "separator", "names"),
    [
        (["Operator;A", "Serial;4711"], ";", COLUMNS),
        (["Channel;Speed;Torque;Oil", "Min;-1500;-50;39", "Max;1500;53;41", ""], ";", COLUMNS),
        (["Date,21.11.2025", "Rate,50", "Channels,3", ""], ",", COLUMNS),
        (LABVIEW, "\t", ("X_Value", *COLUMNS[1:], "Comment")),
        ([f"key {k};{k}" for k in range(100)], ";", COLUMNS),
    ],
)
def test_the_header_is_the_line_above_the_many_rows(tmp_path, before, separator, names):
    lines = [*before, separator.join(names), *lines_of(separator, rows=slice(60))[1:]]
    log, text = mapped(tmp_path, written(tmp_path, "\n".join(lines), "log.txt"))
    assert f"header_line = {len(before) + 1}" in text
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED[:60])
    np.testing.assert_allclose(log.time, TIME[:60])


@pytest.mark.parametrize("name", ["__time", "Timestamp", "x_value"])
def test_names_that_are_clocks(tmp_path, name):
    file = written(tmp_path, "\n".join([",".join([name, *COLUMNS[1:]]), *lines_of(",", rows=slice(60))[1:]]), "log.csv")
    assert inspect_log(file).clock.timed.channel == name


# ---- clocks in the spellings of loggers and spreadsheets


def clocked(folder, stamps, head="timestamp"):
    rows = lines_of(time=stamps, rows=slice(len(stamps)))[1:]
    return tables_of(folder, rows, ",".join([head, *COLUMNS[1:]]))


def spelled(form, start, at, number=100):
    """Times of a clock from `start` on, `at` seconds before it begins again."""
    first = datetime.datetime.fromisoformat(start) - datetime.timedelta(seconds=at)
    times = [first + datetime.timedelta(milliseconds=20 * k) for k in range(number)]
    return [time.strftime(form)[: -3 if form.endswith("f") else None] for time in times]


@pytest.mark.parametrize(
    ("form", "start"),
    [
        ("%M:%S.%f", "2025-06-06T07:00"),  # over the hour
        ("%H:%M:%S.%f", "2025-06-06T00:00"),  # over midnight
        ("%I:%M:%S.%f", "2025-06-06T13:00"),  # twelve hours, from one o'clock
        ("%d.%m.%Y %H:%M:%S.%f", "2025-06-06T00:00"),
        ("%m/%d/%Y %H:%M:%S.%f", "2025-06-06T00:00"),  # the month first
        ("%m/%d/%Y %H:%M:%S.%f", "2025-07-01T00:00"),
        ("%m/%d/%Y %H:%M:%S.%f", "2025-06-13T00:00"),  # 06/12, 06/13
        ("%d/%m/%Y %H:%M:%S.%f", "2025-06-05T00:00"),  # the day first
        ("%d/%m/%Y %H:%M:%S.%f", "2025-06-01T00:00"),
        ("%m-%d-%y %H:%M:%S.%f", "2025-03-04T00:00"),
    ],
)
def test_clocks_go_on_where_they_begin_again(tmp_path, form, start):
    log, _ = mapped(tmp_path, clocked(tmp_path, spelled(form, start, 0.6)))
    np.testing.assert_allclose(log.time, TIME[:100], atol=2e-3)


def test_a_clock_of_twelve_hours_from_noon_at_zero(tmp_path):
    stamps = [f"11:59:59.{k:02d}" for k in range(0, 100, 2)] + [f"00:00:00.{k:02d}" for k in range(0, 100, 2)]
    log, _ = mapped(tmp_path, clocked(tmp_path, stamps))
    np.testing.assert_allclose(log.time, TIME[:100], atol=1e-6)


def test_a_clock_that_was_set_back_by_an_hour_is_no_noon(tmp_path):
    stamps = [f"11:59:59.{k:02d}" for k in range(0, 100, 2)] + [f"10:59:59.{k:02d}" for k in range(0, 100, 2)]
    with pytest.warns(LogWarning, match="time goes back once"):
        mapped(tmp_path, clocked(tmp_path, stamps))


def test_dates_with_the_year_first_or_points_keep_their_order(tmp_path):
    for before, after in [("2025-05-06", "2025-06-06"), ("06.05.2025", "06.06.2025")]:
        log, _ = mapped(tmp_path, clocked(tmp_path, [f"{before} 10:00:00", f"{after} 10:00:00"]))
        assert log.time.values[-1] == 31 * 86400.0


@pytest.mark.parametrize("first", [45986.2708333333, 0.2708333333])
@pytest.mark.parametrize("comma", [True, False])
def test_days_of_a_spreadsheet_are_proposed_as_days(tmp_path, first, comma):
    lines = [f"{first + t / 86400.0:.10f};{n};{m};40" for t, n, m in zip(TIME, SPEED, TORQUE, strict=True)]
    text = "\n".join([";".join(["Timestamp", *COLUMNS[1:]]), *lines])
    log, text = mapped(tmp_path, written(tmp_path, text.replace(".", ",") if comma else text, "log.csv"))
    assert 'unit = "d" }  # days' in text
    np.testing.assert_allclose(log.time, TIME, atol=2e-4)


# ---- MCAP


def nested(number):
    return [("/speed", {"data": {"value": SPEED[number]}}), ("/torque", {"data": {"value": TORQUE[number]}}),
            ("/oil/temperature", {"data": {"value": 40.0}})]  # fmt: skip


NESTED = {"type": "object", "properties": {"data": {"type": "object", "properties": {"value": {"type": "number"}}}}}


@pytest.mark.parametrize("schema", [NESTED, {}, {"type": "object"}, {"properties": {"data": {"properties": {"value": {
    "type": ["number", "null"]}}}}}])  # fmt: skip
def test_fields_of_objects_in_objects_are_channels(tmp_path, schema):
    messages = [(topic, t, content) for k, t in enumerate(TIME) for topic, content in nested(k)]
    file = mcap(tmp_path / "log.mcap", messages, schema or b"{}")
    log, text = mapped(tmp_path, file)
    assert 'channel = "/speed/data.value"' in text
    np.testing.assert_allclose(log.motor_speed.values / RPM, SPEED)


def test_messages_that_are_not_read_are_named(tmp_path):
    messages = [(topic, t, bytes(12)) for t in TIME for topic in ("/speed", "/torque")]
    file = mcap(tmp_path / "log.mcap", messages, b"float64 value", "flatbuffer", "flatbuffer")
    for attempt in (inspect_log, read_log):
        with pytest.raises(
            LogError, match=r"its topics /speed, /torque are in flatbuffer, and messages in JSON are read, .*CSV"
        ):
            attempt(file)


# ---- what a person does next


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("T_oil [C]", "degC"), ("Temp", ""), ("Öltemp", ""), ("Oeltemperatur [Grad C]", "degC"), ("T_Öl [°C]", "°C"),
        ("Temperature (°C)", "°C"), ("O\u0308ltemp [°C]", "°C"), ("Tank temp [degC]", "degC"),
        ("Hydraulic fluid T [K]", "K"),
        ("TempOil", ""), ("Temperatur Hydraulik [C]", "degC"), ("oil.temp", ""), ("DriveState.OilTemp", ""),
    ],
)  # fmt: skip
def test_temperatures_are_proposed_by_many_names(tmp_path, name, unit):
    value = 313.0 if unit == "K" else 40.0
    rows = [f"{t},{n},{m},{value},70" for t, n, m in zip(TIME, SPEED, TORQUE, strict=True)]
    head = f"time_s,motor_speed_rpm,motor_torque_nm,{name},Motor temperature [°C]"
    log, text = mapped(tmp_path, tables_of(tmp_path, rows, head))
    assert f'channel = "{name}"\nunit = "{unit or "degC"}"' in text
    assert 312.0 < log.oil_temperature.values[0] < 314.0


@pytest.mark.parametrize("name", ["Motor temperature [°C]", "T_winding [degC]", "Kühlwassertemperatur", "T"])
def test_no_other_temperature_is_taken_and_no_constant_in_silence(tmp_path, name):
    rows = [f"{t},{n},{m},70" for t, n, m in zip(TIME, SPEED, TORQUE, strict=True)]
    file = tables_of(tmp_path, rows, f"time_s,motor_speed_rpm,motor_torque_nm,{name}")
    text = map_text(inspect_log(file))
    assert "\n# [temperature]" in text
    with pytest.raises(RamsightError, match=r"has no \[temperature\]; name the oil's channel .*constant"):
        read_log(file, written(tmp_path, text))
    stated = 'temperature = {constant = "45 degC"}\n' + text
    assert read_log(file, written(tmp_path, stated)).oil_temperature.values[0] == pytest.approx(318.15)


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
def test_an_error_names_the_command_that_comes_next(tmp_path, encoding):
    file = written(tmp_path, "Zeit;n_ist;M_ist;Öltemp\n0,0;1;1,5;40\n", "log.csv", encoding)
    with pytest.raises(LogError, match=r"ramsight logs inspect \S+log\.csv --out map\.toml"):
        read_log(file)


@pytest.mark.parametrize(("strict", "code"), [(True, 1), (False, 0)])
@pytest.mark.parametrize("wrong", [True, False])
def test_strict_makes_a_warning_an_error(tmp_path, strict, code, wrong):
    file = tables_of(tmp_path, [*lines_of(rows=slice(50))[1:], *(["", "Mean,1,2,3"] if wrong else [])])
    out = tmp_path / "track.csv"
    verb = ["track", "mining-loader", str(file), "--unit", "boom", "--start", "100 mm", "--out", str(out)]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        done = CliRunner().invoke(app, [*verb, *(["--strict"] if strict else [])])
    said = [one for one in caught if issubclass(one.category, LogWarning)]
    assert done.exit_code == (code if said else 0), done.output
    assert bool(said) >= wrong
    assert ("--strict takes a warning" in done.output) is (strict and bool(said))
    assert out.exists()


def test_names_of_channels_command_no_terminal(tmp_path):
    rows = "\n".join(f"{0.02 * k:.2f},{100 + k % 3},{5 + k % 7},40" for k in range(50))
    (tmp_path / "log.csv").write_text("time_s,n\x1b[31m,motor_torque_Nm,T\x07\n" + rows + "\n", encoding="utf-8")
    done = as_command("logs", "inspect", "log.csv", cwd=tmp_path)
    assert r"n\x1b[31m" in done.stdout
    assert not [c for c in done.stdout + done.stderr if not c.isprintable() and c != "\n"]
