"""Stages of the sensor called directly, with plain numbers, at the boundaries where they decide."""

import itertools
import math
from dataclasses import fields, is_dataclass, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from ramsight.logs.channels import ABSOLUTE_POSITION
from ramsight.machine.assumption_description import AssumedReading
from ramsight.plant.limits import limits_of
from ramsight.sensor import thresholds as by
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.belief.position_reading import LinkState, read_angle, read_position
from ramsight.sensor.checks.counter_check import CounterCheckState, Counting, judge_counter, read_counter
from ramsight.sensor.checks.disagreement import Sums, sure
from ramsight.sensor.checks.drive_check import DriveChecks
from ramsight.sensor.checks.power_check import COPPER, GAIN, IRON, PowerReading, PowerState
from ramsight.sensor.checks.pressure_check import PressureCheckState, check_pressures
from ramsight.sensor.circuit.leakage import LeakageState, creep, leakage_law
from ramsight.sensor.circuit.load import LoadState, _give_alone
from ramsight.sensor.circuit.load_release import Release, UnheldState, release_load
from ramsight.sensor.circuit.pressures import MeasuredPressures, PressureState
from ramsight.sensor.circuit.relief import passed_share
from ramsight.sensor.circuit.unseen_load import UnseenLoadState, load_std, unseen_load
from ramsight.sensor.contacts.contact_release import (
    Holding,
    ReleaseState,
    RestState,
    _at_rest,
    _load_before,
    _moved_in_vain,
)
from ramsight.sensor.inputs.intake import (
    IntakeState,
    RateState,
    TorqueState,
    check_inputs,
    check_rate,
)
from ramsight.sensor.inputs.oil_heat import CaseParameters, CaseState, WarmingState, heat_case, warming_rate, with_case
from ramsight.sensor.inputs.sample import (
    DC_POWER,
    LINK_ANGLE,
    MOTOR_TEMPERATURE,
    PRESSURES,
    SHAFT_ANGLE,
    CounterState,
    Raw,
    Sample,
    SampleState,
    plain_sample,
)
from ramsight.sensor.inputs.thermometer import ThermometerState, read_thermometer
from ramsight.sensor.inputs.torque import MagnetState, correct_torque
from ramsight.sensor.machine_model import MachineModel
from ramsight.sensor.quantity import Quantity

from .control_bench import number as value
from .plant_bench import UNITS
from .sensor_bench import made, step_of

BOOM = UNITS["mining-loader boom"]
ABSOLUTE = ABSOLUTE_POSITION.name


def named(value):
    """A name of a test that is the same in every process."""
    return " ".join(sorted(value)) if isinstance(value, (set, frozenset)) else str(value)


NAN = math.nan
H = 0.02


def plain(found):
    """What a stage gives, as plain numbers by the names of its fields."""
    if is_dataclass(found):
        return SimpleNamespace(**{one.name: plain(getattr(found, one.name)) for one in fields(found)})
    if isinstance(found, dict):
        return {name: plain(one) for name, one in found.items()}
    return value(found) if isinstance(found, ca.SX | float) else found


def true_of(found):
    """The names of the flags that hold."""
    return {name for name, one in vars(found).items() if isinstance(one, float) and one == 1.0}


def sample(**values):
    """A sample in the middle of a log: 20 ms after the last one, at rest, 40 degC."""
    known = {"started": 1.0, "elapsed": H, "oil_temperature": 313.15, "way": 1.0, "last_way": 1.0} | values
    numbers = {
        one.name: ca.SX(known.get(one.name, 0.0))
        for one in fields(Sample)
        if one.name not in {"commands", "measured", "counter"}
    }
    measured = {name: ca.SX(one) for name, one in known.get("measured", {}).items()}
    return Sample(**numbers, commands={}, measured=measured, counter=known.get("counter"))


# Input check. A machine of 300 rad/s and 100 N m at relief pressure, 1e-4 m a radian.

DRIVE = SimpleNamespace(
    max_speed=ca.SX(300.0), largest_torque=ca.SX(100.0), relief_torque=ca.SX(100.0), leak_velocity=ca.SX(1e-3),
    travel_per_radian=ca.SX(1e-4),
)  # fmt: skip


def raw(time=10.02, speed=100.0, torque=50.0, temperature=313.15, reference=None, commands=None, measured=None):
    return Raw(
        ca.SX(time), ca.SX(speed), ca.SX(torque), ca.SX(temperature), ca.SX(reference or 0.0),
        ca.SX(float(reference is not None)), {name: ca.SX(one) for name, one in (commands or {}).items()},
        {name: ca.SX(one) for name, one in (measured or {}).items()},
    )  # fmt: skip


def before(*, speed=100.0, torque=50.0, counter=None, **values):
    """After a sample at 10 s, whose torque was known to change with each sample."""
    last = {"value": torque, "habit": 1.0} | values.pop("last", {})
    oil = {"filtered": 313.15, "good_for": 100.0} | values.pop("oil", {})
    known = {"started": 1.0, "time": 10.0, "clock": 10.0, "clocked": 1.0} | values
    return replace(
        IntakeState.initial((), ()),
        motor_speed=ca.SX(speed),
        torque=made(TorqueState, **{name: ca.SX(one) for name, one in last.items()}),
        thermometer=made(ThermometerState, **{name: ca.SX(one) for name, one in oil.items()}),
        counter=counter,
        **{name: one if is_dataclass(one) else ca.SX(one) for name, one in known.items()},
    )


def checked(state=None, now=None, **values):
    return tuple(plain(one) for one in check_inputs(state or before(), now or raw(**values), DRIVE))


def test_a_good_sample_passes_as_it_is():
    after, passed, found = checked(torque=51.0)
    assert true_of(found) == {"usable"}
    assert (passed.elapsed, passed.motor_speed, passed.last_speed) == pytest.approx((0.02, 100.0, 100.0))
    assert (passed.motor_torque, passed.last_torque, passed.oil_temperature) == (51.0, 50.0, 313.15)
    assert (after.time, after.clock, after.started, found.drift, found.unseen) == (10.02, 10.02, 1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("behind", "clock", "time", "after", "usable"),
    [
        (0.0, 10.0, 9.5, 0.0, False),  # the clock has gone back: a late sample, for all that is known
        (0.0, 9.5, 9.52, 1.0, False),  # a second one in its order
        (1.0, 9.52, 9.54, 0.0, True),  # a third: the clock was set, and time goes on from there
        (1.0, 9.52, 9.51, 0.0, False),  # not in order: a bus that swaps
        (1.0, 9.99, 10.01, 0.0, True),  # caught up
    ],
)
def test_late_samples_in_their_order_are_those_of_a_clock_that_was_set_back(behind, clock, time, after, usable):
    new, passed, found = checked(before(behind=behind, clock=clock), raw(time=time))
    assert (new.behind, bool(found.usable)) == (after, usable)
    if usable and time < 10.0:
        assert (passed.elapsed, new.time) == (0.0, time)
        assert found.drift == pytest.approx(1e-4 * (0.5 * 200.0 + 0.02 * 300.0) * 0.5), "half a second unseen"
    if time > 10.0:
        assert found.drift == pytest.approx(1e-4 * 0.5 * 200.0 * 2.0 * 0.02), "two samples unseen"
    assert bool(found.gap) == usable


def _rate_step():
    """The check of the rate as a function of plain numbers."""
    names = [one.name for one in fields(RateState)]
    symbols = {name: ca.SX.sym(name) for name in names}
    tick, counts, speed = (ca.SX.sym(name) for name in ("tick", "counts", "speed"))
    after, odd, unseen = check_rate(
        made(RateState, **symbols), tick, there=ca.SX(1.0), counts=counts, speed=speed
    )  # fmt: skip
    column = ca.vertcat(*(getattr(after, name) for name in names))
    return ca.Function("rate", [ca.vertcat(*symbols.values()), tick, counts, speed], [column, odd, unseen])


