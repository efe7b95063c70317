"""A recorded log looked back at: the smoother against textbooks, births, what is said, and the user's path."""

from __future__ import annotations

import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ramsight
from ramsight.errors import DescriptionError
from ramsight.hindsight import smoother
from ramsight.hindsight.innovations import Innovation, Innovations, mean_range
from ramsight.hindsight.looking_back import Recalled, looked_back, ways_of
from ramsight.hindsight.positions import Positions, said_of, truncated
from ramsight.hindsight.smoother import CLOSE, Ahead, Forward, Sought, backward, silent
from ramsight.hindsight.trace import ASIDE, Trace, Tracer
from ramsight.logs import read_log, read_truth
from ramsight.logs.opening import open_signals
from ramsight.machine.assumption_description import AssumedIntegrity
from ramsight.sensor.belief.lineage import Births, followed, parents, unchanged, used
from ramsight.sensor.kind import KINDS, Kind
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import HIGHEST, IS_REFERENCED, LOWEST, log_inputs
from ramsight.signals import Signals

from .command import at_once

TRACES = Path(__file__).parent / "traces"
STROKE = 0.5


def value(expression):
    return float(ca.DM(ca.SX(expression)))


class Toy:
    """A piston whose way has an unknown factor that walks: x' = x + a u, u' = u + w; two references."""

    def __init__(self, samples=60, seed=0, hypotheses=1):
        random = np.random.default_rng(seed)
        self.way = random.uniform(-0.02, 0.03, samples)
        self.noise, self.R = np.array([1e-8, 1e-6]), 1e-6
        self.at = {samples // 3: 0.12, 5 * samples // 6: 0.4}
        x, p = np.array([0.2, 1.0]), np.diag([0.1**2, 0.2**2])
        shape = (samples, hypotheses)
        before, after = (np.empty((*shape, 2)) for _ in range(2))
        before_p, after_p = (np.empty((*shape, 2, 2)) for _ in range(2))
        updated = np.zeros(samples)
        for k in range(samples):
            step = self.step(k)
            x, p = step @ x, step @ p @ step.T + np.diag(self.noise)
            before[k], before_p[k] = x, p
            if k in self.at:
                gain = p[:, 0] / (p[0, 0] + self.R)
                x = x + gain * (self.at[k] - x[0])
                a = np.eye(2) - np.outer(gain, [1.0, 0.0])
                p = a @ p @ a.T + self.R * np.outer(gain, gain)
                updated[k] = 1.0
            after[k], after_p[k] = x, p
        aside = dict.fromkeys(ASIDE, np.zeros(samples)) | {"updated": updated}
        travel_by = np.column_stack([np.zeros(samples), self.way])
        place = np.tile(np.arange(hypotheses), (samples, 1))
        self.covariance, self.covariance_before = after_p, before_p
        upper = (..., *np.triu_indices(2))
        unknown, none = np.zeros((samples, 2)), np.zeros(shape, bool)
        self.trace = Trace(before, before_p[upper], after, after_p[upper], unknown, place, none, travel_by, aside)

    def step(self, k):
        return np.array([[1.0, self.way[k]], [0.0, 1.0]])

    def textbook(self):
        """Rauch, Tung and Striebel, sample by sample."""
        trace = self.trace
        means, covariances = [trace.mean[-1, 0]], [self.covariance[-1, 0]]
        for k in range(len(trace.mean) - 2, -1, -1):
            p = self.covariance[k, 0]
            gain = p @ self.step(k + 1).T @ np.linalg.inv(self.covariance_before[k + 1, 0])
            means.insert(0, trace.mean[k, 0] + gain @ (means[0] - trace.mean_before[k + 1, 0]))
            covariances.insert(0, p + gain @ (covariances[0] - self.covariance_before[k + 1, 0]) @ gain.T)
        return np.array(means), np.array(covariances)

    def least_squares(self):
        """All states at once: the normal equations of prior, steps and references."""
        n = len(self.way)
        matrix, right = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)

        def add(rows, value, weight):
            matrix[:] += rows.T @ weight @ rows
            right[:] += rows.T @ weight @ value

        first = np.zeros((2, 2 * n))
        first[:, :2] = np.eye(2)
        step = self.step(0)
        p = step @ np.diag([0.1**2, 0.2**2]) @ step.T + np.diag(self.noise)
        add(first, step @ np.array([0.2, 1.0]), np.linalg.inv(p))
        for k in range(1, n):
            rows = np.zeros((2, 2 * n))
            rows[:, 2 * k : 2 * k + 2], rows[:, 2 * k - 2 : 2 * k] = np.eye(2), -self.step(k)
            add(rows, np.zeros(2), np.diag(1.0 / self.noise))
        for k, place in self.at.items():
            rows = np.zeros((1, 2 * n))
            rows[0, 2 * k] = 1.0
            add(rows, np.array([place]), np.array([[1.0 / self.R]]))
        return np.linalg.solve(matrix, right).reshape(n, 2)


