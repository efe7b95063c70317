"""What guards a belief from below: evidence that counts once, ways that are unsure, bands that narrow slowly."""

import math
from types import SimpleNamespace

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from ramsight.expression import scalar
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.bank import Bank
from ramsight.sensor.belief.bank_state import BankState
from ramsight.sensor.belief.hypothesis import BOUNDS, Hypothesis
from ramsight.sensor.belief.measurement import Measurement, applied
from ramsight.sensor.belief.mixture import Mixture, bayes
from ramsight.sensor.belief.renewal import unknown_position
from ramsight.sensor.belief.update import _place, _time_update
from ramsight.sensor.circuit.load import _gains
from ramsight.sensor.circuit.unseen_load import UnseenLoad
from ramsight.sensor.contacts.contact import _waiting
from ramsight.sensor.contacts.press import PressState, chance_of_none
from ramsight.sensor.covariance import Covariance
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.report.report import _others
from ramsight.sensor.report.stated import Beside, stated
from ramsight.sensor.thresholds import (
    BAND_STEP,
    CONTACTS_ALIKE,
    END_GIVES,
    LOG_WEIGHT_LEAST,
    OUTSIDE,
    SEPARATE_CONTACTS,
)

STROKE = 0.7
MODEL = SimpleNamespace(stroke=STROKE, assumed=Assumptions(), kinds=KINDS)


def value(expression):
    return float(ca.evalf(scalar(0.0) + expression))


def bank(std=1e-3, **state):
    """Hypotheses whose positions have this standard deviation, in the middle of the stroke."""
    first = BankState.initial(Assumptions(), STROKE)
    hypotheses = tuple(h.with_covariance(h.covariance.at_least(Quantity.POSITION, std**2)) for h in first.hypotheses)
    state = BankState(**{**vars(first), **{name: scalar(one) for name, one in state.items()}, "hypotheses": hypotheses})
    return Bank(state, Mixture.of(hypotheses, scalar(0.0)), MODEL, scalar(0.5 * STROKE), scalar(0.02))


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_oil_over_a_relief_valve_takes_no_hypothesis_beyond_its_own_stop(way):
    """After a contact each hypothesis knows how far it is from its stop, wherever that is: the piston stays at it."""
    end = Quantity.TOP if way > 0.0 else Quantity.LOW
    contact = Measurement(
        use=scalar(1.0),
        innovation=scalar(0.0),
        H={Quantity.POSITION: 1.0, end: -1.0},
        R=scalar(1e-8),
        alternative=scalar(-20.0),
    )
    before = bank(0.25)
    stands = STROKE if way > 0.0 else 0.0
    met = before.with_hypotheses([applied(h, contact).hypothesis for h in before.hypotheses])
    after = met.confined(scalar(stands + 0.04 * way), ca.SX(1.0), 0.0)
    free = met.confined(scalar(stands + 0.04 * way), ca.SX(0.0), 0.0)
    for kind, h, same in zip(KINDS, after.hypotheses, free.hypotheses, strict=True):
        beyond = 0.04 + value(h.mean[Quantity.POSITION]) * way
        assert beyond == pytest.approx(END_GIVES * STROKE, abs=2e-3), kind
        assert value(same.mean[Quantity.POSITION]) == 0.0, "only where oil may pass"


def test_whoever_lost_the_position_for_no_stated_reason_knows_the_leakage_no_better():
    first = bank().hypotheses[0]
    first = first.with_covariance(Covariance({**first.covariance.entries, (Quantity.LEAKAGE, Quantity.LEAKAGE): 1e-4}))
    lost = unknown_position(first, 0.0, MODEL)
    assert value(lost.covariance.std(Quantity.LEAKAGE)) == Assumptions().machine.other_leak
    assert value(lost.position_std) == 0.5 * STROKE