RATE_STEP = _rate_step()


def after_ticks(ticks, speed=100.0, state=None, counts=True):
    """What is known of the rate after samples so far apart; which of them were odd; the time unseen, all together."""
    names = [one.name for one in fields(RateState)]
    now, odds, unseen = [value(getattr(state or RateState(), name)) for name in names], [], 0.0
    for tick in ticks:
        now, odd, unknown_for = RATE_STEP(now, tick, float(counts), speed)
        odds.append(bool(odd))
        unseen += float(unknown_for)
    return (
        made(RateState, **{name: ca.SX(one) for name, one in zip(names, now.full()[:, 0], strict=True)}),
        odds,
        unseen,
    )


@pytest.mark.parametrize("factor", [0.1, 0.5, 0.8, 1.4, 1.5, 2.0, 5.0])
def test_samples_at_another_rate_are_found_and_all_of_their_time_is_uncertain(factor):
    settled, odds, unseen = after_ticks([H] * 300)
    assert not any(odds)
    assert unseen == 0.0
    assert value(settled.period) == pytest.approx(H)
    again, odds, unseen = after_ticks([factor * H] * 150, state=settled)
    assert any(odds)
    assert all(odds[odds.index(True) :])
    assert unseen == pytest.approx(150 * H * abs(factor - 1.0), rel=0.3)
    assert value(again.period) == pytest.approx(H, rel=0.05), "it is hardly learned from them"


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_samples_a_tenth_too_fast_or_too_slow_are_found_before_they_are_a_tenth_of_a_second_apart(factor):
    settled, *_ = after_ticks([H] * 300)
    _, odds, unseen = after_ticks([factor * H] * 250, state=settled)
    assert odds.index(True) * H * abs(factor - 1.0) < 0.1
    assert unseen > 0.5 * 250 * H * abs(factor - 1.0), "the rest fades, and is less than four standard deviations"


def test_samples_that_are_lost_count_for_less_than_a_clock_that_is_slow():
    settled, *_ = after_ticks([H] * 300)
    assert not any(after_ticks([2.0 * H] * 6, state=settled)[1])
    assert any(after_ticks([1.4 * H] * 15, state=settled)[1])


def test_a_rate_that_stays_is_the_new_one():
    settled, *_ = after_ticks([H] * 30)
    _, odds, _ = after_ticks([0.5 * H] * 60, state=settled)
    assert any(odds)
    assert not odds[-1]


@pytest.mark.parametrize("jitter", [0.0, 0.015, 0.03])
def test_samples_that_are_late_or_lost_now_and_then_are_no_other_rate(jitter):
    sent = [H * k + jitter * (0.5 + 0.5 * math.sin(7.0 * k * k)) for k in range(400) if k % 10 != 3]
    ticks = [b - a for a, b in itertools.pairwise(sent)]
    assert not any(after_ticks(ticks)[1])


@pytest.mark.parametrize("seed", range(5))
def test_samples_that_come_as_they_like_have_no_rate(seed):
    assert not any(after_ticks(np.random.default_rng(seed).uniform(1e-3, 0.1, 600))[1])


def test_only_while_the_motor_turns_is_a_rate_learned_and_a_gap_is_none():
    assert value(after_ticks([H] * 60, speed=0.0)[0].learnt) == 0.0
    settled, *_ = after_ticks([H] * 60)
    state, odds, unseen = after_ticks([0.2] * 5, state=settled)
    assert not any(odds)
    assert (value(state.period), value(state.apart), unseen) == (value(settled.period), 0.0, 0.0)


def test_samples_that_are_passed_over_count_with_the_next_one_that_is_used():
    settled, *_ = after_ticks([H] * 300)
    state, _, _ = after_ticks([0.1 * H] * 5, state=settled, counts=False)
    # A sample that is passed over keeps what it had of `odd`.
    _, odds, unseen = after_ticks([0.1 * H], state=replace(state, odd=ca.SX(0.0)))
    assert odds == [True]
    assert unseen == pytest.approx(6 * 0.9 * H, rel=0.05)


def test_another_rate_makes_the_position_uncertain_by_the_way_at_that_speed():
    rate = made(RateState, period=ca.SX(H), learnt=ca.SX(50.0), apart=ca.SX(0.14), odd=ca.SX(0.0))
    _, passed, found = checked(before(rate=rate), raw(time=10.06))
    assert found.gap
    assert found.usable
    assert found.drift == pytest.approx(1e-4 * 100.0 * (0.99 * 0.14 + 0.04))
    assert passed.elapsed == pytest.approx(0.06)
    assert not checked(before(rate=rate), raw(time=10.02))[2].gap


def test_the_first_sample_takes_no_time_and_is_known_at_once():
    _, first, found = checked(IntakeState.initial((), ()), raw(time=0.0, temperature=280.0))
    assert true_of(found) == {"usable"}
    assert (first.elapsed, first.last_speed, first.oil_temperature) == (0.0, 100.0, 280.0)


@pytest.mark.parametrize(
    ("now", "flags"),
    [
        ({"speed": NAN}, {"passed_over", "missing", "overspeed"}),
        ({"torque": NAN}, {"usable", "missing", "overtorque"}),
        ({"time": NAN}, {"passed_over", "missing", "frozen"}),
        ({"speed": 1e12}, {"passed_over", "missing", "overspeed"}),
        ({"speed": 449.9}, {"usable"}),
        ({"speed": 450.0}, {"passed_over", "overspeed"}),
        ({"speed": -450.0}, {"passed_over", "overspeed"}),
        ({"torque": 94.9}, {"usable"}),
        ({"torque": 150.0}, {"usable", "overtorque"}),
        ({"torque": -150.0}, {"usable", "overtorque"}),
        ({"time": 10.0}, {"passed_over", "frozen"}),
        ({"time": 9.99}, {"passed_over", "frozen"}),
        ({"time": 8.99}, {"usable", "frozen", "gap"}),
        ({"time": 10.007}, {"usable", "passed_over"}),
        ({"time": 10.009}, {"usable"}),
        ({"time": 10.007, "reference": 0.2}, {"usable"}),
        ({"time": 10.149}, {"usable"}),
        ({"time": 10.151}, {"usable", "gap"}),
        ({"temperature": NAN}, {"usable", "temperature_bad"}),
        ({"temperature": 203.15}, {"usable", "temperature_bad"}),
        ({"temperature": 423.15}, {"usable", "temperature_bad"}),
        ({"temperature": 323.1}, {"usable"}),
        ({"temperature": 323.2}, {"usable", "temperature_bad"}),
    ],
    ids=named,
)
def test_each_input_is_checked_at_its_boundary(now, flags):
    assert true_of(checked(**now)[2]) == flags


def test_a_torque_that_steps_while_the_motor_turns_is_used_with_its_second_sample():
    after, first, _ = checked(torque=95.1)
    assert (first.motor_torque, after.torque.waits, after.torque.value) == (50.0, 1.0, 50.0)
    assert checked(before(last={"waits": 1.0}), torque=95.1)[1].motor_torque == 95.1
    assert checked(torque=94.9)[1].motor_torque == 94.9, "less than 45 % of the relief torque"
    assert checked(before(speed=9.0), torque=95.1)[1].motor_torque == 95.1, "a motor slower than 3 % takes up a load"
    assert checked(before(speed=-100.0), torque=95.1)[1].motor_torque == 95.1, "it has turned back"


@pytest.mark.parametrize(
    ("repeats", "habit", "speed", "stuck"),
    [(20.0, 1.0, 100.0, True), (18.0, 1.0, 100.0, False), (40.0, 0.79, 100.0, False), (40.0, 0.9, 5.0, False)],
)
def test_a_torque_with_noise_that_repeats_nineteen_times_more_is_stuck(repeats, habit, speed, stuck):
    after, _, found = checked(before(last={"repeats": repeats, "habit": habit}), speed=speed)
    assert found.stuck == stuck
    assert found.drift == pytest.approx(0.3 * 1e-3 * 0.02 if stuck else 0.0)
    assert after.torque.repeats == (repeats + 1.0 if speed > 5.0 else 0.0)
    assert after.torque.habit == habit, "what repeats teaches no habit"


