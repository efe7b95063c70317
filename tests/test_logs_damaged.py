"""Damaged logs: read as far as they are whole, with a warning, or refused with the place; never a hang."""

import gzip
import importlib
import os
import signal
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from ramsight.errors import DescriptionError, LogError, LogWarning, RamsightError, UnknownNameError
from ramsight.logs import mdf_file, open_log, read_log, write_log
from ramsight.logs.can_dbc import dbc_fields
from ramsight.logs.channel_map import load_map
from ramsight.logs.csv_table import CsvTable
from ramsight.logs.inspect import inspect_log
from ramsight.logs.lines import line_blocks
from ramsight.logs.shown import inspection_table
from ramsight.logs.source_by_suffix import open_frames
from ramsight.machine import load_machine

from . import log_bench
from .command import as_command
from .log_bench import pdo_map

HEADER = f"{log_bench.HEADER}\n"
LOG = HEADER + "".join(f"{k / 100:.2f},1500,12.5,40.1\n" for k in range(1000))


def written(folder, content, name="log.csv"):
    return log_bench.written(folder, content, name)


@pytest.mark.parametrize("size", [1, 2, 3, 40, len(HEADER), len(HEADER) + 19, 400])
def test_no_row_is_lost_whatever_is_read_at_once(tmp_path, size):
    table = CsvTable(written(tmp_path, LOG), size=size)
    rows = np.concatenate(list(table.blocks(["time_s", "oil_temperature_c"])), axis=1)
    np.testing.assert_allclose(rows[0], np.arange(1000) / 100)


@pytest.mark.parametrize("tail", ["10.", "10.00,1500", "10.00,15\0\0\0\0", "\0" * 5000])
@pytest.mark.parametrize("packed", [False, True], ids=["csv", "csv.gz"])
def test_a_line_that_a_power_cut_left_is_left_out_and_said(tmp_path, tail, packed):
    data = (LOG + tail).encode()
    path = written(tmp_path, gzip.compress(data) if packed else data, "log.csv.gz" if packed else "log.csv")
    with pytest.warns(LogWarning, match=r"log\.csv.*, line 1002: the file breaks off in this line.*up to line 1001"):
        log = read_log(path)
    assert log.sizes["time"] == 1000


