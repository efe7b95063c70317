"""The same motion over every clock that loggers write, in every format that holds it: the same travel, or a reason."""

import datetime
import gzip
import warnings

import numpy as np
import pytest

from ramsight.errors import DescriptionError, LogError, LogWarning, RamsightError
from ramsight.logs import load_map, read_log
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text

RPM = 2.0 * np.pi / 60.0
PER_RADIAN = 2e-5  # m; more than any machine of the catalogue moves its rod
N = 300
TIME = np.arange(N) * 0.02
SPEED = np.round(1500.0 * np.sin(TIME), 2)
TORQUE = np.round(12.5 + np.cos(TIME), 3)
NAMES = ("n_ist [1/min]", "M_ist [Nm]", "T_oil [degC]")
COLUMNS = dict(zip(NAMES, (SPEED, TORQUE, np.full(N, 40.0)), strict=True))
ROLES = """
speed = {channel = "n_ist [1/min]"}
torque = {channel = "M_ist [Nm]"}
temperature = {channel = "T_oil [degC]"}
"""


def travel(log):
    speed, time = log.motor_speed.values, log.time.values
    return PER_RADIAN * np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])


def same_travel(log, skipped=0):
    whole = {"speed": SPEED * RPM, "time": TIME}
    steps = 0.5 * (whole["speed"][1:] + whole["speed"][:-1]) * np.diff(TIME)
    wanted = PER_RADIAN * np.concatenate([[0.0], np.cumsum(steps)])
    assert len(log.time) == N - skipped
    np.testing.assert_allclose(travel(log), wanted[skipped:] - wanted[skipped], atol=1e-6)
    np.testing.assert_allclose(log.motor_torque.values, TORQUE[skipped:], atol=1e-9)


def written(folder, text, name="map.toml"):
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def proposed(folder, file):
    """The log by the map that is proposed, and that map."""
    text = map_text(inspect_log(file))
    return read_log(file, written(folder, text)), text


# ---- formats that hold a clock of numbers


def table(path, clocks, separator=","):
    comma = separator == ";"
    cells = [[repr(float(one)) if one == one else "" for one in column] for column in COLUMNS.values()]
    rows = [
        separator.join(row) for row in zip(*[[*map(str, column)] for column in clocks.values()], *cells, strict=True)
    ]
    text = "\n".join([separator.join([*clocks, *NAMES]), *rows]) + "\n"
    text = text.replace(".", ",") if comma else text
    path.write_bytes(gzip.compress(text.encode()) if path.suffix == ".gz" else text.encode())


def parquet(path, clocks):
    arrow, files = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    files.write_table(arrow.table({**clocks, **COLUMNS}), path)


def mat(path, clocks):
    pytest.importorskip("scipy.io").savemat(
        path, {"log": {name.split(" ")[0]: one for name, one in {**clocks, **COLUMNS}.items()}}
    )


def tdms(path, clocks):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [nptdms.ChannelObject("drive", name, np.asarray(one)) for name, one in {**clocks, **COLUMNS}.items()]
        )


def mf4(path, clocks):
    asammdf = pytest.importorskip("asammdf")
    mdf = asammdf.MDF(version="4.10")
    index = np.arange(N) * 1.0  # the recorder's own clock is another
    signals = {**clocks, **COLUMNS}
    units = dict(zip(NAMES, ("1/min", "Nm", "degC"), strict=True))
    mdf.append(
        [
            asammdf.Signal(samples=np.asarray(one), timestamps=index, name=name, unit=units.get(name, ""))
            for name, one in signals.items()
        ]
    )
    mdf.save(path, overwrite=True)
    mdf.close()