def test_the_habit_is_that_of_the_last_two_hundred_samples():
    assert checked(before(last={"habit": 0.5}), torque=51.0)[0].torque.habit == pytest.approx(0.5025)
    assert checked(before(last={"habit": 0.5}), torque=50.0)[0].torque.habit == pytest.approx(0.4975)
    assert checked(before(last={"habit": 0.5, "repeats": 3.0}))[0].torque.habit == pytest.approx(0.4975)
    assert checked(before(last={"habit": 0.5, "repeats": 4.0}))[0].torque.habit == 0.5


def test_a_temperature_is_behind_a_low_pass_of_five_seconds():
    assert checked(temperature=318.17)[1].oil_temperature == pytest.approx(313.15 + 0.02 / 5.02 * 5.02)
    assert checked(temperature=NAN)[1].oil_temperature == 313.15
    unknown = before(oil={"filtered": 0.0})
    assert checked(unknown, temperature=NAN)[1].oil_temperature == 313.15, "40 degC while none is known"
    assert checked(unknown, temperature=290.0)[1].oil_temperature == 290.0


@pytest.mark.parametrize(("good_for", "patience"), [(1.0, 10.0), (100.0, 100.0), (900.0, 600.0)])
def test_a_step_of_the_temperature_is_accepted_after_as_long_as_it_was_good(good_for, patience):
    def seen(step_for):
        return checked(before(oil={"good_for": good_for, "step_for": step_for}), temperature=333.15)

    after, passed, found = seen(patience)
    assert (passed.oil_temperature, found.temperature_bad) == (313.15, 1.0)
    assert (after.thermometer.step_for, after.thermometer.good_for) == pytest.approx((patience + 0.02, good_for))
    after, passed, found = seen(patience + 0.01)
    assert (passed.oil_temperature, found.temperature_bad) == (333.15, 0.0)
    assert (after.thermometer.step_for, after.thermometer.good_for) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("oil", "now", "works", "gained"),
    [
        ({"stands_for": 29.97}, 313.15, 0.02, 0.0),
        ({"stands_for": 29.99}, 313.15, 0.02, 1.0),
        ({"stands_for": 29.99}, 313.15, 0.0, 0.0),
        ({"stands_for": 500.0}, 313.25, 0.02, 0.0),
        ({"stands_for": 299.97, "least_change": 1.0}, 313.15, 0.02, 0.0),
        ({"stands_for": 299.99, "least_change": 1.0}, 313.15, 0.02, 1.0),
        ({"stands_for": 29.99, "least_change": 1e-3}, 313.15, 0.02, 1.0),
        ({}, NAN, 0.02, 1.0),
        ({}, 333.15, 0.02, 1.0),
    ],
)
def test_oil_whose_report_is_lost_or_stands_still_at_work_is_as_warm_as_a_random_walk(oil, now, works, gained):
    """95 % within 2.5 K after a minute; a report of whole kelvins may stand ten times as long as one of tenths."""
    known = {"filtered": 313.15, "good_for": 100.0, "reported": 313.15} | oil
    state = made(ThermometerState, **{name: ca.SX(one) for name, one in known.items()})
    _, oil_temperature = read_thermometer(state, ca.SX(now), ca.SX(0.02), ca.SX(works))
    assert value(oil_temperature.variance) == pytest.approx(gained * 1.25**2 / 60.0 * 0.02)


def test_a_thermometer_shows_its_step_by_the_least_change_of_its_report():
    state = ThermometerState()
    for reported, least, stands in (
        (300.0, 0.0, 1.0), (300.0, 0.0, 2.0), (302.0, 2.0, 0.0), (NAN, 2.0, 1.0), (301.0, 1.0, 0.0), (303.0, 1.0, 0.0)
    ):  # fmt: skip
        state, _ = read_thermometer(state, ca.SX(reported), ca.SX(1.0), ca.SX(1.0))
        assert (value(state.least_change), value(state.stands_for)) == (least, stands)


def test_what_a_motor_may_have_done_in_a_gap_is_uncertain():
    """A nudge is 2 % of 300 rad/s; within a gap that is bridged a quarter of both speeds is wrong beyond 0.1 s."""
    assert checked(time=10.1)[2].drift == pytest.approx(0.0, abs=1e-12)
    assert checked(time=10.5)[2].drift == pytest.approx(1e-4 * (0.25 * 200.0 + 6.0) * 0.4)
    _, passed, found = checked(time=12.0)
    assert passed.elapsed == 0.0
    assert found.drift == pytest.approx(1e-4 * (0.5 * 200.0 + 6.0) * 2.0)
    assert checked(time=1e5)[2].drift == pytest.approx(1e-4 * 106.0 * 3600.0), "through any stroke within an hour"
    assert checked(time=5.0)[2].drift == pytest.approx(1e-4 * 106.0 * 0.5), "a clock that was set"


def test_what_a_motor_may_have_done_since_the_last_sample_that_counts_is_unseen():
    found = checked(speed=NAN, time=10.04)[2]
    assert found.unseen == pytest.approx(1e-4 * (100.0 + 6.0) * 0.04)
    assert found.drift == 0.0
    assert found.passed == pytest.approx(0.04)


@pytest.mark.parametrize(("angle", "replaced"), [(7.0 + 299.0 * H, True), (7.0 + 301.0 * H, False), (NAN, False)])
def test_the_counter_takes_the_place_of_a_speed_that_is_missing(angle, replaced):
    state = before(counter=CounterState(angle=ca.SX(7.0), begun=ca.SX(1.0)))
    after, passed, found = checked(state, raw(speed=NAN, measured={SHAFT_ANGLE: angle}))
    assert found.replaced == replaced
    assert found.usable == replaced
    if replaced:
        assert passed.motor_speed == pytest.approx(299.0)
    assert after.counter.begun == math.isfinite(angle)
    assert after.counter.angle == (angle if math.isfinite(angle) else 7.0)
    assert checked(state, raw(speed=90.0, measured={SHAFT_ANGLE: angle}))[1].motor_speed == 90.0


def test_a_counter_that_was_not_there_before_replaces_nothing():
    state = before(counter=CounterState(angle=ca.SX(7.0), begun=ca.SX(0.0)))
    assert checked(state, raw(speed=NAN, measured={SHAFT_ANGLE: 9.0}))[2].usable == 0.0


@pytest.mark.parametrize(
    ("command", "used"), [(0.4, 0.4), (1.2, 1.0), (1.5, 1.0), (1.6, -0.7), (-1.2, -1.0), (NAN, -0.7)]
)
def test_a_command_is_rounded_or_as_before(command, used):
    state = SampleState(
        started=ca.SX(1.0), time=ca.SX(10.0), motor_speed=ca.SX(80.0), commands={"valve_command": ca.SX(-0.7)}
    )
    after, now = (plain(one) for one in plain_sample(state, raw(commands={"valve": command})))
    assert now.commands["valve"] == after.commands["valve_command"] == used
    assert (now.way, now.last_way) == (1.0 if used >= 0.0 else -1.0, -1.0)
    assert (now.mean_speed, now.elapsed) == pytest.approx((90.0, 0.02))


# Warm magnets and oil

MAGNETS = SimpleNamespace(loss=1e-3, reference=300.0)


