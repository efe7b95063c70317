"""Results appear whole or not at all; and the bar that shows their progress."""

import errno
import gzip
import os
import stat
import sys

import numpy as np
import pytest
import xarray
from hypothesis import given
from hypothesis import strategies as st

from ramsight.errors import OutputError
from ramsight.logs import read_log
from ramsight.output import atomic_path, column_name, write_dataset, write_table
from ramsight.output.cells import rows_text


def refusal(call, *arguments):
    with pytest.raises(OutputError) as caught:
        call(*arguments)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def write_text(path, text="new"):
    with atomic_path(path) as draft:
        draft.write_text(text)


def run():
    return xarray.Dataset(
        {
            "position": ("time", [0.1, np.nan, 0.3], {"units": "m"}),
            "pressure_a": ("time", [1e5, 2e5, 3.4e6], {"units": "Pa"}),
            "motor_speed": ("time", [0.0, -1e-9, 157.07963], {"units": "rad/s"}),
            "status": ("time", np.array([0, 1, 2], dtype=np.int8)),
            "moving": ("time", [True, False, True]),
        },
        coords={"time": ("time", [0.0, 0.02, 0.04], {"units": "s"})},
        attrs={"unit": "boom"},
    )


TABLE = """\
time_s,position_m,pressure_a_pa,motor_speed_rad_per_s,status,moving
0.000000,0.100000,100000,0.0000,0,1
0.020000,,200000,0.0000,1,0
0.040000,0.300000,3400000,157.0796,2,1
"""


def test_a_draft_takes_its_place_when_all_went_well(tmp_path):
    target = tmp_path / "a.tar.csv.gz"
    with atomic_path(target) as draft:
        assert draft.parent == tmp_path
        assert draft.name.endswith("a.tar.csv.gz")
        draft.write_text("new")
        assert not target.exists()
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("error", [ValueError("no"), KeyboardInterrupt(), SystemExit(1), ZeroDivisionError()])
@pytest.mark.parametrize("before", [None, "old"])
def test_a_failure_leaves_things_as_they_were(tmp_path, error, before):
    target = tmp_path / "a.csv"
    if before:
        target.write_text(before)
    with pytest.raises(type(error)), atomic_path(target) as draft:  # noqa: PT012
        draft.write_text("half")
        raise error
    assert [file.read_text() for file in tmp_path.iterdir()] == ([before] if before else [])


def test_a_full_disk_is_said_in_one_line_and_leaves_nothing(tmp_path):
    def fill():
        with atomic_path(tmp_path / "a.csv") as draft:
            draft.write_text("half")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    assert refusal(fill) == f"{tmp_path / 'a.csv'}: cannot be written: No space left on device"
    assert list(tmp_path.iterdir()) == []


def test_an_error_about_another_file_passes_through(tmp_path):
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "a.csv"):
        (tmp_path / "absent").read_text()


def test_places_that_cannot_be_written_are_refused(tmp_path):
    assert "there is no directory" in refusal(write_text, tmp_path / "absent" / "a.csv")
    assert "is a directory" in refusal(write_text, tmp_path)
    assert "cannot be written" in refusal(write_text, "null\0character")
    assert "cannot be written" in refusal(write_text, tmp_path / ("x" * 300))
    assert "not a regular file" in refusal(write_text, os.devnull)
    (tmp_path / "file").write_text("")
    assert "there is no directory" in refusal(write_text, tmp_path / "file" / "a.csv")
    assert "there is no directory" in refusal(write_text, tmp_path / "two\nlines" / "a.csv")

    def idle():
        with atomic_path(tmp_path / "a.csv"):
            pass

    assert "nothing was written" in refusal(idle)
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link.csv").symlink_to(tmp_path / "real" / "a.csv")
    write_text(tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "real" / "a.csv").read_text() == "new"


def test_a_bare_name_is_written_into_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_table({"time_s": [0.0]}, "a.csv")
    assert (tmp_path / "a.csv").read_text() == "time_s\n0.000000\n"


def test_results_can_be_read_by_those_the_umask_allows(tmp_path):
    umask = os.umask(0o022)
    try:
        write_table({"time_s": [0.0]}, tmp_path / "a.csv")
    finally:
        os.umask(umask)
    assert stat.S_IMODE((tmp_path / "a.csv").stat().st_mode) == 0o644


