"""CAN frames as the programs of several makers write them: the same frames from every kind of file."""

import base64
from pathlib import Path

import numpy as np
import pytest

from ramsight.errors import LogError, LogWarning
from ramsight.logs import read_log
from ramsight.logs.frames import EXTENDED, Frame
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text
from ramsight.logs.source_by_suffix import open_frames

from .log_bench import HEADER, written

DBC = Path(__file__).parent / "can" / "drive.dbc"
FRAMES = [
    Frame(0.0, 0x181, 0, bytes(range(8))), Frame(0.0105, 0x18FEF100 | EXTENDED, 1, b"\xaa\xbb\xcc"),
    Frame(1.25, 0x7FF, 0, b"\x01"), Frame(2.0, 0x1 | EXTENDED, 0, b""),
]  # fmt: skip


def hexed(data, sep=" "):
    return data.hex(sep).upper() if sep else data.hex().upper()


def number(key):
    return key & ~EXTENDED


def trc(head, row, tail=()):
    def write(frames):
        rows = [
            row.format(n=n, ms=1e3 * f.time, bus=f.bus + 1, dlc=len(f.data), data=hexed(f.data),
                       id=f"{number(f.key):08X}" if f.key & EXTENDED else f"{f.key:04X}")
            for n, f in enumerate(frames, 1)
        ]  # fmt: skip
        return "\r\n".join([*head, ";---+--   ----+----", *rows, *tail, ""])

    return write


def trc_1(version, row):
    head = [f";$FILEVERSION={version}", ";$STARTTIME=41766.46;"] if version else [";##########", ";   a trace"]
    return trc(head, row)


def trc_2(columns, row):
    return trc([";$FILEVERSION=2.1", f";$COLUMNS={columns}"], row, ["   9  3000.0 ST 1 - Rx 08"])


def busmaster(mode, is_hex=True):
    def write(frames):
        lines, last = [f"***BUSMASTER Ver 3.2.2***\n***{'HEX' if is_hex else 'DEC'}***\n***{mode} MODE***"], 0.0
        for f in frames:
            time = f.time - last if mode == "RELATIVE" else f.time + (36000.0 if mode == "SYSTEM" else 0.0)
            last = f.time
            whole, parts = divmod(round(time * 1e4), 10_000)
            clock = f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}:{parts:04d}"
            key = f"0x{number(f.key):X}" if is_hex else f"{number(f.key)}"
            data = " ".join(f"{one:02X}" if is_hex else f"{one:03d}" for one in f.data)
            lines.append(f"{clock} Rx {f.bus + 1} {key} {'x' if f.key & EXTENDED else 's'} {len(f.data)} {data}")
        return "\n".join([*lines, "***[STOP LOGGING SESSION]***", ""])

    return write


def savvycan(frames):
    rows = [
        f"{round(1e6 * f.time)},{number(f.key):08X},{str(bool(f.key & EXTENDED)).lower()},Rx,{f.bus},{len(f.data)},"
        + "".join(f"{one:02X}," for one in f.data)
        for f in frames
    ]
    return "\n".join(["Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8", *rows, ""])


def canedge(frames):
    rows = [
        f"{1.6e9 + f.time:.6f};{f.bus + 1};{number(f.key):X};{int(bool(f.key & EXTENDED))};{len(f.data)};{len(f.data)};"
        f"0;0;0;0;0;{hexed(f.data, '')}"
        for f in frames
    ]
    return "\n".join(["TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;ESI;RTR;DataBytes", *rows, ""])


def cl2000(frames):
    rows = [
        f"09T164{711 + f.time:06.3f}".replace(".", "")
        + f";{int(bool(f.key & EXTENDED))};{number(f.key):x};{f.data.hex()}"
        for f in frames
    ]
    return "\n".join(["# Logger type: CL2000", "# Value separator: ;", "Timestamp;Type;ID;Data", *rows, ""])