@pytest.mark.parametrize(
    ("reported", "warmer", "used"),
    [
        (360.0, 0.0, 60.0), (360.9, 60.0, 60.0), (361.0, 60.0, 61.0), (359.0, 60.0, 59.0), (203.15, 60.0, 60.0),
        (523.15, 60.0, 60.0), (523.1, 60.0, 223.1), (NAN, 60.0, 60.0), (NAN, 0.0, 0.0),
    ],
)  # fmt: skip
def test_a_torque_of_warm_magnets_is_less_than_reported(reported, warmer, used):
    now = raw(torque=80.0, measured={MOTOR_TEMPERATURE: reported})
    after, corrected = (plain(one) for one in correct_torque(MagnetState(warmer=ca.SX(warmer)), now, MAGNETS))
    assert after.warmer == pytest.approx(used)
    assert corrected.motor_torque == pytest.approx(80.0 * (1.0 - 1e-3 * used))
    assert corrected.motor_speed == 100.0


CASES = CaseParameters(ca.SX(2000.0), ca.SX(50.0))


@pytest.mark.parametrize(
    ("warmer", "tank", "heat", "passed", "after"),
    [
        (10.0, 313.15, 0.0, 0.0, 10.0 / (1.0 + 0.02 * 50.0 / 2000.0)),
        (10.0, 313.15, 500.0, 0.02, 10.005 / 1.0005),
        (10.0, 312.15, 500.0, 0.02, 9.005 / 1.0005),
        (10.0, 0.0, 500.0, 0.02, 10.005 / 1.0005),
        (10.0, 313.15, 500.0, 40.0, 10.005 / 2.0),
        (10.0, 313.15, 500.0, 1e9, 0.0),
        (10.0, 313.15, 1e9, 0.02, 60.0),
        (10.0, 413.15, 0.0, 0.02, 60.0),
        (10.0, 213.15, 0.0, 0.02, -60.0),
    ],
)
def test_cases_store_what_pumps_lose_and_pass_it_to_the_tank(warmer, tank, heat, passed, after):
    state = CaseState(warmer=ca.SX(warmer), tank=ca.SX(tank))
    found = plain(heat_case(state, sample(), ca.SX(heat), ca.SX(passed), CASES))
    assert found.warmer == pytest.approx(after, abs=1e-5)
    assert found.tank == 313.15


def test_oil_in_the_gaps_is_as_warm_as_the_cases():
    warm = CaseState(warmer=ca.SX(8.0), tank=ca.SX(313.15))
    assert plain(with_case(sample(), warm)).pump_warmer == 8.0
    assert plain(with_case(sample(), None)).pump_warmer == 0.0
    assert value(with_case(sample(), warm).pump_temperature) == pytest.approx(321.15)


@pytest.mark.parametrize(
    ("age", "elapsed", "change"),
    [
        (0.0, 0.02, 0.0), (10.0, 0.02, 0.02 / 10.021), (20.0, 0.02, 0.02 / 20.021), (500.0, 0.02, 0.02 / 20.021),
        (500.0, 0.0, 0.0), (500.0, 60.0, 60.0 / 80.001),
    ],
)  # fmt: skip
def test_the_rate_of_a_warming_is_the_change_of_the_smoothed_thermometer(age, elapsed, change):
    state = WarmingState(temperature=ca.SX(312.15), age=ca.SX(age))
    after, rate = warming_rate(state, sample(elapsed=elapsed))
    begun = 312.15 if age else 313.15
    assert value(after.temperature) == pytest.approx(begun + change)
    assert value(rate) == pytest.approx(change / elapsed if elapsed else 0.0)
    assert value(after.age) == age + elapsed


# A viscosity that falls by 5 % a kelvin, so that logarithms are its tenths.

THIN = SimpleNamespace(viscosity=lambda t: ca.exp(-0.05 * (t - 313.15)), relief_torque=ca.SX(100.0))


@pytest.mark.parametrize(
    ("age", "torque", "settled", "share"),
    [
        (0.0, 30.0, 0.0, 0.3), (-10.0 * math.log(0.05), -60.0, 0.5, 0.6), (60.0, 4.0, 1.0, 0.05),
        (600.0, 300.0, 1.0, 1.0),
    ],
)  # fmt: skip
def test_the_law_of_leakage_follows_oil_and_torque(age, torque, settled, share):
    state = LeakageState(temperature=ca.SX(311.15), age=ca.SX(age))
    after, law = leakage_law(state, sample(), ca.SX(torque), THIN)
    slow = 311.15 + 0.02 / (min(age, 20.0) + 0.021) * 2.0
    assert value(after.temperature) == pytest.approx(slow)
    change = settled * 0.05 * (313.15 - slow)
    assert value(law.change) == pytest.approx(change)
    assert value(law.rate) == pytest.approx(change / 20.0)
    assert value(law.per_kelvin) == pytest.approx(0.05)
    assert value(law.by_exponent) == pytest.approx(math.log(0.3 / share))


def test_before_the_first_sample_the_slow_temperature_is_the_reported_one():
    after, law = leakage_law(LeakageState(), sample(started=0.0, elapsed=0.0), ca.SX(30.0), THIN)
    assert value(after.temperature) == pytest.approx(313.15)
    assert value(law.change) == 0.0


def test_leakage_is_scaled_by_what_is_learned():
    _, law = leakage_law(LeakageState(temperature=ca.SX(311.15), age=ca.SX(60.0)), sample(), ca.SX(60.0), THIN)
    learned = {Quantity.LAG: 10.0, Quantity.EXPONENT: 0.2, Quantity.WARMER: 4.0, Quantity.LEAKAGE: 1.5}
    power = 10.0 * value(law.rate) + 0.2 * math.log(0.5) + 4.0 * 0.05
    assert value(law.scale(learned)) == pytest.approx(math.exp(power))


# Counter and power of a drive of 100 N m at 200 rad/s, 20 kW: 2 % of copper and 1 % of iron losses.


def drive_model(**changes):
    declared = {
        "drive.torque": 0.01, "drive.delay": 0.04, "shaft.std": 1e-3, "power.std": 0.005, "power.gain": 0.02,
        "power.copper": 0.02, "power.iron": 0.01, "power.losses": 0.2, "power.standby": 100.0, "pressure.std": 1e5,
    } | changes  # fmt: skip
    assumed = Assumptions().replace(declared)
    return SimpleNamespace(
        assumed=assumed, max_speed=ca.SX(200.0), relief_torque=ca.SX(100.0), travel_per_radian=ca.SX(1e-4),
        torque_std=assumed.drive.torque * ca.SX(100.0),
    )  # fmt: skip


SHAFT = CounterState(angle=ca.SX(7.0), begun=ca.SX(1.0))


@pytest.mark.parametrize(
    ("angle", "speed", "jumps"),
    [
        (7.0 + 90.0 * H, 90.0, 0.0), (7.0 + 299.0 * H, 299.0, 0.0), (7.0 + 301.0 * H, 100.0, 1.0),
        (7.0 - 301.0 * H, 100.0, 1.0), (NAN, 100.0, 0.0), (1e9, 100.0, 0.0),
    ],
)  # fmt: skip
def test_a_counter_counts_between_two_samples_unless_it_jumps(angle, speed, jumps):
    now = sample(mean_speed=100.0, measured={SHAFT_ANGLE: angle}, counter=SHAFT)
    found = plain(read_counter(CounterCheckState(), now, drive_model()))
    assert (found.speed, found.jumps) == pytest.approx((speed, jumps))
    assert (found.counted, found.reported) == pytest.approx((speed * H, 100.0 * H))


def test_a_counter_counts_nothing_after_a_missing_sample_or_without_time():
    missing = sample(mean_speed=100.0, measured={SHAFT_ANGLE: 9.0}, counter=replace(SHAFT, begun=ca.SX(0.0)))
    assert plain(read_counter(CounterCheckState(), missing, drive_model())).speed == 100.0
    at_once = sample(mean_speed=100.0, elapsed=0.0, measured={SHAFT_ANGLE: 9.0}, counter=SHAFT)
    assert plain(read_counter(CounterCheckState(), at_once, drive_model())).speed == 100.0


