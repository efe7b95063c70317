"""Where the way lets the piston be: what that leaves of a hypothesis, when it weighs it, what is said of it then."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.stats import norm

from ramsight.expression import scalar
from ramsight.normal import TWO_SIDED_95
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.mixture import Mixture
from ramsight.sensor.belief.reach import Reach
from ramsight.sensor.circuit.unseen_load import UnseenLoad
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.report.stated import Beside, stated
from ramsight.sensor.thresholds import OUTSIDE

from .test_belief_guards import STROKE, bank, contact, hypothesis, value

LOW = KINDS.index(Kind.LOW)


def test_what_the_way_leaves_clips_a_band_from_both_sides():
    reach = Reach(scalar(-0.022), scalar(0.3), scalar(3.5e-3))
    below, above = reach.clipped(scalar(0.1), scalar(0.1))
    assert (value(below), value(above)) == pytest.approx((0.022 + TWO_SIDED_95 * 3.5e-3, 0.1))
    assert value(reach.second_moment(hypothesis(0.0, 1e-3))) == pytest.approx(1e-6), "what is known stays"
    uniform = (0.022**2 - 0.022 * 0.3 + 0.3**2) / 3.0 + 3.5e-3**2
    assert value(reach.second_moment(hypothesis(0.0, 5.0))) == pytest.approx(uniform)


@pytest.mark.parametrize(("mean", "std"), [(0.0, 0.05), (0.004, 0.049), (-0.03, 0.02), (0.0, 2e-3)])
@pytest.mark.parametrize("limit", [0.015, 0.025, 0.035])
def test_beyond_a_limit_is_what_an_uncertain_edge_leaves_of_a_hypothesis(mean, std, limit):
    """Against the integral over a normal density times the chance that the edge is further away still."""
    low, high, sigma = -0.3, 0.022, 4e-3
    x = np.linspace(-0.5, 0.5, 200_001)
    left = norm.pdf(x, mean, std) * norm.sf(x, high, sigma) * norm.cdf(x, low, sigma)
    expected = left[np.abs(x) > limit].sum() / left.sum()
    reach = Reach(scalar(low), scalar(high), scalar(sigma))
    found = value(reach.beyond(hypothesis(mean, std), scalar(std), scalar(limit)))
    assert found == pytest.approx(expected, rel=0.2, abs=0.02)


def test_a_hypothesis_keeps_the_share_of_its_probability_that_the_way_leaves_and_one_in_twenty_at_least():
    reach = Reach(scalar(-0.3), scalar(0.022), scalar(3e-3))
    wide = norm.cdf(0.025, 0.0, 0.05) - norm.cdf(-0.303, 0.0, 0.05)
    assert value(reach.share(hypothesis(0.0, 0.05))) == pytest.approx(wide, abs=0.02)
    assert value(reach.share(hypothesis(0.0, 1e-3))) == pytest.approx(1.0, abs=0.01)
    assert value(reach.share(hypothesis(0.1, 1e-3))) == OUTSIDE
    longer = Reach(scalar(0.01), scalar(-0.01), scalar(3e-3))  # a way that is 20 mm longer than the cylinder
    assert value(longer.share(hypothesis(0.0, 0.05))) == OUTSIDE


@pytest.mark.parametrize("up", [True, False])
def test_a_way_weighs_an_end_that_is_elsewhere_once_and_after_its_extreme_was_left(up):
    """Of a stroke of 700 mm 650 are new; the piston has left the extreme by 20 mm, or only by 1 mm."""
    odds = {}
    for left in (0.02, 1e-3):
        ways = (0.65 - left, left) if up else (left, 0.65 - left)
        begun = replace(bank(below=ways[0], above=ways[1]), position=scalar(ways[0]))
        spread = list(begun.hypotheses)
        spread[LOW] = spread[LOW].with_covariance(spread[LOW].covariance.added(Quantity.POSITION, 0.1**2))
        begun = begun.with_hypotheses(spread)
        once = begun._within_reach()
        twice = once._within_reach()
        weights = [[value(h.log_weight) for h in one.hypotheses] for one in (begun, once, twice)]
        assert weights[1] == pytest.approx(weights[2]), "once"
        odds[left] = (weights[1][LOW] - weights[1][0]) - (weights[0][LOW] - weights[0][0])
    assert odds[0.02] < -0.1
    assert odds[1e-3] == pytest.approx(0.0)


@pytest.mark.parametrize("by", [0.01, -0.01])
def test_a_way_that_was_none_makes_no_other_longer(by):
    gone = bank(below=0.2, above=0.1).rewound(scalar(by))
    found = value(gone.state.below), value(gone.state.above)
    assert found == pytest.approx((0.19, 0.1) if by > 0.0 else (0.2, 0.09))


def test_a_measured_place_begins_the_way_where_it_was_unknown_and_counts_its_own_extreme():
    yes, no = ca.SX(1.0), ca.SX(0.0)
    unknown, known = (bank(std, below=0.3, above=0.2, extent=0.4) for std in (0.5 * STROKE, 2e-3))
    way = unknown._way_after(contact(0.1, 1e-3), scalar(0.1), no)
    assert (value(way.below), value(way.above), value(way.extent)) == (0.0, 0.0, 0.0)
    way = known._way_after(contact(0.01, 1e-3), scalar(0.01), no)
    assert (value(way.below), value(way.above), value(way.extent)) == pytest.approx((0.3, 0.19, 0.49))
    assert value(known._way_after(contact(0.01, 1e-3), scalar(0.01), yes).extent) == 0.0, "found again"


def test_the_first_contact_after_an_entered_start_corrects_the_start_as_well():
    """By the variance of a start that is wrong by a tenth of the stroke once in a hundred; later ones do not."""
    stops, machine = Assumptions().stops, Assumptions().machine
    taught = []
    for confirmed in (0.0, 1.0):
        begun = bank(entered=1.0, confirmed=confirmed)
        tied = [h.with_covariance(h.covariance.predicted({Quantity.LEAKAGE: 0.05}, {})) for h in begun.hypotheses]
        after, _ = begun.with_hypotheses(tied).placed(contact(0.006, 1e-3), ca.SX(0.0), ca.SX(1.0))
        taught.append(value(after.hypotheses[0].mean[Quantity.LEAKAGE]) - 1.0)
    known = 2e-6 + (0.05 * machine.leak) ** 2 + (stops.std * STROKE) ** 2
    start = stops.entered * (stops.elsewhere * STROKE) ** 2
    assert taught[0] / taught[1] == pytest.approx(known / (known + start), rel=0.05)


@pytest.mark.parametrize("off", [0.04, -0.04])
def test_under_another_machine_the_way_limits_the_place_less_by_as_much_as_that_is_off(off):
    """The band holds where the piston is if its position is unknown; an end that is elsewhere makes no way longer."""
    limits, another = {}, (Kind.LEAKS, Kind.UNKNOWN_POSITION)
    for kind in KINDS:
        begun = bank(below=0.35, above=0.35)
        each = list(begun.hypotheses)
        place = KINDS.index(kind)
        each[place] = each[place].shifted(off).with_log_weight(each[0].log_weight - 0.5)
        begun = begun.with_hypotheses(each)
        begun = replace(begun, together=Mixture.of(each, scalar(0.0)))
        sides = begun.together.band(scalar(1.0), scalar(0.0), begun.reach)
        limits[kind] = value(sides[0 if off < 0.0 else 1])
        reach = begun.reach.under(each)[place]
        beyond = value(begun.together.beyond(scalar(0.03), scalar(1.0), scalar(0.0), begun.reach))
        assert (beyond > 0.1) == (kind in another), kind
        assert value(reach.highest) == pytest.approx(abs(off) if kind in another else 0.0, abs=1e-9)
    slack = value(bank(below=0.35, above=0.35).reach.std) * TWO_SIDED_95
    for kind in KINDS[1:]:
        assert (limits[kind] > abs(off)) == (kind in another), kind
        assert kind in another or limits[kind] == pytest.approx(slack, rel=0.01)


def test_the_chance_of_a_large_error_is_asked_for_where_no_reference_is_due_anyway():
    """Whether a reference is due does not depend on it elsewhere, and its exponentials take a twentieth of a step."""
    begun, nothing = bank(below=0.35, above=0.35), scalar(0.0)
    beside = Beside(nothing, UnseenLoad(nothing, nothing), nothing)
    found = {}
    for share in (0.5, 1.0, 2.0):
        settled = value(stated(begun.together, scalar(1.0), begun.reach, beside, scalar(1e-4), nothing).settled)
        due = scalar(share * settled)
        said = stated(begun.together, scalar(1.0), begun.reach, beside, scalar(1e-4), due)
        found[share] = value(said.beyond)
    assert found[0.5] == 0.0
    assert found[1.0] == found[2.0] > 0.1
