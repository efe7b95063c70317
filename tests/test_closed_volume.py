"""What stops and starts of the motor against a closed valve tell of leakage and compliance."""

import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.stats import norm

from ramsight import machine
from ramsight.closed_loop.loop import UnitLoop
from ramsight.closed_loop.planning import learned_covariance, learned_factors
from ramsight.closed_loop.referencing import LoopSettings
from ramsight.duty import DriveReport, lift_lower, report, simulate
from ramsight.logs import read_log
from ramsight.plant.as_built import AsBuilt
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.sensor.belief.closed_volume import (
    _INNOVATION,
    _NAMES,
    _NUISANCES,
    _PAIRS,
    EVENT_QUANTITIES,
    EventState,
    _event,
)
from ramsight.sensor.belief.hypothesis import BOUNDS, Hypothesis
from ramsight.sensor.belief.measurement import Measurement, applied
from ramsight.sensor.contacts.mode import Mode
from ramsight.sensor.covariance import Covariance
from ramsight.sensor.kalman import kalman
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.thresholds import EFFICIENCY_STD, EVENT_COUNTS, EVENT_MOVING_STD, EVENT_STANDING_STD, SURE_STDS
from ramsight.units import RPM

TRACES = Path(__file__).parent / "traces"


def summed(rows, innovations):
    """The state after samples with these derivatives and innovations, each over its standard deviation."""
    normal = {f"{i},{j}": ca.DM(float(rows[i] @ rows[j])) for i, j in _PAIRS}
    right = {i: ca.DM(float(rows[i] @ innovations)) for i in _NAMES}
    return EventState(
        active=ca.DM(1), stands=ca.DM(1), torque=ca.DM(0), offset=ca.DM(0), last={}, normal=normal, right=right
    )


@pytest.mark.parametrize("stands", [0, 1])
def test_an_event_is_the_least_squares_estimate_of_its_best_known_combination(stands):
    """With nuisances as further unknowns of a prior of one, against numpy's solution of the whole problem."""
    rng = np.random.default_rng(3)
    rows = {one: rng.normal(size=40) for one in _NAMES}
    rows[EVENT_QUANTITIES[1]] = -rows[EVENT_QUANTITIES[0]] + 0.05 * rng.normal(size=40)
    innovations = 0.1 * rows[EVENT_QUANTITIES[0]] + 0.4 * rows["offset"] + 0.05 * rng.normal(size=40)
    state = summed(rows, innovations)
    state = EventState(**{**vars(state), "stands": ca.DM(stands)})
    event = _event(state, ca.DM(1), ca.DM(0.0), {})
    a = np.array([[rows[i] @ rows[j] for j in _NAMES] for i in _NAMES])
    a += np.diag([0.0] * len(EVENT_QUANTITIES) + [1.0] * len(_NUISANCES))
    covariance = np.linalg.inv(a)
    estimate = covariance @ np.array([rows[i] @ innovations for i in _NAMES])
    floor = (EVENT_STANDING_STD if stands else EVENT_MOVING_STD) ** 2
    known = np.linalg.inv(covariance[:2, :2] + floor * np.eye(2))  # the model's error comes on top
    assert float(event.R) == pytest.approx(1.0 / known[0, 0], rel=1e-6)
    assert float(event.H[EVENT_QUANTITIES[1]]) == pytest.approx(known[0, 1] / known[0, 0], rel=1e-6)
    assert float(event.innovation) == pytest.approx(known[0] @ estimate[:2] / known[0, 0], rel=1e-6)


def test_what_all_events_share_is_in_each_of_them():
    """Friction makes both factors of a start too small; a drive that releases its torque is seen by stops alone."""
    rng = np.random.default_rng(4)
    rows = {one: rng.normal(size=20) for one in _NAMES}
    for stands in (0.0, 1.0):
        state = EventState(**{**vars(summed(rows, rows[EVENT_QUANTITIES[0]])), "stands": ca.DM(stands)})
        event = _event(state, ca.DM(1), ca.DM(0.0), {})
        row = {one: float(by) for one, by in event.H.items()}
        friction = EFFICIENCY_STD * (row[Quantity.LEAKAGE] + row[Quantity.COMPLIANCE])
        assert abs(float(event.common)) == pytest.approx(0.0 if stands else abs(friction))
        assert row[Quantity.RELEASE] == stands
    assert _INNOVATION not in _NAMES


@pytest.mark.parametrize("leak", [0.8, 1.25])
def test_a_machine_that_leaks_otherwise_shows_it_without_a_reference(boom, leak):
    built = AsBuilt(leak=leak).apply(boom)
    run = simulate(built, lift_lower(built, 350e3, 313.15, cycles=8))
    sensor = kalman(boom)
    sensor.start(float(run["position"][0]))
    track = sensor.track(report(run, DriveReport(seed=1)))
    factor, std = float(track["leak_factor"][-1]), float(track["leak_factor_std"][-1])
    assert factor == pytest.approx(leak, abs=2.0 * std)
    assert std < 0.6 * boom.assumptions.machine.leak
    assert float(track["compliance_factor"][-1]) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(("release", "most"), [(0.05, 3.5), (0.1, 2.0), (0.3, 2.0)])
