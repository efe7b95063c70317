"""Static analysis gets through exported C: gcc's analyzer, clang-tidy, and cppcheck with the rules of MISRA C:2012."""

import os
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import pytest

from ramsight import machine
from ramsight.deploy.c_sensor import sensor_source
from ramsight.deploy.compiler import find_compiler
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman

pytestmark = pytest.mark.slow
PREFIX = "ramsight_axis"
ALL_PARTS = bool(os.environ.get("RAMSIGHT_ANALYSE"))
"""gcc's analyzer takes minutes of all parts: `make analyse` looks at each, the slow tests at every fourth."""
LONG = ("balance", "contacts", "update")
"""Parts of the same kind of lines as the others, of which clang-tidy takes up to a minute each."""
PAGE = Path(__file__).parent.parent / "docs" / "reference" / "c-cost.md"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The sensor of the test bench's axis in functions of some longest length, `written(longest)`."""
    unit = build(machine.load_machine("eha-test-bench").unit("axis"), "axis")
    sensor = kalman(unit)

    def of(longest):
        folder = tmp_path_factory.mktemp("axis")
        source = sensor_source(sensor, unit, PREFIX, "eha-test-bench", single=False, longest=longest)
        for name, text in source.files.items():
            (folder / name).write_text(text)
        return folder, sorted(name for name in source.files if name.endswith(".c"))

    return of


def said(command, folder):
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.skipif("gcc" not in (find_compiler() or ""), reason="there is no gcc")
def test_gcc_s_analyzer_finds_nothing(written):
    folder, sources = written(200)
    for source in sources if ALL_PARTS else sources[::4]:
        part = source.removesuffix(".c").rpartition("_")[2]
        whole = ["-Wanalyzer-too-complex"] if part in ("check", "balance", "status") else []
        command = [find_compiler(), "-std=c99", "-O1", "-fanalyzer", *whole, "-Werror", "-c", source]
        assert said([*command, "-o", "one.o"], folder) == (0, ""), source


@pytest.mark.skipif(shutil.which("clang-tidy") is None, reason="there is no clang-tidy")
def test_clang_tidy_finds_nothing_in_the_step(written):
    folder, sources = written(200)
    checks = "-*,bugprone-*,cert-*,clang-analyzer-*,-bugprone-reserved-identifier,-cert-dcl37-c,-cert-dcl51-cpp"
    steps = [name for name in sources if "_step_" in name and name.removesuffix(".c").rpartition("_")[2] not in LONG]
    _, found = said(["clang-tidy", "--quiet", f"--checks={checks}", *steps, "--", "-std=c99"], folder)
    assert re.findall(rf"{PREFIX}.*warning: .*", found) == []


def _has_quick_cppcheck():
    """Whether there is a cppcheck that can be told not to follow values for minutes, 2.17 or newer."""
    if shutil.which("cppcheck") is None:
        return False
    return said(["cppcheck", "--check-level=reduced", "--version"], ".")[0] == 0


@pytest.mark.skipif(not _has_quick_cppcheck(), reason="there is no cppcheck 2.17 or newer")
def test_cppcheck_finds_no_rule_of_misra_that_the_page_does_not_name(written):
    folder, _ = written(40)
    names = ("contacts", "results")
    options = ["--std=c99", "--check-level=reduced", "--enable=warning,style,performance,portability", "--quiet"]
    options += ["--addon=misra", "--suppress=missingIncludeSystem", "--template={id} {file}:{line}"]
    _, found = said(["cppcheck", *options, f"{PREFIX}.c", *(f"{PREFIX}_step_{name}.c" for name in names)], folder)
    rules = Counter(re.findall(r"^misra-c2012-([\d.]+)", found, flags=re.MULTILINE))
    assert rules, found
    named = set(re.findall(r"^\| (\d+\.\d+) \|", PAGE.read_text(), flags=re.MULTILINE))
    assert set(rules) - named == set()
