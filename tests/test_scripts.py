"""What a script reads of the commands: JSON alone on standard output, exit codes, and nothing that only people need."""

import json
import math
import re
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
import pytest

from ramsight import progress
from ramsight.cli import common, verbs
from tests.command import as_command, at_once

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "reference" / "scripts.md").read_text(encoding="utf-8")
TRACES = ROOT / "tests" / "traces"
LOG, TRUTH = str(TRACES / "boom_258kN_40C.csv.gz"), str(TRACES / "boom_258kN_40C_truth.csv.gz")
BOOM = ("mining-loader", "--unit", "boom")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One with the log of a rehearsed leak test."""
    found = tmp_path_factory.mktemp("scripts")
    words = ("--duty", "leak-test", "--load", "300 kN", "--log", "leak.csv", "--truth", "true.csv", "--quiet")
    done = at_once("simulate", *BOOM, *words, cwd=found)
    assert done.returncode == 0, done.stderr
    added = at_once("history", "add", "mining-loader", LOG, "--unit", "boom", "--store", "shown.db", cwd=found)
    assert added.returncode == 0, added.stderr
    return found


def loads(text):
    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


CALLS = {
    "check": ("check", "press"),
    "simulate": ("simulate", *BOOM, "--load", "100 kN", "--truth", "t.csv"),
    "track": ("track", "mining-loader", LOG, "--unit", "boom", "--start", "100 mm", "--truth", TRUTH),
    "compare": ("compare", "mining-loader", LOG, TRUTH, "--unit", "boom", "--start", "100 mm"),
    "weigh": ("weigh", "mining-loader", LOG, "--start", "100 mm", "--at", "bucket=250 mm"),
    "leak-test": ("leak-test", "mining-loader", "leak.csv", "--unit", "boom"),
    "commission": ("commission", "mining-loader", "leak.csv", "--unit", "boom"),
    "datasheet": (
        "datasheet", *BOOM, "--machines", "1", "--duty", "lift-lower", "--sensor", "balance", "--out", "sheet",
    ),
    "history-show": ("history", "show", "--store", "shown.db"),
    "history-add": ("history", "add", "mining-loader", LOG, "--unit", "boom", "--store", "scripts.db"),
    "logs-inspect": ("logs", "inspect", "leak.csv"),
}  # fmt: skip
SLOW = {"datasheet", "commission"}


@pytest.mark.parametrize("verb", [pytest.param(verb, marks=pytest.mark.slow if verb in SLOW else ()) for verb in CALLS])
def test_a_verb_prints_its_figures_as_json_alone(folder, verb):
    done = at_once(*CALLS[verb], "--json", cwd=folder)
    assert done.returncode in (0, 1), done.stderr
    said = loads(done.stdout)
    assert said["format"] == f"ramsight-{verb}-1"
    (row,) = re.findall(rf"^\| `[a-z -]+` \| `ramsight-{verb}-1` \| (.*) \|$", PAGE, re.MULTILINE)
    named = set(re.findall(r"`([a-z_]+)`", row))
    assert said.keys() - {"format", "written"} <= named, "the page names every key"


@pytest.mark.slow
def test_an_identification_is_json_too(folder, tmp_path):
    words = ("--duty", "commissioning", "--leak", "1.2", "--log", "log.csv", "--truth", "position.csv")
    assert at_once("simulate", *BOOM, *words, cwd=tmp_path).returncode == 0
    done = at_once(
        "identify", "mining-loader", "log.csv", "--unit", "boom", "--truth", "position.csv", "--json", cwd=tmp_path
    )
    said = loads(done.stdout)
    assert said["format"] == "ramsight-identify-1"
    assert said["identification"]["factors"]["leak"]["value"] == pytest.approx(1.2, abs=0.02)


def test_every_verb_with_figures_has_a_row_and_is_called_here():
    assert set(re.findall(r"`ramsight-([a-z-]+)-1` \|", PAGE)) == verbs.FIGURES
    assert CALLS.keys() | {"identify"} == verbs.FIGURES


def test_the_figures_are_those_of_the_words(folder):
    words, figures = (
        at_once(*CALLS["track"], cwd=folder).stdout,
        loads(at_once(*CALLS["track"], "--json", cwd=folder).stdout),
    )
    assert f"kalman sensor: {figures['samples']} samples over {figures['duration']:.1f} s" in words
    assert (
        f"position {1e3 * figures['position_first']:.1f} mm at first, {1e3 * figures['position_last']:.1f} mm" in words
    )
    assert f"{1e3 * figures['errors']['usable']['p95']:.1f}" in words
    assert sum(figures["status"].values()) == pytest.approx(1.0)
    words, figures = (
        at_once(*CALLS["leak-test"], cwd=folder).stdout,
        loads(at_once(*CALLS["leak-test"], "--json", cwd=folder).stdout),
    )
    assert f"{figures['leak_test']['factor']:.2f}" in words


def test_a_command_keeps_standard_output_for_json_and_its_exit_code(tmp_path):
    """Warnings and errors are on standard error; a missed requirement is 1, a mistake 2 and no JSON."""
    track = ("track", "mining-loader", LOG, "--unit", "boom", "--truth", TRUTH, "--json")
    missed = as_command(*track, "--require", "1 mm", "--out", "track.csv", cwd=tmp_path)
    said = loads(missed.stdout)
    assert missed.returncode == 1
    assert said["requirement"]["is_met"] is False
    assert said["position_first"] is None
    assert said["written"] == ["track.csv"]
    wrong = as_command(*track, "--start", "9 km", cwd=tmp_path)
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith("error: --start = '9 km'")


def test_quiet_leaves_results_and_warnings_alone(tmp_path):
    words = ("simulate", "loader-valve-controlled", "--unit", "boom", "--load", "441 kN", "--out", "run.csv")
    loud, quiet = (at_once(*words, *more, cwd=tmp_path) for more in ((), ("--quiet",)))
    assert "look twice: " in loud.stdout
    assert loud.stdout.endswith("run.csv: written\n")
    assert "look twice" not in quiet.stdout
    assert "written" not in quiet.stdout
    assert quiet.stdout
    assert loud.stdout.startswith(quiet.stdout)
    said = loads(at_once(*words, "--json", cwd=tmp_path).stdout)
    assert any("the oil tears in chamber B" in sentence for sentence in said["look_twice"])
    assert said["signals"]["pressure_b"]["least"] >= 0.0


def test_progress_is_silent_only_meanwhile(monkeypatch, capfd):
    monkeypatch.setattr(progress, "EVERY", 0.01)
    with progress.spoken("work"), progress.silent():
        progress._speaking[-1].wait(0.1)
    assert capfd.readouterr().err == ""
    with progress.spoken("work"):
        progress._speaking[-1].wait(0.1)
    assert "work: " in capfd.readouterr().err


@pytest.mark.parametrize("option", ["-V", "--version"])
def test_the_version_has_a_short_option(option):
    from ramsight._version import __version__

    assert at_once(option).stdout == f"ramsight {__version__}\n"


class Colour(Enum):
    RED = "a text"


@dataclass
class Pair:
    one: float
    other: object
    _hidden: int = 3


@pytest.mark.parametrize(
    ("value", "json_value"),
    [
        (math.inf, None),
        (np.float64(2.5), 2.5),
        (np.array([1.0, math.nan]), [1.0, None]),
        (np.int64(3), 3),
        (True, True),
        (Colour.RED, "red"),
        ({"b", "a"}, ["a", "b"]),
        (Pair(1.0, lambda: 0), {"one": 1.0}),
        ([Pair(1.0, {"k": Pair(2.0, None)})], [{"one": 1.0, "other": {"k": {"one": 2.0, "other": None}}}]),
    ],
)
def test_values_as_json_has_them(value, json_value):
    assert common.plain(value) == json_value


def test_a_dataset_is_no_figure():
    xarray = pytest.importorskip("xarray")
    assert common.plain(Pair(1.0, xarray.Dataset({"a": ("t", [1.0])}))) == {"one": 1.0}
    with pytest.raises(TypeError, match="no figure: object"):
        common.plain(object())