def test_a_gzip_file_without_its_end_is_read_as_far_as_it_goes(tmp_path):
    rng = np.random.default_rng(1)
    data = (HEADER + "".join(f"{k / 100:.2f},{rng.normal():.6f},12.5,40.1\n" for k in range(5000))).encode()
    packed = gzip.compress(data)
    with pytest.warns(LogWarning, match=r"log\.csv\.gz: is a gzip file that breaks off .*read up to line \d+"):
        log = read_log(written(tmp_path, packed[: len(packed) // 2], "log.csv.gz"))
    assert 2000 < log.sizes["time"] < 3000
    np.testing.assert_allclose(log.time, np.arange(log.sizes["time"]) / 100)


def test_several_gzip_members_are_one_file(tmp_path):
    lines = LOG.encode().splitlines(keepends=True)
    data = b"".join(gzip.compress(b"".join(lines[first : first + 100])) for first in range(0, len(lines), 100))
    assert read_log(written(tmp_path, data, "log.csv.gz")).sizes["time"] == 1000


MEASURE = """
import resource, sys
from ramsight.logs import read_log
from ramsight.logs.can_dbc import dbc_fields
from ramsight.logs.channel_map import load_map
from ramsight.logs.source_by_suffix import open_frames
from ramsight.errors import RamsightError
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for path in sys.argv[1:]:
    try:
        read_log(path) if ".csv" in path else list(open_frames(path))
    except RamsightError as error:
        print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024, error)
"""


@pytest.mark.slow
def test_a_small_file_that_unpacks_to_much_takes_no_memory(tmp_path):
    files = []
    for k, fill in enumerate((b"\n", b"\0", b"\t\n")):
        piece = zlib.compressobj(9, wbits=31)
        data = b"".join(piece.compress(fill * ((1 << 20) // len(fill))) for _ in range(80)) + piece.flush()
        files += [written(tmp_path, data, f"{k}.{suffix}") for suffix in ("csv.gz", "asc.gz", "log.gz")]
    pytest.importorskip("resource")
    command = [sys.executable, "-c", MEASURE, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    for file, line in zip(files, done.stdout.splitlines(), strict=True):
        megabytes, said = line.split(maxsplit=1)
        assert file.name in said
        assert float(megabytes) < 100.0


def blf(*objects, header=144, count=None, file_size=None):
    head = struct.pack("<4sL8xQQL", b"LOGG", header, file_size or 0, 0, len(objects) if count is None else count)
    return head.ljust(header, b"\0") + b"".join(objects)


def container(inside, size=None):
    packed = zlib.compress(inside)
    body = struct.pack("<H6xL4x", 2, len(inside) if size is None else size) + packed
    return struct.pack("<4sHHLL", b"LOBJ", 16, 1, 16 + len(body), 10) + body + bytes((16 + len(body)) % 4)


def frame(number, size=48, data=bytes(8)):
    head = struct.pack("<4sHHLL", b"LOBJ", 32, 1, size, 1) + struct.pack("<LHHQ", 2, 0, 0, number * 10_000_000)
    return head + struct.pack("<HBBL8s", 1, 0, 8, 0x181, data)


FRAMES = [frame(k) for k in range(100)]


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (blf(container(frame(0, size=0))), "damaged in the container at byte 144: an object of 0 bytes"),
        (blf(container(b"LOBJ" + bytes(100))), "an object of 0 bytes"),
        (blf(container(b"x" * 100)), "no object where one should begin"),
        (blf(struct.pack("<4sHHLL", b"LOBJ", 16, 1, 0, 10) + bytes(99)), "damaged at byte 144: an object of 0 bytes"),
        (blf(struct.pack("<4sHHLL", b"LOBJ", 16, 1, 1 << 31, 10)), "damaged at byte 144: an object of 2147483648"),
        (blf(container(b"".join(FRAMES), size=1 << 31)), "a container with 2147483648 bytes"),
        (blf(container(b"".join(FRAMES), size=200)), "a container that cannot be unpacked"),
        (blf(container(b"".join(FRAMES))[:-9] + bytes(9)), "a container that cannot be unpacked"),
        (blf(b"JUNK" + bytes(40)), "damaged at byte 144: no object begins there"),
        (b"LOGG" + bytes(200), "is no BLF file: a header of 0 bytes"),
        (b"", "is no BLF file"),
    ],
)
def test_a_damaged_blf_file_says_where_and_ends(tmp_path, data, text):
    with pytest.raises(LogError, match=rf"log\.blf: .*{text}"):
        list(open_frames(written(tmp_path, data, "log.blf")))


def test_a_blf_file_that_breaks_off_is_read_and_said(tmp_path):
    whole = blf(container(b"".join(FRAMES[:60])), container(b"".join(FRAMES[60:])), count=100)
    assert len(list(open_frames(written(tmp_path, whole, "log.blf")))) == 100
    with pytest.warns(LogWarning, match=r"log\.blf: the file breaks off at byte \d+; \d+ of 100 objects; read \d+ fr"):
        frames = list(open_frames(written(tmp_path, whole[:-40], "log.blf")))
    assert 60 <= len(frames) < 100
    with pytest.warns(LogWarning, match=r"60 of 100 objects; read 60 frames, up to 0\.59 s"):
        list(open_frames(written(tmp_path, blf(container(b"".join(FRAMES[:60])), count=100), "log.blf")))


def test_an_object_may_go_on_in_the_next_container(tmp_path):
    inside = b"".join(FRAMES)
    pieces = [container(inside[first : first + 70]) for first in range(0, len(inside), 70)]
    assert len(list(open_frames(written(tmp_path, blf(*pieces, count=100), "log.blf")))) == 100


ASC = "date Sat Nov 21 06:30:00.000 2026\nbase hex  timestamps {}\ninternal events logged\n// version 9.0.0\n"


def test_relative_times_of_an_asc_file_add_up(tmp_path):
    row = " 0.010000 1  181             Rx   d 8 01 02 03 04 05 06 07 08\n"
    event = " 0.500000 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n"
    relative = written(tmp_path, ASC.format("relative") + row * 50 + event + row * 50, "log.asc")
    frames = list(open_frames(relative))
    assert len(frames) == 100
    assert frames[-1].time == pytest.approx(1.5)
    absolute = written(tmp_path, ASC.format("absolute") + row, "log.asc")
    assert [one.time for one in open_frames(absolute)] == [0.01]


@pytest.mark.parametrize(
    ("name", "head", "row", "broken"),
    [
        ("log.asc", ASC.format("absolute"), "{:.6f} 1  181  Rx   d 8 01 02 03 04 05 06 07 08\n", "9.0 1 181 Rx d 8 01"),
        ("log.log", "", "({:.6f}) can0 181#0102030405060708\n", "(9.000000) can0 181#01020"),
        ("log.log", "", " ({:.6f})  can0  181   [8]  01 02 03 04 05 06 07 08\n", " (9.000000) can0  181  [8]  01 02"),
    ],
    ids=["ASC", "candump -L", "candump on a screen"],
)
def test_a_text_log_that_breaks_off_is_read_and_said(tmp_path, name, head, row, broken):
    rows = head + "".join(row.format(k / 100) for k in range(100))
    lines = rows.count("\n")
    with pytest.warns(LogWarning, match=rf"{name}, line {lines + 1}: the file breaks off in this line"):
        frames = list(open_frames(written(tmp_path, rows + broken, name)))
    assert len(frames) == 100
    assert frames[-1] == (0.99, 0x181, frames[-1].bus, bytes(range(1, 9)))
    with pytest.raises(LogError, match=rf"{name}, line {lines + 1}: is no CAN frame"):
        list(open_frames(written(tmp_path, rows + broken + "\n" + row.format(1.0), name)))


def test_frames_are_those_of_python_can(tmp_path):
    can = importlib.import_module("can")
    sent = []
    for k in range(200):
        is_fd = k % 5 == 0
        sent.append(
            can.Message(
                timestamp=k * 0.01,
                arbitration_id=0x181 if k % 3 else 0x18FE6817,
                is_extended_id=k % 3 == 0,
                data=bytes(range(k % 9)) if not is_fd else bytes(16),
                is_fd=is_fd,
                is_remote_frame=k % 7 == 3 and not is_fd,
                is_error_frame=k % 50 == 49,
                channel=k % 2,
            )
        )
    for name in ("log.blf", "log.asc", "log.log"):
        with can.Logger(str(tmp_path / name)) as logger:
            for message in sent:
                logger(message)
        frames = list(open_frames(tmp_path / name))
        assert len(frames) == len(sent)
        for frame, message in zip(frames, sent, strict=True):
            if message.is_error_frame or message.is_remote_frame:
                assert frame.data is None
                continue
            assert frame.time - frames[0].time == pytest.approx(message.timestamp, abs=1e-6)
            assert frame.key == message.arbitration_id | (1 << 31 if message.is_extended_id else 0)
            assert (frame.data, frame.bus) == (bytes(message.data), message.channel)


def test_candump_says_what_to_do_where_it_has_no_usable_time(tmp_path):
    with pytest.raises(LogError, match=r"line 1: .*no time stamp; record with candump -L"):
        list(open_frames(written(tmp_path, "  can0  181   [2]  01 02\n", "log.log")))
    deltas = " (000.010000)  can0  181   [2]  01 02\n" * 100
    with pytest.raises(LogError, match=r"line 50: .*candump -td"):
        list(open_frames(written(tmp_path, deltas, "log.log")))


@pytest.fixture(scope="module")
def parquet(tmp_path_factory):
    path = tmp_path_factory.mktemp("parquet") / "log.parquet"
    write_log(read_log(written(path.parent, LOG)), path)
    return path


def test_a_damaged_parquet_file_names_itself_and_never_standard_output(parquet, tmp_path):
    data = parquet.read_bytes()
    for cut in (4, len(data) // 2, len(data) - 4):
        with pytest.raises(LogError, match=r"cut\.parquet: is no Parquet file, or a damaged one"):
            read_log(written(tmp_path, data[:cut], "cut.parquet"))
    hole = data[:60] + bytes(len(data) // 3) + data[60 + len(data) // 3 :]
    path = written(tmp_path, hole, "hole.parquet")
    done = as_command("track", "mining-loader", path, "--unit", "boom")
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {path}: is damaged after row")
    assert len(done.stderr.splitlines()) == 1


def test_flipped_bits_in_a_zipped_mdf_file_are_refused_in_one_line(tmp_path):
    write_log(read_log(written(tmp_path, LOG)), tmp_path / "log.mf4")
    data = bytearray((tmp_path / "log.mf4").read_bytes())
    rng, refused = np.random.default_rng(3), 0
    for _ in range(60):
        bad = bytearray(data)
        for place in rng.integers(64, len(data), 8):
            bad[place] ^= 1 << int(rng.integers(8))
        path, said = written(tmp_path, bytes(bad), "bad.mf4"), ""
        try:
            read_log(path)
        except RamsightError as error:
            said = str(error)
            refused += 1
        assert said.startswith(str(path)) or not said
        assert len(said.splitlines()) < 2
    assert refused > 20


def test_no_value_is_repeated_at_length():
    errors = [
        DescriptionError("is wrong", key="a", value="x" * 200_000),
        UnknownNameError("channel", "y" * 200_000, [f"c{k}" for k in range(5000)]),
        LogError("is wrong", file="f", column="z" * 200_000),
    ]
    assert [len(str(error)) < 1000 for error in errors] == [True] * 3


def calls(work):
    """How many functions are called, of Python and of C: what a clock would say, the same on every machine."""
    count = 0

    def profile(_frame, event, _argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(profile)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def test_blank_lines_cost_no_call_each(tmp_path):
    path = written(tmp_path, HEADER + "\n" * (4 << 20))
    assert sum(len(block) for block in line_blocks(path)) == len(HEADER)
    assert calls(lambda: list(line_blocks(path))) < 1000


def test_what_can_be_listed_of_a_damaged_log_is_listed(tmp_path):
    path = written(tmp_path, LOG + "10.00,1500\n" + "10.01,1500,12.5,40.1\n" * 5)
    with pytest.warns(LogWarning, match=r"only what stands before this is listed: .*line 1002: has 2 cells"):
        found = inspect_log(path)
    assert [one.name for one in found.channels] == ["motor_speed_rpm", "motor_torque_nm", "oil_temperature_c"]
    with pytest.raises(LogError, match="line 1002"):
        list(open_log(path))
    assert Path(found.file).name == "log.csv"


def test_a_page_of_a_parquet_file_that_does_not_fit_its_checksum_is_refused(parquet, tmp_path):
    data, refused = parquet.read_bytes(), 0
    for place in range(100, len(data) // 2, len(data) // 40):
        bad = bytearray(data)
        bad[place] ^= 0x10
        try:
            read_log(written(tmp_path, bytes(bad), "bad.parquet"))
        except RamsightError:
            refused += 1
    assert refused >= 18


@pytest.fixture
def mf4(tmp_path):
    write_log(read_log(written(tmp_path, LOG)), tmp_path / "log.mf4")
    return tmp_path / "log.mf4"


@pytest.mark.posix
@pytest.mark.parametrize("way", ["dies", "hangs"])
def test_a_reader_that_dies_or_hangs_over_a_file_is_one_error_and_the_next_file_is_read(mf4, monkeypatch, way):
    assert read_log(mf4).sizes["time"] == 1000
    reader = mdf_file._current[0]
    reader._process.send_signal(signal.SIGSEGV if way == "dies" else signal.SIGSTOP)
    if way == "hangs":
        monkeypatch.setattr(mdf_file, "_PATIENCE", 0.3)
    else:  # how soon a dead one is noticed is the machine's affair
        monkeypatch.setattr(type(reader), "is_alive", property(lambda self: True))
    said = "broke down over it" if way == "dies" else "no progress within 0 s"
    with pytest.raises(LogError, match=rf"log\.mf4: is no MDF file, or a damaged one: .*{said}"):
        read_log(mf4)
    monkeypatch.undo()
    assert read_log(mf4).sizes["time"] == 1000


def test_a_process_that_was_forked_has_a_reader_of_its_own(mf4):
    read_log(mf4)
    before = mdf_file._current[0]
    before.owner = -1
    try:
        assert read_log(mf4).sizes["time"] == 1000
        assert mdf_file._current[0] is not before
    finally:
        before.end()


def test_an_mdf_file_without_a_channel_to_read_is_listed(tmp_path):
    asammdf = importlib.import_module("asammdf")
    with asammdf.MDF(version="4.10") as mdf:
        mdf.save(tmp_path / "empty.mf4", overwrite=True)
    assert inspect_log(tmp_path / "empty.mf4").channels == []


def test_two_mdf_files_are_read_side_by_side(mf4):
    pieces = zip(open_log(mf4, samples=100), open_log(mf4, samples=100), strict=True)
    assert sum(one.identical(other) for one, other in pieces) == 10


def test_a_clock_that_goes_back_is_said(tmp_path):
    rows = LOG.splitlines(keepends=True)
    path = written(tmp_path, "".join([*rows[:800], *rows[300:]]))
    with pytest.warns(LogWarning, match=r"time goes back once from 7\.98 s to 2\.99 s: .*there twice"):
        assert read_log(path).sizes["time"] == 1500


@pytest.mark.posix
def test_a_pipe_is_no_file_and_nobody_waits_for_it(tmp_path):
    for name in ("pipe.csv", "pipe.parquet", "pipe.mf4", "pipe.blf", "pipe.log"):
        os.mkfifo(tmp_path / name)
        with pytest.raises(LogError, match="is not a regular file"):
            list(open_log(tmp_path / name))
    with pytest.raises(DescriptionError, match="is not a regular file"):
        load_map(tmp_path / "pipe.csv")
    with pytest.raises(DescriptionError, match="is not a regular file"):
        load_machine(str(tmp_path / "pipe.csv"))


def test_a_description_that_is_too_large_is_not_read(tmp_path):
    with open(tmp_path / "large.toml", "wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(DescriptionError, match=r"large\.toml: is too large for a description"):
        load_machine(str(tmp_path / "large.toml"))


def test_the_clock_of_a_can_log_is_watched_from_its_first_frame(tmp_path):
    text = ASC.format("absolute") + "8.000000 1  281  Rx   d 8 00 00 00 00 00 00 00 00\n"
    text += "".join(f"{k / 100:.6f} 1  181  Rx   d 8 01 02 03 04 05 06 07 08\n" for k in range(100))
    log_bench.written(tmp_path, pdo_map())
    with pytest.warns(LogWarning, match=r"log\.asc: time goes back once from 8 s to 0 s") as caught:
        read_log(written(tmp_path, text, "log.asc"), tmp_path / "map.toml")
    assert len(caught) == 1


def test_signals_of_a_dbc_file_that_are_no_numbers_are_left_out(tmp_path):
    text = 'VERSION ""\n\nBO_ 385 DriveState: 64 Drive\n SG_ MotorSpeed : 0|16@1- (0.5,0) [0|0] "rpm" X\n'
    text += ' SG_ Name : 16|80@1+ (1,0) [0|0] "" X\n SG_ Beyond : 505|16@1+ (1,0) [0|0] "" X\n'
    text += ' SG_ Small : 120|8@1- (1,0) [0|0] "" X\n\nSIG_VALTYPE_ 385 Small : 1;\n'
    exact, _ = dbc_fields(written(tmp_path, text, "odd.dbc"))
    assert [field.name for field in exact[385]] == ["DriveState.MotorSpeed"]


def test_a_table_of_many_columns_is_read_in_proportion(tmp_path):
    """Ten times the columns take ten times the work, not a hundred times."""

    def work(columns: int) -> int:
        path, names = tmp_path / f"{columns}.csv", ",".join(f"c{k}" for k in range(columns))
        rows = [f"{0.02 * k:.2f},0,1,40,{','.join(['1'] * columns)}" for k in range(3)]
        path.write_text("\n".join([f"time_s,motor_speed_rpm,motor_torque_nm,oil_temperature_c,{names}", *rows]) + "\n")

        def read() -> None:
            found = inspect_log(path)
            inspection_table(found)
            read_log(path)
            assert len(found.channels) == columns + 3

        return calls(read)

    work(50)
    assert work(1_000) < 20.0 * work(100)


def test_a_table_of_very_many_columns_is_shown_in_part(tmp_path, capsys):
    names = [f"c{k}" for k in range(2050)]
    (tmp_path / "wide.csv").write_text(
        f"{','.join(names)},time_s,motor_speed_rpm\n" + f"{'1,' * 2050}0.00,5\n{'1,' * 2050}0.02,6\n"
    )
    Console(width=140).print(inspection_table(inspect_log(tmp_path / "wide.csv")))
    said = capsys.readouterr().out
    assert "motor_speed_rpm" in said, "what has a use comes before all others"
    assert "and 51 more" in said


def test_a_clock_that_is_no_time_is_no_clock(tmp_path):
    """Cells between blanks are one column, whose name begins like that of a clock."""
    path = tmp_path / "blanks.txt"
    path.write_text("time_s  motor_torque_nm  oil_temperature_c\n0.00  1  40\n0.02  1  40\n")
    found = inspect_log(path)
    assert found.clock.timed.columns == ()
    assert [one.name for one in found.channels] == ["time_s  motor_torque_nm  oil_temperature_c"]