def test_a_table_has_decimals_by_unit(tmp_path):
    write_dataset(run(), tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text() == TABLE


def test_a_compressed_table_is_the_same_to_the_byte(tmp_path):
    write_dataset(run(), tmp_path / "one.csv.gz")
    write_dataset(run(), tmp_path / "two.csv.gz")
    assert (tmp_path / "one.csv.gz").read_bytes() == (tmp_path / "two.csv.gz").read_bytes()
    assert gzip.decompress((tmp_path / "one.csv.gz").read_bytes()).decode() == TABLE


def test_a_table_longer_than_a_chunk_is_whole(tmp_path):
    values = np.arange(100_000)
    write_table({"n": values, "x": values / 7.0}, tmp_path / "long.csv")
    again = np.loadtxt(tmp_path / "long.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(again[:, 0], values)
    np.testing.assert_allclose(again[:, 1], values / 7.0, rtol=1e-8)


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        (
            {"a, b": ["plain", 'says "so"', "two\nlines"], "x": [1.0, -0.0, np.inf]},
            '"a, b",x\nplain,1\n"says ""so""",0\n"two\nlines",inf\n',
        ),
        ({"time_s": [], "position_m": []}, "time_s,position_m\n"),
    ],
)
def test_words_in_a_table_are_quoted_where_they_must_be_and_one_without_rows_has_its_header(tmp_path, columns, text):
    write_table(columns, tmp_path / "w.csv")
    assert (tmp_path / "w.csv").read_text() == text


@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=30))
def test_a_position_in_a_table_is_right_to_a_micrometre(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("table") / "p.csv"
    write_table({"position_m": values}, path)
    lines = path.read_text().splitlines()[1:]
    np.testing.assert_allclose([float(line) for line in lines], values, atol=0.500001e-6)
    assert "-0.000000" not in lines


def test_columns_of_different_length_are_a_mistake(tmp_path):
    for columns in ({"a": [1.0], "b": [1.0, 2.0]}, {"a": [[1.0]]}, {"a": 1.0}):
        with pytest.raises(ValueError, match="one length"):
            write_table(columns, tmp_path / "a.csv")
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_suffix_is_refused_with_those_known(tmp_path):
    assert refusal(write_dataset, run(), tmp_path / "run.xlsx").endswith(
        "(known: .nc, .csv, .csv.gz, .parquet, .mf4, .mcap)"
    )
    assert refusal(write_table, {}, tmp_path / "run.nc").endswith("(known: .csv, .csv.gz, .parquet, .mf4, .mcap)")
    assert "unknown suffix" in refusal(write_dataset, run(), tmp_path / ".csv")


def test_a_scalar_is_repeated_and_a_second_dimension_refused(tmp_path):
    short = run()[["position"]].assign(stroke=((), 0.79, {"units": "m"}))
    write_dataset(short, tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_text().splitlines()[:2] == [
        "time_s,position_m,stroke_m",
        "0.000000,0.100000,0.790000",
    ]
    many = run().assign(table=(("x", "y"), [[1.0]]))
    assert "write .nc" in refusal(write_dataset, many, tmp_path / "many.csv")


def test_netcdf_keeps_all_there_is(tmp_path):
    write_dataset(run(), tmp_path / "run.nc")
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as again:
        xarray.testing.assert_identical(again.load(), run())
    assert [file.name for file in tmp_path.iterdir()] == ["run.nc"]


def test_netcdf_without_its_library_is_refused_in_one_line(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5netcdf", None)
    assert "NetCDF cannot be written" in refusal(write_dataset, run(), tmp_path / "run.nc")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "units", "expected"),
    [
        ("position", "m", "position_m"), ("motor_torque", "N m", "motor_torque_nm"),
        ("velocity", "m/s", "velocity_m_per_s"), ("flow_a", "m3/s", "flow_a_m3_per_s"),
        ("flow_a", "m^3/s", "flow_a_m3_per_s"), ("oil_temperature", "K", "oil_temperature_k"),
        ("status", "1", "status"),
    ],
)  # fmt: skip
def test_columns_are_named_by_variable_and_unit(name, units, expected):
    assert column_name(name, units) == expected


def test_a_drive_log_as_a_dataset_keeps_its_values(trace, tmp_path):
    log = read_log(trace("bucket_48kN_40C").log)
    write_dataset(log, tmp_path / "log.csv")
    assert (tmp_path / "log.csv").read_text().splitlines()[0] == (
        "time_s,motor_speed_rad_per_s,motor_torque_nm,oil_temperature_k"
    )


@pytest.mark.parametrize("number", [2**53 - 1, 2**53 + 1, 2**62 + 1])
def test_whole_numbers_keep_all_digits(number):
    assert rows_text([("count", np.array([number, -number]))], {}) == f"{number}\n{-number}\n".encode()
