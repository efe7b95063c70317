"""What works where no extra is installed, and what is said where one is needed: always one line, with its name."""

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from ramsight import optional

from .conftest import TRACES

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
ABSENT = (
    "PIL", "SALib", "asammdf", "asyncua", "can", "canopen", "cantools", "dask", "distributed", "fmpy", "h5netcdf",
    "h5py", "matplotlib", "mcap", "msgpack", "nicegui", "nptdms", "openpyxl", "pandas", "pint", "pyarrow",
    "psycopg", "scipy", "sqlalchemy", "tomlkit", "xarray", "zarr",
)  # fmt: skip
"""Packages of extras, and what these bring."""
DAY = TRACES / "boom_asbuilt1_workday.csv.gz"
TRUTH = TRACES / "boom_asbuilt1_workday_truth.csv.gz"
BOOM = ("mining-loader", "--unit", "boom")
CORE = {
    "check": ("check", *BOOM),
    "new": ("new", "lift.toml", "--circuit", "ddh", "--unit", "lift", "--minimal"),
    "catalog": ("catalog",),
    "draw": ("draw", *BOOM, "--out", "boom.svg"),
    "simulate": ("simulate", *BOOM, "--load", "100 kN", "--out", "run.csv", "--log", "log.csv", "--truth", "true.csv"),
    "leak-test day": ("simulate", *BOOM, "--duty", "leak-test", "--load", "300 kN", "--log", "leak.csv"),
    "leak-test": ("leak-test", "mining-loader", "leak.csv", "--unit", "boom", "--out", "tested.toml"),
    "track": ("track", "mining-loader", str(DAY), "--unit", "boom", "--truth", str(TRUTH), "--out", "track.csv"),
    "require": ("track", "mining-loader", "log.csv", "--unit", "boom", "--start", "70 mm", "--require", "90 mm"),
    "inspect": ("logs", "inspect", str(DAY), "--out", "map.toml"),
    "measured": ("track", "mining-loader", "measured.csv", "--unit", "boom", "--map", "measured.toml"),
    "parameters": ("export", "parameters", *BOOM, "--out", "boom.h"),
    "demo": ("demo",),
}
NEEDED = {
    "figures": [
        ("track", "mining-loader", str(DAY), "--unit", "boom", "--figure", "track.png"),
        ("simulate", *BOOM, "--load", "100 kN", "--figure", "run.svg"),
        ("check", *BOOM, "--figure", "map.png"),
        ("calibrate", *BOOM, "--out", "boom.sensor", "--figure", "table.png"),
        ("draw", *BOOM, "--out", "boom.pdf"),
        ("demo", "--out", "demo.png"),
    ],
    "datasets": [
        ("track", "mining-loader", str(DAY), "--unit", "boom", "--out", "track.nc"),
        ("simulate", *BOOM, "--load", "100 kN", "--out", "run.nc"),
        ("compare", "mining-loader", str(DAY), str(TRUTH), "--unit", "boom"),
        ("logs", "shared", str(DAY), str(DAY)),
    ],
    "datasets,figures": [("compare", "mining-loader", str(DAY), str(TRUTH), "--unit", "boom", "--figure", "both.png")],
    "identify": [
        ("identify", "mining-loader", str(DAY), "--truth", str(TRUTH), "--unit", "boom"),
        ("commission", "mining-loader", str(DAY), "--unit", "boom"),
        (
            "compare", "mining-loader", str(DAY), "--unit", "boom", "--dc", "90 %", "--false-alarms", "1e-5/h",
            "--other-std", "1 mm", "--drift", "5 mm",
        ),
    ],
    "identify,figures": [("commission", "mining-loader", str(DAY), "--unit", "boom", "--out", "report.html")],
    "logs": [
        ("track", "mining-loader", str(DAY), "--unit", "boom", "--out", "track.parquet"),
        ("track", "mining-loader", str(DAY), "--unit", "boom", "--out", "track.mf4"),
        ("track", "mining-loader", "log.mat", "--unit", "boom"),
        ("track", "mining-loader", "log.parquet", "--unit", "boom"),
    ],
    "can": [
        ("check", *BOOM, "--map", "measured.toml"),
        ("logs", "replay", str(DAY), "--channel", "can0", "--rated-torque", "80 N m"),
    ],
    "study": [("datasheet", *BOOM, "--out", "sheet")],
    "history": [("history", "add", "mining-loader", str(DAY), "--unit", "boom")],
    "studio": [("studio", "--no-show")],
}  # fmt: skip
MEASURED_MAP = """
time = {channel = "t", unit = "s"}
speed = {channel = "n", unit = "rpm"}
torque = {channel = "m", unit = "N m"}
temperature = {channel = "oil", unit = "degC"}
measured.position = {channel = "rod", unit = "mm"}
"""
WORKS = f"""
import json, os, sys
for name in {ABSENT}:
    sys.modules[name] = None
from tests.command import at_once
from tests.made_once import share
share()
os.chdir(sys.argv[1])
for words in json.load(sys.stdin):
    for name in {ABSENT}:
        sys.modules[name] = None
    done = at_once(*words)
    print(json.dumps([done.returncode, done.stdout, done.stderr]), flush=True)
"""


