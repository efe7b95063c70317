"""Places of the sensor where a small change of the code once went unseen: each function by itself, at its boundary."""

from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import pytest

from ramsight.expression import scalar
from ramsight.plant.balance import FACTORS
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.measurement import applied
from ramsight.sensor.belief.update import UpdateState, _place, _torque_evidence
from ramsight.sensor.circuit.load import LOAD, _Following, _starting_load
from ramsight.sensor.contacts import contact
from ramsight.sensor.contacts.contact import NearSettingState, _over
from ramsight.sensor.contacts.contact_release import RestState, _at_rest
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.report.report import _shown
from ramsight.sensor.thresholds import CERTAIN

from .test_belief_guards import STROKE, bank, value

YES, NO = ca.SX(1.0), ca.SX(0.0)
LOW = KINDS.index(Kind.LOW)


def torque(**more):
    """What a step says of the torque."""
    usual = {"expected": 30.0, "change": 0.0, "noise": 0.5, "shows": 0.9, "innovation": 2.0}
    return SimpleNamespace(**{name: ca.SX(one) for name, one in (usual | more).items()})


@pytest.mark.parametrize("held", [False, True])
def test_at_rest_a_torque_has_changed_by_nothing_before_it_was_held(held):
    state = RestState(held=ca.SX(held), expected_began=ca.SX(28.0), shown_began=ca.SX(19.0))
    step = SimpleNamespace(torque=torque(), motion=SimpleNamespace(give=ca.SX(1e-7)))
    sample = SimpleNamespace(motor_torque=ca.SX(20.0))
    found = _at_rest(state, sample, step, YES, NO, SimpleNamespace(travel_per_radian=1e-4))
    assert (value(found.expected), value(found.shown)) == ((2.0, 1.0) if held else (0.0, 0.0))
    began = value(found.state.expected_began), value(found.state.shown_began)
    assert began == ((28.0, 19.0) if held else (30.0, 20.0))
    gone = _at_rest(state, sample, step, NO, NO, SimpleNamespace(travel_per_radian=1e-4))
    assert value(gone.state.least_behind) == 0.0, "the next time it begins where the torque does not stay behind"


@pytest.mark.parametrize(("innovation", "load"), [(-0.5, 1e4), (0.5, 5e4), (2.0, 5e4)])
def test_a_load_that_only_resists_sinks_to_what_presses_by_a_torque_that_is_too_small_alone(innovation, load):
    model = SimpleNamespace(passive=True, balance=SimpleNamespace(force=lambda _: ca.SX(1e4)))
    free = SimpleNamespace(solution=SimpleNamespace(stands=YES, z=None))
    state = SimpleNamespace(load=ca.SX(5e4))
    assert value(_starting_load(state, free, ca.SX(innovation), model)) == load


@pytest.mark.parametrize(("lasts", "began"), [(0.0, 0.31), (0.02, 0.3), (0.9, 0.3)])
def test_a_press_near_the_setting_began_where_the_first_sample_of_it_was(lasts, began):
    state = SimpleNamespace(held=NO, near_setting=NearSettingState(lasts=ca.SX(lasts), position=ca.SX(0.3)))
    step = SimpleNamespace(motion=SimpleNamespace(noise=ca.SX(1e-5)))
    now = SimpleNamespace(relief=ca.SX(0.5), std=ca.SX(1e-3))
    motor = SimpleNamespace(turns=YES, delivered=ca.SX(1e-3), before=ca.SX(0.31), way=ca.SX(1.0))
    model = SimpleNamespace(stroke=STROKE, assumed=Assumptions())
    sample = SimpleNamespace(elapsed=ca.SX(0.02))
    found, _ = _over(state, sample, step, now, motor, YES, model)
    assert value(found.position) == began
    assert value(found.lasts) == pytest.approx(lasts + 0.02)