@pytest.mark.parametrize("before", [0, 1, 7])
def test_a_repeated_contact_counts_as_the_derivative_of_what_all_together_are_worth(before):
    """n contacts whose errors are correlated by r are worth n / (1 + (n - 1) r) independent ones."""

    def worth(n):
        return n / (1.0 + (n - 1.0) * CONTACTS_ALIKE)

    step = 1e-6
    slope = (worth(before + 1.0 + step) - worth(before + 1.0 - step)) / (2.0 * step)
    expected = slope / (1.0 - CONTACTS_ALIKE)
    met = bank(met_low=before, met_top=3.0)
    assert value(met._counts(ca.SX(1.0), ca.SX(0.0))) == pytest.approx(expected)
    assert value(met._counts(ca.SX(0.0), ca.SX(0.0))) == 1.0, "a reference is no contact"


@pytest.mark.parametrize(("std", "share"), [(1e-3, 1.0 - 0.2 / STROKE), (0.12, 1.0)])
def test_a_way_that_is_as_unsure_as_it_is_long_refutes_no_place(std, share):
    """0.2 m, known to a millimetre or to 0.12 m."""
    unknown = bank(std, room=1.0)
    unknown = unknown.with_hypotheses(
        [
            h.with_covariance(h.covariance.at_least(Quantity.POSITION, (0.5 * STROKE) ** 2))
            if kind == Kind.UNKNOWN_POSITION
            else h
            for kind, h in zip(KINDS, unknown.hypotheses, strict=True)
        ]
    )
    after = unknown.roamed(scalar(0.2))
    odds = [one.hypotheses[-1].log_weight - one.hypotheses[0].log_weight for one in (unknown, after)]
    assert value(odds[1] - odds[0]) == pytest.approx(math.log(share), abs=0.02)


@pytest.mark.parametrize(
    ("size", "width", "after"),
    [
        (1.9, 2.0, 2.0 * math.exp(-BAND_STEP * OUTSIDE)), (4.1, 2.0, 2.0 * math.exp(BAND_STEP * (1.0 - OUTSIDE))),
        (3.8, 2.0, 2.0 * math.exp(-BAND_STEP * OUTSIDE)), (0.0, 1.0, 1.0),
    ],
)  # fmt: skip
def test_a_band_widens_by_a_miss_as_much_as_nineteen_hits_narrow_it(size, width, after):
    found = bank(band_width=width)._widened(scalar(size), ca.SX(1.0), ca.SX(1.0))
    assert value(found) == pytest.approx(after)
    unused = bank(band_width=width)._widened(scalar(size), ca.SX(1.0), ca.SX(0.0))
    assert value(unused) == width


@pytest.mark.parametrize(
    ("known", "gone", "separate"), [(1.0, 0.0, 0.0), (1.0, SEPARATE_CONTACTS, 1.0), (0.0, 0.0, 1.0)]
)
def test_a_contact_is_another_one_after_a_way_or_at_an_unknown_position(known, gone, separate):
    state = SimpleNamespace(waits=ca.SX(0.0), gone=ca.SX(gone))
    step = SimpleNamespace(motion=SimpleNamespace(travel=ca.SX(0.0)))
    no, yes = ca.SX(0.0), ca.SX(1.0)
    now = SimpleNamespace(known=ca.SX(known))
    waits, left, another = _waiting(state, yes, no, no, no, step, now, no, SimpleNamespace(stroke=STROKE))
    assert value(another) == value(waits) == separate
    assert value(left) == 0.0


def test_a_contact_that_turned_out_to_be_none_makes_the_next_another_one():
    step = SimpleNamespace(motion=SimpleNamespace(travel=ca.SX(0.0)))
    no, yes, now = ca.SX(0.0), ca.SX(1.0), SimpleNamespace(known=ca.SX(1.0))
    state = SimpleNamespace(waits=yes, gone=no)
    waits, gone, _ = _waiting(state, no, no, yes, no, step, now, no, SimpleNamespace(stroke=STROKE))
    assert value(waits) == 0.0, "released before it was decided"
    assert value(gone) == SEPARATE_CONTACTS


