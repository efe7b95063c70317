"""Runs of one duty laid over each other: one clock, differences, whether bands overlap, readings at instants."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import ramsight
from ramsight.errors import DescriptionError
from ramsight.sensor.contacts.mode import Mode
from ramsight.signals import Signal, Signals
from ramsight.tracking.overlay import SHOWN, laid_over
from ramsight.tracking.track_errors import ComparisonError

from .command import at_once

TRACES = Path(__file__).parent / "traces"
STROKE = 0.5
COLD, HOT = TRACES / "boom_441kN_20C.csv.gz", TRACES / "boom_441kN_60C.csv.gz"


def run(time, position, half=1e-3, **more):
    """A track with a band that is as wide everywhere."""
    time, position = np.asarray(time, dtype=float), np.asarray(position, dtype=float)
    columns = {
        "time": time, "position": position, "position_low": position - half, "position_high": position + half,
        "status": np.zeros(len(time), dtype=int), **more,
    }  # fmt: skip
    return Signals({name: Signal(one) for name, one in columns.items()}, {"sensor": "kalman"})


TIME = np.arange(0.0, 10.0, 0.1)
RAMP = 0.1 + 0.02 * TIME


def test_the_same_run_on_another_clock_is_the_same():
    found = laid_over({"a": run(TIME, RAMP), "b": run(TIME + 50.0, RAMP)}, "start", STROKE)
    assert found.begins == (0.0, 50.0)
    assert np.abs(found.difference).max() < 1e-12
    assert (found.overlap == 1.0).all()
    assert found.figures["differences"] == [
        {"run": "b", "rms": pytest.approx(0.0, abs=1e-12), "largest": pytest.approx(0.0, abs=1e-12), "overlap": 1.0}
    ]


@pytest.mark.parametrize(
    ("off", "overlap"), [(1.999e-3, True), (2.001e-3, False), (-1.999e-3, True), (-2.001e-3, False)]
)
def test_bands_overlap_up_to_the_sum_of_their_halves(off, overlap):
    found = laid_over({"a": run(TIME, RAMP), "b": run(TIME, RAMP + off)}, "start", STROKE)
    assert [one.overlap for one in found.readings] == [[overlap]] * SHOWN
    assert found.difference_low[0] == pytest.approx(off - 2e-3)
    assert found.difference_high[0] == pytest.approx(off + 2e-3)


def test_another_sample_time_is_interpolated_and_time_that_one_has_not_is_left_out():
    found = laid_over({"a": run(TIME, RAMP), "b": run(TIME[:60:3], RAMP[:60:3] + 1e-3)}, "start", STROKE)
    assert found.time[-1] == pytest.approx(5.7)
    assert np.allclose(found.difference, 1e-3)


def test_of_a_stretch_without_rows_nothing_is_made_up():
    there = (TIME < 3.0) | (TIME > 6.0)
    found = laid_over({"a": run(TIME, RAMP), "b": run(TIME[there], RAMP[there])}, "start", STROKE)
    inside = (found.time > 3.15) & (found.time < 5.85)
    assert np.isnan(found.difference[0, inside]).all()
    assert np.isfinite(found.difference[0, found.time < 2.9]).all()


def test_the_largest_differences_are_read_apart_from_each_other_and_in_order():
    off = 5e-3 * np.exp(-(((TIME - 7.0) / 0.3) ** 2)) - 4e-3 * np.exp(-(((TIME - 2.0) / 0.3) ** 2))
    found = laid_over({"a": run(TIME, RAMP), "b": run(TIME, RAMP + off)}, "start", STROKE)
    times = [one.time for one in found.readings]
    assert times == sorted(times)
    assert {2.0, 7.0} <= {round(one, 6) for one in times}
    assert np.diff(times).min() >= 0.05 * 9.9
    assert "at 7.00 s\n  a: 240.0 mm (239.0 to 241.0 mm)\n  b: 245.0 mm (244.0 to 246.0 mm), +5.0 mm, " in found.text
    assert "the bands do not overlap" in found.text


def ended(delay):
    """A run that meets the retracted end after so much time."""
    position = np.clip(0.1 - 0.05 * (TIME - delay), 0.0, 0.1)
    held = position == 0.0
    mode = np.where(held, int(Mode.HELD_RETRACTING), int(Mode.MOVING))
    return run(TIME, position, mode=mode, motor_speed=np.full(len(TIME), -100.0))


def test_runs_are_aligned_where_they_meet_an_end():
    found = laid_over({"a": ended(1.0), "b": ended(3.0)}, "reference", STROKE)
    assert found.begins[1] - found.begins[0] == pytest.approx(2.0)
    assert found.begins[0] == pytest.approx(3.0, abs=0.11)
    assert np.nanmax(np.abs(found.difference)) < 1e-9
    by_start = laid_over({"a": ended(1.0), "b": ended(3.0)}, "start", STROKE)
    assert np.nanmax(np.abs(by_start.difference)) == pytest.approx(0.1)


def test_a_reference_of_the_log_comes_first_where_it_does():
    switched = np.full(len(TIME), np.nan)
    switched[12] = 0.1
    found = laid_over({"a": ended(1.0), "b": run(TIME, RAMP, reference=switched)}, "reference", STROKE)
    assert found.begins[1] == pytest.approx(1.2)
    with pytest.raises(ComparisonError, match="b meets neither an end nor a reference"):
        laid_over({"a": ended(1.0), "b": run(TIME, RAMP)}, "reference", STROKE)


def test_runs_that_never_meet_are_refused():
    late = run(TIME, RAMP, reference=np.where(TIME > 9.85, 0.1, np.nan))
    early = run(TIME, RAMP, reference=np.where(TIME < 0.05, 0.1, np.nan))
    with pytest.raises(ComparisonError, match="no time in common"):
        laid_over({"a": late, "b": early}, "reference", STROKE)


def test_python_takes_tracks_of_other_sensors_and_refuses_what_it_cannot():
    tracks = [ramsight.track("mining-loader", COLD, "100 mm", unit="boom", sensor=one) for one in ("kalman", "balance")]
    found = ramsight.overlay("mining-loader", tracks, unit="boom", cursors=["10 s", 20.0])
    assert found.names == ("run 1", "run 2")
    assert [one.time for one in found.readings] == pytest.approx([10.0, 20.0])
    assert found.readings[0].overlap == [None], "the balance states no band"
    assert "nan" not in found.text
    for passed, words in (
        ({"logs": tracks[:1]}, "logs = 1: too few or too many runs"),
        ({"logs": tracks, "align": "middle"}, "align = 'middle': is not known (allowed: start or reference)"),
        ({"logs": tracks, "cursors": ["99 s"]}, "cursors = '99 s': is out of range"),
    ):
        with pytest.raises(DescriptionError) as error:
            ramsight.overlay("mining-loader", unit="boom", **passed)
        assert words in str(error.value)


def test_the_command_reads_draws_and_writes(tmp_path):
    words = ["track", "mining-loader", COLD, HOT, "--unit", "boom", "--start", "100 mm", "--cursor", "20 s"]
    out, figure = tmp_path / "runs.csv", tmp_path / "runs.svg"
    done = at_once(*words, "--out", out, "--figure", figure)
    assert done.returncode == 0, done.stderr
    assert "2 runs over 27.5 s in common; 0 s is the first sample of each" in done.stdout
    with out.open() as stream:
        rows = list(csv.DictReader(stream))
    row = next(one for one in rows if float(one["time_s"]) == 20.0)
    difference = float(row["position_2_m"]) - float(row["position_1_m"])
    assert float(row["difference_2_m"]) == pytest.approx(difference, abs=1e-8)
    assert float(row["overlap_2"]) == 0.0
    text = figure.read_text()
    for words_of in ("position", "less boom_441kN_20C.csv.gz", "[mm]", "time since the first sample [s]"):
        assert f"<!-- {words_of} -->" in text
    assert "<!-- bands do not overlap -->" in text
    figures = json.loads(at_once(*words, "--json").stdout)
    assert figures["readings"][0]["difference"] == [pytest.approx(difference, abs=1e-8)]
    assert figures["readings"][0]["overlap"] == [False]
    assert [one["run"] for one in figures["runs"]] == [COLD.name, HOT.name]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([HOT, "--both"], "--both = True: is of one log alone"),
        ([HOT, "--tool", "tip"], "--tool = 'tip': is of one log alone"),
        ([HOT, "--truth", HOT], "--truth = "),
        ([HOT, "--out", HOT], "error"),
        ([HOT, "--align", "reference"], "meets neither an end nor a reference"),
        (["--align", "start"], "--align = 'start': needs several logs"),
        (["--cursor", "1 s"], "--cursor = ['1 s']: needs several logs"),
    ],
)
def test_options_that_do_not_fit_are_refused(more, said):
    done = at_once("track", "mining-loader", COLD, "--unit", "boom", "--start", "100 mm", *more)
    assert done.returncode == 2
    assert said in done.stderr
    assert not done.stdout


def test_files_of_one_name_are_told_apart_by_their_folders(tmp_path):
    same = tmp_path / COLD.name
    same.write_bytes(COLD.read_bytes())
    found = ramsight.overlay("mining-loader", [COLD, str(same)], unit="boom", start="100 mm")
    assert found.names == (str(COLD), str(same))
    assert np.nanmax(np.abs(found.difference)) == 0.0
    assert found.readings == []
