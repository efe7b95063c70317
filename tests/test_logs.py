"""Drive logs and truth files: what is read, what is written, and what stays out."""

import gzip
import math

import numpy as np
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st

from ramsight.errors import OutputError
from ramsight.logs import read_log, read_truth, write_log
from ramsight.logs.csv_table import read_columns

from . import log_bench
from .log_bench import HEADER

ROWS = ["0.00,0,-0.6875,39.8", "0.02,1500,12.5,40.1", "0.04,-1500,0,39.7"]
PLAIN = "\n".join([HEADER, *ROWS]) + "\n"


def written(folder, content, name="log.csv"):
    return log_bench.written(folder, content, name)


def drive_log(time, speed, torque, temperature, reference=None):
    columns = {"motor_speed": speed, "motor_torque": torque, "oil_temperature": temperature, "reference": reference}
    variables = {name: ("time", values) for name, values in columns.items() if values is not None}
    return xarray.Dataset(variables, coords={"time": ("time", time)})


def test_a_log_is_read_into_si_units(tmp_path):
    log = read_log(written(tmp_path, PLAIN))
    assert log.time.values.tolist() == [0.0, 0.02, 0.04]
    np.testing.assert_allclose(log.motor_speed, [0.0, 50.0 * math.pi, -50.0 * math.pi], rtol=1e-15)
    assert log.motor_torque.values.tolist() == [-0.6875, 12.5, 0.0]
    np.testing.assert_allclose(log.oil_temperature, [312.95, 313.25, 312.85], rtol=1e-15)
    units = {name: log[name].attrs["units"] for name in log.variables}
    assert units == {"time": "s", "motor_speed": "rad/s", "motor_torque": "N m", "oil_temperature": "K"}
    assert all(log[name].attrs["long_name"] for name in log.variables)
    assert all(log[name].dtype == np.float64 for name in log.variables)


def by_line(change):
    return "\n".join(change(line) for line in PLAIN.splitlines())