def mcap(path, clocks):
    import json

    writers = pytest.importorskip("mcap.writer")
    with path.open("wb") as file:
        writer = writers.Writer(file)
        writer.start()
        schema = writer.register_schema("drive", "jsonschema", b"{}")
        channel = writer.register_channel("/drive", "json", schema)
        for number in range(N):
            content = {name: float(one[number]) for name, one in {**clocks, **COLUMNS}.items()}
            content |= {name: int(one[number]) for name, one in clocks.items() if np.asarray(one).dtype.kind in "iu"}
            arrived = (number // 50 + 1) * 10**9  # in bursts
            writer.add_message(channel, arrived, json.dumps(content).encode(), arrived)
        writer.finish()


def xlsx(path, clocks):
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.append([*clocks, *NAMES])
    for row in zip(*clocks.values(), *COLUMNS.values(), strict=True):
        book.active.append([one.item() if isinstance(one, np.generic) else one for one in row])
    book.save(path)


FORMATS = {
    "log.csv": table, "log.csv.gz": table, "log.tsv": lambda path, clocks: table(path, clocks, "\t"),
    "semicolon.csv": lambda path, clocks: table(path, clocks, ";"), "log.parquet": parquet, "log.mat": mat,
    "log.tdms": tdms, "log.mf4": mf4, "log.mcap": mcap, "log.xlsx": xlsx,
}  # fmt: skip

# ---- clocks of numbers: the numbers, and what a map states of them

FILETIME, TICKS = 133863461000000000, 639089893000000000
CLOCKS = {
    "s": (TIME, 'unit = "s"'),
    "ms": (np.round(1e3 * TIME).astype(np.int64), 'unit = "ms"'),
    "us": (np.round(1e6 * TIME).astype(np.int64) + 77, 'unit = "us"'),
    "ns since 1970": (np.round(1e9 * TIME).astype(np.int64) + 1763700000 * 10**9, ""),
    "ms since 1970": (np.round(1e3 * TIME).astype(np.int64) + 1763700000000, ""),
    "s since 1970": (TIME + 1763700000.0, ""),
    "FILETIME": (np.round(1e7 * TIME).astype(np.int64) + FILETIME, ""),
    ".NET": (np.round(1e7 * TIME).astype(np.int64) + TICKS, 'unit = "100 ns"'),
    "16 bits of ms": ((np.round(1e3 * TIME).astype(np.int64) + 62000) % 65536, 'unit = "ms"'),
    "32 bits of ms": ((np.round(1e3 * TIME).astype(np.int64) + 2**32 - 3000) % 2**32, 'unit = "ms"'),
    "32 bits of us": ((np.round(1e6 * TIME).astype(np.int64) + 2**32 - 3000000) % 2**32, 'unit = "us"'),
    "31 bits of ms": ((np.round(1e3 * TIME).astype(np.int64) + 2**31 - 3000) % 2**31, 'unit = "ms"'),
    "signed 32 bits of ms": ((np.round(1e3 * TIME).astype(np.int64) + 3 * 2**31 - 3000) % 2**32 - 2**31, 'unit = "ms"'),
    "seconds of a minute": ((TIME + 57.0) % 60.0, 'unit = "s"'),
    "time of week": ((TIME + 604797.0) % 604800.0, 'unit = "s"'),
    "newest first": (TIME[::-1], 'unit = "s"'),
    "row numbers": (np.arange(N), 'period = "20 ms"'),
    "row numbers, as a unit": (np.arange(N), 'unit = "20 ms"'),
    "scaled": (np.round(500.0 * TIME).astype(np.int64) + 5, 'unit = "ms", scale = 2, offset = -10'),
    "counts down": (np.round(1e3 * (60.0 - TIME)).astype(np.int64), 'unit = "ms", sign = -1'),
    "days of a spreadsheet": (45986.25 + TIME / 86400.0, 'unit = "d"'),
    "steps that nobody says": (np.round(1e3 * TIME).astype(np.int64), ""),
}  # fmt: skip
REFUSED = {
    ("steps that nobody says", ""): r'rows are 20 apart: "ms"',
    ("newest first", "log.mf4"): "the newest is first",
    ("newest first", "log.mcap"): "the newest is first",
}
"""Clocks that are no clock without a word more, and the reason; in one format, or in all."""


def drawn(number):
    chosen = np.random.default_rng(number)
    return str(chosen.choice(list(CLOCKS))), str(chosen.choice(list(FORMATS)))


def check_drawn(folder, clock, name):
    numbers, said = CLOCKS[clock]
    columns = {key: one.copy() for key, one in COLUMNS.items()}
    if clock == "newest first":
        for key in COLUMNS:
            COLUMNS[key] = columns[key][::-1]
    try:
        FORMATS[name](folder / name, {"clk": numbers})
    finally:
        COLUMNS.update(columns)
    inner = "log.clk" if name == "log.mat" else "clk"
    text = f'time = {{channel = "{inner}"{", " if said else ""}{said}}}' + ROLES
    if name == "log.mat":
        for one, unit in zip(NAMES, ("1/min", "Nm", "degC"), strict=True):
            text = text.replace(f'"{one}"', f'"log.{one.split(" ")[0]}", unit = "{unit}"')
    reason = REFUSED.get((clock, name)) or REFUSED.get((clock, ""))
    mapping = written(folder, text)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "(?s).*rows are newest first", LogWarning)
        if reason is None:
            same_travel(read_log(folder / name, mapping))
            return
        with pytest.raises(RamsightError, match=reason):
            read_log(folder / name, mapping)