def test_a_counter_that_jumps_three_times_within_a_second_is_wild():
    now = sample(mean_speed=100.0, measured={SHAFT_ANGLE: 7.0 + 400.0 * H}, counter=SHAFT)
    for jumps, wild in ((1.5, 0.0), (1.54, 1.0)):
        found = plain(read_counter(CounterCheckState(jumps=ca.SX(jumps)), now, drive_model()))
        assert found.jumps == pytest.approx(1.0 + jumps * math.exp(-0.02))
        assert found.wild == wild


@pytest.mark.parametrize(("counted", "reported", "ratio"), [(2.0, 2.6, 1.3), (1.0, 2.0, 1.0), (1.1, 0.0, 0.0)])
def test_the_ratio_of_both_speeds_is_that_of_a_radian_at_least(counted, reported, ratio):
    counting = Counting(*(ca.SX(one) for one in (0.0, 0.0, 90.0, counted, reported)))
    assert value(counting.ratio) == pytest.approx(ratio)


APART = made(Sums, apart=ca.SX(5.0), mean=ca.SX(100.0), level=ca.SX(100.0))
NEAR = made(Sums, mean=ca.SX(100.0), level=ca.SX(100.0))


def judged(sums=APART, by_power=None, jumps=0.0, state=None, speed=100.0, counted=60.0):
    counting = Counting(ca.SX(jumps), ca.SX(float(jumps > 2.5)), ca.SX(counted), ca.SX(60.0), ca.SX(100.0))
    now = sample(mean_speed=speed, motor_speed=speed, last_speed=speed, counter=SHAFT)
    before_it = replace(state or CounterCheckState(), difference=sums)
    power = None if by_power is None else tuple(ca.SX(float(one)) for one in by_power)
    return tuple(plain(one) for one in judge_counter(before_it, now, counting, power, drive_model()))


@pytest.mark.parametrize(
    ("by_power", "jumps", "flags", "mean", "now"),
    [
        (None, 0.0, {"undecided"}, 60.0, 60.0), ((True, False), 0.0, {"speed_wrong"}, 60.0, 60.0),
        ((False, True), 0.0, {"counter_wrong"}, 100.0, 100.0), ((True, True), 0.0, {"undecided"}, 60.0, 60.0),
        ((False, False), 0.0, {"undecided"}, 60.0, 60.0), (None, 3.0, {"counter_wrong"}, 100.0, 100.0),
    ],
)  # fmt: skip
def test_the_power_shows_which_of_speed_and_counter_is_wrong(by_power, jumps, flags, mean, now):
    after, used, check = judged(by_power=by_power, jumps=jumps)
    assert true_of(check) == flags
    assert (used.mean_speed, used.motor_speed) == (mean, now)
    assert after.speed_was_wrong == ("counter_wrong" not in flags)
    assert after.used_speed == now


def test_speed_and_counter_that_agree_are_both_right():
    after, used, check = judged(sums=NEAR, counted=100.0)
    assert true_of(check) == set()
    assert (used.motor_speed, used.mean_speed, check.grows) == (100.0, 100.0, 0.0)
    assert after.uncertain == 0.0


def test_while_nothing_decides_the_position_is_uncertain_by_what_they_are_apart():
    by_now = 5.0 * math.exp(-0.02) + 40.0 * H
    assert judged()[2].grows == pytest.approx(1e-4 * by_now), "all that came together"
    later = CounterCheckState(uncertain=ca.SX(1.0))
    assert judged(state=later)[2].grows == pytest.approx(1e-4 * 40.0 * H), "then what each sample adds"
    wrong = judged(by_power=(False, True), state=later)[2]
    assert wrong.grows == 0.0, "the speed is right, by the power"


def test_the_speed_of_the_sample_before_is_the_one_that_was_used():
    state = CounterCheckState(speed_was_wrong=ca.SX(1.0), used_speed=ca.SX(55.0))
    assert judged(state=state)[1].last_speed == 55.0
    assert judged()[1].last_speed == 100.0


def power_state(**values):
    fresh = PowerState.initial(drive_model().assumed, with_counter=False)
    return replace(fresh, **{name: ca.SX(one) for name, one in values.items()})


def reading(reported, *, begun=1.0, elapsed=H, torque=50.0, state=None):
    now = sample(
        motor_torque=torque, last_torque=torque, mean_speed=100.0, motor_speed=100.0, elapsed=elapsed,
        measured={DC_POWER: reported},
    )  # fmt: skip
    known = state or power_state(last=5300.0, begun=begun, turned=3.0)
    return PowerReading.of(known, now, drive_model())


@pytest.mark.parametrize(
    ("reported", "begun", "elapsed", "there"),
    [(5500.0, 1.0, H, 1.0), (NAN, 1.0, H, 0.0), (1e9, 1.0, H, 0.0), (5500.0, 0.0, H, 0.0), (5500.0, 1.0, 0.0, 0.0)],
)
def test_a_power_is_a_mean_of_two_samples(reported, begun, elapsed, there):
    found = reading(reported, begun=begun, elapsed=elapsed)
    assert value(found.there) == there
    assert value(found.power) == pytest.approx(5400.0 if there else 0.0)
    assert value(found.turned) == pytest.approx(3.0 * math.exp(-elapsed) + 100.0 * elapsed)


def test_a_power_that_is_explained_leaves_nothing_over():
    """50 N m at 100 rad/s: 5000 W, a quarter of 400 W in copper, half of 200 W in iron, 100 W of standby."""
    explained = 5000.0 + 100.0 + 100.0 + 100.0
    sums, found = reading(2.0 * explained - 5300.0).against(Sums(), ca.SX(100.0), ca.SX(100.0))
    assert value(found.by) == pytest.approx(0.0, abs=1e-9)
    more, found = reading(2.0 * (explained + 700.0) - 5300.0).against(Sums(), ca.SX(100.0), ca.SX(100.0))
    assert value(found.by) == pytest.approx(700.0 * H)
    lasts = math.hypot(0.02 * 5000.0, 0.2 * 100.0, 0.2 * 100.0, 0.2 * 100.0)
    assert value(more.lasts) == pytest.approx(lasts * H)
    noise = math.hypot(0.005 * 20e3, 1.0 * 100.0)
    first = 0.5 * H * 5000.0  # the level began with this sample
    assert value(more.variance) == pytest.approx(first**2 + (noise * H) ** 2)
    assert value(sums.lasts) == value(more.lasts)


@pytest.mark.parametrize("torque", [20.0, 50.0, -30.0])
@pytest.mark.parametrize("speed", [100.0, -100.0])
def test_the_torque_that_the_power_asks_for_is_the_one_that_makes_it(torque, speed):
    power = torque * speed + 0.02 * (torque / 100.0) ** 2 * 20e3 + 0.01 * 0.5 * 20e3 + 100.0
    found = reading(2.0 * power - 5300.0, torque=torque)
    pair = found.pair(ca.SX(speed), found.state.covariance)
    assert value(pair.other) == pytest.approx(torque)
    assert value(pair.reported) == torque


def test_a_pair_of_torques_needs_a_motor_that_turns():
    found = reading(5500.0)
    assert [value(found.pair(ca.SX(speed), found.state.covariance).there) for speed in (5.0, 5.1, -5.1)] == [0, 1, 1]


def test_gain_and_losses_are_learned_only_from_a_usual_difference():
    found = reading(2.0 * 5350.0 - 5300.0)
    _, apart = found.against(Sums(), ca.SX(100.0), ca.SX(100.0))
    far = replace(apart, by=0.51 * apart.allowed)
    learned = {name: value(one) for name, one in found.learned(ca.SX(100.0), apart)[0].items()}
    assert learned[GAIN] > 0.0
    assert learned[COPPER] > 0.0
    assert learned[IRON] > 0.0
    assert all(value(one) == 0.0 for one in found.learned(ca.SX(100.0), far)[0].values())
    assert all(value(one) == 0.0 for one in found.learned(ca.SX(5.0), apart)[0].values())