def answers(folder, commands):
    """Exit code, output and errors of each command, in a process in which no package of an extra can be imported."""
    code = f"import sys\nsys.path.insert(0, {str(ROOT)!r})\n{WORKS}"
    done = subprocess.run(
        [sys.executable, "-c", code, str(folder)],
        input=json.dumps(commands),
        capture_output=True,
        text=True,
        check=True,
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("core")
    (made / "log.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    (made / "log.parquet").write_bytes(b"PAR1")
    (made / "measured.toml").write_text(MEASURED_MAP)
    rows = "".join(f"{k / 50:.2f},0,12.5,40,100\n" for k in range(200))
    (made / "measured.csv").write_text(f"t,n,m,oil,rod\n{rows}")
    return made


@pytest.fixture(scope="module")
def core(folder):
    return dict(zip(CORE, answers(folder, list(CORE.values())), strict=True))


@pytest.mark.parametrize("name", CORE)
def test_it_works_without_extras(core, name):
    code, out, err = core[name]
    assert code == 0, err
    assert "Traceback" not in out + err


def test_what_was_written_without_extras_is_there(core, folder):
    assert core["demo"][1].splitlines()[-1].startswith("no picture: a figure needs the package matplotlib")
    assert not (folder / "demo.png").exists()
    assert "factor 1.00" in core["leak-test"][1]
    assert "requirement achieved" in core["require"][1]
    assert "error against the truth: none to be had" in core["measured"][1]
    head = (folder / "track.csv").read_text().partition("\n")[0]
    assert head.startswith("time_s,position_m,position_std_m,status")
    assert {"run.csv", "log.csv", "true.csv", "boom.h"} <= {one.name for one in folder.iterdir()}


def test_a_missing_extra_is_named_in_one_line(folder):
    asked = [(extra, words) for extra, all_of_it in NEEDED.items() for words in all_of_it]
    found = answers(folder, [words for _, words in asked])
    for (extra, words), (code, out, err) in zip(asked, found, strict=True):
        lines = [line for line in err.splitlines() if not line.endswith(" s so far")]  # of a busy machine
        assert (code, len(lines), out) == (2, 1, ""), (words, out, err)
        assert re.search(rf"""pip install ["']ramsight\[{extra}\]["']$""", lines[0]), (words, err)


PYTHON = f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from tests.made_once import share
share()
for name in {ABSENT}:
    sys.modules[name] = None
import importlib, numpy as np, ramsight
boom = ramsight.build("mining-loader", "boom")
sensor = ramsight.sensor_for(boom)
sensor.start(position="100 mm")
print(sensor.step(time=0.0, motor_speed=0.0, motor_torque=0.0, oil_temperature=313.15).position)
print(ramsight.LivePlant(boom, load="100 kN", start="100 mm").advance(10.0).time)
print("ramsight_boom.c" in ramsight.export_c("mining-loader", "boom", out="c", compiler="").files)
for call in (
    lambda: ramsight.simulate(boom, load="100 kN"),
    lambda: ramsight.track(boom, sys.argv[1]),
    lambda: ramsight.read_log(sys.argv[1]),
    lambda: ramsight.identify(boom, sys.argv[1], sys.argv[1]),
    lambda: ramsight.commission(boom, sys.argv[1]),
    lambda: ramsight.Study("mining-loader", unit="boom"),
    lambda: importlib.import_module("ramsight.deploy.encoder"),
):
    try:
        call()
    except ramsight.RamsightError as error:
        print(str(error))
"""


@pytest.mark.slow
def test_python_says_the_same(folder):
    command = [sys.executable, "-c", PYTHON, str(DAY)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    assert done.returncode == 0, done.stderr
    *numbers, datasets, tracks, logs, identify, commission, study, encoder = done.stdout.splitlines()
    assert numbers == ["0.1", "0.02", "True"]
    assert {datasets, tracks, logs} == {'a Dataset needs the package xarray: pip install "ramsight[datasets]"'}
    assert {identify, commission} == {'an identification needs the package xarray: pip install "ramsight[identify]"'}
    assert study == 'a study needs the package xarray: pip install "ramsight[study]"'
    assert encoder == 'the encoder needs the package canopen: pip install "ramsight[can]"'


def names_of(extra):
    """Packages that an extra asks for, those of the extras in it among them."""
    found = set()
    for one in map(Requirement, EXTRAS[extra]):
        found |= set().union(*map(names_of, one.extras)) if one.name == "ramsight" else {one.name}
    return found


def test_what_is_looked_for_is_what_the_extra_installs():
    for extra, packages in optional.PACKAGES.items():
        assert set(packages) <= names_of(extra)
        assert not set(packages) & {Requirement(one).name for one in PROJECT["dependencies"]}
    assert set(optional.USES) >= set(optional.PACKAGES)


NEEDS = {
    "can": r"^import can$|^ramsight (encoder|logs replay) ",
    "datasets": r"\bramsight\.(simulate|drive_report|read_log|track|compare)\(|^ramsight (compare|loader|paper) ",
    "figures": r"\bramsight\.plot\(|^ramsight .*--figure|^ramsight commission .*--out",
    "history": r"^ramsight history ",
    "identify": r"^ramsight (identify|commission) |\bramsight\.(identify|commission)\(",
}
"""Lines of a tutorial that need an extra."""


TUTORIALS = [page for page in sorted((ROOT / "docs" / "tutorials").glob("*.md")) if page.stem != "index"]


@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_a_tutorial_names_the_extras_that_it_needs(page):
    text = page.read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+)`", text[: text.index("](../how-to/install.md)")])) & EXTRAS.keys()
    there = set().union(*map(names_of, named))
    for extra, lines in NEEDS.items():
        found = re.search(lines, text, flags=re.MULTILINE)
        assert found is None or names_of(extra) <= there, (found[0], extra, named)


def test_all_has_every_extra_of_a_user():
    (only,) = map(Requirement, EXTRAS["all"])
    rest = set(EXTRAS) - {"all", "dev", "docs", "platforms"}
    assert set().union(*map(names_of, rest)) == names_of("all")
    assert only.extras <= rest
    assert names_of("all") <= names_of("dev")


def test_a_core_has_few_packages():
    """Those that it asks for, and what these ask for, as they are installed here."""
    found, left = set(), {Requirement(one).name for one in PROJECT["dependencies"] if "win32" not in one}
    while left:
        name = left.pop()
        found.add(re.sub(r"[-_.]+", "-", name).lower())
        asked = [one for one in map(Requirement, requires(name) or []) if one.marker is None or one.marker.evaluate()]
        left |= {one.name for one in asked if re.sub(r"[-_.]+", "-", one.name).lower() not in found}
    assert len(found) <= 16, sorted(found)
