"""Constants that no log of the study tries: each decides on one signal, a little below it and a little above.

The numbers are written out here, and nothing is imported from the table: `constants_varied.py --tests` runs each test
with its constant times and over 1.5, and it has to fail. Which test is which constant's is in `constants_varied.toml`.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from scipy.stats import norm

from ramsight.deploy.encoder.saving import Saving
from ramsight.expression import scalar
from ramsight.plant.symbols import Parameters
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.mixture import Mixture
from ramsight.sensor.belief.position_reading import read_position
from ramsight.sensor.belief.update import UpdateState, _torque_evidence
from ramsight.sensor.checks.counter_check import CounterCheckState, Counting, read_counter
from ramsight.sensor.checks.diagnosis import Evidence, offset_of
from ramsight.sensor.checks.disagreement import sure
from ramsight.sensor.checks.drive_check import DriveChecks
from ramsight.sensor.checks.inertia_check import BandState, InertiaState, _band, check_inertia
from ramsight.sensor.circuit import load_step
from ramsight.sensor.circuit.load import _correct
from ramsight.sensor.circuit.pressures import _possible
from ramsight.sensor.contacts.contact import SettlingState, _settling
from ramsight.sensor.inputs.intake import (
    IntakeState,
    RateState,
    TorqueState,
    _clock,
    _torque,
    check_inputs,
    check_rate,
)
from ramsight.sensor.inputs.oil_heat import CaseParameters, CaseState, heat_case
from ramsight.sensor.inputs.sample import SHAFT_ANGLE, CounterState, Raw, SampleState, commanded, plain_sample
from ramsight.sensor.inputs.thermometer import ThermometerState, read_thermometer
from ramsight.sensor.inputs.torque import MagnetState, TorqueZeroState, correct_torque, correct_zero
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.status import Status
from ramsight.sensor.table import MovementTable, table
from ramsight.tracking.comparing import ComparisonState, compare

from .test_belief_guards import bank, value
from .test_sensor_boundaries import torque

NEAR = 0.2
"""How near a test comes to its constant: less than the half of it by which the study changes it."""
YES, NO = ca.SX(1.0), ca.SX(0.0)
DRIVE = SimpleNamespace(
    max_speed=300.0,
    largest_torque=100.0,
    relief_torque=60.0,
    leak_velocity=1e-3,
    travel_per_radian=1e-4,
    torque_std=0.5,
    assumed=Assumptions(),
    limits=SimpleNamespace(pressure=300e5),
)
"""What the checks ask of a machine: 300 rad/s, 60 N m at a relief pressure of 300 bar."""


def decides(at):
    """Values a little below and a little above a limit, and whether they are beyond it."""
    return pytest.mark.parametrize(("at", "beyond"), [(at / (1.0 + NEAR), False), (at * (1.0 + NEAR), True)])


def about(expected):
    """A value that is nearer to the expected one than the study's changes are."""
    return pytest.approx(expected, rel=NEAR)


def raw(**how):
    """A sample as it is reported: the motor stands, the oil is at 40 C."""
    usual = {"time": 10.0, "motor_speed": 0.0, "motor_torque": 0.0, "oil_temperature": 313.15, "reference": 0.0}
    found = {name: ca.SX(one) for name, one in (usual | how).items()}
    return Raw(**found, referenced=NO, commands={}, measured={})


def taken(since=0.02, speed=0.0, **how):
    """The state before a sample that comes so long after the last one [s], at a speed [rad/s]."""
    last = ca.SX(10.0 - since)
    usual = {"started": YES, "time": last, "motor_speed": ca.SX(speed), "clock": last, "clocked": YES, "commands": {}}
    return IntakeState(**(usual | how))


# Time.


@decides(1e12)
def test_a_clock_in_milliseconds_since_1970_is_no_time_in_seconds(at, beyond):
    assert value(_clock(taken(), raw(time=at)).number) == (not beyond)


@decides(8e-3)
def test_a_sample_that_follows_too_closely_is_passed_over(at, beyond):
    _, _, found = check_inputs(taken(at), raw(), DRIVE)
    assert value(found.passed_over) == (not beyond)


@decides(0.5)
def test_a_gap_in_which_a_motor_can_start_and_stop_is_no_sample(at, beyond):
    assert value(_clock(taken(at), raw()).jump) == beyond


