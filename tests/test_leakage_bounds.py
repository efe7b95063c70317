"""Estimates of the leakage's law that no machine has, as impossible inputs once left them, do not overflow."""

import casadi as ca
import numpy as np
import pytest

from ramsight import machine
from ramsight.engine.recursion import replay
from ramsight.plant.ddh import build_ddh
from ramsight.sensor.belief.hypothesis import BOUNDS, Hypothesis
from ramsight.sensor.circuit.leakage import Leakage
from ramsight.sensor.kalman import kalman
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.status import Status
from ramsight.sensor.thresholds import LEAK_FACTOR_LEAST, LEAK_FACTOR_MOST


@pytest.mark.parametrize(("lag", "exponent"), [(78869.6, -49.1), (-28990.0, -10.96), (20.1, 5.02), (0.0, 1e30)])
def test_no_estimate_makes_leakage_other_than_a_machine_s(lag, exponent):
    law = Leakage(change=0.1, rate=1e-3, per_kelvin=0.04, by_exponent=0.9)
    scale = float(law.scale({Quantity.LAG: lag, Quantity.EXPONENT: exponent}))
    most = LEAK_FACTOR_MOST / LEAK_FACTOR_LEAST
    assert 1.0 / most <= scale * (1.0 + 1e-12)
    assert scale <= most * (1.0 + 1e-12)


def test_usual_estimates_are_not_touched():
    law = Leakage(change=0.1, rate=-2e-3, per_kelvin=0.04, by_exponent=2.0)
    scale = float(law.scale({Quantity.LAG: 100.0, Quantity.EXPONENT: 0.3}))
    assert scale == pytest.approx(np.exp(-0.2 + 0.6), rel=1e-15)


def test_a_correction_leaves_every_estimate_of_the_machine_within_its_bounds():
    names = list(BOUNDS)
    assert {Quantity.LEAKAGE, Quantity.LAG, Quantity.EXPONENT} <= set(names)
    changed = Hypothesis(mean={one: ca.SX(1.0) for one in names}, covariance=None, log_weight=ca.SX(0.0)).corrected(
        None, {one: ca.SX(1e9 * (-1.0) ** k) for k, one in enumerate(names)}
    )
    for k, one in enumerate(names):
        assert float(changed.mean[one]) == BOUNDS[one][0 if k % 2 else 1]


@pytest.mark.parametrize("exponent", [-1e3, 1e3])
def test_a_sensor_with_such_estimates_still_says_numbers(exponent):
    """Of the state that the balance had no number for: here the status was *state invalid* at once."""
    sensor = kalman(build_ddh("boom", machine.load_machine("mining-loader").unit("boom")))
    time = np.arange(0.0, 20.0, 0.02)
    speed = np.interp(time, [5.0, 6.0, 19.0, 20.0], [0.0, 150.0, 150.0, 0.0])
    rows = np.column_stack([time, speed, np.full_like(time, 40.0), np.full_like(time, 313.0), 0.0 * time, 0.0 * time])
    sensor.start(0.1)
    state = np.array([sensor.state[name] for name in sensor.recursion.state])
    for k, name in enumerate(sensor.recursion.state):
        if name.startswith("hypotheses["):
            state[k] = {"exponent": exponent, "lag": 78869.6}.get(name.partition(".")[2], state[k])
    said = replay(sensor.recursion, np.ascontiguousarray(rows), sensor.parameters, state)
    assert np.isfinite(said).all()
    assert not (said[:, 4] == Status.STATE_INVALID).any()
