"""Hypotheses of what is wrong with a report: each against data made for it, and where nothing can tell them apart."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ramsight
from ramsight.duty.faults import Fault, inject
from ramsight.engine.typed_state import column, symbols
from ramsight.sensor.checks.diagnosis import (
    KINDS,
    DiagnosisState,
    Evidence,
    Pair,
    diagnose,
    gain_of,
    gathered,
    likelihoods,
    offset_of,
    probabilities,
)
from ramsight.sensor.status import Status
from ramsight.tracking.named_faults import FaultNames, NamedFault, named_faults
from ramsight.tracking.pieces import Tally

MOST, STD = 400.0, 0.3
MOVES = 150.0 * np.sin(0.3 * np.arange(60))


def of(y, x, std=STD):
    sums = Evidence()
    for one, other in zip(y, x, strict=True):
        sums = gathered(sums, ca.DM(float(one)), ca.DM(float(other)), ca.DM(std), 1.0, MOST)
    return sums


def chances(y, x, **how):
    return dict(zip(KINDS, (float(p) for p in probabilities(of(y, x), MOST, **how)), strict=True))


NOISE = STD * np.random.default_rng(3).standard_normal(60)


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        ("gain", 1.3 * MOVES), ("gain", 0.6 * MOVES), ("offset", MOVES + 10.0), ("offset", MOVES - 40.0),
        ("sign", -MOVES), ("stuck", np.full(60, 77.0)), ("other", 300.0 * np.cos(1.7 * np.arange(60))),
    ],
)  # fmt: skip
def test_each_kind_is_found_on_data_made_for_it(kind, wrong):
    noise = 0.0 if kind == "stuck" else NOISE
    found = chances(wrong + noise, MOVES)
    assert found[kind] > 0.999, found
    assert sum(found.values()) == pytest.approx(1.0)


def test_a_steady_level_tells_no_gain_from_an_offset_and_says_so():
    found = chances(np.full(500, 130.0), np.full(500, 100.0))
    assert found["gain"] > 0.1
    assert found["offset"] > 0.02
    assert max(found.values()) < 0.95
    assert found["sign"] < 1e-6


def test_more_of_the_same_is_no_evidence_for_what_fits_better_than_its_noise():
    """A report that repeats itself is not stuck for that."""
    few, many = (chances(np.full(n, 130.0), np.full(n, 100.0))["stuck"] for n in (50, 5000))
    assert few == pytest.approx(many, rel=0.05)


def test_a_report_without_noise_is_not_stuck_for_that():
    """At a steady speed one that is rounded repeats itself, and the other one trembles."""
    found = chances(np.full(60, 130.0), np.full(60, 100.0) + NOISE)
    assert found["stuck"] < 0.5, found


def test_gain_and_offset_are_those_of_least_squares():
    y = 1.3 * MOVES + 4.0 + NOISE
    sums = of(y, MOVES)
    assert float(gain_of(sums)) == pytest.approx(float(MOVES @ y / (MOVES @ MOVES)), rel=1e-9)
    assert float(offset_of(sums)) == pytest.approx(float(np.mean(y - MOVES)), rel=1e-9)


def test_the_evidence_of_a_gain_is_that_of_its_marginal_normal():
    """Against the density of y itself, covariance sigma^2 + 0.25 x x', that no formula of the module makes."""
    x, y = MOVES[:5], 0.6 * MOVES[:5] + 3.0 * NOISE[:5]
    covariance = STD**2 * np.eye(5) + 0.25 * np.outer(x, x)
    apart = y - x
    exact = -0.5 * (apart @ np.linalg.solve(covariance, apart) + np.linalg.slogdet(covariance)[1])
    exact += 5 * np.log(STD)
    assert float(likelihoods(of(y, x), MOST)[0]) == pytest.approx(exact, rel=1e-9)


def test_a_sign_may_be_wrong_by_as_much_as_a_gain_is_unknown():
    assert chances(-1.03 * MOVES, MOVES, gain=0.0)["gain"] > 0.9
    assert chances(-1.03 * MOVES, MOVES, gain=0.03)["sign"] > 0.9


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-400.0, 400.0), st.floats(-400.0, 400.0)), min_size=1, max_size=30),
    st.floats(1e-3, 50.0),
)
def test_probabilities_are_probabilities_whatever_is_reported(pairs, std):
    y, x = np.array(pairs).T
    found = [float(p) for p in probabilities(of(y, x, std), MOST)]
    assert all(0.0 <= p <= 1.0 for p in found)
    assert sum(found) == pytest.approx(1.0)


def followed(y, x, alarm, other=None, h=0.02, least=3.0):
    """Outputs of a sensor's step, sample by sample."""
    signals = [ca.SX.sym(name) for name in ("y", "x", "alarm", "other")]
    pair = Pair("speed", "rad/s", signals[0], signals[1], STD, 0.0, ca.SX(1.0), MOST, least)
    state, sample = symbols(DiagnosisState()), SimpleNamespace(elapsed=ca.SX(h))
    after, more = diagnose(state, sample, pair, signals[2], ca.SX(0.0), signals[3])
    outputs = ca.vertcat(*(value for value, _ in more.values()))
    step = ca.Function("step", [column(state), *signals], [column(after), outputs])
    z, rows = ca.DM.zeros(column(state).numel()), []
    for k in range(len(y)):
        z, out = step(z, y[k], x[k], alarm[k], 0.0 if other is None else other[k])
        rows.append(np.array(out).ravel())
    return dict(zip(more, np.array(rows).T, strict=True))