@pytest.mark.parametrize(("before", "back"), [(0.0, False), (1.0, True)])
def test_two_late_samples_in_their_order_are_those_of_a_clock_that_was_set(before, back):
    state = taken(-0.1, clock=ca.SX(9.98), behind=ca.SX(before))
    assert value(_clock(state, raw()).back) == back


@pytest.mark.parametrize(("gap", "lasts"), [(3000.0, 3000.0), (1e5, 3600.0)])
def test_in_a_gap_a_motor_turns_for_an_hour_at_most(gap, lasts):
    """It turned at 100 rad/s before and stands after it: 50 rad/s, and 2 % of 300 rad/s."""
    _, _, found = check_inputs(taken(gap, 100.0), raw(), DRIVE)
    assert value(found.drift) == about(56.0 * lasts * 1e-4)
    assert value(found.drift) <= 56.0 * lasts * 1e-4 + 1e-9


def test_between_two_standstills_a_motor_may_have_turned_at_a_fiftieth_of_its_highest_speed():
    _, _, found = check_inputs(taken(10.0), raw(), DRIVE)
    assert value(found.drift) == about(0.02 * 300.0 * 10.0 * 1e-4)


def rated(tick=0.02, **how):
    """The rate after a sample that comes so long after the last one [s]; samples came every 20 ms."""
    usual = {"period": 0.02, "last": 0.02, "variance": 1e-10, "learnt": 50.0, "apart": 0.0}
    state = RateState(**{name: ca.SX(one) for name, one in (usual | how).items()})
    return check_rate(state, ca.SX(tick), there=YES, counts=YES, speed=ca.SX(50.0))[0]


def test_a_deviation_from_the_period_fades_in_a_hundred_samples():
    assert 1e-3 - value(rated(apart=1e-3).apart) == about(1e-5)


@decides(20.0)
def test_a_period_is_known_after_twenty_samples(at, beyond):
    assert (value(rated(0.021, learnt=at).apart) > 0.0) == beyond


@decides(1000.0)
def test_a_period_is_the_mean_of_a_thousand_samples_at_most(at, beyond):
    assert (value(rated(learnt=at).learnt) < at + 1.0) == beyond


def test_a_step_passes_the_fast_filter_within_two_usual_samples():
    band, _ = _band(BandState(), ca.SX(1.0), YES, ca.SX(0.04))
    assert value(band.fast) == pytest.approx(1.0 - math.exp(-1.0), abs=0.05)


# Values.


@decides(1.5)
def test_a_command_that_is_far_beyond_its_range_is_none(at, beyond):
    found = commanded({"valve": ca.SX(at)}, {"valve_command": ca.SX(-0.3)})
    assert value(found["valve"]) == (-0.3 if beyond else 1.0)


def torque_state(speed=50.0, reported=10.0, **how):
    """What is known of a torque of 10 N m, and whether it is stuck, after one more sample."""
    state = TorqueState(**{name: ca.SX(one) for name, one in ({"value": 10.0} | how).items()})
    after, _, stuck = _torque(taken(torque=state), raw(motor_torque=reported), ca.SX(speed), DRIVE)
    return after, stuck


@decides(5.0)
def test_a_torque_that_stays_counts_while_the_motor_turns(at, beyond):
    assert value(torque_state(speed=at)[0].repeats) == beyond


def test_a_habit_is_that_of_two_hundred_samples():
    assert value(torque_state(reported=10.1)[0].habit) == about(1.0 / 200.0)


@decides(0.8)
def test_a_torque_that_seldom_stays_is_stuck_when_it_does(at, beyond):
    assert value(torque_state(habit=at, repeats=100.0)[1]) == beyond


@pytest.mark.parametrize(("repeats", "learns"), [(3.0, True), (4.0, False)])
def test_a_torque_that_stays_for_long_is_no_habit(repeats, learns):
    assert (value(torque_state(habit=0.9, repeats=repeats)[0].habit) < 0.9) == learns


def test_while_no_torque_is_possible_leakage_may_be_that_of_a_third_of_relief_pressure():
    _, _, found = check_inputs(taken(), raw(motor_torque=1e4), DRIVE)
    assert value(found.drift) == about(0.3 * 1e-3 * 0.02)


