"""The demonstration that ships with the package: whose log it is, and that it says what it shows."""

import gzip
import re

import numpy as np
import pytest

from ramsight.cli import app
from ramsight.demo import AS_BUILT, LOG, POSITION
from ramsight.demo.showing import demonstrated, draw
from ramsight.logs import read_truth


@pytest.fixture(scope="module")
def shown():
    return demonstrated()


def test_the_log_is_the_recorded_one_and_small(trace):
    case = trace("boom_asbuilt1_workday")
    assert gzip.decompress(LOG.read_bytes()) == gzip.decompress(case.log.read_bytes())
    assert {name: case.case["asbuilt"][name] for name in AS_BUILT} == AS_BUILT
    whole, short = read_truth(case.truth), read_truth(POSITION)
    at = np.interp(short["time"], whole["time"], whole["position"])
    np.testing.assert_allclose(short["position"], at, atol=1e-6)
    assert short["time"][-1] == whole["time"][-1]
    assert LOG.stat().st_size + POSITION.stat().st_size < 150_000


def test_the_sensor_learns_and_the_data_sheet_alone_does_not(shown):
    for name, value in AS_BUILT.items():
        learned, std = (float(shown.sensor[f"{name}_factor{more}"].values[-1]) for more in ("", "_std"))
        assert abs(learned - value) < 1.96 * std
        assert abs(1.0 - value) > 1.96 * std  # the data sheet is outside of what was learned
    assert shown.within(shown.sensor) < 2e-3
    assert shown.within(shown.sheet) > 10.0 * shown.within(shown.sensor)
    later = shown.sensor["time"].values > shown.taught
    sure = np.abs(shown.sensor["error"].values) < 1.96 * shown.sensor["position_std"].values
    assert sure[later].mean() > 0.95


def test_its_text_says_what_its_tracks_have(shown):
    assert f"within {1e3 * shown.within(shown.sensor):.1f} mm" in shown.text
    when = float(re.search(r"after (\d+) s, and", shown.text)[1])
    found = shown.sensor["time"].values[np.isfinite(shown.sensor["position"].values)][0]
    assert when == pytest.approx(found, abs=0.5)
    panels = [axes.get_ylabel().split("\n")[0] for axes in draw(shown).axes]
    assert panels == ["position", "errors", "band ±", "leakage", "displacement", "speed", "torque", "oil"]


def test_the_verb_writes_its_picture(tmp_path, monkeypatch):
    from typer.testing import CliRunner

    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["demo"])
    assert done.exit_code == 0, done.output
    assert "demo.png: written" in done.output
    assert (tmp_path / "demo.png").stat().st_size > 50_000
