"""How often rounded reports repeat by chance, and when a run of them says that a report is stuck."""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

from ramsight.control.repeats import look, nothing_learned, repeats, repeats_in_a_row, runs, runs_of, upper_share
from ramsight.control.thresholds import FALSE_ALARM_RATE
from ramsight.engine.recursion import Live, recursion_of
from ramsight.engine.typed_state import leaf, symbols
from ramsight.expression import Flag, Scalar, flag

from .control_bench import number

DT = 0.02


def rounded(noise, count, mean=100.0, seed=0):
    return np.round(mean + noise * np.random.default_rng(seed).standard_normal(count))


@pytest.mark.parametrize("noise", [0.4, 1.0, 3.0])
@pytest.mark.parametrize("off", [0.0, 0.3, 0.5])
def test_repeats_of_a_rounded_value_are_as_frequent_as_worked_out(noise, off):
    values = rounded(noise, 400_000, 100.0 + off)
    for count in (1, 2, 3):
        windows = np.lib.stride_tricks.sliding_window_view(values, count + 1)
        seen = np.mean(np.all(windows == windows[:, :1], axis=1))
        expected = repeats(count, noise, 1.0, off)
        assert seen == pytest.approx(expected, abs=6.0 * math.sqrt(count * expected / len(values)))


@pytest.mark.parametrize("noise", [0.3, 0.7, 1.0, 2.0, 8.0])
def test_a_value_in_the_middle_of_its_step_repeats_most_often(noise):
    for count in (1, 5, 20):
        chances = [repeats(count, noise, 1.0, off) for off in np.linspace(0.0, 0.5, 11)]
        assert max(chances) == pytest.approx(chances[0], rel=1e-9)


def test_two_repeats_are_more_frequent_than_the_square_of_one():
    assert repeats(2, 1.0, 1.0) > 1.1 * repeats(1, 1.0, 1.0) ** 2


def test_rare_events_in_a_row_are_rarer_than_the_stated_rate():
    for share in (0.01, 0.05, 0.3, 0.9):
        count = runs(share, DT)
        assert share**count <= DT * FALSE_ALARM_RATE < share ** (count - 1)


@pytest.mark.parametrize("period", [0.005, 0.02, 0.1])
@pytest.mark.parametrize("noise", [0.2, 0.5, 1.0, 2.0, 5.0, 20.0])
def test_so_many_repeats_are_rarer_than_the_stated_rate_and_one_less_is_not(noise, period):
    count = repeats_in_a_row(noise, 1.0, period)
    assert repeats(count, noise, 1.0) <= period * FALSE_ALARM_RATE < repeats(count - 1, noise, 1.0)


def test_without_noise_a_report_may_repeat_for_ever_and_without_steps_not_once():
    assert repeats_in_a_row(0.0, 1.0, DT) == math.inf
    assert repeats_in_a_row(0.01, 1.0, DT) == math.inf
    assert repeats_in_a_row(1.0, 0.0, DT) == 1


def test_runs_of_an_expression_are_those_of_a_number():
    for share in (0.001, 0.05, 0.2, 0.5, 0.9, 0.99):
        assert number(runs_of(ca.SX(share), DT)) == runs(share, DT)


def test_what_was_never_seen_is_believed_to_be_rare_only_after_many_samples():
    assert upper_share(0.0, 0.0) == 1.0
    assert upper_share(0.0, 100.0) == pytest.approx(3.0 / 103.0)


@dataclass(frozen=True)
class Report:
    speed: Scalar = leaf("rad/s")
    steady: Flag = leaf("1")
    trembles: Flag = leaf("1")


STEADY, TREMBLING, MOVING = (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)


class Watched:
    """The check by itself."""

    def __init__(self, noise, step, period):
        enough = repeats_in_a_row(noise, step, period)

        def stage(state, now):
            new, alarm = look(state, flag(True), now.speed, (now.steady, now.trembles), enough, period)
            return new, (alarm,)

        self._live = Live(recursion_of(nothing_learned(), symbols(Report()), ("alarm",), stage), nothing_learned())

    def look(self, speed, command):
        return bool(self._live.step((speed, *command))[0])

    @property
    def believed(self):
        return bool(self._live.state["confirmed"])


def stops_at(watched, values, going):
    said = [watched.look(float(value), going) for value in values]
    return said.index(True) if True in said else None


@pytest.mark.parametrize("going", [STEADY, TREMBLING])
@pytest.mark.parametrize(("noise", "least"), [(1.0, 19), (2.0, 11), (10.0, 6)])
def test_a_speed_that_is_stuck_is_told_by_its_repeats_once_its_noise_was_seen(going, noise, least):
    watched = Watched(noise, 1.0, DT)
    assert stops_at(watched, rounded(noise, 20_000), going) is None
    assert least <= stops_at(watched, [40.0] * 40, going) <= least + 2


def test_noise_that_was_not_seen_yet_or_only_while_the_command_trembled_is_no_ground_to_stop():
    assert stops_at(Watched(1.0, 1.0, DT), [40.0] * 5000, STEADY) is None
    watched = Watched(1.0, 1.0, DT)
    stops_at(watched, rounded(1.0, 20_000), TREMBLING)
    assert stops_at(watched, [40.0] * 5000, STEADY) is None


@pytest.mark.parametrize(("samples", "found"), [(160, False), (220, True)])
def test_a_run_is_an_alarm_only_after_ten_times_its_length_was_seen(samples, found):
    watched = Watched(1.0, 1.0, DT)
    assert stops_at(watched, rounded(1.0, samples), STEADY) is None
    assert (stops_at(watched, [40.0] * 60, STEADY) is not None) is found


def test_a_long_run_that_ends_refutes_the_declared_noise():
    watched = Watched(1.0, 1.0, DT)
    stops_at(watched, [40.0] * 25, STEADY)
    assert watched.believed
    stops_at(watched, [41.0], MOVING)
    assert not watched.believed
    stops_at(watched, rounded(1.0, 20_000), STEADY)
    assert stops_at(watched, [40.0] * 5000, STEADY) is None


def test_where_more_repeats_than_the_noise_has_them_it_takes_longer():
    """Declared 2 rpm, and there is 1 rpm: the longest of 500 runs does not refute it, and the repeats count."""
    watched = Watched(1.3, 1.0, DT)
    stops_at(watched, rounded(1.0, 3000), STEADY)
    assert watched.believed
    assert stops_at(watched, [40.0] * 60, STEADY) > repeats_in_a_row(1.3, 1.0, DT)


def test_an_alarm_that_ends_teaches_nothing_and_repeats_while_the_command_goes_are_not_counted():
    watched = Watched(1.0, 1.0, DT)
    stops_at(watched, rounded(1.0, 20_000), STEADY)
    assert stops_at(watched, [40.0] * 300, MOVING) is None
    stops_at(watched, rounded(1.0, 20_000), STEADY)
    assert stops_at(watched, [40.0] * 300, STEADY) is not None
    stops_at(watched, rounded(1.0, 100), STEADY)
    assert watched.believed