def looked_at(trace, ahead=None):
    """Both quantities of each hypothesis in all samples but the last one: means, variances, and what is known first."""
    k = trace.mean.shape[1]
    sought = Sought(np.repeat(np.arange(k), 2), np.tile([0, 1], k))
    mean, variance, ahead = backward(trace, ahead or Ahead.end(trace), STROKE, sought)
    return mean.reshape(-1, k, 2), variance.reshape(-1, k, 2), ahead


@pytest.mark.parametrize("seed", range(3))
def test_a_linear_toy_is_smoothed_as_in_the_textbook(seed):
    toy = Toy(seed=seed)
    found = looked_at(toy.trace)[:2]
    last = Sought(np.array([0, 0]), np.array([0, 1])).last(toy.trace)
    mean, variance = (np.concatenate([one[:, 0], [end]]) for one, end in zip(found, last, strict=True))
    expected, covariance = toy.textbook()
    assert np.abs(mean - expected).max() < 1e-9
    assert np.abs(variance - np.diagonal(covariance, axis1=1, axis2=2)).max() < 1e-9


def test_a_linear_toy_is_smoothed_as_all_of_it_at_once_by_least_squares():
    toy = Toy(seed=7)
    mean, variance, _ = looked_at(toy.trace)
    assert np.abs(mean[:, 0] - toy.least_squares()[:-1]).max() < 1e-8
    assert (variance[:, 0] <= np.diagonal(toy.covariance[:-1, 0], axis1=1, axis2=2) + 1e-12).all()


def cut(trace, first, last):
    kept = {one: getattr(trace, one)[first:last] for one in Trace.__dataclass_fields__ if one != "aside"}
    return Trace(**kept, aside={name: one[first:last] for name, one in trace.aside.items()})


def test_blocks_are_smoothed_as_the_whole():
    trace = Toy(seed=1).trace
    whole = looked_at(trace)
    late = looked_at(cut(trace, 30, 60))
    early = looked_at(cut(trace, 0, 31), late[2])
    for k in range(2):
        assert np.abs(np.concatenate([early[k], late[k]]) - whole[k]).max() < 1e-12


def test_what_is_known_exactly_is_not_moved():
    toy = Toy(seed=2)
    for one in (toy.trace.covariance, toy.trace.covariance_before):
        one[..., 1:] = 0.0
    mean, variance, _ = looked_at(toy.trace)
    assert np.isfinite(mean).all()
    assert np.array_equal(mean[:, 0, 1], toy.trace.mean[:-1, 0, 1])
    assert not variance[:, 0, 1].any()


def test_what_changed_unknown_is_more_variance_of_the_position_before_and_after():
    """As if the filter had known of it, which is what the smoother takes it for."""
    added, filtered = Toy(seed=5), Toy(seed=5)
    added.trace.unknown[10:30] = 1e-6
    for one in (filtered.trace.covariance, filtered.trace.covariance_before):
        one[10:30, :, 0] += 1e-6
    for one, other in zip(looked_at(added.trace)[:2], looked_at(filtered.trace)[:2], strict=True):
        assert np.abs(one - other).max() < 1e-15
    assert np.abs(looked_at(added.trace)[0] - looked_at(Toy(seed=5).trace)[0]).max() > 1e-6


