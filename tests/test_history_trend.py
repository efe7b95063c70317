"""What is said of records over time: the trend, its steps, the date of its limit, causes, and sisters."""

import math

import numpy as np
import pytest

from ramsight.errors import DescriptionError
from ramsight.histories import trend as trends
from ramsight.histories.assessed import CAUSES, UNEXPLAINED, suspected
from ramsight.histories.fleet import FEWEST, population
from ramsight.histories.forecast import FEWEST as FEWEST_RECORDS
from ramsight.histories.forecast import FOLLOWED, HORIZON, forecasts, limited, passed
from ramsight.histories.trend import (
    KINDS,
    LEVEL_STD,
    SLOPE_STD,
    STEP_STD,
    SURE,
    THERMOMETER_STD,
    YEAR,
    Series,
    explained,
    likeliest,
    trend,
)


def series(value, std=0.02, *, span=1.0, warm=0.0, warm2=0.0, jumps=(), time=None):
    """One series of records that are evenly apart, or at these times [years]."""
    value = np.asarray(value, dtype=float)[:, None]
    at = np.linspace(0.0, span, len(value)) if time is None else np.asarray(time)
    same = np.ones_like(value)
    jumped = np.isin(np.arange(len(value)), jumps)[:, None]
    first, second = ((np.asarray(one) * same.T).T if np.ndim(one) else one * same for one in (warm, warm2))
    return Series(at[:, None] * YEAR, value, std * same, first, second, jumped)


def mixed(found, place):
    return float((found.weight * found.mean[place]).sum())


def batch(one, kind):
    """The same by dense linear algebra: levels, slope, thermometer and first level of one kind of trend."""
    scatter, walk_level, walk_slope = KINDS[kind]
    at, n = one.time[:, 0] / YEAR, len(one.time)
    size = 2 * n + 1  # level and slope at each record, thermometer
    precision = np.zeros((size, size))
    precision[0, 0], precision[1, 1], precision[-1, -1] = LEVEL_STD**-2, SLOPE_STD**-2, THERMOMETER_STD**-2
    for k in range(1, n):
        dt, jump = at[k] - at[k - 1], STEP_STD**2 * one.jumps[k, 0]
        move = np.zeros((2, size))
        move[0, 2 * k], move[0, 2 * k - 2], move[0, 2 * k - 1] = 1.0, -1.0, -dt
        move[1, 2 * k + 1], move[1, 2 * k - 1] = 1.0, -1.0
        q = np.array([[walk_level**2 * dt + walk_slope**2 * dt**3 / 3 + jump, walk_slope**2 * dt**2 / 2],
                      [walk_slope**2 * dt**2 / 2, walk_slope**2 * dt + jump]])  # fmt: skip
        precision += move.T @ np.linalg.inv(q) @ move
    right = np.zeros(size)
    for k in np.flatnonzero(one.known[:, 0]):
        row = np.zeros(size)
        row[2 * k], row[-1] = 1.0, one.per_kelvin[k, 0]
        weight = 1.0 / (one.std[k, 0] ** 2 + scatter**2)
        precision += weight * np.outer(row, row)
        right += weight * row * one.value[k, 0]
    covariance = np.linalg.inv(precision)
    return covariance @ right, covariance


def test_filter_and_smoother_are_the_dense_solution():
    rng = np.random.default_rng(3)
    one = series(
        rng.normal(0.1, 0.05, 12), warm=rng.uniform(0.02, 0.08, 12), jumps=[7], time=np.cumsum(rng.random(12)) / 9
    )
    one.value[4] = np.nan
    found = trend(one)
    levels, spreads = [], []
    for kind in range(len(KINDS)):
        mean, covariance = batch(one, kind)
        n = len(one.time)
        last, first = 2 * n - 2, 0
        assert found.mean[:, kind, 0] == pytest.approx([mean[last], mean[last + 1], mean[-1], mean[first]], abs=1e-9)
        places = [last, last + 1, 2 * n, first]
        assert found.covariance[:, :, kind, 0] == pytest.approx(covariance[np.ix_(places, places)], abs=1e-9)
        levels.append(mean[0 : 2 * n : 2])
        spreads.append(np.diag(covariance)[0 : 2 * n : 2])
    weight = found.weight[:, 0]
    level = weight @ np.array(levels)
    assert found.level[:, 0] == pytest.approx(level, abs=1e-9)
    spread = weight @ (np.array(spreads) + (np.array(levels) - level) ** 2)
    assert found.level_std[:, 0] == pytest.approx(np.sqrt(spread), abs=1e-9)


