"""What a press on something that holds the piston, and how it is left, tell of what it is."""

import math

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from ramsight.sensor.contacts.press import (
    PressState,
    Pushed,
    at_setting,
    chance_of_none,
    follow_press,
    likelier_at_end,
    odds_of_end,
    odds_of_obstacle,
)
from ramsight.sensor.thresholds import END_HELD_TIME, FALSE_CONTACT, NO_END_HOLDS, OUTSIDE, VOLUME_MODEL_STD

from .sensor_bench import Machine, step_of


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
    back = OUTSIDE * obstacle / (end + OUTSIDE * obstacle)
    on = obstacle / (OUTSIDE * (end + obstacle))
    assert odds(rise, softness * rise, std=std) == pytest.approx(back, rel=1e-6)
    assert odds(rise, softness * rise, std=std, on=1.0) == pytest.approx(on, rel=1e-6)


def test_a_stiff_contact_that_is_left_backwards_is_an_end_and_a_soft_one_undecided():
    stiff, soft = odds(50.0, 0.0), odds(50.0, 30.0)
    assert stiff < 0.02
    assert soft == pytest.approx(OUTSIDE / OUTSIDE, rel=0.05)
    assert odds(0.0, 0.0) == pytest.approx(OUTSIDE, rel=0.1), "without a press the way alone tells"


def test_a_piston_that_goes_on_was_on_no_end_the_less_the_stiffer_it_was():
    assert 1.0 < odds(50.0, 0.0, on=1.0) < odds(50.0, 30.0, on=1.0) <= 1.0 / OUTSIDE


def pushed(held, rise, missing, compliance=1.0, std=0.1, pushing=1.0, setting=0.0, elapsed=0.02, place=0.0):
    values = {"pushing": pushing, "rise": rise, "missing": missing, "compliance": compliance, "compliance_std": std}
    values |= {"at_setting": setting, "elapsed": elapsed, "place": place}
    return Pushed(held=ca.DM(held), **{name: ca.DM(value) for name, value in values.items()})


def test_the_strongest_press_of_a_hold_counts_and_none_of_another():
    state = PressState()
    for now in (pushed(0, 0.0, 0.0), pushed(1, 10.0, 2.0), pushed(1, 30.0, 3.0), pushed(1, 20.0, 9.0)):
        state, _ = follow_press(state, now)
    assert (float(state.rise), float(state.missing)) == (30.0, 3.0)
    drawn, _ = follow_press(state, pushed(1, 60.0, 50.0, pushing=0.0))
    assert float(drawn.rise) == 30.0, "a motor that turns back presses nothing"
    assert float(follow_press(state, pushed(0, 0.0, 0.0))[0].rise) == 0.0


def test_what_a_contact_teaches_of_the_oil_is_no_stiffness_of_it():
    """Half of the rise is missing by the compliance from before; to the filter the oil is twice as soft by now."""
    state, _ = follow_press(PressState(), pushed(0, 0.0, 0.0, compliance=1.0, std=0.2))
    at_once, _ = follow_press(state, pushed(1, 40.0, 20.0))
    learned, _ = follow_press(state, pushed(1, 20.0, 0.0, compliance=2.0, std=0.05))
    assert float(at_once.missing) / float(at_once.rise) == pytest.approx(0.5)
    assert (float(learned.rise), float(learned.missing)) == pytest.approx((40.0, 20.0))
    assert float(learned.compliance_std) == 0.2


def pressed_for(seconds, **how):
    """The state and whether it was decided on the way, of a press at the relief setting."""
    state, decided = PressState(), False
    for _ in range(round(seconds / 0.02)):
        state, now = follow_press(state, pushed(1, 10.0, 0.0, setting=1.0, **how))
        decided |= bool(float(now))
    return state, decided


NEEDED = END_HELD_TIME * (math.log(NO_END_HOLDS) - math.log(FALSE_CONTACT))
"""How long a press at an unknown position has to last at the setting [s]: 0.53 s."""