def test_a_hypothesis_is_followed_back_to_the_one_it_continues():
    toy = Toy(seed=3, hypotheses=2)
    toy.trace.mean[:, 1, 0] += 0.05
    toy.trace.mean_before[:, 1, 0] += 0.05
    found = 40
    toy.trace.parent[found, 0] = 1  # the first one is what was the second until then
    toy.trace.mean[found:, 0], toy.trace.mean_before[found + 1 :, 0] = (
        toy.trace.mean[found:, 1], toy.trace.mean_before[found + 1 :, 1],
    )  # fmt: skip
    mean, _, ahead = looked_at(toy.trace)
    assert ahead.place.tolist() == [1, 1]
    assert np.abs(mean[:, 0] - mean[:, 1]).max() < 1e-12


@pytest.mark.parametrize(("independent", "least", "most"), [(False, 0.2, 0.4), (True, 0.0, 0.02)])
def test_nothing_of_a_position_is_carried_back_over_its_birth(independent, least, most):
    born, before = 25, []
    for by in (0.0, 0.3):
        toy = Toy(seed=4)
        toy.trace.independent[born, 0], toy.trace.aside["updated"][born] = independent, 1.0
        toy.trace.mean[born:, 0, 0] += by
        toy.trace.mean_before[born + 1 :, 0, 0] += by
        before.append(looked_at(toy.trace)[0][born - 1, 0, 0])
    assert least <= abs(before[1] - before[0]) < most


NONE = dict.fromkeys(("found", "surely", "restarts", "goes_on", "lost"), 0.0)


def after(**births):
    flags = {name: ca.SX(one) for name, one in (NONE | births).items()}
    return [(int(value(one.place)), bool(value(one.independent))) for one in parents(KINDS, Births(**flags))]


SAME = [(0, False), (1, False), (2, False), (3, False), (4, False)]


@pytest.mark.parametrize(
    ("births", "expected"),
    [
        ({}, SAME),
        ({"surely": 1.0}, [(1, False), *SAME[1:]]),
        ({"restarts": 1.0}, [*SAME[:4], (0, True)]),
        ({"restarts": 1.0, "goes_on": 1.0}, [*SAME[:4], (0, False)]),
        ({"lost": 1.0}, [*SAME[:4], (0, True)]),
        ({"found": 1.0, "restarts": 1.0}, [(4, False), (1, False), (4, False), (4, False), (4, True)]),
        ({"found": 1.0, "restarts": 1.0, "lost": 1.0}, [(0, True), (1, False), (0, True), (0, True), (0, True)]),
    ],
)
def test_each_hypothesis_continues_another_one(births, expected):
    assert after(**births) == expected


def test_parents_of_parents_and_of_no_measurement():
    flags = {name: ca.SX(one) for name, one in NONE.items()}
    first = parents(KINDS, Births(**(flags | {"surely": ca.SX(1.0)})))
    then = parents(KINDS, Births(**(flags | {"restarts": ca.SX(1.0)})))
    both = [(int(value(one.place)), bool(value(one.independent))) for one in followed(first, then)]
    assert both == [(1, False), (1, False), (2, False), (3, False), (1, True)]
    assert [value(one.place) for one in used(ca.SX(0.0), first, KINDS)] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert [value(one.place) for one in used(ca.SX(1.0), first, KINDS)] == [1.0, 1.0, 2.0, 3.0, 4.0]
    assert len(unchanged(KINDS[:2])) == 2


@given(st.floats(-6.0, 3.0), st.floats(0.1, 6.0))
def test_a_truncated_normal_has_the_moments_of_its_density(low, width):
    high = low + width
    x = np.linspace(low, high, 20001)
    density = np.exp(-0.5 * x**2)
    share = np.trapezoid(density, x) / math.sqrt(2.0 * math.pi)
    mean, variance = truncated(low, high)
    if share > 1e-5:
        whole = np.trapezoid(density, x)
        expected = np.trapezoid(x * density, x) / whole
        assert mean == pytest.approx(expected, abs=1e-6)
        assert variance == pytest.approx(np.trapezoid((x - expected) ** 2 * density, x) / whole, abs=1e-6)