def test_the_score_of_a_step_gives_the_bayes_factor_of_declaring_it(monkeypatch):
    rng = np.random.default_rng(5)
    value = rng.normal(0.0, 0.02, 15) + 0.05 * (np.arange(15) > 8)
    without = trend(series(value))
    # A declared step makes the slope new, too; the score is of the level alone.
    slope = KINDS[:, 2]
    for place in (4, 9, 14):
        score, information = without.step_score[place, :, 0], without.step_information[place, :, 0]
        wider = 1.0 + STEP_STD**2 * information
        predicted = 0.5 * score**2 * STEP_STD**2 / wider - 0.5 * np.log(wider)
        real = trend(series(value, jumps=[place])).log_likelihood - without.log_likelihood
        close = slope < 0.1
        assert real[close, 0] == pytest.approx(predicted[close], abs=1.6)
    monkeypatch.setattr(trends, "STEP_STD", 0.0)
    assert trend(series(value, jumps=[9])).log_likelihood == pytest.approx(without.log_likelihood)


def test_a_thermometer_that_is_off_is_no_wear():
    season = 0.04 + 0.02 * np.cos(2.0 * np.pi * np.linspace(0.0, 1.0, 60))
    found = trend(series(4.0 * season, warm=season))
    assert mixed(found, 2) == pytest.approx(4.0, abs=0.4)
    assert mixed(found, 0) == pytest.approx(0.0, abs=0.02)
    curved = trend(series(4.0 * season - 8.0 * 0.05 * season, 0.005, warm=season, warm2=-0.05 * season))
    assert mixed(curved, 2) == pytest.approx(4.0, abs=0.3), "and its effect is curved"


def test_series_do_not_depend_on_what_is_beside_them():
    one, other = series(np.linspace(0.0, 0.3, 30)), series(np.full(30, 0.1), 0.05)
    both = Series(*(np.hstack([getattr(one, name), getattr(other, name)]) for name in vars(one) if name != "known"))
    assert trend(both).level[:, :1] == pytest.approx(trend(one).level)
    assert trend(both).weight[:, 1:] == pytest.approx(trend(other).weight)


def test_a_step_is_found_where_it_is_and_an_odd_record_is_none():
    rng = np.random.default_rng(1)
    noise = rng.normal(0.0, 0.02, 40)
    stepped = explained(series(noise + 0.18 * (np.arange(40) >= 25)))
    assert [step.record for step in stepped.steps[0]] == [25]
    assert stepped.steps[0][0].factor > SURE
    odd = explained(series(noise + 0.3 * (np.arange(40) == 25)))
    assert (odd.steps[0], odd.odd[0]) == ((), (25,))
    assert odd.trend.level[25, 0] == pytest.approx(0.0, abs=0.02)
    assert explained(series(noise)).steps[0] == ()
    last = explained(series(noise[:26] + 0.3 * (np.arange(26) == 25)))
    assert last.steps[0] == (), "one record alone shows no step"
    declared = explained(series(noise + 0.18 * (np.arange(40) >= 25), jumps=[25]))
    assert [(step.record, step.is_declared) for step in declared.steps[0]] == [(25, True)]