@pytest.mark.parametrize("number", range(24))
def test_the_same_motion_over_any_clock_in_any_format(tmp_path, number):
    check_drawn(tmp_path, *drawn(number))


@pytest.mark.parametrize("clock", CLOCKS)
def test_the_same_motion_over_every_clock_in_a_table(tmp_path, clock):
    check_drawn(tmp_path, clock, "log.csv")


@pytest.mark.parametrize("name", FORMATS)
def test_rows_at_a_period_without_a_clock(tmp_path, name):
    if name == "log.mcap":
        pytest.skip("messages have a time")
    FORMATS[name](tmp_path / name, {"other": np.ones(N)})
    text = 'time = {period = "20 ms"}' + ROLES
    if name == "log.mat":
        for one, unit in zip(NAMES, ("1/min", "Nm", "degC"), strict=True):
            text = text.replace(f'"{one}"', f'"log.{one.split(" ")[0]}", unit = "{unit}"')
    same_travel(read_log(tmp_path / name, written(tmp_path, text)))


# ---- clocks of dates and times of day


def stamped(path, stamps, head="timestamp"):
    table(path, {head: stamps} if isinstance(head, str) else dict(zip(head, zip(*stamps, strict=True), strict=True)))
    return path


def times(start):
    first = datetime.datetime.fromisoformat(start)
    return [first + datetime.timedelta(milliseconds=20 * number) for number in range(N)]


@pytest.mark.parametrize(
    "form", ["%Y-%m-%d %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S.%f", "%H:%M:%S.%f", "%m/%d/%Y %I:%M:%S.%f %p"]
)
@pytest.mark.parametrize(("start", "way"), [("2026-03-29 01:59:57", 1), ("2026-10-25 02:59:57", -1)])
def test_summer_time_is_no_gap(tmp_path, form, start, way):
    at = times(start)
    turned = [one + datetime.timedelta(hours=way * (k >= 150)) for k, one in enumerate(at)]
    file = stamped(tmp_path / "log.csv", [one.strftime(form) for one in turned])
    with pytest.warns(LogWarning, match=r"by one hour to the sample, at a full hour: a change of summer time"):
        log, _ = proposed(tmp_path, file)
    same_travel(log)


def test_an_hour_that_is_missing_with_a_zone_is_a_gap(tmp_path):
    at = times("2026-03-29 01:59:57")
    turned = [one + datetime.timedelta(hours=int(k >= 150)) for k, one in enumerate(at)]
    log, _ = proposed(
        tmp_path, stamped(tmp_path / "log.csv", [f"{one.isoformat(timespec='milliseconds')}Z" for one in turned])
    )
    assert log.time.values[-1] > 3600.0


def test_a_clock_of_a_plc_is_its_time_with_the_date_beside_it(tmp_path):
    at = times("2026-03-12 23:59:57")
    stamps = [(k + 1, f"{one:%m/%d/%Y}", f"{one:%H:%M:%S.%f}"[:-3]) for k, one in enumerate(at)]
    log, text = proposed(tmp_path, stamped(tmp_path / "log.csv", stamps, ("Record", "Date", "UTC Time")))
    assert 'time = { channel = "UTC Time", date = "Date" }' in text
    same_travel(log)