@pytest.mark.parametrize(("turned", "signed", "size"), [(0.5, 0.0, 8.0), (2.0, -4.0, 4.0), (0.01, 0.0, 8.0)])
def test_a_torque_that_is_missing_is_power_over_the_angle_turned(turned, signed, size):
    found = replace(reading(5500.0), turned=ca.SX(turned))
    assert value(found.signed(ca.SX(-8.0))) == pytest.approx(signed)
    assert value(found.torque_off(ca.SX(-8.0))) == pytest.approx(size)
    assert value(found.torque_off(ca.SX(-1e4))) == 100.0, "no more than at relief pressure"


# Measured pressures

BOOM_MODEL = MachineModel.of(BOOM, BOOM.assumptions.replace({"pressure.std": 1e5, "pressure.lag": 0.02}))


def of_machine(expression):
    """The value of an expression whose symbols are parameters of the boom."""
    return float(ca.Function("of", [BOOM_MODEL.table.column], [ca.SX(expression)])(BOOM_MODEL.table.values))


def pressed(pressure):
    """States of the boom's circuit at rest, one pressure in all of it."""
    return ca.SX([pressure if name.startswith("pressure") else 0.0 for name in BOOM_MODEL.balance.states])


def settled(**values):
    zeros = {name: ca.SX(0.0) for name in PRESSURES}
    known = {"shown": {name: ca.SX(50e5) for name in PRESSURES}, "leaked": zeros, "corrected": zeros}
    return made(PressureState, **(known | values))


def measuring(state, a=51e5, b=50e5):
    now = sample(motor_speed=100.0, measured=dict(zip(PRESSURES, (a, b), strict=True)))
    return MeasuredPressures.of(state, now, BOOM_MODEL, pressed(50e5), ca.SX(H))


STANDS = {"begun": ca.SX(1.0), "stood": ca.SX(1.0)}


def test_pressures_of_a_standing_piston_follow_their_sensors_by_the_share_of_their_variance():
    area = float(BOOM.cylinder.area_a)
    state = settled(**STANDS, load_variance=ca.SX((3e5 * area) ** 2))
    found = measuring(state)
    gain, share = 9.0 / 10.0, H / (1.0 + H)
    assert value(found.corrected[PRESSURES[0]]) == pytest.approx(gain * share * 1e5)
    assert value(found.shown[PRESSURES[0]]) == pytest.approx(50e5 + gain * share * 1e5)
    assert value(found.corrected[PRESSURES[1]]) == 0.0, "it shows what is expected"


@pytest.mark.parametrize(
    ("changed", "a"),
    [({"stood": ca.SX(0.0)}, 51e5), ({"begun": ca.SX(0.0)}, 51e5), ({}, NAN), ({}, 1e9)],
    ids=["moves", "first", "missing", "impossible"],
)
def test_pressures_that_show_nothing_correct_nothing(changed, a):
    state = settled(**(STANDS | {"load_variance": ca.SX(1e12)} | changed))
    assert value(measuring(state, a=a).corrected[PRESSURES[0]]) == 0.0


def test_a_piston_that_stands_keeps_what_leaked_and_one_that_moves_begins_again():
    found = measuring(settled(**STANDS, load_variance=ca.SX(4.0)))
    after = found.after(pressed(49e5), ca.SX(1.0), ca.SX(H), ca.SX(9.0))
    place = BOOM_MODEL.balance.states.index(f"pressure_{BOOM.cylinder.node_a}")
    assert value(after.leaked[PRESSURES[0]]) == pytest.approx(49e5 - value(found.before[place]))
    assert value(after.load_variance) == 4.0
    assert value(after.shown[PRESSURES[1]]) == pytest.approx(50e5 - 0.5 * 1e5), "a lag as long as the sample"
    moves = found.after(pressed(49e5), ca.SX(0.0), ca.SX(H), ca.SX(9.0))
    assert [value(moves.leaked[name]) for name in PRESSURES] == [0.0, 0.0]
    assert value(moves.load_variance) == 9.0


def test_the_first_sample_of_a_pressure_is_as_it_is_reported():
    found = measuring(settled(), a=70e5, b=NAN).after(pressed(49e5), ca.SX(0.0), ca.SX(H), ca.SX(9.0))
    assert [value(found.shown[name]) for name in PRESSURES] == [70e5, 49e5]


def test_a_load_follows_both_pressures_while_the_piston_moves():
    """By the areas alone: a newton of load is a newton of the pressures' force."""
    area_a, area_b = float(BOOM.cylinder.area_a), float(BOOM.cylinder.area_b)
    found = measuring(settled(**STANDS), a=51e5, b=50e5)
    names = BOOM_MODEL.balance.states
    by_load = ca.SX(pressed(0.0))
    by_load[names.index(f"pressure_{BOOM.cylinder.node_a}")] = 1.0 / area_a
    moves = SimpleNamespace(z=pressed(50e5), stands=ca.SX(0.0))
    force_std = math.hypot(area_a, area_b) * 1e5
    variance = (2.0 * force_std) ** 2
    slope = 0.5  # half of a step has passed the sensors' lag
    gain = variance * slope / (slope**2 * variance + force_std**2)
    correction, left = found.correction(moves, by_load, ca.SX(variance), ca.SX(H))
    assert value(correction) == pytest.approx(gain * area_a * 1e5)
    assert value(left) == pytest.approx((1.0 - gain * slope) * variance)
    still = SimpleNamespace(z=pressed(50e5), stands=ca.SX(1.0))
    correction, left = found.correction(still, by_load, ca.SX(variance), ca.SX(H))
    assert (value(correction), value(left)) == (0.0, variance)
    one_missing = measuring(settled(**STANDS), b=NAN)
    assert value(one_missing.correction(moves, by_load, ca.SX(variance), ca.SX(H))[1]) == variance


@pytest.mark.parametrize(
    ("over", "over_std", "before_it", "alarm"),
    [(0.0, 2.0, 0.0, 0.0), (30.0, 2.0, 30.0, 1.0), (30.0, 0.0, 0.0, 0.0), (2.0, 2.0, 2.0, 0.0)],
)
def test_a_torque_that_pressures_contradict_is_wrong(over, over_std, before_it, alarm, monkeypatch):
    monkeypatch.setattr("ramsight.sensor.checks.pressure_check.wrong_leakage", lambda torque, *_: 1e-5 * torque)
    state = PressureCheckState(
        difference=made(Sums, apart=ca.SX(before_it), mean=ca.SX(50.0), level=ca.SX(50.0), lasts=ca.SX(2.0)),
        shown=ca.SX(1.0),
    )
    now = sample(motor_torque=50.0, motor_speed=100.0, mean_speed=100.0)
    after, found = check_pressures(state, now, DriveChecks(), ca.SX(over), ca.SX(over_std), drive_model())
    shown = math.exp(-H) + (H if over_std else 0.0)
    summed = before_it * math.exp(-H) + over * H
    assert value(after.shown) == pytest.approx(shown)
    assert value(found.more["torque_over_pressures"][0]) == pytest.approx(summed / shown)
    assert value(found.torque_wrong) == alarm
    assert value(found.torque_off) == pytest.approx(min(summed / shown, 100.0) if alarm else 0.0)
    assert found.declared


def test_pressures_decide_nothing_while_speed_and_counter_are_disputed():
    state = PressureCheckState(
        difference=made(Sums, apart=ca.SX(30.0), mean=ca.SX(50.0), level=ca.SX(50.0)), shown=ca.SX(1.0)
    )
    disputed = DriveChecks(undecided=ca.SX(1.0))
    model = BOOM_MODEL
    now = sample(motor_torque=50.0, motor_speed=100.0, mean_speed=100.0)
    found = check_pressures(state, now, disputed, ca.SX(30.0), ca.SX(2.0), model)[1]
    assert of_machine(found.torque_wrong) == 0.0


