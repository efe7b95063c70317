"""What a press on something that holds the piston, and how it is left, tell of what it is."""

import math

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from ramsight.sensor.pressing import PressState, Pushed, follow_press, odds_of_obstacle
from ramsight.sensor.thresholds import HELD_OBSTACLE, PASSED_END, VOLUME_MODEL_STD


def press(rise, missing, std=0.1):
    return PressState(rise=ca.DM(rise), missing=ca.DM(missing), compliance=ca.DM(1.0), compliance_std=ca.DM(std))


def odds(rise, missing, *, on=0.0, noise=0.5, std=0.1):
    return math.exp(float(odds_of_obstacle(press(rise, missing, std), ca.DM(noise), ca.DM(on))))


@given(rise=st.floats(5.0, 200.0), softness=st.floats(0.0, 0.9), std=st.floats(0.02, 0.25))
def test_the_odds_are_a_ratio_of_densities(rise, softness, std):
    """Of an end by scipy's normal density, of an obstacle by that of anything between rigid and yielding."""
    deviation = math.sqrt(0.5**2 + rise**2 * (std**2 + VOLUME_MODEL_STD**2))
    end = norm.pdf(softness * rise, 0.0, deviation)
    obstacle = 1.0 / math.sqrt(rise**2 + 2.0 * math.pi * deviation**2)
    back = HELD_OBSTACLE * obstacle / (end + PASSED_END * obstacle)
    on = obstacle / (PASSED_END * (end + obstacle))
    assert odds(rise, softness * rise, std=std) == pytest.approx(back, rel=1e-6)
    assert odds(rise, softness * rise, std=std, on=1.0) == pytest.approx(on, rel=1e-6)


def test_a_stiff_contact_that_is_left_backwards_is_an_end_and_a_soft_one_undecided():
    stiff, soft = odds(50.0, 0.0), odds(50.0, 30.0)
    assert stiff < 0.02
    assert soft == pytest.approx(HELD_OBSTACLE / PASSED_END, rel=0.05)
    assert odds(0.0, 0.0) == pytest.approx(HELD_OBSTACLE, rel=0.1), "without a press the way alone tells"


def test_a_piston_that_goes_on_was_on_no_end_the_less_the_stiffer_it_was():
    assert 1.0 < odds(50.0, 0.0, on=1.0) < odds(50.0, 30.0, on=1.0) <= 1.0 / PASSED_END


def pushed(held, rise, missing, compliance=1.0, std=0.1, pushing=1.0):
    values = {"pushing": pushing, "rise": rise, "missing": missing, "compliance": compliance, "compliance_std": std}
    return Pushed(held=ca.DM(held), **{name: ca.DM(value) for name, value in values.items()})


def test_the_strongest_press_of_a_hold_counts_and_none_of_another():
    state = PressState()
    for now in (pushed(0, 0.0, 0.0), pushed(1, 10.0, 2.0), pushed(1, 30.0, 3.0), pushed(1, 20.0, 9.0)):
        state = follow_press(state, now)
    assert (float(state.rise), float(state.missing)) == (30.0, 3.0)
    drawn = follow_press(state, pushed(1, 60.0, 50.0, pushing=0.0))
    assert float(drawn.rise) == 30.0, "a motor that turns back presses nothing"
    assert float(follow_press(state, pushed(0, 0.0, 0.0)).rise) == 0.0


def test_what_a_contact_teaches_of_the_oil_is_no_stiffness_of_it():
    """Half of the rise is missing by the compliance from before; to the filter the oil is twice as soft by now."""
    state = follow_press(PressState(), pushed(0, 0.0, 0.0, compliance=1.0, std=0.2))
    at_once = follow_press(state, pushed(1, 40.0, 20.0))
    learned = follow_press(state, pushed(1, 20.0, 0.0, compliance=2.0, std=0.05))
    assert float(at_once.missing) / float(at_once.rise) == pytest.approx(0.5)
    assert (float(learned.rise), float(learned.missing)) == pytest.approx((40.0, 20.0))
    assert float(learned.compliance_std) == 0.2