def test_no_room_leaves_a_normal_variable_as_it_is():
    assert truncated(1.0, 1.0) == truncated(2.0, 1.0) == truncated(6.0, 7.0) == (0.0, 1.0)


def within(position, variance):
    return Positions(position, variance, np.zeros(1), STROKE).at(slice(None))


def test_a_way_as_long_as_the_stroke_leaves_nowhere_else_to_be():
    way = np.linspace(0.0, STROKE, 50)[:, None]
    unsure = np.full_like(way, 0.05**2)
    assert within(way, unsure)[1].max() < 0.1 * unsure.max()
    assert within(0.5 * way + 0.1, unsure)[1].min() > 0.5 * unsure.max()
    assert 0.01 < (within(way - 0.02, unsure)[0] - way + 0.02).mean() < 0.03, "put back into the cylinder"
    # What is uncertain only here and there is uncertain as before.
    local = unsure.copy()
    local[:10] = 1e-12
    assert np.allclose(within(way, local)[1], local, atol=1e-9)


def unit():
    return ramsight.build("mining-loader", unit="bucket")


def said(position=0.2, std=1e-3, others=(), status=Status.OK, **aside):
    position, stds = [position, *(one for one, _, _ in others)], [std, *(one for _, one, _ in others)]
    log_weight = np.array([0.0, *(math.log(p) for _, _, p in others)])
    positions = Positions(np.array([position]), np.array([stds]) ** 2, log_weight, STROKE)
    zero = dict.fromkeys(("others", "unseen", "unseen_most", "offset", "wrong"), 0.0) | {"width": 1.0}
    asides = {name: np.array([float(one)]) for name, one in (zero | {"status": status} | aside).items()}
    return {name: one[0] for name, one in said_of(positions, asides, unit()).items()}


def test_what_is_said_of_one_sure_hypothesis():
    found = said()
    assert found["position"] == 0.2
    assert found["position_std"] == pytest.approx(1e-3)
    assert (found[LOWEST], found[HIGHEST]) == pytest.approx((0.2 - 1.96e-3, 0.2 + 1.96e-3), abs=1e-6)
    assert found["position_bound"] == pytest.approx(math.sqrt(2.0 * math.log(1e5)) * 1e-3, rel=1e-6)
    assert found["status"] == Status.OK


def test_another_likely_hypothesis_and_what_no_one_follows_widen_it():
    alone, more = said(), said(others=[(0.24, 1e-3, 0.2)])
    assert more[HIGHEST] > 0.24 > alone[HIGHEST]
    assert said(others_=0.0)["position_std"] < said(unseen=2e-3)["position_std"]
    assert said(offset=1e-3)["position_std"] == pytest.approx(alone["position_std"] + 1e-3)
    assert said(width=2.0)["position_std"] == pytest.approx(2e-3)
    assert said(position=-0.01)["position"] == 0.0


@pytest.mark.parametrize(
    ("std", "of_sample", "expected"),
    [
        (0.9, Status.OK, Status.OK), (1.1, Status.OK, Status.REFERENCE_DUE),
        (1.1, Status.INPUT_GAP, Status.INPUT_GAP), (0.1, Status.INPUT_LOST, Status.INPUT_LOST),
        (100.0, Status.OK, Status.TOO_UNCERTAIN), (100.0, Status.FAULT_PASSED, Status.TOO_UNCERTAIN),
        (100.0, Status.INPUT_LOST, Status.INPUT_LOST),
    ],
)  # fmt: skip
def test_the_status_is_what_weighs_most_of_sample_and_position(std, of_sample, expected):
    due = AssumedIntegrity().due * float(unit().cylinder.stroke)
    assert said(position=0.25, std=std * due, status=of_sample)["status"] == expected


def innovations(*all_of_them):
    return Innovations([Innovation(*one) for one in all_of_them])


