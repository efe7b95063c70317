"""The same motion over every clock that loggers write, in every format that holds it: the same travel, or a reason."""

import contextlib
import datetime
import gzip
import warnings

import numpy as np
import pytest

from ramsight.errors import DescriptionError, LogError, LogWarning, RamsightError
from ramsight.logs import load_map, read_log
from ramsight.logs.inspect import inspect_log
from ramsight.logs.proposal import map_text

from . import log_bench
from .log_bench import (
    COLUMNS,
    NAMES,
    OIL,
    RPM,
    SPEED,
    TIME,
    TORQUE,
    N,
    mapped,
    mat,
    parquet,
    pdo_map,
    roles,
    tdms,
    written,
    xlsx,
)  # fmt: skip

PER_RADIAN = 2e-5  # m; more than any machine of the catalogue moves its rod
ROLES = roles(temperature=NAMES[2])


def travel(log):
    speed, time = log.motor_speed.values, log.time.values
    return PER_RADIAN * np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])


def same_travel(log, skipped=0):
    steps = 0.5 * RPM * (SPEED[1:] + SPEED[:-1]) * np.diff(TIME)
    wanted = PER_RADIAN * np.concatenate([[0.0], np.cumsum(steps)])
    assert len(log.time) == N - skipped
    np.testing.assert_allclose(travel(log), wanted[skipped:] - wanted[skipped], atol=1e-6)
    np.testing.assert_allclose(log.motor_torque.values, TORQUE[skipped:], atol=1e-9)


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