@decides(0.05)
def test_a_pressure_sensor_may_read_a_twentieth_of_relief_pressure_below_vacuum(at, beyond):
    assert value(_possible(ca.SX(-at * 300e5), DRIVE)) == (not beyond)


@decides(10.0)
def test_oil_does_not_change_by_ten_kelvin_from_sample_to_sample(at, beyond):
    state = ThermometerState(filtered=ca.SX(313.15), good_for=ca.SX(60.0))
    _, oil = read_thermometer(state, ca.SX(313.15 + at), ca.SX(0.02), ca.SX(0.02))
    assert value(oil.good) == (not beyond)


def stands(seconds, least_change):
    """Whether a report that has changed by so much at least, and stands for so long at work, is of no use."""
    state = ThermometerState(filtered=ca.SX(313.15), good_for=ca.SX(60.0), reported=ca.SX(313.15))
    state = replace(state, stands_for=ca.SX(seconds), least_change=ca.SX(least_change))
    return value(read_thermometer(state, ca.SX(313.15), ca.SX(0.02), ca.SX(0.0))[1].variance) > 0.0


@decides(300.0)
def test_oil_at_work_does_not_keep_its_temperature_within_a_kelvin_for_five_minutes(at, beyond):
    assert stands(at, 1.0) == beyond


@decides(0.1)
def test_a_thermometer_need_not_show_less_than_a_tenth_of_a_kelvin(at, beyond):
    assert stands(300.0 * at, 0.0) == beyond


def warmed(reported, before=20.0):
    """By how much the magnets are warmer than 20 C after a reported temperature [K]."""
    reading = raw(motor_torque=10.0)
    reading.measured["motor_temperature"] = ca.SX(reported)
    assumed = SimpleNamespace(reference=293.15, loss=1e-3)
    return value(correct_torque(MagnetState(warmer=ca.SX(before)), reading, assumed)[0].warmer)


@decides(523.15)
def test_magnets_of_two_hundred_and_fifty_degrees_are_destroyed(at, beyond):
    assert (warmed(at) == 20.0) == beyond


@decides(1.0)
def test_magnets_that_warm_up_by_less_than_a_kelvin_are_as_they_were(at, beyond):
    assert (warmed(293.15 + 20.0 + at) != 20.0) == beyond


def test_a_case_is_no_more_than_sixty_kelvin_warmer_than_its_tank():
    cases = CaseParameters.of(Parameters(), SimpleNamespace(case=4200.0, case_to_tank=300.0))
    sample = SimpleNamespace(oil_temperature=ca.SX(300.0), elapsed=ca.SX(0.02))
    hot = heat_case(CaseState(warmer=ca.SX(1e9), tank=ca.SX(300.0)), sample, NO, ca.SX(0.0), cases).warmer
    found = ca.Function("hot", ca.symvar(hot), [hot])(
        *(4200.0 if str(x) == "heat.case" else 300.0 for x in ca.symvar(hot))
    )
    assert float(found) == about(60.0)


# Reports held against each other.


def test_two_reports_that_agree_contradict_each_other_once_in_a_thousand_hours():
    assert 2.0 * norm.sf(sure(1.0)) * 1000.0 * 3600.0 == about(1.0)


def counted(angle, before, jumps=0.0):
    """The counter at a sample of 20 ms of a shaft whose reported speed is 40 rad/s."""
    sample = SimpleNamespace(
        measured={SHAFT_ANGLE: ca.SX(angle)},
        counter=CounterState(angle=ca.SX(before), begun=YES),
        elapsed=ca.SX(0.02),
        mean_speed=ca.SX(40.0),
    )
    return read_counter(CounterCheckState(jumps=ca.SX(jumps)), sample, DRIVE)


@decides(1e9)
def test_a_counter_that_has_turned_for_a_century_is_none(at, beyond):
    assert value(counted(at, at - 1.0).speed) == pytest.approx(40.0 if beyond else 50.0)


@pytest.mark.parametrize(("before", "wild"), [(0.98, False), (1.94, True)])
def test_a_counter_jumps_twice_in_a_second_when_it_is_reset_and_not_three_times(before, wild):
    assert value(counted(0.0, 1e6, before).wild) == wild