def test_the_first_record_and_one_after_a_known_step_are_no_steps():
    one = series([0.3, 0.0, 0.0, 0.0, 0.0, 0.0], 0.01)
    _, place, _ = likeliest(trend(one), one.known, one.jumps)
    assert place[0] in (0, 1)
    flat = series(np.zeros(30))
    assert likeliest(trend(flat), flat.known, flat.jumps)[2][0] < 0.5, "a step that is not there speaks against one"
    is_step, place, _ = likeliest(trend(one), one.known, np.ones((6, 1), bool))
    assert not is_step[0], "there is one already everywhere"


WORN = math.log(1.5)


def date(one, limit=WORN, way=1.0):
    found = explained(one)
    known = one.known[:, 0]
    span = one.time[known][-1, 0] - one.time[known][0, 0]
    (said,) = forecasts(
        found.trend, one.time[-1], np.array([known.sum()]), np.array([span]), np.array([limit]), np.array([way])
    )
    return said


def seasons(count, span=1.0):
    """A year's change of temperature, so that a thermometer's error does not matter."""
    return 0.04 + 0.02 * np.cos(2.0 * np.pi * np.linspace(0.0, span, count))


def test_a_steady_trend_is_dated_and_its_limit_may_be_below():
    rising = date(series(np.linspace(0.0, 0.3, 100), 0.02, warm=seasons(100)))
    assert rising.is_dated
    assert rising.low < rising.middle < rising.high
    between = 1.0 + (math.log(1.5) - 0.3) / 0.3, 1.0 + (1.5 / math.exp(0.3) - 1.0) / 0.3  # by the share, by the amount
    assert between[0] - 0.03 < rising.middle / YEAR < between[1] + 0.03
    falling = date(series(np.linspace(0.0, -0.08, 100), 0.005, warm=seasons(100)), math.log(0.9), -1.0)
    assert falling.is_dated
    assert falling.middle > YEAR


def test_no_date_is_given_without_a_reason():
    rng = np.random.default_rng(2)
    steady = date(series(rng.normal(0.0, 0.03, 60), 0.03, warm=seasons(60)))
    assert not steady.is_dated
    assert steady.reason.startswith("no trend is visible")
    assert math.isnan(steady.middle)
    few = date(series(np.linspace(0.0, 0.3, FEWEST_RECORDS - 1), 0.01))
    assert few.reason == f"{FEWEST_RECORDS - 1} records are too few; {FEWEST_RECORDS} are needed"
    beyond = date(series(np.full(50, 0.8), 0.02, warm=seasons(50)))
    assert beyond.reason == "the limit is passed already, with a probability of 100 %"
    far = date(series(np.linspace(0.0, 0.1, 200), 0.005, warm=seasons(200)), math.log(9.0))
    assert "more than 5 years away" in far.reason
    assert date(series(np.zeros(9)), math.nan).reason == "no limit is given"
    brief = date(series(np.linspace(0.0, 0.02, 20), 0.02, span=0.1, warm=seasons(20)))
    assert "more days like these" in brief.reason


def test_a_limit_that_may_be_passed_has_no_first_date():
    near = date(series(np.linspace(0.0, 0.34, 100), 0.03, warm=0.04))  # by a thermometer, which nothing checks
    assert near.is_dated
    assert near.low == -math.inf
    assert near.high > near.middle > YEAR


