"""What may be lifted: charts of a description, load moments over the rated ones, statuses, and the verb."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.api.tool_places import followed
from ramsight.duty.linked_duty import simulate_linked, unit_run
from ramsight.duty.loading import lifting
from ramsight.logs import write_log
from ramsight.machine import catalogue
from ramsight.machine.as_toml import as_toml
from ramsight.normal import ONE_SIDED_95
from ramsight.plant.linked import build_linked
from ramsight.studio.draft import edited, rows
from ramsight.tool.force_balance import balance
from ramsight.tool.load_chart import LoadChart, LoadStatus, RatedLoad
from ramsight.tool.tool_place import place_law
from ramsight.tool.unit_tracks import Others
from ramsight.tool.weigher import lifts
from ramsight.tool.weighing_events import Scene
from ramsight.tool.weighing_limits import EXCEEDED_FROM, NEAR_FROM

from .command import at_once
from .shown import ROOT

DESCRIBED = machine.load_machine("mining-loader")
LINKED = build_linked(DESCRIBED)
CHART = LoadChart.of(DESCRIBED.linkage)
TEXT = catalogue.find("machine", "mining-loader").path.read_text(encoding="utf-8")
LEVEL = {"bucket": "250 mm"}
OVER = 8200.0  # kg


def place_at(mechanism, point, positions):
    """Reach, height and angle of a point, a row for each position of the cylinders."""
    return np.asarray(place_law(mechanism, point)(positions.T).full().T)


def level(boom):
    boom = np.atleast_1d(boom)
    return np.column_stack([boom, np.full_like(boom, 0.25)])


# The chart in a description


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('"3.1 m"', '"2.95 m"', "load_chart.reach.2 = '2.95 m': is not more than the reach before it (allowed: above"),
        ('"3.1 m", ', "", "load_chart.rated = '6 values': has another length than reach"),
        ('"7820 kg"', '"-1 kg"', "load_chart.rated.2 = '-1 kg': out of range (allowed: above 0 kg, at most 1e6 kg)"),
        ('"7820 kg"', '"0 kg"', "load_chart.rated.2 = '0 kg': out of range"),
        ('["2.75 m"', '["0 m"', "load_chart.reach.0 = '0 m': out of range (allowed: above 0 m, at most 1000 m)"),
        ('"7820 kg"', '"7.82 m"', "load_chart.rated.2 = '7.82 m'"),
        ('"7820 kg"', "7820", "load_chart.rated.2 = 7820: a unit is missing"),
        ("about =", 'tool = "lip"\nabout =', "load_chart.tool = 'lip': no such point (allowed: tip, payload"),
        (
            'reach = ["2.75 m", "2.95 m", "3.1 m", "3.2 m", "3.28 m", "3.4 m"]',
            'reach = ["3 m"]',
            "load_chart.reach = '1 values': is no table (allowed: 2 to 100 values)",
        ),
        (
            'reach = ["2.75 m", "2.95 m", "3.1 m", "3.2 m", "3.28 m", "3.4 m"]',
            'reach = "2 m"',
            "load_chart.reach = '2 m': expected a list of values",
        ),
    ],
)
def test_a_chart_that_cannot_be_is_refused_with_file_key_value_and_range(tmp_path, before, after, words):
    assert TEXT.count(before) == 1
    (tmp_path / "loader.toml").write_text(TEXT.replace(before, after), encoding="utf-8")
    done = at_once("check", "loader.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert f"loader.toml: linkage.{words}" in " ".join(done.stderr.split())


def test_two_rows_that_differ_at_all_are_a_chart():
    chart = {"linkage.load_chart.reach": ["3 m", "3.001 m"], "linkage.load_chart.rated": ["7 t", "8 t"]}
    assert DESCRIBED.replace(chart).linkage.load_chart.rated == (7000.0, 8000.0)


def test_a_chart_comes_back_from_text_template_and_form():
    for text in ("\n".join(as_toml(DESCRIBED, DESCRIBED.sources)), machine.template(DESCRIBED)):
        assert machine.loads(text).linkage == DESCRIBED.linkage
    path = "linkage.load_chart.rated"
    (row,) = [one for one in rows(TEXT, DESCRIBED) if one.path == path]
    assert row.text == "7760 kg, 7760 kg, 7820 kg, 7900 kg, 8080 kg, 8080 kg"
    after = edited(TEXT, DESCRIBED, path, "7 t, 7 t, 7 t, 6 t, 6 t, 6 t")
    assert machine.loads(after).linkage.load_chart.rated == (7e3, 7e3, 7e3, 6e3, 6e3, 6e3)


def test_the_loaders_chart_is_what_its_boom_carries_with_441_kn():
    """The lesser of both heights with one reach: the upper half; the lower one could carry more."""
    upper = level(np.linspace(0.35, 0.7, 400))
    still = np.zeros_like(upper)
    force = balance(LINKED.mechanism, "boom", upper, still, still)
    carries = (441e3 - force.bodies) / force.payload
    shares, inside = CHART.shares(LINKED.mechanism, upper)
    assert inside.all()
    over = carries * shares
    assert over.min() > 0.999, "a rated load is no more than it carries"
    assert over.max() < 1.04, "nor much less"
    assert CHART.shares(LINKED.mechanism, level(np.linspace(0.0, 0.7, 99)))[1].all()


# Load moments


def test_between_rows_the_moment_is_straight_so_that_a_tipping_moment_is_exact():
    moment = 2e4  # kg m about the axle, of which the arm takes 1500 kg at half the reach
    tips = [(moment - 750.0 * r) / r for r in (2.0, 4.0)]
    chart = replace(CHART, about=(0.0, 0.0), reach=(2.0, 4.0), moment=(2.0 * tips[0], 4.0 * tips[1]))
    at = level([0.1, 0.35])
    reach = place_at(LINKED.mechanism, chart.point, at)[:, 0]
    shares, _ = chart.shares(LINKED.mechanism, at)
    assert shares == pytest.approx(reach / (moment - 750.0 * reach), rel=1e-12)


def test_reach_is_level_on_a_slope():
    """With the front up by an angle the point is turned about the one that moments are about."""
    at, tilt = level([0.2]), math.radians(10.0)
    x, z = place_at(LINKED.mechanism, CHART.point, at)[0, :2] - CHART.about
    reach = x * math.cos(tilt) - z * math.sin(tilt)
    flat = replace(CHART, reach=(1.0, 5.0), moment=(1.0, 1.0))
    assert flat.shares(LINKED.mechanism, at, tilt)[0][0] == pytest.approx(reach, rel=1e-12)
    assert flat.shares(LINKED.mechanism, at)[0][0] == pytest.approx(x, rel=1e-12)


def test_beyond_its_ends_a_chart_has_no_reach():
    reach = place_at(LINKED.mechanism, CHART.point, level([0.2]))[0, 0]
    for ends, inside in (((reach, 9.0), True), ((reach + 1e-9, 9.0), False), ((1.0, reach), True)):
        chart = replace(CHART, about=(0.0, 0.0), reach=ends, moment=(1.0, 1.0))
        assert chart.shares(LINKED.mechanism, level([0.2]))[1].tolist() == [inside]
    assert CHART.shares(LINKED.mechanism, level([math.nan]))[1].tolist() == [False]


@pytest.mark.parametrize(
    ("stds", "covered", "status"),
    [
        (-ONE_SIDED_95 - 1e-4, True, LoadStatus.WITHIN),
        (-ONE_SIDED_95 + 1e-4, True, LoadStatus.NEAR),
        (-1e-9, True, LoadStatus.NEAR),
        (0.0, True, LoadStatus.EXCEEDED),
        (-9.0, False, LoadStatus.UNKNOWN),
        (-1e-9, False, LoadStatus.UNKNOWN),
        (0.0, False, LoadStatus.EXCEEDED),
    ],
)
def test_the_status_is_of_the_probability(stds, covered, status):
    found = RatedLoad.of(1.0 + 0.02 * stds, 0.02, covered=covered)
    assert found.status is status
    assert found.exceeded == pytest.approx(0.5 * math.erfc(-stds / math.sqrt(2.0)), rel=1e-6)


def test_the_words_of_a_status_have_its_limits():
    near, exceeded = (f"{100 * one:g}" for one in (NEAR_FROM, EXCEEDED_FROM))
    assert f"less than {near} %" in LoadStatus.WITHIN.value
    assert f"{near} to {exceeded} %" in LoadStatus.NEAR.value
    assert f"{exceeded} % or more" in LoadStatus.EXCEEDED.value
    page = (ROOT / "docs" / "explanation" / "weighing.md").read_text(encoding="utf-8")
    for row in (f"less than {near} %", f"{near} to {exceeded} %", f"{exceeded} % or more"):
        assert f"| {row} |" in page


# Lifts


@pytest.fixture(scope="module")
def log():
    run = simulate_linked(LINKED, lifting(LINKED, [4000.0, OVER]))
    return ramsight.drive_report(unit_run(run, "boom"))


@pytest.fixture(scope="module")
def found(log):
    return ramsight.weigh(DESCRIBED, log, start="70 mm", at=LEVEL)


def charted(reach, rated):
    return DESCRIBED.replace({"linkage.load_chart.reach": reach, "linkage.load_chart.rated": rated})


def test_a_lift_has_its_largest_load_moment_over_the_rated_one(found):
    way = level(np.linspace(0.07, 0.42, 200))  # of a lift
    largest = CHART.shares(LINKED.mechanism, way)[0].max()
    light, heavy = found.weighings
    assert light.rated_share == pytest.approx(4000.0 * largest, abs=0.01)
    assert heavy.rated_share == pytest.approx(OVER * largest, abs=0.01)
    assert light.rated_status is LoadStatus.WITHIN
    assert light.exceeded_probability < 1e-6
    assert heavy.rated_status is LoadStatus.EXCEEDED
    assert 0.5 < heavy.exceeded_probability < 1.0
    assert heavy.rated_share_std > 0.8 * heavy.std / OVER


def test_the_start_and_the_end_of_a_motion_count(log):
    """A rated moment that falls to nothing where the boom begins, before the window that is weighed."""
    begins = place_at(LINKED.mechanism, CHART.point, level([0.07]))[0, 0]
    reach = [f"{begins + far} m" for far in (-0.01, 0.02, 1.0)]
    one = ramsight.weigh(charted(reach, ["4 t", "4 t", "40 t"]), log, start="70 mm", at=LEVEL).weighings[0]
    later = place_at(LINKED.mechanism, CHART.point, level([0.09]))[0, 0]
    assert one.rated_share > 0.97
    assert np.interp(later, [begins + 0.02, begins + 1.0], [4.0, 40.0]) > 4.5, "the weighed part has less"


def test_a_share_is_as_uncertain_as_the_positions_make_mass_and_reach_together(log):
    """A bucket that is known within 20 mm, against one that is 20 mm farther in or out."""
    track = followed(LINKED, "boom", log, 0.07, None)

    def lift(bucket, std):
        return lifts(Scene(LINKED, "boom", Others(held={"bucket": bucket}, held_std=std), chart=CHART), track)[-2]

    sure, unsure = lift(0.25, 0.0), lift(0.25, 0.02)
    shares = [one.mass * one.moment.per_mass for one in (sure, lift(0.23, 0.0), lift(0.27, 0.0))]
    got = math.sqrt(unsure.moment.own_std**2 - sure.moment.own_std**2)
    wanted = max(abs(one - shares[0]) for one in shares)
    assert got == pytest.approx(wanted, rel=0.03), "what motion adds is that of the position itself"


def test_beside_the_chart_it_is_unknown_unless_it_exceeded_within(log):
    none = ramsight.weigh(charted(["1 m", "2 m"], ["9 t", "9 t"]), log, start="70 mm", at=LEVEL)
    assert {one.rated_status for one in none.weighings} == {LoadStatus.UNKNOWN}
    assert all(math.isnan(one.rated_share) for one in none.weighings)
    half = charted(["3.2 m", "4 m"], ["5 t", "5 t"])  # the reach at which a lift begins is less
    light, heavy = ramsight.weigh(half, log, start="70 mm", at=LEVEL).weighings
    assert (light.rated_status, heavy.rated_status) == (LoadStatus.UNKNOWN, LoadStatus.EXCEEDED)
    assert light.rated_share == pytest.approx(0.8, abs=0.05)


def test_a_bad_weighing_has_no_status(log):
    bad = ramsight.weigh(DESCRIBED, log, at=LEVEL)
    assert not any(one.is_good for one in bad.weighings)
    assert {one.rated_status for one in bad.weighings} == {LoadStatus.UNKNOWN}


def test_without_a_chart_nothing_is_said_of_it(log, found):
    linkage = DESCRIBED.linkage.model_copy(update={"load_chart": None})
    plain = ramsight.weigh(DESCRIBED.model_copy(update={"linkage": linkage}), log, start="70 mm", at=LEVEL)
    assert [one.mass for one in plain.weighings] == [one.mass for one in found.weighings]
    assert {one.rated_status for one in plain.weighings} == {LoadStatus.UNKNOWN}
    assert "rated load" not in plain.text
    assert found.text.endswith("rated load: 1 within, 0 near, 1 exceeded, 0 unknown; no safety function")


# The verb


def test_the_verb_shows_the_share_and_writes_it(log, found, tmp_path):
    write_log(log, tmp_path / "shift.csv")
    words = ("weigh", "mining-loader", "shift.csv", "--start", "70 mm", "--at", "bucket=250 mm")
    done = at_once(*words, "--out", "w.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "of rated load" in done.stdout
    assert "%, exceeded" in done.stdout
    assert "no safety function" in done.stdout
    header, first, second = (line.split(",") for line in (tmp_path / "w.csv").read_text().splitlines())
    assert header[-4:] == ["rated_share", "rated_share_std", "exceeded_probability", "rated_status"]
    assert float(second[-4]) == pytest.approx(found.weighings[1].rated_share, abs=1e-3)
    assert (first[-1], second[-1]) == ("within", "exceeded")
    said = json.loads(at_once(*words, "--json", cwd=tmp_path).stdout)["weighings"][1]
    assert said["rated_status"] == "exceeded"
    assert said["exceeded_probability"] == pytest.approx(found.weighings[1].exceeded_probability, abs=0.02)
    assert "no safety claim" in " ".join(at_once("weigh", "--help", cwd=tmp_path).stdout.split())