def test_a_torque_that_is_contradicted_moves_the_piston_by_what_the_oil_gives():
    hold = SimpleNamespace(held=ca.SX(0.0), give_back=ca.SX(0.0), travel_std=ca.SX(3e-3))
    at = SimpleNamespace(
        step=SimpleNamespace(
            load=SimpleNamespace(carried=ca.SX(1e5)), motion=SimpleNamespace(give=ca.SX(1e-8), noise=ca.SX(1e-3))
        ),
        checks=SimpleNamespace(torque_off=ca.SX(20.0)),
    )
    model = SimpleNamespace(stop_stiffness=ca.SX(1e8), travel_per_radian=ca.SX(1e-4))
    expected = 3e-3**2 + 1e-3**2 + (1e-8 * 20.0 / 1e-4) ** 2
    assert value(_others(at, SimpleNamespace(hold=hold), model)) == pytest.approx(expected)
    hold.held, hold.travel_std = ca.SX(1.0), ca.SX(0.0)
    at.checks.torque_off = ca.SX(0.0)
    assert value(_others(at, SimpleNamespace(hold=hold), model)) == pytest.approx(1e-3**2 + (1e5 / 1e8) ** 2)


@pytest.mark.parametrize("most", [0.0, 0.02])
def test_a_bound_holds_what_a_load_may_do_that_nobody_sees(most):
    known = bank(std=2e-3)
    together, width = known.limited().together, known.state.band_width
    alone = value(together.bound(width, scalar(1e-6)))
    beside = Beside(scalar(1e-6), UnseenLoad(ca.SX(0.0), ca.SX(most)), scalar(0.0))
    said = stated(together, width, known.reach, beside, 0.05, 0.1)
    assert value(said.bound) == pytest.approx(math.hypot(alone, most))
    assert alone > 4.0 * 2e-3


@pytest.mark.parametrize(
    ("passive", "stands", "innovation", "corrects"),
    [(True, 1.0, 5.0, False), (True, 1.0, -5.0, True), (True, 0.0, 5.0, True), (False, 1.0, 5.0, True)],
)
def test_a_load_that_only_resists_is_not_found_larger_while_it_stands(passive, stands, innovation, corrects):
    """What holds a load that resists is friction and its own support: the torque shows a lower limit of it."""
    state = SimpleNamespace(first_variance=ca.SX(1e6), variance=ca.SX(1e8))
    free = SimpleNamespace(
        torque_by_first=ca.SX(1e-4), torque_by_load=ca.SX(1e-4), noise=SimpleNamespace(variance=ca.SX(0.25)),
        h=ca.SX(0.02), solution=SimpleNamespace(stands=ca.SX(stands)),
    )  # fmt: skip
    model = SimpleNamespace(
        travel_per_radian=1e-4, torque_std=0.5, assumed=Assumptions(), relief_load=4e5, passive=passive
    )
    found = _gains(state, free, ca.SX(innovation), ca.SX(0.0), model)
    assert (value(found.changing) > 0.0) == corrects
    assert value(found.first) > 0.0


def hypothesis(position, std, weight=0.0, low=0.0):
    mean = {
        one: scalar(position if one == Quantity.POSITION else 0.0) for one in (Quantity.POSITION, *BOUNDS, Quantity.LOW)
    }
    spread = {one: {Quantity.POSITION: std, Quantity.LOW: low}.get(one, 0.0) for one in mean}
    return Hypothesis(mean=mean, covariance=Covariance.diagonal(spread), log_weight=scalar(weight))


def contact(innovation, std, chance=0.05, **how):
    return Measurement(
        use=ca.SX(1.0), innovation=scalar(innovation), H={Quantity.POSITION: 1.0, Quantity.LOW: -1.0},
        R=scalar(std**2), alternative=scalar(math.log(chance / STROKE)), **how,
    )  # fmt: skip