def kvaser(frames):
    rows = [
        f"{f.time:.6f},{f.bus + 1},{number(f.key):X},{'X' if f.key & EXTENDED else ''},{len(f.data)},"
        + ",".join(f"{one:02X}" for one in f.data.ljust(8, b"\0")[:8])
        for f in frames
    ]
    names = ",".join(f"Data{k}" for k in range(8))
    return "\n".join(["Kvaser Memorator Log", "", f"Time,Channel,ID,Flags,DLC,{names}", *rows, ""])


def python_can(frames):
    rows = [
        f"{1.7e9 + f.time},{hex(number(f.key))},{int(bool(f.key & EXTENDED))},0,0,{len(f.data)},"
        + base64.b64encode(f.data).decode()
        for f in frames
        if f.bus == 0
    ]
    return "\n".join(["timestamp,arbitration_id,extended,remote,error,dlc,data", *rows, ""])


ROW_1 = "     {n})  {ms:10.1f}  Rx  {id}  {dlc}  {data}"
WRITERS = {
    "trc 1.0": (".trc", trc_1(None, "     {n})  {ms:10.1f}  {id}  {dlc}  {data}")),
    "trc 1.1": (".trc", trc_1("1.1", ROW_1)),
    "trc 1.2": (".trc", trc_1("1.2", "     {n})  {ms:10.3f} {bus} Rx  {id}  {dlc}  {data}")),
    "trc 1.3": (".trc", trc_1("1.3", "     {n})  {ms:10.3f} {bus} Rx  {id} -  {dlc}  {data}")),
    "trc 2.0": (".trc", trc_2("N,O,T,I,d,l,D", "   {n}  {ms:10.3f} DT {id} Rx {dlc} {data}")),
    "trc 2.1": (".trc", trc_2("N,O,T,B,I,d,R,L,D", "   {n}  {ms:10.3f} DT {bus} {id} Rx - {dlc} {data}")),
    "busmaster": (".log", busmaster("SYSTEM")),
    "busmaster relative": (".log", busmaster("RELATIVE")),
    "busmaster decimal": (".log", busmaster("ABSOLUTE", is_hex=False)),
    "savvycan": (".csv", savvycan),
    "canedge": (".csv", canedge),
    "cl2000": (".txt", cl2000),
    "kvaser": (".csv", kvaser),
    "python-can": (".csv", python_can),
}
WITHOUT_BUS = ("trc 1.0", "trc 1.1", "trc 2.0", "cl2000", "python-can")


@pytest.mark.parametrize("packed", ["", ".gz"])
@pytest.mark.parametrize("kind", WRITERS)
def test_frames_are_the_same_from_every_kind_of_file(tmp_path, kind, packed):
    end, write = WRITERS[kind]
    found = [one for one in open_frames(written(tmp_path, write(FRAMES), f"log{end}{packed}")) if one.key]
    wanted = [one for one in FRAMES if kind != "python-can" or one.bus == 0]
    assert [(one.key, one.data) for one in found] == [(one.key, one.data) for one in wanted]
    since = [one.time - found[0].time for one in found]
    np.testing.assert_allclose(since, [one.time for one in wanted], atol=0.00051)
    if kind not in WITHOUT_BUS:
        assert [one.bus for one in found] == [one.bus for one in wanted]


@pytest.mark.parametrize("kind", WRITERS)
def test_a_damaged_line_is_refused_with_its_number_and_a_cut_one_left_out(tmp_path, kind):
    end, write = WRITERS[kind]
    text = write([*FRAMES[:1] * 3])
    lines = text.splitlines()
    place = next(k for k, line in enumerate(lines) if ("02" in line and "07" in line) or "AAECAw" in line)
    bad = [*lines[: place + 1], lines[place + 1].replace("07", "QZ").replace("AAEC", "$$$$"), *lines[place + 2 :], ""]
    with pytest.raises(LogError, match=rf"line {place + 2}: is no CAN frame"):
        list(open_frames(written(tmp_path, "\n".join(bad), f"bad{end}")))
    cut = "\n".join([*lines[: place + 2], lines[place + 2][:-9]])
    with pytest.warns(LogWarning, match=f"breaks off in this line, .* line {place + 2}"):
        assert len(list(open_frames(written(tmp_path, cut, f"cut{end}")))) == 2