def test_nothing_is_said_without_a_contradiction():
    found = followed(1.3 * MOVES, MOVES, np.zeros(60))
    assert all(not found[f"speed_{kind}_probability"].any() for kind in KINDS)
    assert set(found["speed_gain"]) == {1.0}
    assert set(found["speed_offset"]) == {0.0}


def test_a_contradiction_begins_its_sums_anew():
    alarm = np.ones(60)
    alarm[28:30] = 0.0
    y = np.where(np.arange(60) < 28, -MOVES, 1.3 * MOVES)
    found = followed(y, MOVES, alarm)
    assert found["speed_sign_probability"][27] > 0.99
    assert found["speed_gain_probability"][-1] > 0.99


def test_samples_after_the_fault_do_not_blur_it():
    """An alarm outlasts its fault by some seconds, in which both reports agree."""
    x = np.tile(MOVES + 200.0, 4)
    y = np.where(np.arange(240) < 60, 1.3 * x, x)
    y[60] = 1.15 * x[60]  # a mean over the sample in which it ended
    found = followed(y, x, np.ones(240))
    assert found["speed_gain_probability"][-1] > 0.99
    assert found["speed_gain"][-1] == pytest.approx(1.3, abs=1e-3)
    y[200:] += 5.0  # a ramp, in which a late report differs a little
    assert followed(y, x, np.ones(240))["speed_gain_probability"][-1] > 0.99


def test_the_other_report_is_named_where_that_one_is_wrong():
    known = np.arange(60) < 40  # and not known to the end
    found = followed(MOVES, 1.3 * MOVES, np.ones(60), known)
    assert found["speed_gain_probability"][-1] > 0.99
    assert found["speed_gain"][-1] == pytest.approx(1.3, abs=1e-9)


@pytest.mark.parametrize(("unit", "load"), [("boom", "200 kN"), ("bucket", "90 kN")])
def test_a_torque_is_named_by_what_the_power_has_after_all_losses(unit, load):
    """Boom and bucket lift by turning either way; copper losses are a tenth of what a slow shaft takes."""
    where = f"units.{unit}.assumptions"
    loader = ramsight.load_machine("mining-loader").replace(
        {f"{where}.shaft.std": "0.05 deg", f"{where}.power.std": "0.5 %"}
    )
    moves = {"load": load, "speed": "700 rpm", "cycles": 2, "hold": "8 s"}
    run = ramsight.simulate(loader, "lift-lower", unit=unit, **moves)
    log = ramsight.drive_report(run, loader, unit=unit)
    lifts = log["time"].values[(log["motor_speed"].values * log["motor_torque"].values > 0.0) & (log["time"] > 20.0)]
    for kind, size in (("gain", 1.3), ("offset", 8.0 if unit == "boom" else -8.0)):
        wrong = inject(log, Fault(kind, lifts[0], lifts[0] + 8.0, "motor_torque", size), 0)
        track = ramsight.track(loader, wrong, unit=unit, start=float(run["position"][0]))
        (one,) = (name for name in named_faults(track) if name.first < lifts[0] + 8.0)
        assert (one.signal, one.or_else) == ("motor torque", "DC power")
        assert kind in one.kinds
        assert getattr(one, kind) == pytest.approx(size, rel=0.05)


def tracked(kinds, status, gain=1.3, signal="speed"):
    import xarray

    n = len(status)
    values = {f"{signal}_{kind}_probability": ("time", kinds.get(kind, np.zeros(n))) for kind in KINDS}
    values |= {f"{signal}_gain": ("time", np.full(n, gain)), f"{signal}_offset": ("time", np.full(n, 12.0))}
    return xarray.Dataset({**values, "status": ("time", status)}, {"time": 0.1 * np.arange(n)})


def test_a_fault_is_named_by_all_that_came_together_until_its_end():
    status = np.full(60, int(Status.SPEED_WRONG))
    gain = np.r_[np.full(10, 0.8), np.full(50, 0.99)]
    one = named_faults(tracked({"gain": gain, "stuck": np.r_[np.full(10, 0.2), np.full(50, 0.01)]}, status))
    assert one == [NamedFault("motor speed", "", ("gain",), 1.3, 12.0, "rad/s", 0.0, pytest.approx(5.9))]
    assert one[0].text == "motor speed: 1.30 times what it should be, from 0.0 s to 5.9 s"


def test_what_nobody_can_tell_is_named_with_all_that_is_left():
    status = np.full(20, int(Status.TORQUE_CONTRADICTED))
    (one,) = named_faults(tracked({"gain": np.full(20, 0.5), "offset": np.full(20, 0.5)}, status, signal="torque"))
    said = "motor torque: 1.30 times what it should be or off by +12 N m (unless it is DC power that is wrong), from"
    assert one.text.startswith(said)


@pytest.mark.parametrize("signal", ["speed", "torque"])
def test_the_summary_of_a_track_names_a_fault_in_a_line_of_its_own(signal):
    whole = tracked({"gain": np.ones(20)}, np.full(20, int(Status.TORQUE_CONTRADICTED)), signal=signal)
    whole = whole.assign(position=("time", np.ones(20))).assign_attrs(sensor="kalman")
    tally = Tally()
    tally.append(whole)
    assert tally.text.splitlines()[-1] == f"  {named_faults(whole)[0].text}"


def test_pieces_of_a_track_give_the_names_of_the_whole():
    status = np.full(200, int(Status.COUNTER_WRONG))
    sign = np.zeros(200)
    sign[20:60] = sign[120:180] = 1.0
    whole = tracked({"sign": sign}, status)
    pieces = FaultNames()
    for begin in range(0, 200, 17):
        pieces.append(whole.isel(time=slice(begin, begin + 17)))
    assert pieces.close() == named_faults(whole)
    assert [one.signal for one in named_faults(whole)] == ["the shaft's counter"] * 2