def test_what_a_measurement_shows_that_nobody_assumed():
    position = np.linspace(0.0, 0.5, 11)
    expected = innovations((10, 10.0, 0.5, 0.01, True)).unknown(position)
    assert not expected.any(), "no more than was assumed"
    walked = innovations((4, 4.0, 0.2, 0.01, True), (10, 10.0, 4.0, 0.02, True)).unknown(position)
    excess = 0.02**2 * (1.0 - 1.0 / 4.0)
    assert not walked[:5, 0].any()
    assert walked[10, 0] == pytest.approx(excess)
    assert walked[7] == pytest.approx([0.5 * excess, 0.5 * excess])
    assert not walked[10:, 1].any()
    assert not innovations((10, 10.0, 50.0, 0.02, False)).unknown(position).any(), "a measurement of something else"
    assert innovations((10, 10.0, math.nan, 0.02, True)).unknown(position)[10, 0] == pytest.approx(0.02**2)
    assert not innovations((10, 10.0, 9.0, 0.02, True)).unknown(np.zeros(11)).any(), "a piston that stands"


def test_what_the_first_measurement_shows_of_an_entered_start_is_in_all_samples_before_it():
    position = np.linspace(0.0, 0.5, 11)
    both = innovations((4, 4.0, math.nan, 0.02, True), (6, 6.0, 4.0, 0.01, True), (10, 10.0, 4.0, 0.02, True))
    walked = both.unknown(position)
    both.by_start = 7
    found = both.unknown(position)
    put_back, first = 0.02**2, 0.01**2 * (1.0 - 1.0 / 4.0)
    assert found[:5, 0] == pytest.approx(put_back + first)
    assert found[5:7, 0] == pytest.approx(first)
    assert found[:4, 1] == pytest.approx(put_back + first)
    assert found[4:6, 1] == pytest.approx(first)
    assert found[7:] == pytest.approx(walked[7:]), "after it nothing is the start's"
    assert walked[1, 0] < found[1, 0]


def test_innovations_are_taken_as_they_come():
    zero, found = np.zeros(4), Innovations()
    aside = {name: zero.copy() for name in ("accepted", "rejected", "put_back", "moved", "by_start")}
    aside |= {"normal": zero + 2.0, "by_start": np.array([1.0, 1.0, 0.0, 0.0])}
    aside["accepted"][1], aside["rejected"][2], aside["put_back"][3] = 1.0, 1.0, -0.01
    found.append(10, np.arange(4.0), aside)
    assert [(one.sample, one.accepted, math.isnan(one.normal)) for one in found.all] == [
        (11, True, False), (12, False, False), (13, True, True),
    ]  # fmt: skip
    assert found.by_start == 2
    column = found.column(14)
    assert np.flatnonzero(np.isfinite(column)).tolist() == [11, 12]
    assert "not as expected at 2 s" in found.text
    assert innovations().text == ""
    assert "not as expected" not in innovations((0, 0.0, 9.0, 0.0, True)).text
    often = [(k, float(k), 9.1, 0.0, True) for k in range(7)]
    assert innovations(*often[:5]).text.endswith("at 0 s, 1 s, 2 s, 3 s, 4 s")
    assert innovations(*often).text.endswith("4 s and 2 times more")
    assert "not as expected at 3 s" in innovations((0, 3.0, 9.1, 0.0, True)).text


@pytest.mark.parametrize(("n", "low", "high"), [(1, 0.001, 5.02), (4, 0.121, 2.786), (30, 0.560, 1.566)])
def test_the_mean_of_squares_lies_where_chi_square_says(n, low, high):
    found = mean_range(n)
    assert found[0] == pytest.approx(low, abs=0.012)
    assert found[1] == pytest.approx(high, rel=0.02)


@pytest.fixture(scope="module")
def bucket():
    built = unit()
    pieces = list(open_signals(TRACES / "unknown" / "bucket_hot.csv.gz", None))
    tracer = Tracer.of(built)
    tracer.sensor.start(None)
    back = looked_back(tracer, pieces, tracer.sensor.state)
    live = ramsight.sensor_for(built)
    return tracer, pieces, back, live.track(read_log(TRACES / "unknown" / "bucket_hot.csv.gz"))


