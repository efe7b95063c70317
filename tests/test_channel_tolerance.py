"""The tolerance between two sensors, against the analytic normal case and against simulated pairs of them."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

import ramsight
from ramsight.arrays import true_intervals
from ramsight.errors import DescriptionError
from ramsight.sensor.status import Status
from ramsight.tracking.channel_tolerance import STEP, Asked, Channels, derive, forward_most, stated_std
from ramsight.tracking.comparing import ALERTS, Comparison, verdicts

from .command import at_once

HOUR, ALERT, STROKE = 3600.0, 0.2, 0.7
WORDS = ("--dc", "90 %", "--false-alarms", "1e-5/h", "--other-std", "0.3 mm")
DAY = Path(__file__).parent / "traces" / "bucket_asbuilt1_workday.csv.gz"


def steady(std, other_std, *, bound=0.0, samples=50, dt=0.02, alert=ALERT, status=Status.OK):
    """Two sensors whose errors have the same distribution all the time."""
    time, ones = dt * np.arange(samples), np.ones(samples)
    codes = np.full(samples, int(status), dtype=np.int64)
    how = {"other_std": other_std, "time_to_alert": alert, "stroke": STROKE}
    return Channels.of(time, codes, bound * ones, std * ones, **how)


@given(st.floats(1e-4, 5e-3), st.floats(5e-5, 2e-3), st.floats(0.0, 5e-3), st.floats(-8.0, -1.0))
def test_the_tolerance_of_two_normal_sensors_is_the_quantile_that_a_table_gives(std, other, bound, exponent):
    rate = 10.0**exponent / HOUR
    found = derive(steady(std, other, bound=bound), Asked(0.9, rate, 0.02, 0.0))
    jumping = math.sqrt(2.0) * other * 0.5 * norm.isf(0.5 * rate * 0.02)  # noise that would look like jumps
    apart = norm.isf(0.5 * rate * ALERT) * math.hypot(std, other) - bound
    least = max(apart, jumping, 0.0)
    assert least - STEP <= found.tolerance
    both = max(norm.isf(0.25 * rate * ALERT) * math.hypot(std, other) - bound,
               math.sqrt(2.0) * other * 0.5 * norm.isf(0.25 * rate * 0.02), 0.0)  # fmt: skip
    assert found.tolerance <= both + STEP
    assert found.rate <= rate
    reach = bound + found.tolerance
    expected = norm.sf((reach - 0.02) / math.hypot(std, other)) + norm.sf((reach + 0.02) / math.hypot(std, other))
    assert found.coverage == pytest.approx(expected, rel=1e-9)
    assert found.possible == (expected >= 0.9)


def test_what_would_be_possible_is_just_possible():
    channels = steady(2e-3, 0.5e-3)
    hard = Asked(0.9, 1e-5 / HOUR, 0.008, 0.0)
    found = derive(channels, hard)
    assert not found.possible
    assert found.narrow < found.tolerance
    assert (
        channels.coverage(found.narrow - 1e-9, hard.drift) >= 0.9 > channels.coverage(found.narrow + 1e-9, hard.drift)
    )
    assert found.narrow_rate > hard.rate
    larger = derive(channels, Asked(0.9, hard.rate, found.least_drift + 1e-9, 0.0))
    assert larger.possible
    assert not derive(channels, Asked(0.9, hard.rate, found.least_drift - 1e-6, 0.0)).possible
    often = derive(channels, Asked(0.9, 2.0 * found.narrow_rate, hard.drift, 0.0))
    assert often.possible


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.999])
def test_simulated_sensors_have_no_more_false_alerts_than_stated(correlation):
    """However the errors are correlated: white, and slower than the time to alert."""
    std, other, dt, count = 1e-3, 0.5e-3, 0.02, 200_000
    random = np.random.default_rng(int(1000 * correlation))
    step = random.standard_normal(count) * math.sqrt(1.0 - correlation**2)
    error = np.empty(count)
    error[0] = random.standard_normal()
    for k in range(1, count):
        error[k] = correlation * error[k - 1] + step[k]
    real = 0.3 + other * random.standard_normal(count)
    time, hours = dt * np.arange(count), dt * count / HOUR
    for alert in (0.0, 0.1):
        channels = steady(std, other, bound=1e-3, alert=alert)
        tolerance = derive(channels, Asked(0.5, 30.0 / HOUR, 0.02, 0.0)).tolerance
        pair = Comparison(STROKE, 0.2, tolerance, alert)
        said = verdicts(pair, time, 0.3 + std * error, np.full(count, 1e-3), np.zeros(count, dtype=np.int64), real)
        alerts = len(true_intervals(np.isin(said, ALERTS)))
        most = 30.0 * hours
        assert alerts <= most + 3.0 * math.sqrt(most), (alert, alerts)
    assert said.shape == (count,)


def test_white_errors_at_once_have_as_many_alerts_as_stated():
    """Where the bound is exact, it is met: a rate that was ten times too high would not show above."""
    channels = steady(1e-3, 1e-6, bound=1e-3, alert=0.0)
    tolerance = 2.5e-3
    random = np.random.default_rng(3)
    beyond = np.abs(1e-3 * random.standard_normal(4_000_000)) > 1e-3 + tolerance
    assert beyond.mean() / 0.02 == pytest.approx(channels.false_alerts(tolerance), rel=0.1)


def test_what_is_stated_is_within_the_normal_distribution_that_is_taken():
    ones = np.ones(1)
    (by_std,) = stated_std(0.0 * ones, 3.0 * ones, -1.0 * ones, 1.0 * ones, ones)
    (by_band,) = stated_std(0.0 * ones, ones, -1.0 * ones, 6.0 * ones, ones)
    (by_bound,) = stated_std(0.0 * ones, ones, -ones, ones, 10.0 * ones)
    assert by_std == 3.0
    assert 2.0 * norm.sf(6.0 / by_band) == pytest.approx(0.05, rel=1e-4)
    assert 2.0 * norm.sf(10.0 / by_bound) == pytest.approx(1e-5, rel=1e-6)


def test_samples_without_a_position_find_nothing_and_alert_nobody():
    channels = steady(1e-3, 1e-4, status=Status.NOT_REFERENCED)
    found = derive(channels, Asked(0.9, 1e-5, 0.1, 0.0))
    assert (found.tolerance, found.narrow, found.checked) == (None, None, 0.0)
    assert found.narrow_coverage == 0.0


def test_time_that_is_missing_or_goes_back_changes_no_rate():
    good = steady(1e-3, 1e-4, samples=100)
    time = 0.02 * np.arange(100)
    time[[20, 40]] = np.nan, 0.1
    codes, ones = np.zeros(100, dtype=np.int64), np.ones(100)
    bad = Channels.of(time, codes, 0 * ones, 1e-3 * ones, other_std=1e-4, time_to_alert=ALERT, stroke=STROKE)
    asked = Asked(0.9, 1e-5 / HOUR, 0.02, 0.1)
    one, other = derive(good, asked), derive(bad, asked)
    assert (other.tolerance, other.rate, other.coverage) == pytest.approx((one.tolerance, one.rate, one.coverage))


@pytest.mark.parametrize("times", [[1.0] * 50, [1.0], [np.nan] * 50])
def test_a_log_in_which_no_time_passes_states_no_rate(times):
    codes, ones = np.zeros(len(times), dtype=np.int64), np.ones(len(times))
    with pytest.raises(DescriptionError, match="no time passes"):
        Channels.of(np.array(times), codes, ones, ones, other_std=1e-4, time_to_alert=ALERT, stroke=STROKE)


def test_more_time_finds_what_the_best_instant_in_it_finds():
    channels = steady(1e-3, 1e-4, samples=100)
    channels.bound[::10] = 0.0
    channels.bound[np.arange(100) % 10 > 0] = 0.5
    at_once_found = channels.coverage(1e-3, 0.02)
    assert at_once_found == pytest.approx(0.1, abs=1e-6)
    assert channels.coverage(1e-3, 0.02, 0.18) == pytest.approx(0.91, abs=1e-6)  # behind the last one nothing comes


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40), st.integers(1, 60))
def test_the_largest_of_those_behind(values, count):
    found = forward_most(np.array(values), count)
    assert found.tolist() == [max(values[k : k + count]) for k in range(len(values))]


@given(st.floats(1e-4, 5e-3), st.floats(0.0, 0.05), st.floats(0.0, 0.05), st.floats(1e-3, 0.3))
def test_a_wider_tolerance_alerts_and_finds_less(std, one, other, drift):
    low, high = sorted((one, other))
    channels = steady(std, 2e-4, bound=1e-3)
    assert channels.false_alerts(high) <= channels.false_alerts(low)
    assert channels.coverage(high, drift) <= channels.coverage(low, drift) + 1e-12


def test_from_a_log_a_large_drift_is_found_and_a_small_one_is_refused_as_the_page_shows():
    asked = {"dc": "90 %", "false_alarms": "1e-5/h", "other_std": "0.3 mm", "within": "60 s", "start": "400 mm"}
    (_, large), (_, small) = (
        (size, ramsight.derive_tolerance("mining-loader", DAY, unit="bucket", drift=size, **asked))
        for size in ("100 mm", "20 mm")
    )
    assert large.tolerance == pytest.approx(large.derived.tolerance)
    assert large.text.startswith("passed: tolerance ")
    assert small.tolerance is None
    assert small.text.startswith("failed: no tolerance gives both")
    assert small.derived.tolerance == large.derived.tolerance
    assert f"from {1e3 * small.derived.least_drift:.1f} mm on" in small.text
    assert 0.01 < small.derived.least_drift <= 0.1
    page = (DAY.parents[2] / "docs" / "safety.md").read_text(encoding="utf-8")
    assert all(f"```text\n{one.text}\n```" in page for one in (large, small))


@pytest.mark.parametrize(
    ("key", "value"),
    [("dc", "101 %"), ("false_alarms", "often"), ("false_alarms", "0/h"), ("drift", "2 m"), ("other_std", "0 mm")],
)
def test_what_cannot_be_is_refused(key, value):
    asked = {"dc": "90 %", "false_alarms": "1e-5/h", "other_std": "0.3 mm", "drift": "20 mm", key: value}
    with pytest.raises(DescriptionError, match=key):
        ramsight.derive_tolerance("mining-loader", DAY, unit="bucket", **asked)


def test_the_command_line_derives_and_compares_with_it(tmp_path):
    words = ("compare", "mining-loader", DAY, "--unit", "bucket", "--start", "400 mm", *WORDS, "--within", "60 s")
    done = at_once(*words, "--drift", "100 mm", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("passed: tolerance ")
    refused = at_once(*words, "--drift", "10 mm", cwd=tmp_path)
    assert refused.returncode == 1
    assert "no tolerance gives both" in refused.stdout
    truth = DAY.with_name("bucket_asbuilt1_workday_truth.csv.gz")
    both = at_once(*words[:3], truth, *words[3:], "--drift", "100 mm", cwd=tmp_path)
    assert both.returncode == 0, both.stderr
    assert "passed: tolerance " in both.stdout
    assert "both agree" in both.stdout


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--dc", "90 %"), "needs --false-alarms, --other-std, --drift"),
        ((*WORDS, "--drift", "1 mm", "--tolerance", "2 mm"), "is derived with --dc"),
        ((), "what the real sensor says is missing"),
        (("--within", "5 s"), "is of a tolerance that --dc derives"),
        ((*WORDS, "--drift", "1 mm", "--out", "a.csv"), "needs what the real sensor says"),
    ],
)
def test_options_that_do_not_go_together_are_refused(tmp_path, options, says):
    done = at_once("compare", "mining-loader", DAY, "--unit", "bucket", *options, cwd=tmp_path)
    assert done.returncode == 2
    assert says in done.stderr