@pytest.mark.parametrize("odds", [-0.2, 0.2])
def test_a_press_that_lasts_is_at_an_end_where_that_is_likelier_than_not(monkeypatch, odds):
    monkeypatch.setattr(contact, "likelier_at_end", lambda *_: ca.SX(odds))
    state = SimpleNamespace(held=NO, near_setting=NearSettingState(lasts=ca.SX(0.9), position=ca.SX(0.3)))
    step = SimpleNamespace(motion=SimpleNamespace(noise=ca.SX(1e-5)))
    now = SimpleNamespace(relief=ca.SX(0.5), std=ca.SX(1e-3))
    motor = SimpleNamespace(turns=YES, delivered=ca.SX(1e-3), before=ca.SX(0.31), way=ca.SX(1.0))
    _, over = _over(state, SimpleNamespace(elapsed=ca.SX(0.02)), step, now, motor, YES, SimpleNamespace())
    assert value(over) == (odds > 0.0)


def reached(**state):
    """A bank at 0.63 m of 0.7 m that has been 0.63 m below and 0.02 m above its place."""
    return replace(bank(below=0.63, above=0.02, **state), position=scalar(0.63))


def test_a_way_that_is_no_longer_than_before_leaves_what_it_was_known_by():
    once = reached(extent=0.649, extent_std=1e-4)._within_reach()
    assert value(once.state.extent_std) == 1e-4, "a millimetre more is no more"
    more = reached(extent=0.6, extent_std=1e-4)._within_reach()
    assert value(more.state.extent_std) > 5e-4
    assert value(more.state.extent) == pytest.approx(0.65)


@pytest.mark.parametrize(("mean", "refuted"), [(0.12, True), (-0.12, False)])
def test_a_new_extreme_above_refutes_a_place_that_is_too_high_and_weighs_one_that_is_too_low_no_more(mean, refuted):
    """A place that is too low was as far from the cylinder before the piston went higher."""
    begun = reached(extent=0.45)
    moved = [h.shifted(scalar(mean)) if k == LOW else h for k, h in enumerate(begun.hypotheses)]
    begun = begun.with_hypotheses(moved)
    odds = [
        value(one.hypotheses[LOW].log_weight - one.hypotheses[0].log_weight) for one in (begun, begun._within_reach())
    ]
    assert (odds[1] - odds[0] < -1.0) == refuted


def test_a_torque_teaches_the_machine_and_weighs_no_hypothesis():
    by = {Quantity.LEAKAGE: ca.SX(1.0), Quantity.COMPLIANCE: ca.SX(-30.0)}
    at = SimpleNamespace(
        sample=SimpleNamespace(elapsed=ca.SX(0.02), motor_speed=ca.SX(50.0), motor_torque=ca.SX(30.0)),
        step=SimpleNamespace(torque=torque(shows=0.0), load=SimpleNamespace(empty=NO)),
        linearised_at={Quantity.LEAKAGE: ca.SX(1.0), Quantity.COMPLIANCE: ca.SX(1.0)},
        torque_by=by,
        checks=SimpleNamespace(unless_contradicted=lambda flag: flag),
    )
    hold = SimpleNamespace(press=SimpleNamespace(decided=YES), pushing=YES, draws=NO, held=YES)
    met = SimpleNamespace(contact=SimpleNamespace(hold=hold), relief=SimpleNamespace(probability=NO))
    state = UpdateState.initial(Assumptions(), ())
    _, evidence = _torque_evidence(state, at, met, SimpleNamespace(assumed=Assumptions()))
    assert (value(evidence.use), evidence.gate) == (1.0, CERTAIN)
    begun = bank()
    after, _ = begun.update(evidence)
    assert [value(h.log_weight) for h in after.hypotheses] == [value(h.log_weight) for h in begun.hypotheses]
    taught = applied(begun.hypotheses[0], evidence).hypothesis
    assert value(taught.mean[Quantity.COMPLIANCE]) != 1.0