@pytest.mark.parametrize("wrong", [0.005, 0.02, 0.2])
def test_after_a_first_reading_the_position_is_unknown_by_the_chance_that_it_was_of_something_else(wrong):
    std = 2e-3
    reading = Measurement(
        use=ca.SX(1.0), innovation=scalar(0.0), H={Quantity.POSITION: 1.0}, R=scalar(std**2),
        alternative=scalar(math.log(wrong / STROKE)), stands=(scalar(0.5 * STROKE), scalar(STROKE)),
    )  # fmt: skip
    after, _ = bank(std=0.5 * STROKE).placed(reading, is_reading=True)
    first, unknown = (value(after.hypotheses[k].log_weight) for k in (0, -1))
    expected = wrong / STROKE / norm.pdf(0.0, scale=math.hypot(0.5 * STROKE, std))
    assert math.exp(unknown - first) == pytest.approx(expected, rel=0.01)
    assert value(after.hypotheses[-1].position_std) == pytest.approx(0.5 * STROKE, rel=0.01)
    switch, _ = bank(std=0.5 * STROKE).placed(reading)
    assert value(switch.hypotheses[-1].log_weight) == pytest.approx(math.log(Assumptions().stops.wrong), abs=0.02)


@given(
    innovation=st.floats(-0.1, 0.1),
    positions=st.lists(st.floats(-0.05, 0.05), min_size=2, max_size=4),
    std=st.floats(1e-3, 0.05),
    low=st.floats(0.0, 0.05),
)
def test_weights_follow_bayes_on_hand_made_innovations(innovation, positions, std, low):
    """The oracle multiplies densities: of the contact, or of an obstacle anywhere in the stroke if that is larger."""
    m = contact(innovation, 1e-3)
    each = [applied(hypothesis(x, std, low=low), m) for x in positions]
    after = bayes([one.hypothesis for one in each], [one.evidence for one in each])
    total = math.sqrt(std**2 + low**2 + 1e-3**2)
    densities = [max(norm.pdf(innovation - x, 0.0, total), 0.05 / STROKE) for x in positions]
    expected = [max(math.log(d / max(densities)), LOG_WEIGHT_LEAST) for d in densities]
    assert [value(h.log_weight) for h in after] == pytest.approx(expected, abs=1e-9)


@given(std=st.floats(1e-3, 0.05), more=st.floats(1.0, 10.0))
def test_a_larger_variance_of_anything_leaves_a_hypothesis_no_surer(std, more):
    """After a contact where it was expected: never less spread where the prior or the contact had more."""

    def left(prior, own):
        return value(applied(hypothesis(0.0, prior), contact(0.0, own)).hypothesis.position_std)

    assert left(more * std, 1e-3) >= left(std, 1e-3) - 1e-12
    assert left(std, more * 1e-3) >= left(std, 1e-3) - 1e-12


@given(innovation=st.floats(-0.05, 0.05), position=st.floats(-0.05, 0.05), std=st.floats(1e-3, 0.05))
def test_mirrored_measurements_give_mirrored_corrections(innovation, position, std):
    here = applied(hypothesis(position, std), contact(innovation, 2e-3))
    there = applied(hypothesis(-position, std), contact(-innovation, 2e-3))
    assert value(here.hypothesis.mean[Quantity.POSITION]) == pytest.approx(
        -value(there.hypothesis.mean[Quantity.POSITION]), abs=1e-12
    )
    assert value(here.evidence) == pytest.approx(value(there.evidence))


def test_beyond_the_end_nothing_is_met_whatever_explains_it():
    """A hypothesis 20 mm beyond the end, known to 2 mm: contact and obstacle are as unlikely as it is there."""
    h, stands = hypothesis(0.0, 2e-3, low=0.07), (scalar(-0.02), scalar(STROKE))
    inside, outside = (applied(h, contact(0.02, 1e-3, stands=one)) for one in (None, stands))
    lost = 0.5 * 0.02**2 / (2e-3**2 + 1e-3**2)
    assert value(inside.otherwise - outside.otherwise) == pytest.approx(lost)
    assert value(outside.likelihood) < value(inside.likelihood) - 0.5 * lost