def test_a_log_is_known_from_its_first_sample_on(bucket):
    tracer, _, back, live = bucket
    truth = read_truth(TRACES / "unknown" / "bucket_hot_truth.csv.gz")
    time, found = back.track["time"].values, {name: back.track[name].values for name in back.track.names}
    true = np.interp(time, truth["time"].values, truth["position"].values)
    stroke = float(tracer.unit.cylinder.stroke)
    off = (true > 1e-6) & (true < stroke - 1e-6)
    error = np.abs(found["position"] - true)
    assert back.passes > 1, "linearised where it was"
    assert np.isfinite(found["position"]).all()
    assert np.isnan(live["position"].values).any()
    assert np.percentile(error[off], 95.0) < 1.5e-3
    assert (error <= 1.96 * found["position_std"])[off].mean() > 0.93
    assert (error <= found["position_bound"]).all()
    ok = found["status"] == Status.OK
    assert ok.mean() > 0.85
    assert not (ok & (error > 4.0 * found["position_std"]) & (error > 1e-3)).any()
    known = np.isfinite(live["position"].values) & off
    rms = np.sqrt(np.mean(error[known] ** 2))
    assert rms < np.sqrt(np.mean((live["position"].values - true)[known] ** 2))
    assert "measurements of the place" in back.text


def test_beside_it_stands_what_the_live_sensor_says_to_the_last_digit(bucket):
    _, _, back, live = bucket
    for name in ("position", "position_std", "position_low", "position_high", "position_bound", "status"):
        assert np.array_equal(back.track[f"live_{name}"].values, live[name].values, equal_nan=True), name
    for name in ("velocity", "motor_torque_expected", "load"):
        if name in live:
            assert np.isfinite(back.track[name].values).all()
    measured = back.track["nis"].values
    assert 3 <= np.isfinite(measured).sum() < 50
    assert set(back.further) == {one for one in back.track.names if one.startswith("live_")} | {"nis"}


def test_what_passed_a_relief_valve_has_shown_at_the_next_measurement(bucket):
    tracer, pieces, back, live = bucket
    last = np.flatnonzero(np.isfinite(back.track["nis"].values))[-1]
    near = live["status"].values == Status.NEAR_RELIEF
    status = back.track["status"].values
    assert near[:last].sum() > 100
    assert not (status[:last] == Status.NEAR_RELIEF).any()
    assert (near[last:] == (status[last:] == Status.NEAR_RELIEF)).all()
    # A thermometer that is lost meanwhile is said all the same.
    at = int(np.flatnonzero(near)[0])
    piece = Signals.of(pieces[0]).rows(slice(0, last + 1))
    lost = piece["oil_temperature"].values.copy()
    lost[at - 50 : at + 50] = np.nan
    tracer.sensor.start(None)
    without = looked_back(tracer, [piece.replaced({"oil_temperature": lost})], tracer.sensor.state, names=())
    assert without.track["live_status"].values[at] == Status.NEAR_RELIEF
    assert without.track["status"].values[at] == Status.TEMPERATURE_LOST


def test_blocks_change_nothing(bucket, monkeypatch):
    tracer, pieces, *_ = bucket
    short = [Signals.of(pieces[0]).rows(slice(0, 9000))]
    tracer.sensor.start(0.4)
    state = tracer.sensor.state
    whole = looked_back(tracer, short, state)
    monkeypatch.setattr(smoother, "BLOCK", 1000)
    parts = looked_back(tracer, short, state)
    for name in ("position", "position_std", "leak_factor", "position_bound"):
        assert np.abs(whole.track[name].values - parts.track[name].values).max() < 1e-9
    assert parts.state == whole.state
    assert whole.passes == 1, "a start that is known is linearised where it is"