@pytest.mark.parametrize(("delay", "samples"), [(0.01, 0.5), (0.02, 0.5), (0.1, 2.5)])
def test_a_contact_is_late_by_half_the_delay_of_the_torque_or_half_a_sample(delay, samples):
    assumed = Assumptions.model_validate({"drive": {"delay": delay}})
    place = SimpleNamespace(found=YES, evidence=YES, at_top=YES, position=ca.SX(0.699), std=ca.SX(3e-4))
    press = SimpleNamespace(at_setting=ca.SX(1.0))
    at = SimpleNamespace(
        sample=SimpleNamespace(referenced=NO, reference=NO, elapsed=ca.SX(0.02)),
        step=SimpleNamespace(motion=SimpleNamespace(free_travel=ca.SX(1e-3)), load=SimpleNamespace(carried=ca.SX(0.0))),
        checks=SimpleNamespace(unless_contradicted=lambda flag: flag),
    )
    met = SimpleNamespace(
        contact=SimpleNamespace(place=place, hold=SimpleNamespace(press=press)), nominal=ca.SX(0.6995)
    )
    found = _place(at, met, SimpleNamespace(assumed=assumed, stroke=STROKE, stop_stiffness=1e9))
    assert value(found.measurement.arrived) == pytest.approx((1e-3 * samples) ** 2 + 3e-4**2)
    assert value(found.measurement.innovation) == pytest.approx(STROKE - 0.699)
    assert value(found.stands) == 0.699, "where it was met, and not where the step ends"


def test_a_load_follows_a_factor_by_both_of_its_corrections():
    """Its first variance and its changing one correct it by what the torque shows of the factor, 2 N m per unit."""
    solution = SimpleNamespace(
        by_factor=lambda k, start, load: ca.SX([0.0, 0.0]),
        torque_by=lambda _: ca.SX(0.0),
        torque_by_factor=lambda k: ca.SX(2.0),
    )
    done = SimpleNamespace(load=ca.SX(1e4), asked=ca.SX(1e4), solution=SimpleNamespace(
        by_factor=lambda k, start, load: ca.vertcat(0.0, load)))  # fmt: skip
    before = {name: {"velocity": ca.SX(0.0), LOAD: ca.SX(500.0)} for name in FACTORS}
    found = _Following(
        state=SimpleNamespace(sensitivities=before, circuit={"velocity": None}),
        free=SimpleNamespace(solution=solution, by_first=ca.SX([0.0, 0.0])),
        done=done, gains=SimpleNamespace(first=ca.SX(30.0), changing=ca.SX(7.0)),
        used=ca.SX(1.0), moves=YES, goes=NO,
    )  # fmt: skip
    kept, travel, shown = found._of(0, FACTORS[0])
    assert value(kept[LOAD]) == pytest.approx(500.0 - 30.0 * 2.0 - 7.0 * 2.0)
    assert (value(travel), value(shown)) == (0.0, 2.0)


def test_a_position_that_is_shown_may_be_off_by_what_it_stays_behind_and_what_was_unseen():
    """The estimate went 10 mm in a sample in which a piston goes 3.3 mm; 2 mm may have passed unseen before."""
    at = SimpleNamespace(
        intake=SimpleNamespace(passed=ca.SX(0.1), usable=YES, unseen=ca.SX(2e-3)),
        sample=SimpleNamespace(started=YES), position=ca.SX(0.3),
    )  # fmt: skip
    updated = SimpleNamespace(measured=SimpleNamespace(accepted=NO))
    model = SimpleNamespace(travel_per_radian=1e-4, max_speed=300.0, stroke=STROKE)
    state, outcome = SimpleNamespace(position=ca.SX(0.3)), SimpleNamespace(kept=ca.SX(0.31))
    shown, offset = _shown(state, at, updated, outcome, model)
    assert (value(shown), value(offset)) == pytest.approx((0.3033, 2e-3 + 6.7e-3))


def test_a_piston_may_have_sunk_at_rest_by_what_the_torque_has_stayed_behind_since_it_went_along():
    """2 N m behind, after it was 3 N m ahead: oil that gives 1e-7 m/N, and 1e-4 m per radian."""
    state = RestState(
        held=YES, expected_began=ca.SX(28.0), shown_began=ca.SX(19.0), least_behind=ca.SX(-3.0), sunk=ca.SX(1.0)
    )
    step = SimpleNamespace(torque=torque(expected=31.0), motion=SimpleNamespace(give=ca.SX(1e-7)))
    found = _at_rest(
        state, SimpleNamespace(motor_torque=ca.SX(20.0)), step, YES, NO, SimpleNamespace(travel_per_radian=1e-4)
    )
    assert value(found.state.least_behind) == -3.0
    assert value(found.sunk) == pytest.approx(5.0 * 1e-7 / 1e-4)