FORMS = {
    "byte-order mark": "\ufeff" + PLAIN,
    "CRLF": PLAIN.replace("\n", "\r\n"),
    "CR": PLAIN.replace("\n", "\r"),
    "no newline at the end": PLAIN.rstrip("\n"),
    "blank lines at the end": PLAIN + "\n\n  \n\r\n",
    "blanks around cells": PLAIN.replace(",", " ,\t"),
    "blanks around lines": by_line(lambda line: f"  {line}  "),
    "other order": by_line(lambda line: ",".join(reversed(line.split(",")))),
    "text in another column": by_line(lambda line: f"{line},x"),
    "comma at the end": by_line(lambda line: f"{line},"),
    "quotes": by_line(lambda line: ",".join(f'"{cell}"' for cell in line.split(","))),
    "quoted comma": by_line(lambda line: f'{line},"a, b"'),
    "semicolon and decimal comma": PLAIN.replace(",", ";").replace(".", ","),
    "semicolon and decimal point": PLAIN.replace(",", ";"),
    "exponent": PLAIN.replace("0.02", "2e-2"),
    "letters beyond ASCII": by_line(lambda line: f"{line},Öltemperatur 漢"),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", ["other.csv", "other.csv.gz"])
def test_the_same_log_in_another_form_reads_the_same(tmp_path, form, name):
    expected = read_log(written(tmp_path, PLAIN))
    xarray.testing.assert_identical(read_log(written(tmp_path, FORMS[form], name)), expected)


def test_truth_does_not_get_into_a_drive_log(tmp_path):
    lines = [f"{line},{extra}" for line, extra in zip(PLAIN.splitlines(), ["position_m", 1, 2, 3], strict=True)]
    log = read_log(written(tmp_path, "\n".join(lines)))
    assert set(log.variables) == {"time", "motor_speed", "motor_torque", "oil_temperature"}
    assert log.attrs == {}


@pytest.mark.parametrize("place", [0, 2, 4], ids=["first", "middle", "last"])
def test_a_reference_is_nan_where_its_cell_is_empty(tmp_path, place):
    cells = ["reference_m", "", "0.79", ""]
    lines = []
    for line, cell in zip(PLAIN.splitlines(), cells, strict=True):
        parts = line.split(",")
        parts.insert(place, cell)
        lines.append(",".join(parts))
    log = read_log(written(tmp_path, "\n".join(lines)))
    np.testing.assert_array_equal(log.reference, [np.nan, 0.79, np.nan])
    assert log.reference.attrs["units"] == "m"


def test_truth_has_pressures_where_the_file_has_them(tmp_path):
    text = "position_m,time_s,pressure_b_pa\n0.1,0,400000\n0.2,1,500000\n"
    truth = read_truth(written(tmp_path, text))
    assert set(truth.variables) == {"time", "position", "pressure_b"}
    assert truth.position.values.tolist() == [0.1, 0.2]
    assert (truth.position.attrs["units"], truth.pressure_b.attrs["units"]) == ("m", "Pa")


def test_every_recorded_trace_reads(traces):
    assert len(traces) == 17
    for trace in traces:
        log, truth = read_log(trace.log), read_truth(trace.truth)
        np.testing.assert_allclose(log.time, truth.time)
        assert float(truth.position[0]) == pytest.approx(trace.case["x0"], abs=1e-3)
        assert float(log.oil_temperature.mean()) - 273.15 == pytest.approx(trace.case["temp_c"], abs=0.1)
        speed = np.interp(log.time, *np.transpose(trace.case["speed"])) * 2.0 * math.pi / 60.0
        np.testing.assert_allclose(log.motor_speed, speed, atol=0.5)  # 5 rpm: the case's corners are rounded
        assert set(truth.data_vars) == {"position", "pressure_a", "pressure_b"}


def test_a_simulated_log_written_and_read_is_the_same(trace, tmp_path):
    log = read_log(trace("boom_441kN_40C").log)
    write_log(log, tmp_path / "again.csv.gz")
    again = read_log(tmp_path / "again.csv.gz")
    xarray.testing.assert_allclose(again, log, rtol=1e-12, atol=0.0)
    assert again.time.values.tolist() == log.time.values.tolist()
    with gzip.open(tmp_path / "again.csv.gz", "rt") as file:
        assert file.readline() == HEADER + "\n"
        assert file.readline() == "0,0,-0.6875,39.8\n"


finite = {"allow_nan": False, "allow_infinity": False}


@given(
    rows=st.lists(
        st.tuples(
            st.floats(1e-4, 1e3),
            st.floats(-1e4, 1e4, **finite),
            st.floats(-1e4, 1e4, **finite),
            st.floats(214.0, 473.0),
            st.none() | st.floats(0.0, 3.0),
        ),
        min_size=1,
        max_size=20,
    ),
    start=st.floats(-1e4, 1e4),
    packed=st.booleans(),
    has_reference=st.booleans(),
)
def test_any_log_written_is_read_the_same(tmp_path_factory, rows, start, packed, has_reference):
    steps, speed, torque, temperature, reference = map(list, zip(*rows, strict=True))
    known = [np.nan if r is None else r for r in reference] if has_reference else None
    log = drive_log(start + np.cumsum(steps), speed, torque, temperature, known)
    path = tmp_path_factory.mktemp("log") / ("log.csv.gz" if packed else "log.csv")
    write_log(log, path)
    again = read_log(path)
    assert set(again.variables) == set(log.variables)
    for name in log.variables:
        np.testing.assert_allclose(again[name], log[name], rtol=1e-11, atol=1e-9)


def test_a_whole_run_is_written_without_its_truth(tmp_path):
    log = drive_log([0.0, 1.0], [1.0, 2.0], [3.0, 4.0], [300.0, 301.0])
    log["position"] = ("time", [0.1, 0.2])
    write_log(log, tmp_path / "log.csv")
    assert (tmp_path / "log.csv").read_text().splitlines()[0] == HEADER


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (lambda log: log.drop_vars("motor_torque"), "missing motor_torque"),
        (lambda log: log.assign(oil_temperature=("time", [40.0, 40.0])), "another unit"),
        (lambda log: log.assign_coords(time=[np.nan, np.nan]), "no samples"),
        (lambda log: log.isel(time=slice(0)), "no samples"),
        (lambda log: log.assign(motor_speed=("other", [0.0])), "over time alone"),
    ],
    ids=["absent", "degrees Celsius", "no time", "empty", "other dimension"],
)
def test_what_could_not_be_read_is_not_written(tmp_path, change, part):
    log = change(drive_log([0.0, 1.0], [1.0, 2.0], [3.0, 4.0], [300.0, 301.0]))
    with pytest.raises(OutputError, match=part):
        write_log(log, tmp_path / "log.csv")
    assert list(tmp_path.iterdir()) == []


def test_the_careful_pass_reads_what_the_fast_one_reads(tmp_path, trace):
    with gzip.open(trace("bucket_48kN_40C").log, "rt") as file:
        text = file.read()
    names = ["time_s", "oil_temperature_c"]
    fast = read_columns(written(tmp_path, text), names)
    quoted = text.replace("0.020,", '"0.020",', 1)
    careful = read_columns(written(tmp_path, quoted), names)
    for name in names:
        assert fast[name].tolist() == careful[name].tolist()


def test_a_long_log_takes_the_fast_pass_alone(tmp_path, monkeypatch):
    def slow(*_args, **_said):
        raise AssertionError("the slow pass was taken for a log without faults")

    monkeypatch.setattr("ramsight.logs.csv_table.parse_carefully", slow)
    rows = 23_000
    text = HEADER + "\n" + "".join(f"{i * 0.02:.3f},1500.000,-12.5000,40.1\n" for i in range(rows))
    path = written(tmp_path, text)
    assert read_log(path).sizes["time"] == rows


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be", "utf-16-le"])
@pytest.mark.parametrize("end", ["\n", "\r\n", ""], ids=repr)
def test_a_spreadsheets_unicode_text_is_read(tmp_path, encoding, end):
    expected = read_log(written(tmp_path, PLAIN))
    text = PLAIN.replace(",", "\t").replace("\n", end or "\n").rstrip("\n" if not end else "")
    data = (text if encoding == "utf-16" else f"\ufeff{text}").encode(encoding)
    xarray.testing.assert_identical(read_log(written(tmp_path, data, "other.txt")), expected)