# Relief valves


@pytest.mark.parametrize(
    ("probability", "mean", "std"),
    [
        (0.0, 0.0, 0.0), (0.5, 0.0, math.sqrt(0.25 * 0.75 + 0.125**2)),
        (0.75, 0.5, math.sqrt(0.5625 * 0.4375 + 0.28125**2)), (1.0, 1.0, 0.5),
    ],
)  # fmt: skip
def test_what_passed_is_expected_from_the_middle_on(probability, mean, std):
    expected, deviation = passed_share(ca.SX(probability))
    assert value(expected) == pytest.approx(mean)
    assert value(deviation) == pytest.approx(std)


# Rest


def crept(**values):
    known = {"position": 0.3, "load": 0.5, "warming": 0.0} | values
    assumed = Assumptions().replace({"machine.closed_leakage": "100 ml/min", "machine.expansion": 0.2})
    model = replace(BOOM_MODEL, assumed=assumed)
    return of_machine(creep(sample(), *(ca.SX(known[name]) for name in ("position", "load", "warming")), model))


def test_a_closed_valve_leaks_by_its_pressure():
    assert crept() > 0.0
    assert crept(load=1.0) == pytest.approx(2.0 * crept())
    assert crept(load=-1.0) == crept(load=1.0) == crept(load=1.7), "no more than relief valves carry"
    assert crept(load=0.0) == 0.0


def test_trapped_oil_expands_by_its_column_whichever_way_its_temperature_goes():
    """What it gives adds to what leaks: both errors persist."""
    grown = crept(warming=0.01) - crept()
    assert grown == pytest.approx(crept(warming=-0.01) - crept())
    assert crept(warming=0.02) - crept() == pytest.approx(2.0 * grown)
    hose = BOOM.a.hose.volume if BOOM.held == "a" else BOOM.b.hose.volume  # behind the same valve
    dead = (float(BOOM.cylinder.dead_volume(BOOM.held)) + hose) / float(BOOM.cylinder.area(BOOM.held))
    height = 0.3 if BOOM.held == "a" else BOOM.cylinder.stroke - 0.3
    lower = crept(load=0.0, position=0.0 if BOOM.held == "a" else BOOM.cylinder.stroke, warming=0.01)
    assert lower / grown == pytest.approx(dead / (height + dead))


@pytest.mark.parametrize(
    ("shows", "speed", "held", "std"),
    [(0.51, 1.1, False, 0.0), (0.5, 1.1, False, 1.0), (0.51, 1.0, False, 1.0), (0.0, 0.0, True, 0.0)],
)
def test_a_load_is_unseen_while_the_torque_shows_none_of_it(shows, speed, held, std):
    step = step_of(shows=shows, give_alone=1e-7, value=2e4)
    now = sample(motor_speed=speed)
    state = UnseenLoadState(shown_for=ca.SX(0.3))  # the load has been found
    _, found = unseen_load(state, now, step, ca.SX(float(held)), ca.SX(1e4), ca.SX(1e6))
    assert value(found.std) == pytest.approx(std * by.LATEST_SURE * 1e-3)
    assert value(found.most) == pytest.approx(std * by.CERTAIN * 1e-3)


def test_a_load_counts_as_seen_once_a_valve_had_time_to_open():
    step, now = step_of(shows=1.0, give_alone=1e-7, value=2e4), sample(motor_speed=50.0)
    for shown_for, load in ((0.27, 1e4), (0.29, 2e4)):
        state = UnseenLoadState(shown_for=ca.SX(shown_for), load=ca.SX(1e4), was_seen=ca.SX(1.0))
        after, _ = unseen_load(state, now, step, ca.SX(0.0), ca.SX(5e3), ca.SX(1e6))
        assert value(after.load) == load
        # Of two expected changes the square is 4, and a sixth of what it is above 1 is learned; 1/12 is for a rare one.
        assert value(after.changes) == pytest.approx((3.0 + 1.0 / 12.0) / 6.0 if load == 2e4 else 0.0)


def test_no_load_is_further_than_relief_valves_carry():
    _, found = unseen_load(UnseenLoadState(), sample(), step_of(give_alone=1e-7), ca.SX(0.0), ca.SX(1e4), ca.SX(2e4))
    assert value(found.most) == pytest.approx(1e-7 * 2e4)


def test_a_load_that_is_hidden_becomes_older_and_one_that_shakes_is_known_worse():
    shown, hidden = step_of(shows=1.0, value=2e4), step_of(shows=0.0, value=2e4)
    state = UnseenLoadState(shown_for=ca.SX(1.0), load=ca.SX(1e4), was_seen=ca.SX(1.0))
    seen, _ = unseen_load(state, sample(motor_speed=50.0), shown, ca.SX(0.0), ca.SX(5e3), ca.SX(1e6))
    assert value(seen.hidden_for) == 0.0
    assert value(seen.shakes) == pytest.approx(0.02 * 1e4**2), "a sample of a second"
    after, _ = unseen_load(seen, sample(motor_speed=0.0), hidden, ca.SX(0.0), ca.SX(5e3), ca.SX(1e6))
    assert value(after.hidden_for) == pytest.approx(0.02)
    assert value(after.shakes) == value(seen.shakes), "nothing shows it"


@pytest.mark.parametrize(
    ("term", "state", "std", "load"),
    [
        ("observer", {}, 3e3, 0.0),
        ("gain", {}, 0.0, 2e5),
        ("shakes", {"shakes": 4e6}, 0.0, 0.0),
        ("change", {"hidden_for": 0.02, "changes": 3.0}, 0.0, 0.0),
    ],
)
def test_the_deviation_of_a_load_is_the_root_of_a_sum_of_squares(term, state, std, load):
    """Each term alone, over those that are always there: the torque's offset and the cylinder's friction."""
    drive = SimpleNamespace(torque_gain=0.04)
    model = SimpleNamespace(
        assumed=SimpleNamespace(drive=drive), relief_load=1e5, of_circuit={"cylinder.coulomb_friction": 800.0}.get
    )
    always = (by.TORQUE_OFFSET * 1e5) ** 2 + (by.BETWEEN_STD * 800.0) ** 2
    alone = {"observer": 3e3, "gain": 0.05 * 2e5, "shakes": 1e3, "change": 2.0 * 5e3}[term]
    known = UnseenLoadState(**{name: ca.SX(one) for name, one in state.items()})
    found = value(load_std(known, step_of(std=std, value=load), ca.SX(5e3), model))
    assert found == pytest.approx(math.sqrt(always + alone**2)), term


# Link angle: 2 m a radian, 1 mrad of error, 0.1 s of vibration

LEVER = SimpleNamespace(slope=lambda angle: ca.SX(2.0), position=lambda angle: 0.1 + 2.0 * angle)
SENSOR = SimpleNamespace(
    stroke=1.0,
    assumed=SimpleNamespace(
        link_angle=SimpleNamespace(std=1e-3, lag=0.05, correlation=0.1), stops=SimpleNamespace(lies=0.05)
    ),
)
READING = AssumedReading(std=2e-3, offset=1e-3, delay=0.05, wrong=0.02, correlation=0.1)


def angled(angle=0.2, *, since=1.0, travel=0.0, last=0.1, step=0.004, known=True):
    state = LinkState(since=ca.SX(since), travel=ca.SX(travel), angle=ca.SX(last))
    now = sample(measured={LINK_ANGLE: angle})
    after, found = read_angle(
        state, now, step_of(travel=step), ca.SX(0.4), ca.SX(float(known)), LEVER, SENSOR
    )  # fmt: skip
    return plain(after), found