def test_what_else_is_uncertain_of_a_position_widens_all_that_is_said_of_it():
    known = bank(std=2e-3)
    together, width = known.limited().together, known.state.band_width

    def said(others):
        beside = Beside(scalar(others), UnseenLoad(ca.SX(0.0), ca.SX(0.0)), scalar(0.0))
        return stated(together, width, known.reach, beside, 0.01, 0.1)

    without, alone = said(0.0), said(1e-4)
    for name in ("below", "above", "overall", "settled", "beyond", "bound"):
        assert value(getattr(alone, name)) > value(getattr(without, name)), name


def test_what_a_wrong_torque_and_unseen_oil_leave_uncertain_grows_with_their_time():
    """An error of the torque that lasts for the time T leaks for T: its variance in a step dt is 2 T/dt of it."""
    kept = []
    watched = SimpleNamespace(
        predicted=lambda *given: kept.append(given) or SimpleNamespace(floored=lambda leak: known)
    )
    known = SimpleNamespace(roamed=lambda travel: None)
    torque = SimpleNamespace(hidden=ca.SX(0.0))
    step = SimpleNamespace(
        torque=torque, load=SimpleNamespace(std=ca.SX(1.0), value=ca.SX(1.0)),
        motion=SimpleNamespace(travel=ca.SX(0.0), free_travel=ca.SX(0.0)),
    )  # fmt: skip
    at = SimpleNamespace(
        step=step, leakage=SimpleNamespace(change=ca.SX(0.0), per_kelvin=ca.SX(0.05)),
        travel_by={Quantity.LEAKAGE: ca.SX(3e-4)}, linearised_at={Quantity.LEAKAGE: ca.SX(1.2)},
        sample=SimpleNamespace(
            elapsed=ca.SX(0.02), offset_variance=ca.SX(0.0), motor_torque=ca.SX(20.0), temperature_variance=ca.SX(0.04),
        ),
    )  # fmt: skip
    for correlation in (5.0, 20.0):
        assumed = Assumptions().replace({"drive.correlation": correlation, "drive.torque_gain": 0.04})
        _time_update(watched, at, scalar(0.0), SimpleNamespace(assumed=assumed, torque_std=0.5, travel_per_radian=1e-4))
        assert value(kept[-1][3]) == pytest.approx(0.04**2 * 3e-4**2 * 2.0 * correlation / 0.02)
        assert value(kept[-1][5]) == pytest.approx(1.2 * 0.05 * 0.2), "what oil may have warmed by unseen, leaks"


@pytest.mark.parametrize("held", [0.0, 0.05])
def test_a_press_that_was_short_leaves_it_likelier_that_a_contact_is_with_none_of_both(held):
    press = PressState(at_setting=ca.SX(held))
    place = SimpleNamespace(
        evidence=ca.SX(1.0), found=ca.SX(1.0), position=ca.SX(0.699), std=ca.SX(1e-3), at_top=ca.SX(1.0)
    )
    met = SimpleNamespace(contact=SimpleNamespace(place=place, hold=SimpleNamespace(press=press)), nominal=ca.SX(0.698))
    at = SimpleNamespace(
        sample=SimpleNamespace(referenced=ca.SX(0.0), reference=ca.SX(0.0), elapsed=ca.SX(0.02)),
        step=SimpleNamespace(load=SimpleNamespace(carried=ca.SX(0.0)), motion=SimpleNamespace(free_travel=ca.SX(0.0))),
        checks=SimpleNamespace(unless_contradicted=lambda one: one),
    )
    found = _place(at, met, SimpleNamespace(stroke=STROKE, assumed=Assumptions(), stop_stiffness=ca.SX(1e8)))
    obstacle = Assumptions().stops.obstacle
    chance = obstacle + value(chance_of_none(press))
    assert value(found.measurement.alternative) == pytest.approx(math.log(chance / STROKE))
    assert (chance > obstacle) == (held > 0.0)