def test_newest_first_is_turned_round(tmp_path):
    at = times("2026-03-12 23:59:57")
    columns = {name: one.copy() for name, one in COLUMNS.items()}
    try:
        COLUMNS.update({name: one[::-1] for name, one in columns.items()})
        file = stamped(tmp_path / "log.csv", [f"{one:%H:%M:%S.%f}"[:-3] for one in at[::-1]])
    finally:
        COLUMNS.update(columns)
    with pytest.warns(LogWarning, match="the rows are newest first; they are turned round"):
        log, _ = proposed(tmp_path, file)
    same_travel(log)


def test_the_index_that_pandas_writes_is_the_clock(tmp_path):
    stamps = np.datetime64("2026-03-12T09:15:00", "ns") + np.round(TIME * 1e9).astype("timedelta64[ns]")
    parquet(tmp_path / "log.parquet", {"__index_level_0__": stamps})
    log, text = proposed(tmp_path, tmp_path / "log.parquet")
    assert 'time = { channel = "__index_level_0__" }' in text
    same_travel(log)


# ---- clocks that are proposed


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        (CLOCKS["FILETIME"][0], 'unit = "100 ns" }  # Windows\' time'),
        (CLOCKS[".NET"][0], 'unit = "100 ns" }  # ticks of .NET'),
        (CLOCKS["ms since 1970"][0], 'unit = "ms" }  # time since 1970'),
        (CLOCKS["days of a spreadsheet"][0], 'unit = "d" }  # days'),
        (TIME, 'unit = "s" }'),
    ],
)
def test_a_unit_is_proposed_by_size_and_step(tmp_path, numbers, words):
    table(tmp_path / "log.csv", {"Timestamp": numbers})
    log, text = proposed(tmp_path, tmp_path / "log.csv")
    assert words in text
    np.testing.assert_allclose(travel(log), travel(log), atol=1e-6)


def test_a_unit_that_numbers_leave_open_is_asked_for(tmp_path):
    table(tmp_path / "log.csv", {"Timestamp": np.arange(N) * 20})
    text = map_text(inspect_log(tmp_path / "log.csv"))
    assert '# time = { channel = "Timestamp", unit = ... }  # needed: rows are 20 apart: "ms", or "s"' in text
    with pytest.raises(
        DescriptionError, match=r'time\.unit: is needed: rows are 20 apart: "ms".*\(allowed: "ms" or "s"\)'
    ):
        read_log(tmp_path / "log.csv", written(tmp_path, 'time = {channel = "Timestamp"}' + ROLES))


@pytest.mark.parametrize(
    ("head", "period"),
    [("Sampling time: 20 ms", "20 ms"), ("Abtastrate;50 Hz", "20 ms"), ("Sampling rate [Hz],50", "20 ms"), ("", "")],
)
def test_rows_that_are_numbered_have_the_period_of_the_head_or_ask_for_it(tmp_path, head, period):
    table(tmp_path / "log.csv", {"No.": np.arange(N)})
    text = (tmp_path / "log.csv").read_text()
    file = written(tmp_path, f"{head}\nUnit 7\n{text}" if head else text, "log.csv")
    found = map_text(inspect_log(file))
    if not period:
        assert '# time = { channel = "No.", period = "20 ms" }  # needed: how far rows are apart' in found
        return
    assert f'time = {{ channel = "No.", period = "{period}" }}  # line 1 of the file states it' in found
    same_travel(read_log(file, written(tmp_path, found)))


def test_weeks_and_seconds_of_gps(tmp_path):
    seconds = TIME + 604797.0
    clocks = {"GPS Week": 2400 + (seconds >= 604800.0).astype(np.int64), "TOW [s]": seconds % 604800.0}
    table(tmp_path / "log.csv", clocks)
    log, text = proposed(tmp_path, tmp_path / "log.csv")
    assert 'time = { channel = "TOW [s]", week = "GPS Week", unit = "s" }' in text
    same_travel(log)


# ---- what is wrong is said


@pytest.mark.parametrize("back", [0.3, 0.9, 1.0, 1.5])
@pytest.mark.parametrize("name", ["log.csv", "log.parquet"])
def test_a_clock_that_is_set_back_while_samples_go_on_is_said(tmp_path, back, name):
    FORMATS[name](tmp_path / name, {"clk": np.where(TIME < 3.0, TIME, TIME - back)})
    mapping = written(tmp_path, 'time = {channel = "clk", unit = "s"}' + ROLES)
    with pytest.warns(LogWarning, match=rf"time goes back once from 2\.98 s to {3.0 - back:g} s: was the clock set"):
        read_log(tmp_path / name, mapping)