@pytest.mark.parametrize(
    ("changed", "used"),
    [
        ({}, True),
        ({"since": 0.179}, False),
        ({"since": 0.180}, True),
        ({"step": 0.0019}, False),
        ({"step": -0.0021}, True),
        ({"last": 0.1991}, False),
        ({"last": 0.1989}, True),
        ({"angle": NAN}, False),
        ({"angle": 3.15}, False),
        ({"since": 0.0, "step": 0.0, "last": 0.2, "known": False}, True),
    ],
    ids=named,
)
def test_an_angle_is_used_once_piston_and_angle_have_moved(changed, used):
    after, found = angled(**changed)
    assert value(found.use) == used
    if used:
        assert (after.since, after.travel) == (0.0, 0.0)
        assert after.angle == changed.get("angle", 0.2)


def test_an_angle_is_late_by_its_lag():
    _, found = angled()
    late = 0.004 * 0.05 / 0.02
    assert value(found.innovation) == pytest.approx(0.1 + 2.0 * 0.2 + late - 0.4)
    assert value(found.R) == pytest.approx((1e-3 * 2.0) ** 2 + late**2 / 3.0)
    assert value(found.H[Quantity.ANGLE_OFFSET]) == 2.0


def read(reading=0.3, *, since=1.0, step=0.004):
    now = sample(measured={ABSOLUTE: reading})
    return read_position(ABSOLUTE, ca.SX(since), now, step_of(travel=step), ca.SX(0.29), 0.5, READING)


@pytest.mark.parametrize(
    ("changed", "used"),
    [
        ({}, True), ({"since": 0.179}, False), ({"since": 0.180}, True), ({"reading": NAN}, False),
        ({"reading": -0.501}, False), ({"reading": 1.001}, False), ({"reading": -0.02}, True),
    ],
    ids=named,
)  # fmt: skip
def test_a_reading_is_used_where_it_is_a_place_and_independent_of_the_last(changed, used):
    after, found = read(**changed)
    assert value(found.use) == used
    assert value(after) == (0.0 if used else pytest.approx(changed.get("since", 1.0) + H))


def test_a_reading_is_of_a_moment_ago_and_may_be_of_something_else():
    _, found = read()
    late = 0.004 * 0.05 / 0.02
    assert value(found.innovation) == pytest.approx(0.3 + late - 0.29)
    assert value(found.R) == pytest.approx(READING.std**2 + late**2 / 3.0)
    assert value(found.alternative) == pytest.approx(math.log(0.02 / 0.5))
    assert found.common == READING.offset


# A held piston that is released


@pytest.mark.parametrize(
    ("released", "held", "shown"), [(False, True, 1.0), (False, False, 1.0), (True, False, 0.25), (True, False, 1.0)]
)
def test_a_piston_that_was_not_held_after_all_has_the_pressures_that_the_torque_shows(released, held, shown):
    fresh = LoadState.initial(BOOM_MODEL)
    now = {name: ca.SX(80e5 if name.startswith("pressure") else 0.0) for name in fresh.circuit}
    then = {name: ca.SX(40e5 if name.startswith("pressure") else 0.0) for name in fresh.circuit}
    load = replace(fresh, circuit=now, load=ca.SX(1e5))
    how = Release(ca.SX(float(released)), ca.SX(float(held)), ca.SX(shown))
    state, after, travel = release_load(UnheldState(circuit=then), load, ca.SX(0.3), how, ca.SX(1e-8), BOOM_MODEL)
    pressure = 40e5 + shown * 40e5 if released else 80e5
    name = f"pressure_{BOOM.cylinder.node_a}"
    assert value(after.circuit[name]) == pressure
    assert value(state.circuit[name]) == (40e5 if held else pressure)
    force = float(BOOM.cylinder.area_a) - float(BOOM.cylinder.area_b)
    if not released:
        assert value(after.load) == 1e5
        assert of_machine(travel) == 0.0
    else:
        fallen = of_machine(BOOM_MODEL.balance.force(ca.vertcat(0.3, *now.values()))) - of_machine(after.load)
        assert fallen == pytest.approx(force * (80e5 - pressure), rel=1e-9)
        assert of_machine(travel) == pytest.approx(BOOM_MODEL.lift * 1e-8 * fallen)


# What all share


def test_a_sum_over_a_longer_time_has_fewer_chances():
    assert sure(1.0) == pytest.approx(5.14, abs=5e-3)
    assert sure(60.0) < sure(1.0)


def test_numbers_of_the_boom_are_those_of_its_limits():
    assert of_machine(BOOM_MODEL.relief_load) == pytest.approx(limits_of(BOOM).load)


# A load on one chamber, and from before the piston stood.


@pytest.mark.parametrize("more", [0.5, 2.0])
def test_oil_of_one_chamber_gives_way_at_least_as_far_as_that_of_both(more):
    unit, capacity = UNITS["mining-loader boom"], 2e-12
    alone = capacity / float(unit.cylinder.area(unit.held)) ** 2
    model = SimpleNamespace(unit=unit, trapped_oil=lambda _: (ca.SX(1e-3), ca.SX(capacity)))
    assert value(_give_alone(ca.SX(more * alone), ca.SX(0.3), model)) == pytest.approx(max(more, 1.0) * alone)


@pytest.mark.parametrize(
    ("started", "keeps", "load", "least", "largest"),
    [(1.0, 0.0, 100.0, 100.0, 150.0), (1.0, 0.0, 300.0, 250.0, 300.0), (0.0, 0.0, 100.0, 100.0, 100.0),
     (0.0, 1.0, 100.0, 200.0, 200.0), (1.0, 1.0, 300.0, 200.0, 200.0)],
)  # fmt: skip
def test_a_load_from_before_is_forgotten_within_its_memory_and_at_once_when_samples_begin(
    started, keeps, load, least, largest
):
    lately = replace(made(ReleaseState, rest=None), load_least=ca.SX(200.0), load_largest=ca.SX(200.0))
    now, step = sample(started=started, elapsed=0.5 * by.MEMORY_TIME), step_of(value=load)
    for direction, before in ((1.0, least), (-1.0, largest)):
        piston = made(Holding, keeps_load=ca.SX(keeps), direction=ca.SX(direction))
        found = _load_before(lately, now, step, piston, SimpleNamespace(lift=1.0))
        assert [value(one) for one in found] == pytest.approx([least, largest, before])


@pytest.mark.parametrize(("times", "share"), [(0.5, 0.5), (1.0, 1.0), (1.5, 1.0)])
def test_what_was_before_is_forgotten_once_and_not_more_often(times, share):
    """Leakage of 3 mm/s that was taken for 1 mm/s, and a load of 100 N that was 200 N."""
    elapsed = times * by.MEMORY_TIME
    state = replace(
        made(ReleaseState, rest=None), leakage=ca.SX(1e-3), load_least=ca.SX(200.0), load_largest=ca.SX(200.0)
    )
    now = sample(elapsed=elapsed, mean_speed=5.0)
    step = step_of(free_travel=2e-3 * elapsed, value=100.0)
    model = SimpleNamespace(travel_per_radian=1e-3, lift=1.0)
    leakage, _ = _moved_in_vain(state, now, step, ca.SX(0.0), model)
    assert value(leakage) == pytest.approx(1e-3 + share * 2e-3)
    piston = made(Holding, direction=ca.SX(-1.0))
    assert value(_load_before(state, now, step, piston, model)[2]) == pytest.approx(200.0 - share * 100.0)


def test_a_piston_has_sunk_nowhere_in_the_sample_from_which_on_it_is_held_at_rest():
    step, now = step_of(expected=20.0, give=1e-7), sample(motor_torque=15.0)
    found = _at_rest(made(RestState), now, step, ca.SX(1.0), ca.SX(0.0), SimpleNamespace(travel_per_radian=1e-4))
    assert [value(one) for one in (found.state.least_behind, found.sunk)] == [0.0, 0.0]
    assert [value(one) for one in (found.state.expected_began, found.state.shown_began)] == [20.0, 15.0]
