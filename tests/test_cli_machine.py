"""The verbs about machines, run as a user runs them."""

import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

import ramsight
from ramsight.cli import app
from ramsight.machine.description import circuits

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
    for words in ("unit boom", "unit bucket", "0.613, +0.6% off the area ratio", "535.0 kN", "0.852, 0.857 mm"):
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


@pytest.mark.parametrize("circuit", circuits())
def test_a_minimal_description_has_one_unit_and_fits_on_a_page(circuit, tmp_path):
    from ramsight import machine
    from ramsight.machine.template_text import example_of

    file = tmp_path / "mine.toml"
    done = at_once("new", file, "--circuit", circuit, "--unit", "hoist", "--minimal")
    assert done.returncode == 0, done.stderr
    assert len(file.read_text(encoding="utf-8").splitlines()) < 80
    written = machine.load_machine(file)
    like, name = example_of(circuit)
    assert list(written.units) == ["hoist"]
    hoist, given = dict(written.unit("hoist")), dict(like.unit(name))  # what a sensor assumes has defaults
    assert {key for key in given if hoist[key] != given[key]} <= {"assumptions"}
    full = tmp_path / "full.toml"
    assert at_once("new", full, "--circuit", circuit).returncode == 0
    assert machine.load_machine(full).unit(name) == like.unit(name)
    assert "assumptions" in full.read_text(encoding="utf-8")
    assert "what hoist can have" in at_once("check", file).stdout


@pytest.mark.parametrize("circuit", ["ddh", "eha-double-rod", "load-sensing", "parts"])
def test_what_is_marked_as_yours_is_what_a_description_cannot_do_without(circuit, tmp_path):
    from ramsight import DescriptionError, machine

    file = tmp_path / "mine.toml"
    assert at_once("new", file, "--circuit", circuit, "--minimal").returncode == 0
    lines = file.read_text(encoding="utf-8").splitlines()
    places = [k for k, line in enumerate(lines) if line[:1].isalpha()]
    marked = [k for k in places if "# yours: " in lines[k]]
    assert len(marked) > 20
    for k in marked:
        with pytest.raises(DescriptionError, match="is missing"):
            machine.loads("\n".join(lines[:k] + lines[k + 1 :]))
    of_the_file = ("format", "name", "circuit", "kind", "inlet", "outlet", "pilot", "node", "cushion", "setting")
    keys = {k: lines[k].partition(" =")[0].rpartition(".")[2] for k in places}
    left = [k for k in places if k not in marked and not keys[k].startswith(of_the_file)]
    machine.loads("\n".join(line for k, line in enumerate(lines) if k not in left))


def test_all_that_is_wrong_is_said_at_once(tmp_path):
    from ramsight import machine

    text = machine.template(machine.load_machine("mining-loader"))
    for right, wrong in (
        ("format = 1 ", "# format = 1 "),
        ('bore = "127 mm" ', "# "),
        ('rod = "79.4 mm"', 'rodd = "79.4 mm"'),
        ('"tellus-t-32"', '"tellus"'),
        ('max_torque = "90 N m" ', 'max_torque = "90" '),
        ('"PGI100-2-008"', '"PGI100-2-009"'),
    ):
        assert right in text
        text = text.replace(right, wrong, 1)
    file = tmp_path / "mine.toml"
    file.write_text(text, encoding="utf-8")
    done = at_once("check", file)
    assert done.returncode == 2
    said = done.stderr.splitlines()
    assert all(line.startswith(f"error: {file}: ") for line in said)
    for words in (
        "format: is missing; write format = 1 (and 6 more)",
        "units.boom.oil: unknown oil 'tellus'",
        "units.boom.pump_a: unknown pump 'PGI100-2-009'",
        "units.boom.cylinder.bore: is missing",
        "units.boom.cylinder.rodd: unknown key; did you mean 'rod'?",
        "units.boom.cylinder.rod: is missing",
        "units.boom.drive.max_torque = '90': a unit is missing",
    ):
        assert sum(words in line for line in said) == 1, words
    assert len(said) == 7, "nothing is said of what only follows"


def test_a_table_that_is_missing_says_what_it_needs(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('format = 1\nname = "a"\n[units.a]\ncircuit = "ddh"\nload_direction = "extend"\n')
    assert "units.a.tank: is missing: a table, with pressure\n" in at_once("check", file).stderr


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
        assert f"\n    ramsight {' '.join(verb)}" in done.stdout


def test_a_reader_that_leaves_early_is_no_error():
    with subprocess.Popen(
        [*RUN, "catalog", "show", "mining-loader"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        process.stdout.close()
        said = process.stderr.read().splitlines()
    assert [line for line in said if not line.endswith(b"so far")] == [], "but for what a busy computer takes"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_is_one_line():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*RUN, "check", "mining-loader"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)


def verbs(command, path=()):
    """Every verb with the words that lead to it, and groups that do something by themselves."""
    below = getattr(command, "commands", {})
    if not below or command.invoke_without_command:
        yield path, command
    for name, one in below.items():
        yield from verbs(one, (*path, name))


@pytest.mark.parametrize(
    ("words", "verb"), [pytest.param(*one, id=" ".join(one[0])) for one in verbs(get_command(app))]
)
def test_help_shows_each_example_on_a_line_that_can_be_copied(words, verb):
    shown = at_once(*words, "--help").stdout.splitlines()
    documented = (getattr(verb.callback, "__wrapped__", verb.callback).__doc__ or "").splitlines()
    examples = [line.strip().removeprefix("Example: ") for line in documented if "Example: " in line]
    assert examples
    assert [line.strip() for line in shown if line.startswith(f"    ramsight {' '.join(words)}")] == [
        one for one in examples if one.startswith(f"ramsight {' '.join(words)}")
    ]
    assert [one for one in examples if f"    {one}" not in shown] == []