@decides(1.0)
def test_a_shaft_that_has_not_turned_by_a_radian_shows_no_ratio(at, beyond):
    found = Counting(NO, NO, NO, counted=ca.SX(at), reported=ca.SX(3.0 * at))
    assert value(found.ratio) == (3.0 if beyond else 1.0)


def test_a_report_without_weight_has_no_offset():
    sums = Evidence(**{name: ca.SX(1e-9 if name in ("y", "one") else 0.0) for name in vars(Evidence())})
    assert value(offset_of(sums)) == pytest.approx(0.5, abs=0.05)


def test_oil_and_moved_mass_hide_a_quarter_of_the_inertia():
    """A torque of -15 N m where the shaft asks for 100 N m: 2 x 15 x 100 over the square of 25, a sample of 20 ms."""
    fast = math.exp(0.5)
    before = InertiaState(
        ramp=YES, expected=BandState(fast=ca.SX(100.0 * fast)), reported=BandState(fast=ca.SX(-15.0 * fast))
    )
    still = SimpleNamespace(
        elapsed=ca.SX(0.02), motor_speed=ca.SX(50.0), last_speed=ca.SX(50.0), motor_torque=NO, last_torque=NO
    )
    drive = SimpleNamespace(torque_std=0.5, assumed=SimpleNamespace(inertia=SimpleNamespace(std=0.0)))
    after, _ = check_inertia(before, still, DriveChecks(), ca.SX(1.0), drive)
    assert value(after.evidence) == about(2.0 * 15.0 * 100.0 / 25.0**2 * 0.02 / 0.15)


@decides(1.2)
def test_no_piston_is_faster_than_its_pump_by_a_fifth(at, beyond):
    settings = {"stroke": 0.7, "fastest": 0.2, "tolerance": 1e-6, "time_to_alert": 0.2}
    sample = {"time": 0.1, "position": 0.3, "bound": 0.01, "status": float(Status.OK), "other": 0.3 + 0.02 * at}
    state = ComparisonState(begun=YES, shown=YES, other=ca.SX(0.3))
    after, _ = compare(state, {k: ca.SX(v) for k, v in sample.items()}, {k: ca.SX(v) for k, v in settings.items()})
    assert value(after.jumps) == beyond


# The circuit.


@decides(0.01)
def test_a_step_has_converged_within_a_hundredth_of_the_torques_noise(monkeypatch, at, beyond):
    """At constant speed a step is solved again from its end's speed where it has not."""
    monkeypatch.setattr(
        load_step,
        "torque_noise",
        lambda problem, solution, earlier, *rest: SimpleNamespace(earlier=earlier, hidden=NO),
    )
    monkeypatch.setattr(load_step, "_shown_at_rest", lambda *_: YES)
    solved = SimpleNamespace(
        torque=ca.SX(30.0), z=None, settled=lambda within: at * 0.5 < within, by_load=lambda: None,
        by_large_load=lambda: None, by_start=lambda *_: None, torque_by=lambda _: None,
    )  # fmt: skip
    again = SimpleNamespace(torque=ca.SX(31.0))

    class Problem(SimpleNamespace):
        def __call__(self, before, load, guess, iterations, *speed):
            return again if speed else solved

    problem = Problem(speed=ca.SX(50.0), mean_speed=ca.SX(50.0), balance=None, h=ca.SX(0.02))
    model = SimpleNamespace(torque_std=0.5, balance=SimpleNamespace(rest_by_load=lambda: [0.0]))
    found = load_step.free_step(problem, None, None, SimpleNamespace(started=YES, motor_torque=NO), {}, model)
    assert value(found.noise.earlier) == (1.0 if beyond else 0.0)


def test_a_solution_is_within_a_five_hundredth_of_the_stroke_of_where_it_began():
    balance = SimpleNamespace(
        possible=lambda z: z, near=lambda z, z0, speed, h, gives: gives,
        unit=SimpleNamespace(cylinder=SimpleNamespace(stroke=0.7)), force=lambda _: ca.SX(0.0),
    )  # fmt: skip
    model = SimpleNamespace(balance=balance, relief_load=5e4, relief_pull=5e4, passive=False)
    free = SimpleNamespace(
        torque_by_load=1e-4,
        before=NO,
        by_first=NO,
        by_load=NO,
        by_initial=NO,
        solution=SimpleNamespace(z=NO, stands=NO),
    )

    class Problem(SimpleNamespace):
        def __call__(self, *_, **__):
            return SimpleNamespace(z=NO)

    state = SimpleNamespace(load=ca.SX(1e4), give=ca.SX(1e-7))
    gains = SimpleNamespace(first=NO, changing=NO, variance=ca.SX(1.0))
    problem = Problem(mean_speed=NO, h=ca.SX(0.02))
    found = _correct(state, problem, free, NO, gains, None, SimpleNamespace(held=NO), model)
    assert value(found.z) == about(2e-3 * 0.7)


