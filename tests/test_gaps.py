"""Stretches of a log without rows stay visible in the track."""

import csv

import numpy as np
import pytest
import xarray

import ramsight
from ramsight import Status
from ramsight.logs import read_log, write_log
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.thresholds import BRIDGED_GAP
from ramsight.signals import Signal, Signals
from ramsight.tracking.pieces import Gaps

from .command import at_once


def track(time):
    count = len(time)
    columns = {
        "time": Signal(time), "position": Signal(np.linspace(0.1, 0.2, count)),
        "status": Signal(np.zeros(count, int)), "referenced": Signal(np.ones(count, bool)),
    }  # fmt: skip
    return Signals(columns)


@pytest.mark.parametrize(("gap", "rows"), [(0.98 * BRIDGED_GAP, 0), (1.02 * BRIDGED_GAP, 2)])
def test_a_gap_that_a_motor_can_start_and_stop_in_has_rows(gap, rows):
    time = np.arange(10) * 0.02
    time[5:] += gap - 0.02
    filled = Gaps().filled(track(time))
    lost = filled["status"].values == Status.INPUT_LOST
    assert lost.sum() == rows
    assert np.isnan(filled["position"].values[lost]).all()
    assert filled["status"].values.dtype == int
    assert filled["referenced"].values.dtype == bool
    assert (np.diff(filled["time"].values) > 0.0).all()


def test_a_log_with_a_slow_clock_has_no_gaps_and_none_between_pieces():
    gaps = Gaps()
    assert len(gaps.filled(track(np.arange(10.0)))) == 10
    assert gaps.text == ""
    assert len(gaps.filled(track(np.arange(10.0, 20.0)))) == 10, "a second, one period, is more than 0.5 s"
    assert len(gaps.filled(track(np.arange(21.1, 30.0)))) == 11, "more than two periods"
    assert gaps.count == 1


def test_a_gap_between_pieces_is_one_too_and_a_clock_that_goes_back_is_none():
    gaps, time = Gaps(), np.arange(10) * 0.02
    assert len(gaps.filled(track(time))) == 10
    assert len(gaps.filled(track(time + 60.0))) == 12
    assert len(gaps.filled(track(time))) == 10
    assert gaps.text == "no rows for 59.8 s from 0.2 s on"
    gaps.filled(track(time + 10.0))
    assert gaps.text.startswith("2 stretches without rows, the longest 59.8 s")


def test_nothing_is_lost_of_a_track_with_several_gaps():
    time = np.concatenate([np.arange(5) * 0.02 + 10.0 * k for k in range(4)])
    given = track(time)
    filled = Gaps().filled(given)
    kept = filled.rows(filled["status"].values != Status.INPUT_LOST)
    xarray.testing.assert_equal(kept.dataset(), given.dataset())


def test_the_track_of_a_log_with_a_pause_shows_it(trace, tmp_path):
    log = read_log(trace("boom_441kN_40C").log)
    time = log["time"].values
    write_log(log.isel(time=(time < 6.0) | (time > 9.0)), tmp_path / "log.csv")
    words = ["track", "mining-loader", "log.csv", "--unit", "boom", "--start", "100 mm", "--out", "track.csv"]
    done = at_once(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "no rows for 3.0 s from 6.0 s on" in done.stdout
    with open(tmp_path / "track.csv", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if 5.99 < float(row["time_s"]) < 9.01]
    assert [row["status"] for row in rows] == [f"{Status.INPUT_LOST.text}"] * 2
    assert [row["position_m"] for row in rows] == ["", ""]


def test_the_farther_end_of_the_band_is_its_deviations_away_also_while_the_speed_is_lost(trace):
    log = read_log(trace("boom_441kN_40C").log)
    lost = (log["time"].values > 4.0) & (log["time"].values < 4.6)
    log["motor_speed"][lost] = np.nan
    track = ramsight.track("mining-loader", log, "100 mm", unit="boom")
    position, std, low, high = (track[f"position{end}"].values for end in ("", "_std", "_low", "_high"))
    inside = (low > 0.0) & (high < 0.7)
    farther = np.maximum(high - position, position - low)
    np.testing.assert_allclose(farther[inside], TWO_SIDED_95 * std[inside], rtol=0, atol=1e-8)
    for end in (high - position, position - low):  # here no other hypothesis reaches farther to one side
        np.testing.assert_allclose(end[lost], TWO_SIDED_95 * std[lost], rtol=0, atol=1e-8)
    assert std[lost].max() > 3.0 * std[lost][0], "it grows by what nobody saw"
