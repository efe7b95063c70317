"""The user's path: identify, check and use the tuned machine, and one clear line for what is wrong. Run as commands."""

import re

import pytest

from .command import as_command, at_once

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def identified(trace, tmp_path_factory):
    folder = tmp_path_factory.mktemp("identified")
    case = trace("boom_asbuilt1_leaktest")
    done = as_command(
        "identify", "mining-loader", case.log, "--unit", "boom", "--truth", case.truth, "--out", "tuned.toml",
        cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder, case, done.stdout


def test_the_table_tells_each_factor_with_its_interval(identified):
    _, _, text = identified
    for words in (
        "leak factor",
        "orifice leak",
        "displacement factor",
        "friction factor",
        "stiffness factor",
        "pump efficiency",
    ):
        assert re.search(rf"^{words} +[+-]?\d", text, flags=re.MULTILINE)
    assert "95 % interval" in text
    assert "tuned.toml: written" in text


def test_the_tuned_machine_is_a_machine(identified):
    folder, case, _ = identified
    done = at_once("check", "tuned.toml", "--unit", "boom", cwd=folder)
    assert done.returncode == 0, done.stderr
    errors = []
    for described in ("mining-loader", "tuned.toml"):
        leaktest = at_once("leak-test", described, case.log, "--unit", "boom", cwd=folder)
        assert leaktest.returncode == 0, leaktest.stderr
        errors.append(abs(float(re.search(r"leak factor ([\d.]+)", leaktest.stdout)[1]) - 1.0))
    # The tuned description is told what the leak test, which needs no position, finds of the untuned one.
    assert errors[1] < 0.2 * errors[0]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"unit": "mast"}, ["unknown unit 'mast'", "boom, bucket"]),
        ({"out": "tuned.txt"}, ["tuned.txt", ".toml"]),
        ({"truth": "none.csv"}, ["none.csv"]),
        ({"machine": "forklift-mast", "unit": "lift"}, ["nothing to identify", "motor and position go the same way"]),
    ],
)
def test_what_is_wrong_is_said_in_one_line(trace, tmp_path, change, words):
    case = trace("boom_441kN_40C")
    given = {"machine": "mining-loader", "unit": "boom", "truth": case.truth, "out": "tuned.toml", **change}
    done = at_once(
        "identify", given["machine"], case.log, "--unit", given["unit"], "--truth", given["truth"], "--out",
        given["out"], cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 2
    said = [line for line in done.stderr.strip().splitlines() if not line.startswith("warning: ")]
    assert len(said) == 1
    for word in words:
        assert word in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_help_teaches(tmp_path):
    text = at_once("identify", "--help", cwd=tmp_path).stdout
    assert "--truth" in text
    assert "Examples: ramsight identify" in " ".join(text.split())
