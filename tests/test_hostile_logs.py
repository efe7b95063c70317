"""Logs that somebody else may have written: one line, in bounded memory, whatever is in them."""

import gzip
import importlib
import json
import re
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

import ramsight
from ramsight.deploy.encoder.opcua import address_of
from ramsight.errors import LogError, RamsightError
from ramsight.logs import mcap_content, open_log, packed
from ramsight.logs.digits import decimal, is_digits, whole
from ramsight.logs.inspect import inspect_log
from ramsight.logs.mcap_content import unpacked_chunk

from . import log_bench
from .command import at_once

FIELDS = ("time_s", "motor_speed_rpm", "motor_torque_nm", "oil_temperature_c")
SCHEMA = json.dumps({"type": "object", "properties": {name: {"type": "number"} for name in FIELDS}}).encode()
FOREIGN = ["\u0661", "\u00b2", "1_000", "\uff11", "\u0967"]


def mcap(path: Path, messages, schema: bytes = SCHEMA, **options):
    return log_bench.mcap(path, [("drive", 0.02 * k, data) for k, data in enumerate(messages)], schema, **options)


def row(k):
    return json.dumps(dict(zip(FIELDS, (0.02 * k, 10.0, 2.0, 40.0), strict=True))).encode()


def read(path):
    return sum(piece.sizes["time"] for piece in open_log(path))


@pytest.mark.parametrize("message", [b"[" * 100_000, b'{"a":' * 100_000, b"[" * 100_000 + b"]" * 100_000])
def test_messages_with_deep_brackets_are_told(tmp_path, message):
    with pytest.raises(LogError, match=r"log\.mcap, column drive: a message at 0.02 s: nested too deeply"):
        read(mcap(tmp_path / "log.mcap", [row(0), message]))


@pytest.mark.parametrize(
    "schema",
    [
        b'{"properties":{"a":' * 50_000, b"{", b"[" * 100_000, b'{"properties":[1]}', b"5", b'{"properties":{"a":7}}',
        b'{"properties":{"a":{"type":[[1]]}}}', b"\xff\xfe{", b'{"properties":' + b"1" * 5000 + b"}",
    ],
)  # fmt: skip
def test_schemas_that_say_nothing_of_use_are_passed_over(tmp_path, schema):
    assert read(mcap(tmp_path / "log.mcap", [row(k) for k in range(30)], schema)) == 30


@pytest.mark.parametrize("says", [1 << 63, (1 << 64) - 1, 1 << 40])
def test_a_chunk_that_says_it_is_longer_than_any_file_is_one_line(tmp_path, says):
    content = struct.pack("<QQQII", 0, 1, 9, 0, 0) + struct.pack("<Q", says) + b"x" * 9
    chunk = b"\x06" + struct.pack("<Q", len(content)) + content
    whole = mcap(tmp_path / "log.mcap", [row(k) for k in range(30)]).read_bytes()
    (tmp_path / "log.mcap").write_bytes(whole[:8] + chunk + whole[8:])
    with pytest.raises(LogError, match=r"log\.mcap: is no MCAP file, or a damaged one"):
        read(tmp_path / "log.mcap")


@pytest.mark.parametrize("number", [b"1" * 5000, b"1e999", b"NaN", b"[[]]", b'"1"'])
def test_numbers_that_are_none_are_told_or_missing(tmp_path, number):
    wild = row(1).replace(b"10.0", number)
    path = mcap(tmp_path / "log.mcap", [row(0), wild])
    if len(number) > 1000:
        with pytest.raises(LogError, match=r"log\.mcap, column drive: a message at 0.02 s"):
            read(path)
    else:
        assert read(path) == 2


@pytest.mark.parametrize("compression", ["zstd", "lz4", ""])
def test_a_chunk_holds_what_it_says_and_no_more_than_is_allowed(compression):
    data = b"x" * 5000
    stored = data if not compression else importlib.import_module(
        {"zstd": "zstandard", "lz4": "lz4.frame"}[compression]
    ).compress(data)  # fmt: skip
    assert unpacked_chunk(stored, compression, 5000, 5000) == data
    for says in (0, 4999, 5001, 1 << 20):
        with pytest.raises(ValueError, match="holds other than"):
            unpacked_chunk(stored, compression, says, 1 << 20)
    with pytest.raises(ValueError, match="allowed: up to 4999"):
        unpacked_chunk(stored, compression, 5000, 4999)
    with pytest.raises(ValueError, match="known: zstd, lz4"):
        unpacked_chunk(stored, "rar", 5000, 5000)


def test_a_chunk_beyond_the_limit_is_one_line(tmp_path, monkeypatch):
    path = mcap(tmp_path / "log.mcap", [row(k) for k in range(3000)], chunk_size=1 << 20)
    assert read(path) == 3000
    monkeypatch.setattr("ramsight.logs.source_mcap._LARGEST", 1 << 16)
    with pytest.raises(LogError, match=r"log\.mcap: is no MCAP file, or a damaged one: a chunk of [0-9]+ bytes"):
        read(path)
    assert mcap_content.__doc__


