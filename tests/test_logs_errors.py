"""Logs that cannot be read: one line that says where, and never another kind of error."""

import gzip
import re
import warnings

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ramsight.errors import DescriptionError, LogError, LogWarning, MissingColumnError, RamsightError
from ramsight.logs import open_log, read_log, read_truth

from .log_bench import HEADER, written

ROWS = ["0.00,0,-0.6875,39.8", "0.02,1500,12.5,40.1", "0.04,-1500,0,39.7"]


def log_of(*lines):
    return "\n".join(lines).encode() + b"\n"


PLAIN = log_of(HEADER, *ROWS)
WITH_REFERENCE = log_of(HEADER + ",reference_m", *(row + "," for row in ROWS))


def refusal(folder, data, name="log.csv", read=read_log):
    path = folder / name
    path.write_bytes(data)
    with pytest.raises(LogError) as caught:
        read(path)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert text.splitlines() == [text]
    return caught.value, text.removeprefix(str(path))


TWICE = "is there more than once: a table has one clock; write all channels over one, or a file for each"
OIL = "a drive log's oil is between -60 and 200 °C: is the column in another unit?"


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", ": is empty"),
        (b" \r\n\n", ": is empty"),
        (b"\xef\xbb\xbf", ": is empty"),
        (log_of(HEADER), ": has a header but no rows"),
        (log_of("", HEADER, *ROWS), ", line 1: is blank where the header should stand"),
        (log_of(HEADER, ROWS[0], "0.02,1500,fast,40.1"), ", line 3, column motor_torque_nm: is not a number: 'fast'"),
        (log_of(HEADER, ROWS[0], "0.02,1_500,1,40.1"), ", line 3, column motor_speed_rpm: is not a number: '1_500'"),
        (log_of(HEADER, "0,١,1,40"), ", line 2, column motor_speed_rpm: is not a number: '١'"),
        (log_of(HEADER, "0,1\0,1,40"), ", line 2, column motor_speed_rpm: is not a number: '1\\x00'"),
        (log_of(HEADER, ",1,1,40", "nan,1,1,40"), ": has no time: not one sample has a number there"),
        (log_of(HEADER, ROWS[0], "0.02,1,40.1"), ", line 3: has 3 cells where the header has 4"),
        (log_of(HEADER, *ROWS, "0.06"), ", line 5: has 1 cell where the header has 4"),
        (log_of(HEADER, ROWS[0] + ",7"), ", line 2: has 5 cells where the header has 4"),
        (log_of(HEADER, "0,0,0", "0.02,1,1,40,7"), ", line 2: has 3 cells where the header has 4"),
        (log_of(HEADER, ROWS[0], " ", ROWS[1]), ", line 3: is blank"),
        (log_of(HEADER + ",time_s", ROWS[0] + ",0"), f", line 1, column time_s: {TWICE}"),
        (log_of(HEADER, ROWS[0], "0.02,0,0,313.2"), f", column oil_temperature_c: is 313.2 °C; {OIL}"),
        (log_of(HEADER, "0.02,0,0,-300"), f", column oil_temperature_c: is -300 °C; {OIL}"),
        (log_of(HEADER, ROWS[0]) + b"0.02,\xff", ", line 3: byte 0xff is not UTF-8 text"),
        (b"\xff\xfe\x00\xd8" + PLAIN.decode().encode("utf-16-le"), ", line 1: is not UTF-16 text though it begins so"),
        (gzip.compress(PLAIN, mtime=0), ": is a gzip file; give it a name that ends in .csv.gz"),
        (
            log_of(HEADER.replace(",", ";"), "0,0;1,5;zwölf;40,1"),
            ", line 2, column motor_torque_nm: is not a number: 'zwölf'",
        ),
        (
            log_of(HEADER, f'0,"{"1" * 140_000}",1,40'),
            ", line 2: is no row of a CSV file: field larger than field limit (131072)",
        ),
    ],
)
def test_a_log_that_cannot_be_read_says_where(tmp_path, data, text):
    error, said = refusal(tmp_path, data)
    assert said.partition("; save it as UTF-8, or, for a log, ramsight logs inspect ")[0] == text
    line, column = re.match(r"(?:, line (\d+))?(?:, column (\w+))?", text).groups()
    assert (error.line, error.column) == (line and int(line), column)


def test_a_log_that_cannot_be_opened_says_so_when_it_is_opened(tmp_path):
    """And not when its first piece is read, which may be far from there."""
    with pytest.raises(LogError, match="no such file"):
        open_log(tmp_path / "missing.csv")
    with pytest.raises(LogError, match="motor_speed_rpm"):
        open_log(written(tmp_path, "time_s,speed\n0.0,1.0\n", "columns.csv"))