def messages(path, columns, clocks):
    """A message a sample, arriving in bursts."""
    kept = {name: list(map(int if np.asarray(clocks.get(name)).dtype.kind in "iu" else float, one))
            for name, one in columns.items()}  # fmt: skip
    arriving = [("/drive", k // 50 + 1.0, {name: one[k] for name, one in kept.items()}) for k in range(N)]
    return log_bench.mcap(path, arriving, b"{}")


def all_of(clocks):
    return {**clocks, **COLUMNS}


FORMATS = {
    "log.csv": table, "log.csv.gz": table, "log.tsv": lambda path, clocks: table(path, clocks, "\t"),
    "semicolon.csv": lambda path, clocks: table(path, clocks, ";"),
    "log.parquet": lambda path, clocks: parquet(path, all_of(clocks)),
    "log.mat": lambda path, clocks: mat(path, {"log": {key.split(" ")[0]: one for key, one in all_of(clocks).items()}}),
    "log.tdms": lambda path, clocks: tdms(path, all_of(clocks)),
    "log.mf4": lambda path, clocks: log_bench.mf4(
        path, (np.arange(N) * 1.0, *all_of(clocks).values()),  # the recorder's own clock is another
        names=tuple(all_of(clocks)), units=("",) * len(clocks) + ("1/min", "Nm", "degC"),
    ),
    "log.mcap": lambda path, clocks: messages(path, all_of(clocks), clocks),
    "log.xlsx": lambda path, clocks: xlsx(path, [tuple(all_of(clocks)), *zip(*all_of(clocks).values(), strict=True)]),
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


@contextlib.contextmanager
def turned_round(is_turned=True):
    """The motion backwards, its last sample first."""
    columns = dict(COLUMNS)
    if is_turned:
        COLUMNS.update({name: one[::-1] for name, one in columns.items()})
    yield
    COLUMNS.update(columns)


def clock_map(folder, name, clock):
    """A map of a file by its name with this clock."""
    text = f"time = {{{clock}}}\n{ROLES}"
    if name == "log.mat":
        text = text.replace('"clk"', '"log.clk"')
        for one, unit in zip(NAMES, ("1/min", "Nm", "degC"), strict=True):
            text = text.replace(f'"{one}"', f'"log.{one.split(" ")[0]}", unit = "{unit}"')
    return written(folder, text)


def check_drawn(folder, clock, name):
    numbers, said = CLOCKS[clock]
    with turned_round(clock == "newest first"):
        FORMATS[name](folder / name, {"clk": numbers})
    reason = REFUSED.get((clock, name)) or REFUSED.get((clock, ""))
    mapping = clock_map(folder, name, ", ".join(['channel = "clk"', *([said] if said else [])]))
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
    same_travel(read_log(tmp_path / name, clock_map(tmp_path, name, 'period = "20 ms"')))


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
        log, _ = mapped(tmp_path, file)
    same_travel(log)


def test_an_hour_that_is_missing_with_a_zone_is_a_gap(tmp_path):
    at = times("2026-03-29 01:59:57")
    turned = [one + datetime.timedelta(hours=int(k >= 150)) for k, one in enumerate(at)]
    log, _ = mapped(
        tmp_path, stamped(tmp_path / "log.csv", [f"{one.isoformat(timespec='milliseconds')}Z" for one in turned])
    )
    assert log.time.values[-1] > 3600.0


def test_a_clock_of_a_plc_is_its_time_with_the_date_beside_it(tmp_path):
    at = times("2026-03-12 23:59:57")
    stamps = [(k + 1, f"{one:%m/%d/%Y}", f"{one:%H:%M:%S.%f}"[:-3]) for k, one in enumerate(at)]
    log, text = mapped(tmp_path, stamped(tmp_path / "log.csv", stamps, ("Record", "Date", "UTC Time")))
    assert 'time = { channel = "UTC Time", date = "Date" }' in text
    same_travel(log)


def test_newest_first_is_turned_round(tmp_path):
    at = times("2026-03-12 23:59:57")
    with turned_round():
        file = stamped(tmp_path / "log.csv", [f"{one:%H:%M:%S.%f}"[:-3] for one in at[::-1]])
    with pytest.warns(LogWarning, match="the rows are newest first; they are turned round"):
        log, _ = mapped(tmp_path, file)
    same_travel(log)


def test_the_index_that_pandas_writes_is_the_clock(tmp_path):
    stamps = np.datetime64("2026-03-12T09:15:00", "ns") + np.round(TIME * 1e9).astype("timedelta64[ns]")
    parquet(tmp_path / "log.parquet", all_of({"__index_level_0__": stamps}))
    log, text = mapped(tmp_path, tmp_path / "log.parquet")
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
    log, text = mapped(tmp_path, tmp_path / "log.csv")
    assert words in text
    np.testing.assert_allclose(travel(log), travel(log), atol=1e-6)


def test_a_unit_that_numbers_leave_open_is_asked_for(tmp_path):
    table(tmp_path / "log.csv", {"Timestamp": np.arange(N) * 20})
    text = map_text(inspect_log(tmp_path / "log.csv"))
    assert '# time = { channel = "Timestamp", unit = ... }  # needed: rows are 20 apart: "ms", or "s"' in text
    with pytest.raises(
        DescriptionError, match=r'time\.unit: is needed: rows are 20 apart: "ms".*\(allowed: "ms" or "s"\)'
    ):
        read_log(tmp_path / "log.csv", written(tmp_path, 'time = {channel = "Timestamp"}\n' + ROLES))


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
    log, text = mapped(tmp_path, tmp_path / "log.csv")
    assert 'time = { channel = "TOW [s]", week = "GPS Week", unit = "s" }' in text
    same_travel(log)


# ---- what is wrong is said


@pytest.mark.parametrize("back", [0.3, 0.9, 1.0, 1.5])
@pytest.mark.parametrize("name", ["log.csv", "log.parquet"])
def test_a_clock_that_is_set_back_while_samples_go_on_is_said(tmp_path, back, name):
    FORMATS[name](tmp_path / name, {"clk": np.where(TIME < 3.0, TIME, TIME - back)})
    mapping = written(tmp_path, 'time = {channel = "clk", unit = "s"}\n' + ROLES)
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
    mapping = written(tmp_path, pdo_map(objects=("606Ch INT16", "6077h")))
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
        load_map(written(tmp_path, f"time = {{{said}}}\n" + ROLES))
    assert words in str(caught.value)


def test_stamps_take_no_scale(tmp_path):
    file = stamped(tmp_path / "log.csv", [f"{one:%H:%M:%S.%f}" for one in times("2026-03-12 10:00:00")])
    mapping = written(tmp_path, 'time = {channel = "timestamp", scale = 2}\n' + ROLES)
    with pytest.raises(DescriptionError, match=r"time\.channel = 'timestamp': holds dates or times of day"):
        read_log(file, mapping)


def test_frames_take_no_clock_of_a_table(tmp_path):
    mapping = written(tmp_path, 'time = {channel = "t"}\n' + pdo_map())
    file = written(tmp_path, "(1.0) can0 181#0000000000000000\n", "log.log")
    with pytest.raises(DescriptionError, match=r"time: is for tables and groups: frames bring their own clock"):
        read_log(file, mapping)


# ---- structures and groups with clocks of their own


def structures(path, late=2.0):
    named = zip(("n_ist", "M_ist", "T_oil"), COLUMNS.values(), strict=True)
    return mat(path, {
        name: {"time": TIME + late * place, "signals": {"values": one}, "blockName": "boom"}
        for place, (name, one) in enumerate(named)
    })  # fmt: skip


def test_times_of_structures_are_clocks_and_nothing_else(tmp_path):
    found = inspect_log(structures(tmp_path / "log.mat", late=0.0))
    assert {one.name: one.role for one in found.channels} == {
        "n_ist.signals.values": "speed", "M_ist.signals.values": "torque", "T_oil.signals.values": "temperature"
    }  # fmt: skip
    same_travel(read_log(tmp_path / "log.mat", written(tmp_path, map_text(found))))


def test_each_structure_has_its_own_clock(tmp_path):
    file = structures(tmp_path / "log.mat")
    log, _ = mapped(tmp_path, file)
    seen = np.searchsorted(TIME, log.time.values - 2.0 + 1e-9, side="right") - 1
    known = np.isfinite(log.motor_torque.values) & (seen >= 0)
    assert known.sum() > 90
    np.testing.assert_allclose(log.motor_torque.values[known], TORQUE[seen[known]])
    named = (("n_ist", "rpm"), ("M_ist", "N m"), ("T_oil", "degC"))
    keys = [f'channel = "{name}.signals.values", unit = "{unit}"' for name, unit in named]
    again = read_log(file, written(tmp_path, roles(*keys, time='channel = "n_ist.time", unit = "s"')))
    np.testing.assert_array_equal(again.motor_torque.values, log.motor_torque.values)


def test_several_clocks_beside_vectors_are_asked_for(tmp_path):
    content = {"time_n": TIME, "time": TIME + 5.0, "t": 2.0 * TIME, "n_rpm": SPEED, "M_nm": TORQUE}
    notes = {one.name: one.note for one in inspect_log(mat(tmp_path / "log.mat", content)).channels}
    assert "has no clock of its own, and the clocks t" in notes["n_rpm"]


def test_rows_of_a_wide_matrix_are_signals_and_the_first_is_the_clock(tmp_path):
    file = mat(tmp_path / "log.mat", {"ans": np.vstack([TIME, SPEED, TORQUE, OIL])})
    assert [one.name for one in inspect_log(file).channels] == ["ans[2]", "ans[3]", "ans[4]"]
    keys = [f'channel = "ans[{place}]", unit = "{unit}"' for place, unit in enumerate(("rpm", "N m", "degC"), 2)]
    same_travel(read_log(file, written(tmp_path, roles(*keys))))


def waves(path, starts, step=0.02, clocks=None):
    own = {
        name: {"wf_start_time": np.datetime64(start)} if start else {}
        for name, start in zip(NAMES, starts, strict=True)
    }
    properties = {name: {"wf_increment": step} | own.get(name, {}) for name in (*NAMES, *(clocks or {}))}
    return tdms(path, COLUMNS | (clocks or {}), properties)


@pytest.mark.parametrize("without", [0, 1, 2])
def test_a_waveform_without_a_start_time_begins_with_the_others(tmp_path, without):
    starts = [None if place == without else "2026-03-12T09:15:00" for place in range(3)]
    file = waves(tmp_path / "log.tdms", starts)
    with pytest.warns(
        LogWarning, match=r"the waveforms .* have no start time; they are read as if they began with the"
    ):
        log, _ = mapped(tmp_path, file)
    same_travel(log)


@pytest.mark.parametrize("is_stated", [True, False])
def test_a_channel_of_times_counts_before_the_step_that_labview_gives(tmp_path, is_stated):
    file = waves(tmp_path / "log.tdms", [None] * 3, 1.0, {"Time": TIME})
    clock = 'time = {channel = "Time", unit = "s"}\n' if is_stated else ""
    same_travel(read_log(file, written(tmp_path, clock + ROLES)))


def test_clocks_of_groups_that_do_not_meet_are_named(tmp_path):
    file = waves(tmp_path / "log.tdms", ["2026-03-12T09:15:00", "2026-03-12T11:15:00", "2026-03-12T09:15:00"])
    mapping = written(tmp_path, map_text(inspect_log(file)))
    with pytest.raises(LogError, match=r"the clocks do not meet: speed from 0 s to 5\.98\S* s, torque from 7200 s"):
        read_log(file, mapping)