@pytest.mark.parametrize("back", [0.3, 1.0])
def test_a_clock_of_frames_that_is_set_back_is_said(tmp_path, back):
    time = np.where(TIME < 3.0, TIME, TIME - back)
    lines = [
        f"({1000.0 + at:.6f}) can0 181#{round(n) & 0xFFFF:04X}{round(m) & 0xFFFF:04X}"
        for at, n, m in zip(time, SPEED, TORQUE, strict=True)
    ]
    file = written(tmp_path, "\n".join(lines) + "\n", "log.log")
    mapping = written(
        tmp_path,
        'speed = {channel = "606Ch"}\ntorque = {channel = "6077h", rated = "10 N m"}\n'
        'temperature = {constant = "40 degC"}\n[[can.pdo]]\ncob_id = 0x181\nobjects = ["606Ch INT16", "6077h"]\n',
    )
    with pytest.warns(LogWarning, match="time goes back once from"):
        read_log(file, mapping)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ('channel = "clk", period = "20 ms", unit = "s"', "time.unit = 's': and period are two for one"),
        ('channel = "clk", unit = "bar"', "time.unit = 'bar': is no unit of time"),
        ('channel = "clk", unit = "s", hold = "1 s"', "time.hold: is not a key"),
        ('channel = "clk", unit = "s", sign = 2', "time.sign = 2: is no sign"),
        ('channel = "clk", unit = "s", scale = 0', "time.scale = 0: makes everything 0"),
        ('period = "20 ms", scale = 2', "time.scale = 2: and offset and sign are for the numbers of a channel"),
        ('period = "20 min"', "time.period = '20 min': is no distance of rows (allowed: 1 us to 100 s)"),
        ('unit = "s"', "time.channel: a channel is needed, or how far rows are apart"),
    ],
)
def test_what_a_clock_cannot_be_is_refused(tmp_path, said, words):
    with pytest.raises(DescriptionError) as caught:
        load_map(written(tmp_path, f"time = {{{said}}}" + ROLES))
    assert words in str(caught.value)


def test_stamps_take_no_scale(tmp_path):
    file = stamped(tmp_path / "log.csv", [f"{one:%H:%M:%S.%f}" for one in times("2026-03-12 10:00:00")])
    mapping = written(tmp_path, 'time = {channel = "timestamp", scale = 2}' + ROLES)
    with pytest.raises(DescriptionError, match=r"time\.channel = 'timestamp': holds dates or times of day"):
        read_log(file, mapping)


def test_frames_take_no_clock_of_a_table(tmp_path):
    mapping = written(
        tmp_path,
        'time = {channel = "t"}\nspeed = {channel = "606Ch"}\ntorque = {channel = "6077h", rated = "10 N m"}\n'
        'temperature = {constant = "40 degC"}\n[[can.pdo]]\ncob_id = 0x181\nobjects = ["606Ch", "6077h"]\n',
    )
    file = written(tmp_path, "(1.0) can0 181#0000000000000000\n", "log.log")
    with pytest.raises(DescriptionError, match=r"time: is for tables and groups: frames bring their own clock"):
        read_log(file, mapping)


# ---- structures and groups with clocks of their own


def structures(path, late=2.0, inner="signals"):
    values = (SPEED, TORQUE, np.full(N, 40.0))
    content = {
        name: {"time": TIME + late * place, inner: {"values": one}, "blockName": "boom"}
        for place, (name, one) in enumerate(zip(("n_ist", "M_ist", "T_oil"), values, strict=True))
    }
    pytest.importorskip("scipy.io").savemat(path, content)
    return path


def test_times_of_structures_are_clocks_and_nothing_else(tmp_path):
    found = inspect_log(structures(tmp_path / "log.mat", late=0.0))
    assert {one.name: one.role for one in found.channels} == {
        "n_ist.signals.values": "speed", "M_ist.signals.values": "torque", "T_oil.signals.values": "temperature"
    }  # fmt: skip
    log = read_log(tmp_path / "log.mat", written(tmp_path, map_text(found)))
    same_travel(log)


