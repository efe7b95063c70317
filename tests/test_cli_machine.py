"""The verbs about machines, run as a user runs them."""

import subprocess
import sys
from pathlib import Path

import pytest

import ramsight

from .command import as_command, at_once

RUN = [sys.executable, "-m", "ramsight.cli"]


def run(*arguments):
    """As a user does, with every warning an error."""
    return as_command(*arguments, NO_COLOR="1", PYTHONWARNINGS="error")


def one_line_error(done):
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_check_shows_what_follows():
    done = run("check", "mining-loader")
    assert done.returncode == 0, done.stderr
    for words in (
        "unit boom",
        "unit bucket",
        "0.613, +0.6% off the area ratio",
        "535.0 kN",
        "0.852, 0.857 mm",
    ):
        assert words in done.stdout
    only = at_once("check", "mining-loader", "--unit", "bucket").stdout
    assert "unit boom" not in only
    assert "lifts by retracting, side B holds the load" in only


def test_check_says_in_one_line_what_is_wrong(tmp_path):
    assert "did you mean 'mining-loader'" in one_line_error(run("check", "mining-loder"))
    assert "unknown unit 'x'" in one_line_error(at_once("check", "mining-loader", "--unit", "x"))
    file = tmp_path / "a.toml"
    assert "no such file" in one_line_error(at_once("check", file))
    file.write_text("format = 1\nname = \n")
    assert f"{file}, line 2: is not TOML" in one_line_error(at_once("check", file))


def test_new_writes_what_check_accepts(tmp_path):
    file = tmp_path / "loader.toml"
    assert run("new", file).returncode == 0
    assert 'name = "loader"' in file.read_text(encoding="utf-8")
    assert at_once("check", file).returncode == 0
    assert "--force" in one_line_error(at_once("new", file))
    file.write_text("mine")
    assert at_once("new", file, "--force").returncode == 0
    assert "format = 1" in file.read_text(encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["loader.toml"]
    one_line_error(at_once("new", tmp_path / "nowhere" / "a.toml"))
    one_line_error(at_once("new", tmp_path / "b.toml", "--like", "nothing"))


@pytest.mark.parametrize("circuit", ["ddh", "eha-double-rod", "eha-pilot-check", "parts"])
def test_a_minimal_description_has_one_unit_and_fits_on_a_page(circuit, tmp_path):
    from ramsight import machine
    from ramsight.machine.minimal import example_of

    file = tmp_path / "mine.toml"
    done = at_once("new", file, "--circuit", circuit, "--unit", "hoist", "--minimal")
    assert done.returncode == 0, done.stderr
    assert len(file.read_text(encoding="utf-8").splitlines()) < 80
    written = machine.load(file)
    like, name = example_of(circuit)
    assert list(written.units) == ["hoist"]
    assert written.unit("hoist") == like.unit(name)
    full = tmp_path / "full.toml"
    assert at_once("new", full, "--circuit", circuit).returncode == 0
    assert machine.load(full).unit(name) == like.unit(name)
    assert "assumptions" in full.read_text(encoding="utf-8")
    assert "what hoist can have" in at_once("check", file).stdout


def test_a_circuit_that_is_not_there_and_options_that_do_not_fit_are_refused(tmp_path):
    file = tmp_path / "mine.toml"
    assert "eha-double-rod" in one_line_error(at_once("new", file, "--circuit", "eha-duble-rod"))
    assert "not both" in one_line_error(at_once("new", file, "--circuit", "ddh", "--like", "press"))
    assert "with --circuit" in one_line_error(at_once("new", file, "--unit", "lift"))
    assert not file.exists()


def test_catalog_lists_and_shows():
    listed = run("catalog").stdout
    for name in ("mining-loader", "tellus-t-32", "PGI100-2-025", "DB10P-01", "RV12A-01", "WS16ZR-01"):
        assert name in listed
        shown = at_once("catalog", "show", name)
        assert shown.returncode == 0, shown.stderr
        assert "[P]" in shown.stdout or "[G]" in shown.stdout
    assert "7.9 cm3/rev" in run("catalog", "show", "pgi100-2-008").stdout
    assert "unknown catalogue name" in one_line_error(at_once("catalog", "show", "PGI"))


def test_usage_errors_are_two_and_help_teaches():
    assert run("check").returncode == 2
    assert at_once("chek").returncode == 2
    assert at_once("check", "mining-loader", "--nothing").returncode == 2
    assert run("--version").stdout == f"ramsight {ramsight.__version__}\n"
    for verb in (["check"], ["catalog"], ["catalog", "show"], ["new"]):
        done = at_once(*verb, "--help")
        assert done.returncode == 0
        assert f"Example: ramsight {' '.join(verb)}" in done.stdout


def test_a_reader_that_leaves_early_is_no_error():
    with subprocess.Popen(
        [*RUN, "catalog", "show", "mining-loader"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == b""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_is_one_line():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*RUN, "check", "mining-loader"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