def test_missing_columns_are_named_with_those_found(tmp_path):
    error, text = refusal(tmp_path, b"time_s,speed,motor_torque_nm\n0,1,2\n")
    assert isinstance(error, MissingColumnError)
    assert error.missing == ["motor_speed_rpm", "oil_temperature_c"]
    assert text.startswith(
        ": missing columns motor_speed_rpm, oil_temperature_c; found time_s, speed, motor_torque_nm; "
    )
    assert re.search(r"ramsight logs inspect \S+log\.csv --out map\.toml writes one$", text)


def test_a_header_of_rubbish_is_not_repeated_at_length(tmp_path):
    _, text = refusal(tmp_path, b"x" * 100_000 + b"," * 1000 + "\x07\u2028\x85".encode() + b"\n1\n")
    assert len(text) < 500


def test_a_truth_without_a_position_is_refused(tmp_path):
    error, text = refusal(tmp_path, b"time_s,pressure_a_pa\n0,1\n", read=read_truth)
    assert isinstance(error, MissingColumnError)
    assert text == ": missing column position_m; found time_s, pressure_a_pa"
    _, text = refusal(tmp_path, b"time_s,position_m,pressure_a_pa\n0,1,\n", read=read_truth)
    assert text == ", line 2, column pressure_a_pa: is empty where a number should stand"
    _, text = refusal(tmp_path, b"time_s,position_m\n1,1\n1,1\n", read=read_truth)
    assert text == ", line 3, column time_s: time does not increase: 1.0 after 1.0"


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (PLAIN, ": is not a gzip file though its name ends in .gz"),
        (gzip.compress(PLAIN)[:15], ": is a gzip file that breaks off before its first line has ended"),
        (gzip.compress(PLAIN)[:15] + bytes(40), ": is a damaged gzip file"),
        (gzip.compress(b""), ": is empty"),
    ],
    ids=["plain text", "cut off", "damaged", "nothing in it"],
)
def test_a_broken_gzip_file_says_so(tmp_path, data, text):
    assert refusal(tmp_path, data, "log.csv.gz")[1] == text


def test_a_file_that_is_none_says_so(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        read_log(tmp_path / "absent.csv")
    with pytest.raises(LogError, match="is a directory"):
        read_log(tmp_path)
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(LogError, match="is a directory"):
        read_log(tmp_path / "folder.csv")
    with pytest.raises(DescriptionError, match="holds a null character"):
        read_log("null\0character.csv")
    (tmp_path / "log.csv").write_bytes(PLAIN)
    with pytest.raises(LogError, match="cannot be read: Not a directory"):
        read_log(tmp_path / "log.csv" / "log.csv")
    with pytest.raises(LogError) as caught:
        read_log(tmp_path / "two\nlines.csv")
    assert len(str(caught.value).splitlines()) == 1


ALPHABET = b'0123456789.,;-+eE_"\n\r\t nainf\x00\x0b\x1c\x85\xff\xe2\x80\xa8'
EDIT = st.tuples(
    st.integers(0, 400), st.integers(0, 3), st.binary(max_size=3) | st.sampled_from([bytes([b]) for b in ALPHABET])
)


def read_or_refuse(path):
    """Read a log; whatever goes wrong must be a RamsightError of one line."""
    for read in (read_log, read_truth):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", LogWarning)
                log = read(path)
        except RamsightError as error:
            text = str(error)
            assert text.splitlines() == [text]
            assert text.isprintable()
            assert len(text) < 1500
        else:
            assert log.sizes["time"] >= 1


@given(source=st.sampled_from([PLAIN, WITH_REFERENCE]), edits=st.lists(EDIT, min_size=1, max_size=4))
@example(source=PLAIN, edits=[(70, 1, b"\xe2\x80\xa8")])
@example(source=PLAIN, edits=[(70, 1, b"\x85")])
def test_a_mutated_log_is_read_or_refused(tmp_path_factory, source, edits):
    data = source
    for place, length, new in edits:
        at = place % len(data) if data else 0
        data = data[:at] + new + data[at + length :]
    path = tmp_path_factory.mktemp("log") / "log.csv"
    path.write_bytes(data)
    read_or_refuse(path)


@given(data=st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("log")
    rows, packed = HEADER.encode() + b"\n" + data, gzip.compress(data)
    for name, content in (("log.csv", data), ("log.csv.gz", data), ("packed.csv.gz", packed), ("rows.csv", rows)):
        read_or_refuse(written(folder, content, name))


@given(place=st.integers(0, 200), new=st.binary(min_size=1, max_size=2))
def test_a_mutated_gzip_file_is_read_or_refused(tmp_path_factory, place, new):
    data = gzip.compress(PLAIN, mtime=0)
    at = place % len(data)
    path = tmp_path_factory.mktemp("log") / "log.csv.gz"
    path.write_bytes(data[:at] + new + data[at + len(new) :])
    read_or_refuse(path)