def test_what_is_not_asked_for_is_not_kept(bucket):
    tracer, pieces, *_ = bucket
    tracer.sensor.start(0.4)
    done = []
    short = [Signals.of(pieces[0]).rows(slice(0, 2000))]
    back = looked_back(tracer, short, tracer.sensor.state, names=("velocity",), advance=done.append)
    assert "velocity" in back.track
    assert "load" not in back.track
    assert sum(done) == pytest.approx(ways_of(tracer.sensor.state)) == 2.0
    recalled = Recalled(back)
    first, rest = recalled.followed(short[0].rows(slice(0, 500))), recalled.followed(short[0].rows(slice(500, 2000)))
    assert (len(first), len(rest)) == (500, 1500)
    assert np.array_equal(rest["position"].values, back.track["position"].values[500:])


def test_a_position_that_is_never_known_stays_unknown(bucket):
    tracer, pieces, *_ = bucket
    tracer.sensor.start(None)
    back = looked_back(tracer, [Signals.of(pieces[0]).rows(slice(0, 1000))], tracer.sensor.state)
    assert np.isnan(back.track["position"].values).all()
    assert (back.track["status"].values >= Status.NOT_REFERENCED).all()
    assert (back.text, back.passes) == ("", 1)
    assert ways_of(tracer.sensor.state) == 6


@pytest.mark.parametrize("off", [0.015, -0.015, 0.04, -0.04])
def test_a_wrong_start_is_said_to_be_uncertain_or_is_corrected(off):
    built, name = unit(), TRACES / "unknown" / "bucket_hot"
    log, truth = read_log(f"{name}.csv.gz"), read_truth(f"{name}_truth.csv.gz")
    start = float(truth["position"].values[0])
    track = ramsight.track(built, log, start=start + off, hindsight=True, truth=truth)
    error = np.abs(track["error"].values)
    assert (error <= 1.96 * track["position_std"].values).mean() > 0.93
    assert abs(float(track["position"][0]) - start) < 2.0 * float(track["position_std"][0])
    live = np.abs(track["live_position"].values - track["true_position"].values)
    assert track.attrs["live_error_largest"] == pytest.approx(np.nanmax(live), rel=0.3)
    assert track.attrs["error_p95"] < track.attrs["live_error_p95"]
    assert np.sqrt(np.nanmean(error**2)) < 0.6 * np.sqrt(np.nanmean(live**2))


def test_python_says_both(bucket):
    built, name = unit(), TRACES / "unknown" / "bucket_hot"
    track = ramsight.track(built, name.with_suffix(".csv.gz"), hindsight=True)
    assert np.isfinite(track["position"].values).all()
    assert np.isnan(track["live_position"].values).any()
    assert track["nis"].attrs["units"] == "1"
    assert np.array_equal(track["position"].values, bucket[2].track["position"].values)
    with pytest.raises(DescriptionError, match="sensor = 'balance': has no hypotheses to look back at"):
        ramsight.track(built, name.with_suffix(".csv.gz"), start=0.1, sensor="balance", hindsight=True)


@pytest.mark.slow
def test_the_command_writes_both(tmp_path):
    log, out, figure = TRACES / "unknown" / "bucket_hot.csv.gz", tmp_path / "t.csv", tmp_path / "t.png"
    asked = ["track", "mining-loader", log, "--unit", "bucket", "--hindsight", "--out", out]
    done = at_once(*asked, "--both", "--figure", figure)
    assert done.returncode == 0
    assert "measurements of the place: normalised innovation squared" in done.stdout
    head, first = out.read_text().splitlines()[:2]
    row = dict(zip(head.split(","), first.split(","), strict=True))
    assert row["position_m"]
    assert row["live_position_m"] == ""
    assert row["live_status"] == "not referenced"
    assert "nis" in row
    assert figure.stat().st_size > 10_000
    truth = TRACES / "unknown" / "bucket_hot_truth.csv.gz"
    judged = at_once(*asked, "--truth", truth)
    assert judged.returncode == 0
    assert judged.stdout.count("error against the truth") == 2
    assert "live sensor: error against the truth" in judged.stdout
    assert "live_position_m" not in out.read_text().splitlines()[0]
    refused = at_once(*asked[:5], "--both")
    assert refused.returncode == 2
    assert "--both: needs --hindsight beside it" in refused.stderr