def test_each_structure_has_its_own_clock(tmp_path):
    file = structures(tmp_path / "log.mat")
    log, _ = proposed(tmp_path, file)
    seen = np.searchsorted(TIME, log.time.values - 2.0 + 1e-9, side="right") - 1
    known = np.isfinite(log.motor_torque.values) & (seen >= 0)
    assert known.sum() > 90
    np.testing.assert_allclose(log.motor_torque.values[known], TORQUE[seen[known]])
    mapping = 'time = {channel = "n_ist.time", unit = "s"}' + "".join(
        f'\n{role} = {{channel = "{name}.signals.values", unit = "{unit}"}}'
        for role, name, unit in [
            ("speed", "n_ist", "rpm"),
            ("torque", "M_ist", "N m"),
            ("temperature", "T_oil", "degC"),
        ]
    )
    again = read_log(file, written(tmp_path, mapping))
    np.testing.assert_array_equal(again.motor_torque.values, log.motor_torque.values)


def test_several_clocks_beside_vectors_are_asked_for(tmp_path):
    pytest.importorskip("scipy.io").savemat(
        tmp_path / "log.mat", {"time_n": TIME, "time": TIME + 5.0, "t": 2.0 * TIME, "n_rpm": SPEED, "M_nm": TORQUE}
    )
    notes = {one.name: one.note for one in inspect_log(tmp_path / "log.mat").channels}
    assert "has no clock of its own, and the clocks t" in notes["n_rpm"]


def test_rows_of_a_wide_matrix_are_signals_and_the_first_is_the_clock(tmp_path):
    matrix = np.vstack([TIME, SPEED, TORQUE, np.full(N, 40.0)])
    pytest.importorskip("scipy.io").savemat(tmp_path / "log.mat", {"ans": matrix})
    assert [one.name for one in inspect_log(tmp_path / "log.mat").channels] == ["ans[2]", "ans[3]", "ans[4]"]
    mapping = "".join(
        f'{role} = {{channel = "ans[{place}]", unit = "{unit}"}}\n'
        for role, place, unit in [("speed", 2, "rpm"), ("torque", 3, "N m"), ("temperature", 4, "degC")]
    )
    same_travel(read_log(tmp_path / "log.mat", written(tmp_path, mapping)))


def waves(path, starts, step=0.02, clocks=None):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        channels = []
        for (name, one), start in zip(COLUMNS.items(), starts, strict=True):
            wave = {"wf_increment": step} | ({} if start is None else {"wf_start_time": np.datetime64(start)})
            channels.append(nptdms.ChannelObject("drive", name, one, wave))
        channels += [
            nptdms.ChannelObject("drive", name, one, {"wf_increment": step}) for name, one in (clocks or {}).items()
        ]
        writer.write_segment(channels)
    return path


@pytest.mark.parametrize("without", [0, 1, 2])
def test_a_waveform_without_a_start_time_begins_with_the_others(tmp_path, without):
    starts = [None if place == without else "2026-03-12T09:15:00" for place in range(3)]
    file = waves(tmp_path / "log.tdms", starts)
    with pytest.warns(
        LogWarning, match=r"the waveforms .* have no start time; they are read as if they began with the"
    ):
        log, _ = proposed(tmp_path, file)
    same_travel(log)


@pytest.mark.parametrize("is_stated", [True, False])
def test_a_channel_of_times_counts_before_the_step_that_labview_gives(tmp_path, is_stated):
    file = waves(tmp_path / "log.tdms", [None] * 3, 1.0, {"Time": TIME})
    clock = 'time = {channel = "Time", unit = "s"}' if is_stated else ""
    same_travel(read_log(file, written(tmp_path, clock + ROLES)))


def test_clocks_of_groups_that_do_not_meet_are_named(tmp_path):
    file = waves(tmp_path / "log.tdms", ["2026-03-12T09:15:00", "2026-03-12T11:15:00", "2026-03-12T09:15:00"])
    mapping = written(tmp_path, map_text(inspect_log(file)))
    with pytest.raises(LogError, match=r"the clocks do not meet: speed from 0 s to 5\.98\S* s, torque from 7200 s"):
        read_log(file, mapping)