def stood(at):
    """Whether a torque teaches its zero once the motor has stood so long [s]."""
    drive = SimpleNamespace(zero=1.0, zero_walk=0.0)
    model = SimpleNamespace(torque_std=0.5, assumed=SimpleNamespace(drive=drive))
    state = TorqueZeroState(variance=ca.SX(1.0), stood=ca.SX(at - 0.02))
    _, sample = plain_sample(SampleState(started=YES, time=ca.SX(9.98), commands={}), raw(motor_torque=0.5))
    after, _ = correct_zero(state, sample, NO, model)
    return value(after.zero) != 0.0


@decides(0.5)
def test_a_torque_shows_its_zero_once_valves_have_closed(at, beyond):
    assert stood(at) == beyond


# Contacts.


@decides(0.3)
def test_a_load_has_settled_on_something_once_a_third_of_it_has_gone(at, beyond):
    step = SimpleNamespace(load=SimpleNamespace(carried=ca.SX(1e4 * (1.0 - at))))
    state = SettlingState(empty=NO, carried=ca.SX(1e4), position=ca.SX(0.2))
    place, _ = _settling(state, SimpleNamespace(elapsed=ca.SX(0.0)), step, ca.SX(0.3), NO)
    assert value(place) == (0.2 if beyond else 0.3)


# What teaches the filters, and their limits.


@pytest.mark.parametrize(
    ("quantity", "least", "most"),
    [
        pytest.param(Quantity.LEAKAGE, 0.3, None, id="tight"),
        pytest.param(Quantity.LEAKAGE, None, 4.0, id="leaky"),
        pytest.param(Quantity.DISPLACEMENT, 0.97, 1.03, id="displacement"),
        pytest.param(Quantity.LAG, -600.0, 600.0, id="lag"),
        pytest.param(Quantity.EXPONENT, -1.0, 1.0, id="exponent"),
    ],
)
def test_what_no_machine_is_no_estimate_is(quantity, least, most):
    first = bank().hypotheses[0]
    for by, limit in ((-1e6, least), (1e6, most)):
        if limit is not None:
            after = first.corrected(first.covariance, {quantity: ca.SX(by)})
            assert value(after.mean[quantity]) == pytest.approx(
                limit, abs=NEAR * min(abs(limit), abs(limit - 1.0) or 1.0)
            )


def shown_by(shows, change, by, by_compliance=0.0, of=30.0):
    """What a torque [N m] teaches that shows so much of a load, changes [N m] and follows the factors [N m]."""
    after_a_second = SimpleNamespace(
        sample=SimpleNamespace(elapsed=ca.SX(1.0), motor_speed=ca.SX(50.0), motor_torque=ca.SX(of)),
        step=SimpleNamespace(torque=torque(shows=shows, change=change), load=SimpleNamespace(empty=NO)),
        linearised_at={Quantity.LEAKAGE: ca.SX(1.0), Quantity.COMPLIANCE: ca.SX(1.0)},
        torque_by={Quantity.LEAKAGE: ca.SX(by), Quantity.COMPLIANCE: ca.SX(by_compliance)},
        checks=SimpleNamespace(unless_contradicted=lambda flag: flag),
    )
    hold = SimpleNamespace(press=SimpleNamespace(decided=NO), pushing=NO, draws=NO, held=NO)
    met = SimpleNamespace(contact=SimpleNamespace(hold=hold), relief=SimpleNamespace(probability=NO))
    state = UpdateState.initial(Assumptions(), ())
    _, evidence = _torque_evidence(state, after_a_second, met, SimpleNamespace(assumed=Assumptions()))
    return evidence


def teaches_leakage(shows, change, by):
    """Whether it teaches the leakage."""
    return bool(value(shown_by(shows, change, by).teaches[Quantity.LEAKAGE]))