def test_a_gzip_bomb_ends_at_a_stated_size(tmp_path, monkeypatch):
    monkeypatch.setattr(packed, "_MOST", 1 << 20)
    head = ",".join(FIELDS) + "\n"
    lines = "".join(f"{0.02 * k:.2f},{10 + k % 97},{2 + k % 89},40\n" for k in range(60_000))
    for name, text, fails in (
        ("bomb", head + "0.00,1,2,40\n" + " " * (8 << 20), True),
        ("blank", head + "0.00,1,2,40\n" + "\n" * (8 << 20), True),
        ("log", head + lines, False),
    ):
        path = tmp_path / f"{name}.csv.gz"
        path.write_bytes(gzip.compress(text.encode()))
        if fails:
            with pytest.raises(LogError, match="is it a log"):
                read(path)
        else:
            assert read(path) == 60_000, "a large log is none"


@pytest.mark.parametrize("digit", FOREIGN)
def test_digits_of_other_scripts_are_no_numbers(tmp_path, digit):
    for read_number in (whole, decimal):
        with pytest.raises(ValueError, match=re.escape(digit)):
            read_number(digit)
    assert not is_digits(digit)
    with pytest.raises(RamsightError):
        ramsight.units.parse(f"{digit} mm", "m")
    with pytest.raises(RamsightError):
        address_of(f"127.0.0.1:{digit}")
    for name, text in (
        ("log.csv", f"{','.join(FIELDS)}\n0,1,2,40\n0.02,{digit},2,40\n"),
        ("log.log", f"(0.000000) can0 185#0000\n({digit}.000000) can0 185#0000\n"),
        ("bytes.asc", f"base hex timestamps absolute\n0.000000 1 185 Rx d 2 00 {digit}\n0.1 1 185 Rx d 1 00\n"),
        ("length.asc", f"base hex timestamps absolute\n0.000000 1 185 Rx d {digit} 00 00\n0.1 1 185 Rx d 1 00\n"),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")
        with pytest.raises(RamsightError):
            read(tmp_path / name)


def test_no_source_takes_digits_of_other_scripts():
    r"""`\d` and `isdigit` know those of every script."""
    for room in ("logs", "units", "machine", "tracking", "api", "studio", "deploy"):
        for file in (Path(ramsight.__file__).parent / room).rglob("*.py"):
            text = file.read_text(encoding="utf-8")
            assert "\\d" not in text, file
            assert len(re.findall(r"\.isdigit\(\)|\.isnumeric\(\)", text)) <= text.count(".isascii()"), file


def test_a_header_of_control_characters_is_named_in_one_printable_line(tmp_path):
    (tmp_path / "log.csv").write_text("\x1f".join(FIELDS) + "\n" + "\x1f".join("1234") + "\n")
    with pytest.raises(RamsightError) as caught:
        read(tmp_path / "log.csv")
    assert str(caught.value).isprintable()
    assert r"time_s\x1fmotor_speed_rpm" in str(caught.value)


@pytest.mark.parametrize("times", [["0", "0.02", "-3590", "-3589.98"], ["0", "0.02", "", "0.06"], ["", "", "", ""]])
def test_odd_times_have_a_duration(tmp_path, times):
    rows = "".join(f"{time},10,2,40\n" for time in times)
    (tmp_path / "log.csv").write_text(f"{','.join(FIELDS)}\n{rows}")
    words = ("track", "mining-loader", "log.csv", "--unit", "boom", "--start", "100 mm")
    done = at_once(*words, cwd=tmp_path)
    if done.returncode == 0:
        lasts = float(re.search(r"samples over (\S+) s", done.stdout)[1])
        assert 0.0 <= lasts < 1.0
    else:
        assert done.stderr.startswith("error: log.csv")


def sheet_of(folder, content):
    """An Excel file whose sheet holds so."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["time_s", "x"])
    book.save(folder / "plain.xlsx")
    space = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    with (
        zipfile.ZipFile(folder / "plain.xlsx") as plain,
        zipfile.ZipFile(folder / "bomb.xlsx", "w", zipfile.ZIP_DEFLATED) as bomb,
    ):
        for name in plain.namelist():
            is_sheet = name.startswith("xl/worksheets/")
            bomb.writestr(name, space + content + b"</sheetData></worksheet>" if is_sheet else plain.read(name))
    return folder / "bomb.xlsx"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b" " * (70 << 20), "unpacks to 70 MiB"),
        (b'<row><c r="XFD1"><v>0</v></c></row>' * 100, "more than 1000000 cells"),
    ],
)
def test_a_sheet_of_nothing_is_refused_before_it_fills_the_memory(tmp_path, content, says):
    with pytest.raises(LogError, match=says):
        inspect_log(sheet_of(tmp_path, content))


def test_zeros_of_matlab_are_refused_before_they_are_unpacked(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(tmp_path / "a.mat", {"a": np.zeros(9 << 20)}, do_compression=True)
    with pytest.raises(LogError, match="unpacks to 72 MiB"):
        inspect_log(tmp_path / "a.mat")
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "b.mat", "w", userblock_size=512) as file:
        file.create_dataset("a", data=np.zeros((1, 9 << 20)), chunks=(1, 1 << 20), compression="gzip")
    with pytest.raises(LogError, match="unpacks to 72 MiB"):
        inspect_log(tmp_path / "b.mat")


def test_a_recording_of_matlab_with_noise_and_constants_is_read(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    noise = np.random.default_rng(1).normal(size=10_000)
    columns = {"t": 0.02 * np.arange(10_000), "x": noise, "c": np.zeros(10_000)}
    scipy_io.savemat(tmp_path / "a.mat", columns, do_compression=True)
    assert len(inspect_log(tmp_path / "a.mat").channels) >= 2
