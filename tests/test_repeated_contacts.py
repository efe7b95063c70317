"""Contacts that are repeated: what they have in common counts once, however often; what is new counts in full."""

import math

import casadi as ca
import numpy as np
import pytest

import ramsight
from ramsight.expression import scalar
from ramsight.sensor.belief.measurement import Applied, log_density, tempered
from ramsight.sensor.kalman import kalman

ROUGHLY = {"rel": 1e-12, "abs": 1e-12}


def gain(misfits, variances, counts, otherwise=-1e3):
    """By how much each hypothesis becomes likelier that misses a measurement by so many of its standard deviations."""
    each = []
    for misfit, variance in zip(misfits, variances, strict=True):
        likelihood = log_density(scalar(misfit**2 * variance), variance)
        wide, normal = scalar(variance), scalar(misfit**2)
        each.append(Applied(None, scalar(1.0) > 0.0, normal, likelihood, likelihood, wide, scalar(otherwise)))
    return [float(ca.evalf(one)) for one in tempered(each, scalar(counts))]


@pytest.mark.parametrize(("misfits", "variances"), [((0.3, 2.0), (1e-6, 3e-6)), ((0.0, 5.0), (1e-6, 4e-2))])
def test_the_first_contact_counts_as_its_likelihood(misfits, variances):
    pairs = zip(misfits, variances, strict=True)
    expected = [-0.5 * (misfit**2 + math.log(2.0 * math.pi * variance)) for misfit, variance in pairs]
    assert gain(misfits, variances, 1.0) == pytest.approx(expected, **ROUGHLY)


def test_a_thousandth_that_is_repeated_is_none():
    one, other = gain((0.1, 0.1), (1e-6, 1.002e-6), 1e-4)
    assert 0.0 < one - other < 1e-6


@pytest.mark.parametrize("counts", [1e-4, 1.0])
def test_what_is_beyond_a_deviation_or_e_times_as_wide_counts_in_full(counts):
    fits, misses = gain((0.0, 4.0), (1e-6, 1e-6), counts)
    assert fits - misses == pytest.approx(0.5 * (15.0 + counts), **ROUGHLY)
    sure, unsure = gain((0.0, 0.0), (1e-6, math.e**3 * 1e-6), counts)
    assert sure - unsure == pytest.approx(0.5 * (2.0 + counts), **ROUGHLY)


def test_what_explains_a_measurement_otherwise_counts_as_it_is():
    assert gain((50.0, 0.0), (1e-6, 1e-6), 1e-4, otherwise=-0.5)[0] == -0.5


@pytest.fixture(scope="module")
def cycle():
    """From rest on the retracted end to the other one and back to the same rest: 79 s that repeat exactly."""
    boom = ramsight.build("mining-loader", "boom")
    run = ramsight.simulate(boom, ramsight.duty_for(boom, "commissioning"))
    log, position = ramsight.drive_report(run, seed=3), run["position"].values
    rests = np.flatnonzero((np.abs(log["motor_speed"].values) < 1e-9) & (position < 2e-4))
    first, last = rests[90], rests[190]
    return boom, log.isel(time=slice(first, last)), position[first:last]


@pytest.mark.slow
def test_a_cycle_that_repeats_for_hours_makes_nothing_likelier(cycle):
    boom, log, true = cycle
    sensor, period = kalman(boom), 0.02 * len(true)
    sensor.start(float(true[0]))
    chances = []
    for k in range(240):
        again = log.assign_coords(time=np.arange(len(true)) * 0.02 + k * period)
        track = sensor.track(again)
        chances.append(float(track["described_probability"][-1]))
    assert abs(chances[-1] - chances[30]) < 0.01, "200 repetitions are no evidence"
    assert np.abs(track["position"].values - true).max() < 1e-3