def test_a_press_is_decided_by_how_long_it_holds_the_setting():
    assert not pressed_for(NEEDED - 0.03)[1]
    state, decided = pressed_for(NEEDED + 0.03)
    assert decided
    assert float(state.decided) == 1.0


def test_where_an_end_is_expected_it_is_decided_sooner_and_elsewhere_later():
    sooner, later = (END_HELD_TIME * place for place in (3.0, math.log(OUTSIDE)))
    assert pressed_for(NEEDED - sooner + 0.03, place=3.0)[1]
    assert not pressed_for(NEEDED - sooner - 0.03, place=3.0)[1]
    assert pressed_for(NEEDED - later + 0.03, place=math.log(OUTSIDE))[1]
    assert not pressed_for(NEEDED - later - 0.03, place=math.log(OUTSIDE))[1]


def test_a_press_that_never_reaches_the_setting_or_only_draws_decides_nothing():
    state = PressState()
    for _ in range(500):
        state, decided = follow_press(state, pushed(1, 50.0, 0.0))
        assert float(decided) == 0.0
    assert not pressed_for(5.0, pushing=0.0)[1]
    assert float(odds_of_end(ca.DM(0.0), ca.DM(9.0))) == 0.0, "a place alone is no end"


def released(seconds, place):
    """Whether a press counts as it is released, after a time at the setting."""
    state, decided = pressed_for(seconds, place=place)
    assert not decided, "it has not decided before"
    return bool(float(follow_press(state, pushed(1, 0.0, 0.0, pushing=0.0, place=place))[1]))


@pytest.mark.parametrize(("seconds", "place", "counts"), [
    (0.04, 2.0, True),  # at the setting, where an end is expected
    (0.0, 2.0, False),  # it never got there
    (0.02, 1e-6, True),
    (0.2, -1e-6, False),  # any other place is as likely
    (0.2, 0.0, False),  # the position is unknown
])  # fmt: skip
def test_a_press_that_is_released_counts_near_an_end_that_is_expected(seconds, place, counts):
    assert released(seconds, place) is counts


def test_what_a_press_leaves_of_no_end_falls_with_its_time():
    chances = [float(chance_of_none(pressed_for(seconds)[0])) for seconds in (0.02, 0.12, 0.52)]
    assert chances[0] == pytest.approx(NO_END_HOLDS * math.exp(-0.2))
    assert chances[0] / chances[1] == pytest.approx(math.e)
    assert chances[2] < 2.0 * FALSE_CONTACT
    assert float(chance_of_none(PressState())) == 0.0, "a load that has settled on its end has pressed nothing"


def test_what_is_let_go_is_forgotten():
    state, _ = pressed_for(0.4)
    state, _ = follow_press(state, pushed(0, 0.0, 0.0))
    assert float(state.at_setting) == float(state.decided) == 0.0


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_a_place_is_as_much_likelier_as_its_density_times_the_stroke(direction):
    model = Machine()
    stroke, own = model.stroke, model.assumed.stops.contact
    end = stroke if direction > 0.0 else 0.0

    def likelier(position, std):
        return float(ca.evalf(ca.SX(1.0) * likelier_at_end(ca.SX(position), std, ca.SX(direction), model)))

    wide = math.hypot(5e-3, own * stroke)
    assert likelier(end - direction * 4e-3, 5e-3) == pytest.approx(
        math.log(stroke * norm.pdf(4e-3, 0.0, wide)), rel=1e-6
    )
    assert likelier(0.5 * stroke, 5e-3) == math.log(OUTSIDE)


def test_the_setting_is_reached_within_what_a_valve_may_open_early():
    step = step_of(expected=100.0, noise=0.5)

    def reached(missing, relief=1.0, tolerance=0.1):
        return bool(float(ca.evalf(at_setting(step, ca.SX(missing), ca.SX(relief), ca.SX(tolerance)))))

    assert reached(10.9)
    assert not reached(11.1)
    assert reached(-30.0), "a valve that holds more is one as well"
    assert not reached(0.0, relief=0.0)