def test_a_drive_that_releases_its_torque_is_no_leak(boom, trace, release, most):
    """The reported torque sinks at standstill by a time constant of the drive's own [s]."""
    case = trace("boom_441kN_40C_x20")
    log = read_log(case.log).copy(deep=True)
    time, torque = log["time"].values, log["motor_torque"].values.copy()
    stands = np.abs(log["motor_speed"].values) < 0.2
    begun = 0.0
    for k in range(len(time)):
        begun = begun if stands[k] and k and stands[k - 1] else time[k]
        torque[k] *= np.exp(-(time[k] - begun) / release) if stands[k] else 1.0
    log["motor_torque"] = ("time", torque, log["motor_torque"].attrs)
    sensor = kalman(boom)
    sensor.start(None)
    track = sensor.track(log)
    for second in (30.0, 60.0, 120.0):
        k = int(np.searchsorted(time, second))
        off = abs(float(track["leak_factor"][k]) - 1.0)
        assert off < most * float(track["leak_factor_std"][k])


def test_a_valve_that_opens_early_is_no_soft_oil(boom):
    """A load that became lighter at rest: the torque stays behind from where its valve opens."""
    log = TRACES / "person" / "person_boom_datasheet.csv.gz"
    sensor = kalman(boom)
    sensor.start(None)
    track = sensor.track(read_log(log))
    k = int(np.searchsorted(track["time"].values, 30.0))
    assert float(track["leak_factor"][k]) == pytest.approx(1.0, abs=2.0 * float(track["leak_factor_std"][k]))
    assert float(track["compliance_factor"][k]) < 1.15


@pytest.mark.parametrize("seed", [1, 3])
def test_a_speed_that_trembles_at_standstill_is_a_standstill(seed):
    """Reports of 1 rpm either way break no stop into moves, whose torque would count as known to 3 %."""
    lift = build(machine.load_machine("forklift-mast").unit("lift"), "lift")
    noisy = DriveReport(speed_step=RPM, speed_noise=RPM)
    loop = UnitLoop(lift, lift, 0.5, 0.4 * limits_of(lift).load, LoopSettings(known=True, seed=seed, report=noisy))
    for target in (0.9, 0.3, 1.0, 0.4):
        loop.go({"lift": target})
        loop.rest(1.0)
    leak, _ = learned_factors(loop.sensors["lift"])
    std = float(np.sqrt(learned_covariance(loop.sensors["lift"])[1, 1]))
    assert std < 0.14, "stops taught something"
    assert abs(leak - 1.0) < 1.5 * std


def evidence(missing, known, std=0.05, common=0.0):
    """By how much an event that is off by so much makes a hypothesis likelier that knows the leakage so well."""
    mean = {one: ca.DM(0.0) for one in (Quantity.POSITION, *BOUNDS)}
    of = Hypothesis(
        mean=mean,
        covariance=Covariance.diagonal({one: known if one == Quantity.LEAKAGE else 0.0 for one in mean}),
        log_weight=ca.DM(0.0),
    )
    event = Measurement(
        use=ca.DM(1), innovation=ca.SX(missing), H={Quantity.LEAKAGE: 1.0}, R=ca.SX(std**2), gate=SURE_STDS,
        power=EVENT_COUNTS, common=common,
    )  # fmt: skip
    return float(ca.evalf(applied(of, event).evidence))


@pytest.mark.parametrize("off", [0.0, 0.05, 0.2, 1.0])
def test_an_event_weighs_hypotheses_by_a_power_of_its_likelihood_or_of_something_else(off):
    for known in (0.01, 0.3):
        scale = np.hypot(0.05, known)
        gate = norm.logpdf(SURE_STDS * scale, 0.0, scale)
        assert evidence(off, known) == pytest.approx(EVENT_COUNTS * max(norm.logpdf(off, 0.0, scale), gate))


def test_one_event_makes_a_sure_leakage_unlikely_and_never_impossible():
    """Twenty deviations off against an event that another hypothesis expects: odds of some to one, no more."""
    sure, wide = (evidence(1.0, known) for known in (0.0, 0.6))
    assert math.log(1.5) < wide - sure < math.log(100.0)


def test_what_all_events_share_refutes_no_hypothesis():
    assert evidence(0.1, 0.0, std=0.01) < evidence(0.1, 0.0, std=0.01, common=0.1) + 1.0


def test_stops_and_starts_tell_a_wrong_start_from_a_machine_that_leaks_more(boom):
    """Entered 30 mm too high, the first contact is explained by leakage, and leakage is what the motor's stops tell."""
    sensor = kalman(boom, boom.assumptions.replace({"stops.undeclared": 1e-4}))
    log = read_log(TRACES / "unknown" / "boom_nominal.csv.gz").sel(time=slice(0.0, 268.0))
    sensor.start(0.13)
    track = sensor.track(log)
    held = np.isin(track["mode"].values, (Mode.HELD_RETRACTING, Mode.HELD_EXTENDING))
    left = int(np.argmax(held)) + int(np.argmin(held[int(np.argmax(held)) :]))
    after, later = (float(track.unknown_position_probability.values[k]) for k in (left, -1))
    assert track.described_probability.values[left] > 0.5
    assert track.leak_factor.values[left] > 1.15, "the first contact is explained by leakage"
    assert later > 2.0 * after
    assert not (track.status.values[: int(np.argmax(held))] == 0).any()