def test_errors_of_a_torque_add_up():
    def variance(**how):
        return value(shown_by(0.0, 0.0, 10.0, **how).R)

    plain = variance(of=0.0)
    friction, model = variance() - plain, variance(of=0.0, by_compliance=20.0) - plain
    assert min(friction, model) > 0.0
    assert variance(by_compliance=20.0) == pytest.approx(plain + friction + model)


@decides(0.02)
def test_a_torque_that_shows_a_fiftieth_of_a_load_shows_no_leakage(at, beyond):
    assert teaches_leakage(at, 0.0, 10.0) == (not beyond)
    assert teaches_leakage(0.0, 10.0 * at, -10.0) == (not beyond), "of a torque that still changes, the same"


@decides(2.0)
def test_a_reading_counts_again_after_twice_the_time_that_its_error_stays(at, beyond):
    assumed = SimpleNamespace(correlation=10.0, delay=0.0, std=1e-3, wrong=0.01, offset=0.0)
    sample = SimpleNamespace(measured={"absolute_position": ca.SX(0.3)}, elapsed=ca.SX(0.02))
    step = SimpleNamespace(motion=SimpleNamespace(travel=NO))
    since = ca.SX(10.0 * at - 0.02)
    _, reading = read_position("absolute_position", since, sample, step, ca.SX(0.3), ca.SX(0.7), assumed)
    assert value(reading.use) == beyond


# What is said.


def test_one_error_of_a_hundred_thousand_exceeds_the_bound():
    """Of a normal error that is surely of one hypothesis: exp(-k^2/2) at k standard deviations (Chernoff)."""
    hypotheses = bank(std=1e-3).hypotheses
    sure_of_one = [h.with_log_weight(ca.SX(-500.0 * (k > 0))) for k, h in enumerate(hypotheses)]
    k = value(Mixture.of(sure_of_one, scalar(0.0)).bound(scalar(1.0), scalar(0.0))) / 1e-3
    assert math.exp(-0.5 * k**2) == about(1e-5)


class Disk:
    """A file that takes everything at once."""

    failure, is_pending = "", False

    def resume(self):
        return True

    def save(self, state):
        """Take it."""


def saving(monkeypatch):
    """An encoder whose piston rests at 0.2 m from 0 s on, and is saved."""
    monkeypatch.setattr("ramsight.deploy.encoder.saving.impossible", lambda *_: False)
    one = Saving(SimpleNamespace(state={}, start=lambda _: None), Disk())
    one.watch(0.0, 0.0, estimate())
    one.moving = False
    one.save(0.0)
    one.rests(math.inf)
    return one


def estimate(position=0.2, velocity=0.0):
    return SimpleNamespace(position=position, position_std=1e-3, velocity=velocity)


@decides(1e-4)
def test_a_rod_that_creeps_by_a_millimetre_in_ten_seconds_rests(monkeypatch, at, beyond):
    assert saving(monkeypatch).watch(1.0, 0.0, estimate(velocity=at)) == beyond


@decides(1.0)
def test_a_rod_that_has_rested_for_a_second_is_saved(monkeypatch, at, beyond):
    one = saving(monkeypatch)
    one.watch(10.0, 50.0, estimate())
    one.watch(10.0 + at, 0.0, estimate())
    assert one.rests(10.0 + at) == beyond


@decides(2e-4)
def test_a_rod_that_went_on_at_rest_by_a_fifth_of_a_millimetre_is_saved_again(monkeypatch, at, beyond):
    one = saving(monkeypatch)
    one.watch(5.0, 0.0, estimate(0.2 + at))
    assert one.rests(5.0) == beyond


@decides(0.05)
def test_a_motor_that_turns_at_a_twentieth_of_the_calibrated_speed_is_judged(at, beyond):
    grid, values = np.linspace(1.0, 80.0, 5), np.full((2, 5), 1.2e-4)
    sensor = table(MovementTable("boom", 157.0, np.array([293.15, 313.15]), grid, values, grid, values, 1.0))
    sensor.start(0.2)
    for k in range(3):
        said = sensor.step(0.02 * k, at * 157.0, -60.0, 303.15)
    assert (said.status == Status.OUTSIDE_TORQUE) == beyond