def test_a_state_goes_on_after_a_log_that_was_looked_back_at(tmp_path):
    built, log = unit(), TRACES / "unknown" / "bucket_hot.csv.gz"
    states = [tmp_path / name for name in ("live.state", "hindsight.state")]
    ramsight.track(built, log, start=0.4, state=states[0])
    ramsight.track(built, log, start=0.4, state=states[1], hindsight=True)
    first, second = (ramsight.track(built, log, state=one) for one in states)
    assert np.array_equal(first["position"].values, second["position"].values, equal_nan=True)


def test_a_log_of_another_machine_is_invalid_in_hindsight_as_well():
    built, log = unit(), read_log(TRACES / "unknown" / "bucket_hot.csv.gz")
    log["motor_torque"] = -log["motor_torque"]
    with pytest.warns(ramsight.LogWarning):
        track = ramsight.track(built, log, hindsight=True)
    assert "mistake" in track.attrs
    assert not (track["status"].values == Status.OK).any()


def test_a_log_is_gone_through_again_until_nothing_is_otherwise(bucket):
    tracer, pieces, _, _ = bucket
    inputs = np.concatenate([log_inputs(tracer.sensor, piece) for piece in pieces])
    tracer.sensor.start(None)
    begun, other = (np.array(list(tracer.sensor.state.values())) for _ in range(2))
    other[tracer.sensor.recursion.state.index("position")] = 0.1
    first, whole = (
        Forward.through(tracer, inputs, inputs[:, 0], state, ("position", "position_std"), silent)
        for state in (begun, other)
    )
    was = first.said["position"].copy()
    blocks = first.again(other, silent)
    assert 1 < blocks < first.blocks
    reached = first.span(blocks - 1).stop
    assert np.array_equal(first.said["position"][:reached], whole.said["position"][:reached], equal_nan=True)
    assert np.array_equal(first.said["position"][reached:], was[reached:])
    assert tracer.alike(first.states[blocks], whole.states[blocks], CLOSE)
    off, std = np.abs(first.said["position"] - whole.said["position"])[reached:], whole.said["position_std"][reached:]
    assert (off < 2.0 * CLOSE * std).all()
    assert [one.sample for one in first.innovations.all] == [one.sample for one in whole.innovations.all]
    for number in (0, blocks - 1, blocks):
        assert np.array_equal(first.rows(number)[:, 0], first.said["position"][first.span(number)], equal_nan=True)


@pytest.mark.parametrize(
    ("name", "by", "alike"),
    [
        ("position", 0.09, True),
        ("position", 0.11, False),
        ("hypotheses[0].leakage", -0.11, False),
        ("hypotheses[4].leakage", 0.5, True),
        ("hypotheses[0].covariance[position,position]", 0.15, True),
        ("hypotheses[0].covariance[position,position]", 0.25, False),
        ("hypotheses[0].log_weight", -1.0, False),
    ],
)
def test_states_are_alike_within_a_tenth_of_what_is_unknown(bucket, name, by, alike):
    """Of the likeliest hypothesis; one of the chance 0.0005 may be anywhere."""
    tracer, _, back, _ = bucket
    state = np.array(list(back.state.values()))
    order, other = tracer.sensor.recursion.state, state.copy()
    assert tracer.alike(state, state, 1e-12)
    quantity, place = name.rpartition(".")[2], order.index(name)
    variance = f"hypotheses[0].covariance[{quantity},{quantity}]"
    unit = math.sqrt(state[order.index(variance)]) if variance in order else state[place] if "[p" in name else 1.0
    other[place] += by * unit
    assert tracer.alike(state, other, CLOSE) == alike
    other[order.index(IS_REFERENCED)] = 0.0
    assert not tracer.alike(state, other, 10.0)


def test_kinds_are_those_of_the_sensor():
    tracer = Tracer.of(unit())
    assert tracer.kinds == KINDS
    assert len(tracer.kinds) == tracer.layout.hypotheses
    assert KINDS[-1] == Kind.UNKNOWN_POSITION
