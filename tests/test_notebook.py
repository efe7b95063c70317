"""What a notebook shows: machines, units, runs and tracks as tables and pictures, and no foreign HTML."""

import pickle
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray

import ramsight
from ramsight.output.notebook import card, curves

HOSTILE = "<script>alert(\"1\")</script><b a='x'>&amp;"


class Seen(HTMLParser):
    """The tags of a text, all closed, and its words."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.words = [], [], ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        assert not [name for name, _ in attrs if name.startswith("on")]
        if tag not in ("path", "br", "input", "link", "meta"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if tag not in ("path", "br", "input"):
            assert self.open.pop() == tag

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)

    def handle_data(self, data):
        self.words += f"{data} "


@pytest.fixture(scope="module")
def run(loader):
    return ramsight.simulate(loader, unit="boom", load="300 kN", start="120 mm")


@pytest.fixture(scope="module")
def track(loader, run):
    return ramsight.track(loader, ramsight.drive_report(run), "120 mm", run, unit="boom")


def test_a_machine_shows_its_units_and_a_circuit(loader):
    seen = Seen(loader._repr_html_())
    for words in (
        "Mining loader, boom and bucket",
        "boom",
        "bucket",
        "127 / 79.4 / 700 mm",
        "90 N m, 4000 rpm",
        "tellus",
    ):
        assert words in seen.words
    assert {"table", "svg"} <= set(seen.tags)
    assert seen.tags.count("svg") == 1


def test_a_unit_shows_its_sizes_described_and_built(loader):
    described = Seen(loader.unit("boom")._repr_html_())
    assert "2 × 127 / 79.4 / 700 mm" in described.words
    for unit, words in (("boom", "0.8518 mm"), ("bucket", "pump_a")):
        built = Seen(ramsight.build(loader, unit)._repr_html_())
        assert words in built.words
        assert f"unit {unit}" in built.words
        assert built.tags.count("svg") == 1
    press = Seen(ramsight.build("press")._repr_html_())
    assert "400 mm" in press.words


def test_a_run_and_a_track_show_their_position_and_what_they_come_to(run, track):
    seen = Seen(run._repr_html_().partition("<details>")[0] + "</div>")
    assert "boom: simulated run" in seen.words
    assert re.search(r"motor +gave \d+\.\d+ kJ, took \d+\.\d+ kJ back", seen.words)
    assert seen.tags.count("path") == 1
    shown = Seen(track._repr_html_().partition("<details>")[0] + "</div>")
    assert shown.tags.count("path") == 2, "true position and position"
    assert re.search(r"error +95 % within 0\.\d+ mm, largest 0\.\d+ mm", shown.words)
    assert "kalman" in shown.words
    assert "all variables" in track._repr_html_()


def test_a_run_stays_a_dataset(run, tmp_path):
    assert isinstance(run, xarray.Dataset)
    xarray.testing.assert_identical(pickle.loads(pickle.dumps(run)), run)
    assert "simulated run" in run.isel(time=slice(100))._repr_html_()
    for less in (run.isel(time=slice(0)), run.drop_vars("position"), run.isel(time=0)):
        assert "simulated run</strong>" not in less._repr_html_(), "without positions it is shown as any other"
    run.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as again:
        np.testing.assert_array_equal(again["position"], run["position"])


def test_what_is_left_of_a_run_is_shown_as_any_other_dataset(run):
    days = run.assign_coords(time=np.arange(run.sizes["time"]).astype("datetime64[s]"))
    words = run.assign(position=run["position"].astype(str))
    for other in (days, words):
        assert "simulated run</strong>" not in other._repr_html_()
    halves = run.assign_attrs({"energy.shaft_given": 1.0, "error_largest": 1e-3})
    del halves.attrs["energy.shaft_taken"]
    seen = Seen(halves._repr_html_().partition("<details>")[0] + "</div>")
    assert "kJ" not in seen.words
    assert "largest" not in seen.words


def test_a_track_that_is_lost_shows_a_gap_or_nothing(track):
    position = track["position"].copy()
    position[300:500] = np.nan
    d = re.findall(r'<path d="([^"]*)"', track.assign(position=position)._repr_html_())
    assert [one.count("M") for one in d[:2]] == [1, 2]
    lost = track.drop_vars("true_position").assign(position=position * np.nan)
    assert "<path d=" not in lost._repr_html_().partition("<details>")[0]


def test_hostile_names_are_text(loader, run):
    machine = loader.model_copy(update={"title": HOSTILE, "description": HOSTILE})
    unit = loader.unit("boom")
    oil = unit.model_copy(update={"oil": unit.oil.model_copy(update={"model": HOSTILE})})
    built = replace(ramsight.build(loader, "boom"), name=HOSTILE)
    named = run.assign_attrs(unit=HOSTILE, kind=HOSTILE, sensor=HOSTILE, mistake=HOSTILE)
    for one in (machine, oil, built, named):
        text = one._repr_html_()
        assert "<script" not in text
        assert "<b a=" not in text
        assert "&lt;script&gt;" in text
    Seen(machine._repr_html_())
    assert "<script" not in card(HOSTILE, [(HOSTILE, HOSTILE)])
    assert "<script" not in curves(np.arange(3.0), {HOSTILE: np.arange(3.0)}, HOSTILE)


def test_curves_need_two_samples_and_a_number():
    assert curves(np.arange(1.0), {"a": np.zeros(1)}, "mm") == ""
    assert curves(np.arange(3.0), {"a": np.full(3, np.nan)}, "mm") == ""
    time, values = np.array([np.nan, 1.0, 0.5, np.nan, 2.0]), np.arange(5.0)
    drawn = curves(time, {"a": values}, "mm")
    assert "1 to 4 mm in 1.5 s" in drawn
    assert re.findall(r'<path d="([^"]*)"', drawn) == ["M141.3 86.0L4.0 58.7L416.0 4.0"], "within the picture"
    assert "0 to 0 mm in 2 s" in curves(np.arange(3.0), {"a": np.zeros(3)}, "mm")
