"""A smaller profile of an exported sensor: what it weighs, that its C says so, and where it is refused."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evaluation.judged_errors import judge
from ramsight import machine
from ramsight.deploy.c_folder import write_sensor
from ramsight.deploy.compiler import find_compiler
from ramsight.deploy.profiles import SURE_ENDS, ControlOptions, Profile, profile_of
from ramsight.errors import DescriptionError
from ramsight.logs import read_log, read_truth
from ramsight.machine.as_toml import as_toml
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman
from ramsight.sensor.kind import KINDS, Kind

from .command import at_once

LOADER = machine.load_machine("mining-loader")
ROOT = Path(__file__).parent.parent
TRACES = ROOT / "tests" / "traces"
UNDECLARED = "stops.undeclared"


def sure(name="boom"):
    """The loader, whose unit has ends that are sure."""
    unit = LOADER.unit(name)
    assumed = unit.assumptions.replace({UNDECLARED: 1e-6})
    return LOADER.model_copy(update={"units": {**LOADER.units, name: unit.model_copy(update={"assumptions": assumed})}})


def built(name, undeclared):
    unit = build(LOADER.unit(name), name)
    return replace(unit, assumptions=unit.assumptions.replace({UNDECLARED: undeclared}))


def test_a_small_sensor_is_for_machines_whose_ends_are_sure():
    assert Profile.KALMAN.kinds(built("boom", 0.1)) == KINDS
    assert Profile.KALMAN_SMALL.kinds(built("boom", SURE_ENDS)) == (Kind.DESCRIBED, Kind.LEAKS, Kind.UNKNOWN_POSITION)
    with pytest.raises(DescriptionError, match=r"units\.boom\.assumptions\.stops\.undeclared.*ends are sure"):
        Profile.KALMAN_SMALL.kinds(built("boom", 2.0 * SURE_ENDS))


def test_a_profile_has_a_name():
    assert [profile_of(one.value) for one in Profile] == list(Profile)
    with pytest.raises(DescriptionError, match="kalman, kalman-small, balance"):
        profile_of("tiny")


def test_a_small_sensor_has_the_probabilities_of_what_it_weighs():
    small = kalman(built("boom", 1e-6), None, (Kind.DESCRIBED, Kind.LEAKS, Kind.UNKNOWN_POSITION))
    names = {name for name in small.recursion.outputs if name.endswith("_probability")}
    assert names == {"described_probability", "leaks_probability", "unknown_position_probability"}
    assert len(small.recursion.state) < len(kalman(built("boom", 1e-6)).recursion.state) - 50


@pytest.mark.slow
@pytest.mark.parametrize(("name", "start"), [("boom_asbuilt1_workday", True), ("bucket_asbuilt1_workday", False)])
def test_on_a_recorded_day_it_is_as_good_as_the_whole_one(name, start):
    unit = built(name.partition("_")[0], 1e-6)
    log, truth = read_log(TRACES / f"{name}.csv.gz"), read_truth(TRACES / f"{name}_truth.csv.gz")
    position = np.interp(log["time"], truth["time"], truth["position"])
    found = []
    for profile in (Profile.KALMAN, Profile.KALMAN_SMALL):
        sensor = profile.sensor(unit)
        if start:
            sensor.start(float(truth["position"][0]))
        found.append(judge(sensor.track(log), log["motor_speed"].values, position, unit.cylinder.stroke))
    whole, small = found
    assert small.p95 < whole.p95 + 0.1e-3
    assert small.coverage > 0.95
    assert small.wrong_and_ok < 0.001


@pytest.mark.slow
@pytest.mark.skipif(find_compiler() is None, reason="there is no C compiler")
def test_its_c_is_smaller_and_passes_its_golden_samples(tmp_path):
    done = {
        one: write_sensor(sure(), "boom", tmp_path / one.value, profile=one) for one in Profile
    }  # each compiles and runs its golden samples, or raises
    (whole,), (small,), (least,) = (done[one].footprints for one in Profile)
    assert least.code < 0.45 * whole.code
    assert least.saved < 0.2 * whole.saved
    assert small.code < 0.95 * whole.code
    assert small.state < 0.85 * whole.state
    assert small.saved < 0.85 * whole.saved
    record = (tmp_path / "kalman-small" / "ramsight.json").read_text(encoding="utf-8")
    assert "--profile kalman-small" in record
    for profile, measured, compared in (
        (Profile.KALMAN, True, True),
        (Profile.KALMAN_SMALL, False, True),
        (Profile.BALANCE, False, False),
    ):
        there = set(done[profile].files)
        page = (tmp_path / profile.value / "README.md").read_text(encoding="utf-8")
        assert ("fmeda.csv" in there, "fmeda.csv" in page) == (measured, measured), "the study measured one sensor"
        assert ("ramsight_boom_compare.c" in there, "_compare.c" in page) == (compared, compared)
    assert "--profile" not in (tmp_path / "kalman" / "ramsight.json").read_text(encoding="utf-8")


def test_what_cannot_be_is_refused(tmp_path):
    with pytest.raises(DescriptionError, match="has no table"):
        write_sensor(sure(), "boom", tmp_path / "a", profile=Profile.KALMAN_SMALL, tabled=True, compiler="")
    with pytest.raises(DescriptionError, match="has no control"):
        write_sensor(sure(), "boom", tmp_path / "a", profile=Profile.BALANCE, control=ControlOptions(), compiler="")
    words = ("export", "c", "mining-loader", "--unit", "boom", "--out", "a")
    refused = at_once(*words, "--profile", "kalman-small", cwd=tmp_path)
    assert refused.returncode == 2
    assert "ends are sure" in refused.stderr
    unknown = at_once(*words, "--profile", "tiny", cwd=tmp_path)
    assert unknown.returncode == 2
    assert "--profile" in unknown.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_command_line_exports_a_small_sensor(tmp_path):
    (tmp_path / "sure.toml").write_text("\n".join(as_toml(sure(), LOADER.sources)) + "\n", encoding="utf-8")
    done = at_once(
        "export", "c", "sure.toml", "--unit", "boom", "--out", "a", "--profile", "kalman-small", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    header = (tmp_path / "a" / "ramsight_boom.h").read_text(encoding="utf-8")
    assert "leaks_probability" in header
    assert "low_probability" not in header


def test_the_page_quotes_what_profiles_cost(script):
    page = (ROOT / "docs" / "export.md").read_text(encoding="utf-8")
    sizes = json.loads((ROOT / "results" / "bench.json").read_text(encoding="utf-8"))["cortex_profiles"]
    study = json.loads((ROOT / "results" / "study.json").read_text(encoding="utf-8"))["profiles"]
    cortex, profiles = script("cortex", "benchmarks"), script("profiles")
    assert "\n".join(cortex.profile_table(sizes)) in page
    assert set(sizes) == set(cortex.PROFILES)
    assert set(study) == {name for name, *_ in profiles.PROFILES}
    assert study["kalman-small, sure ends"]["as drawn"]["wrong_and_ok_most"] < 0.001