def drive(seconds=3.0):
    """Frames of a drive as the DBC file has them."""
    cantools = pytest.importorskip("cantools")
    database = cantools.database.load_file(DBC)
    found = []
    for time in np.arange(0.0, seconds, 0.02):
        state = {"MotorSpeed": 1200.0, "MotorTorque": 12.5, "TorqueTarget": 0.0}
        slow = {"Page": 1, "OilTemperature": 41, "TopSwitch": 0}
        found.append(Frame(float(time), 385, 0, bytes(database.encode_message("DriveState", state))))
        found.append(Frame(float(time), 641, 0, bytes(database.encode_message("DriveSlow", slow))))
    return found


@pytest.mark.parametrize("kind", ["trc 1.1", "trc 2.1", "busmaster", "savvycan", "canedge", "kvaser", "python-can"])
def test_a_drive_is_read_by_the_map_that_is_proposed(tmp_path, kind):
    end, write = WRITERS[kind]
    file = written(tmp_path, write(drive()), f"day{end}")
    assert {key: count for key, (count, _) in inspect_log(file).frames.items()} == {385: 150, 641: 150}
    text = map_text(inspect_log(file, dbc=[DBC]), tmp_path)
    log = read_log(file, written(tmp_path, text))
    assert len(log.time) >= 149
    np.testing.assert_allclose(log.motor_speed.values * 30.0 / np.pi, 1200.0)
    np.testing.assert_allclose(log.oil_temperature.values, 314.15)
    with pytest.raises(LogError, match=r"holds CAN frames; .*ramsight logs inspect"):
        read_log(file)


def test_a_table_of_signals_is_no_table_of_frames(tmp_path):
    text = f"{HEADER},data,id\n0.0,1,2,40,5,6\n"
    assert float(read_log(written(tmp_path, text, "log.csv")).motor_torque[0]) == 2.0


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.trc", ";$FILEVERSION=1.1\n 1) 1.0 Rx 0100 3 RTR\n 2) 2.0 Warng FFFFFFFF 4 00 00 00 04 BUSLIGHT\n"),
        (
            "a.trc",
            ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n1 1.0 RR 1 0100 Rx - 3\n2 2.0 ER 1 - Rx - 5 04 00\n",
        ),
        ("a.log", "***BUSMASTER Ver 2***\n10:00:00:0000 Rx 1 0x100 sr 3\n10:00:00:0010 Rx 1 0x100 sr 3\n"),
        (
            "a.csv",
            "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;RTR;DataBytes\n1.0;1;100;0;3;0;1;\n2.0;1;100;0;3;0;1;\n",
        ),
    ],
)
def test_remote_frames_and_errors_have_no_data(tmp_path, name, text):
    assert [one.data for one in open_frames(written(tmp_path, text, name))] == [None, None]


@pytest.mark.parametrize("code", [9, 12])
def test_long_frames_have_their_length_by_code_or_by_count(tmp_path, code):
    text = f";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n1 1.0 FD 1 0100 Rx - {code} {hexed(bytes(range(12)))}\n"
    (frame,) = open_frames(written(tmp_path, text, "a.trc"))
    assert frame.data == bytes(range(12))


def test_a_clock_of_the_day_goes_on_over_midnight(tmp_path):
    text = "***SYSTEM MODE***\n23:59:59:9900 Rx 1 0x100 s 1 00\n0:00:00:0100 Rx 1 0x100 s 1 00\n"
    first, second = open_frames(written(tmp_path, text, "a.log"))
    assert second.time - first.time == pytest.approx(0.02)


def test_a_trace_of_version_2_without_columns_says_what_it_lacks(tmp_path):
    with pytest.raises(LogError, match=r"line 2: .*;\$COLUMNS"):
        list(open_frames(written(tmp_path, ";$FILEVERSION=2.1\n1 1.0 DT 1 0100 Rx - 1 00\n", "a.trc")))