def test_the_probability_of_the_limit_grows_with_time_and_is_half_of_each_law():
    found = trend(series(np.linspace(0.0, 0.3, 100), 0.02, warm=seasons(100)))
    chance = passed(found, 0, math.log(1.5), 1.0, np.array([0.0, 0.25, 1.0, HORIZON]))
    assert np.all(np.diff(chance) > 0.0)
    assert chance[0] < 0.01
    by_share, by_amount = 1.0 + (math.log(1.5) - 0.3) / 0.3 - 1.0, (1.5 / math.exp(0.3) - 1.0) / 0.3
    (middle,) = passed(found, 0, math.log(1.5), 1.0, np.array([0.5 * (by_share + by_amount)]))
    assert middle == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"leak": (0.0, 0.02), "compliance": (0.0, 0.1)}, "nothing has changed"),
        ({"leak": (0.4, 0.02), "compliance": (0.0, 0.1), "exponent": (0.0, 0.02)}, "the pumps wear"),
        ({"leak": (0.4, 0.02), "exponent": (0.1, 0.01)}, "a groove in a pump, or a valve that leaks"),
        ({"leak": (-0.5, 0.05), "exponent": (0.0, 0.01)}, "the oil is thicker"),
        ({"compliance": (0.6, 0.1), "displacement": (0.0, 0.002)}, "air in the oil, or a soft hose"),
        ({"compliance": (0.6, 0.1), "displacement": (-0.02, 0.002)}, "the pump takes in air"),
        ({"relief": (-0.1, 0.01), "leak": (0.0, 0.02)}, "the relief valve opens earlier"),
        ({"relief": (0.06, 0.005), "leak": (-0.06, 0.01)}, "the drive reports too much torque"),
        ({}, "nothing has changed"),
    ],
)
def test_the_cause_is_named_by_what_moved(changes, words):
    found = suspected(changes)
    assert found[0].cause.words == words
    assert sum(one.probability for one in found) == pytest.approx(1.0)


def test_what_nothing_tells_apart_stays_as_likely_as_before_until_an_oil_change():
    changes = {"leak": (0.4, 0.02), "exponent": (0.0, 0.02)}
    chance = {one.cause.words: one.probability for one in suspected(changes)}
    prior = {one.words: one.prior for one in CAUSES}
    ratio = prior["the pumps wear"] / prior["the oil is thinner"]
    assert chance["the pumps wear"] / chance["the oil is thinner"] == pytest.approx(ratio)
    at_change = suspected(changes, at_oil_change=True)
    assert at_change[0].cause.words == "the oil is thinner"
    assert at_change[0].probability > 0.9


def test_every_cause_moves_what_is_measured_and_a_change_that_none_explains_is_open():
    assert {name for one in CAUSES for name in one.does} <= UNEXPLAINED.keys() == FOLLOWED.keys()
    assert sum(one.prior for one in CAUSES) == pytest.approx(1.0, abs=0.05)
    odd = suspected({"displacement": (5.0, 1e-6)})
    assert odd[0].cause.words == "nothing has changed"
    assert odd[0].probability == pytest.approx(CAUSES[0].prior / sum(one.prior for one in CAUSES))


def test_a_machine_leaves_its_sisters_and_the_unsure_one_is_moved_to_them():
    rng = np.random.default_rng(4)
    values = [*rng.normal(0.1, 0.03, 12), 0.6, 0.6]
    stds = [0.02] * 12 + [0.02, 0.5]
    found = population(values, stds)
    assert [k for k, one in enumerate(found.members) if one.leaves] == [12]
    sure, unsure = found.members[12], found.members[13]
    assert unsure.shrinkage > 0.8 > 0.2 > sure.shrinkage
    assert abs(unsure.shrunk - found.mean) < 0.15
    assert unsure.shrunk_std < 0.5
    assert sure.shrunk == pytest.approx(0.6, abs=0.05)


def test_too_few_sisters_leave_nobody_and_alike_ones_none():
    assert not any(one.leaves for one in population([0.0, 0.0, 9.0], [0.01] * 3).members)
    assert len([0.0, 0.0, 9.0]) < FEWEST
    rng, alarms = np.random.default_rng(6), 0
    for _ in range(60):
        found = population(rng.normal(0.0, 0.05, 10) + rng.normal(0.0, 0.03, 10), [0.03] * 10)
        alarms += any(one.leaves for one in found.members)
    assert alarms <= 8, "5 % of populations have one that leaves them"


def test_limits_are_of_what_is_followed():
    assert limited(None)["leak"].limit == 1.5
    assert limited({"displacement": 0.97})["displacement"].way == -1.0
    assert limited({"leak": 2})["leak"].way == 1.0
    with pytest.raises(DescriptionError, match="limit = 'rust': is not followed"):
        limited({"rust": 1.0})
    with pytest.raises(DescriptionError, match=r"limit leak = 0.0: is out of range"):
        limited({"leak": 0.0})
