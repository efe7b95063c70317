"""The flow law against the plant's pump, its fit against what made the data, and a real pump where its data are."""

import json
import math
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.flow_law import columns, fit, root
from ramsight.calibration.identify_balance import sandwich, student

from .pump_curves import catalogue_pump

ROOT = Path(__file__).parent.parent
DATA = Path(os.environ.get("RAMSIGHT_DATA", ROOT.parent / "shared" / "data")) / "uci_hydraulic"
PUMP = catalogue_pump("PGI100-2-016")


@given(
    speed=st.floats(-400.0, 400.0),
    rise=st.floats(-250e5, 250e5),
    viscosity=st.floats(5e-6, 500e-6),
    wear=st.floats(0.5, 3.0),
    orifice=st.floats(1e-12, 1e-8),
)
def test_the_law_is_the_plants(speed, rise, viscosity, wear, orifice):
    worn = replace(PUMP, leak_factor=wear, orifice_leak=orifice)
    law = np.array([PUMP.displacement, wear * PUMP.leak_coefficient(1.0, 1.0), orifice])
    expected = float(worn.flow(speed, rise, viscosity, 872.0))
    assert float(columns(speed, rise, 872.0 * viscosity) @ law) == pytest.approx(expected, rel=1e-9, abs=1e-15)


@given(rise=st.floats(-300e5, 300e5))
def test_the_root_is_odd_and_one_but_near_zero(rise):
    found = float(root(rise))
    assert found == -float(root(-rise))
    if abs(rise) > 1e5:
        assert found == pytest.approx(math.copysign(math.sqrt(abs(rise)), rise), rel=1e-3, abs=0.0)
    else:
        assert abs(found) <= math.sqrt(abs(rise)) * (1.0 + 1e-9)


def test_the_root_is_straight_near_zero():
    slopes = [float(root(rise)) / rise for rise in (1e-3, 1e-2, 1.0)]
    assert slopes == pytest.approx([slopes[0]] * 3, rel=1e-3)
    assert float(root(0.0)) == 0.0


@given(rise=st.floats(1e5, 300e5), viscosity=st.floats(0.005, 0.5))
def test_only_the_gaps_know_the_viscosity(rise, viscosity):
    thin, thick = columns(0.0, rise, viscosity), columns(0.0, rise, 2.0 * viscosity)
    assert float(thick[1]) == pytest.approx(0.5 * float(thin[1]))
    assert float(thick[2]) == float(thin[2])
    assert float(thin[1]) < 0.0
    assert float(thin[2]) < 0.0


def _bench(seed, clusters=60, each=5):
    """Flows of a known law with noise that a cluster shares."""
    random = np.random.default_rng(seed)
    cluster = np.repeat(np.arange(clusters), each)
    speed, rise = random.uniform(50, 200, cluster.size), random.uniform(20e5, 200e5, cluster.size)
    design = columns(speed, rise, random.uniform(0.01, 0.06, cluster.size))
    law = np.array([5e-6, 1.2e-13, 3e-9])
    noise = 2e-6 * random.standard_normal(clusters)[cluster] + 1e-6 * random.standard_normal(cluster.size)
    return design, design @ law + noise, cluster, law


def test_intervals_hold_the_truth_though_errors_come_in_clusters():
    held = np.zeros(3)
    for seed in range(100):
        design, flow, cluster, true = _bench(seed)
        found = fit(design, flow, cluster)
        held += np.abs(found.value - true) <= found.half_width
    assert np.all(held >= 88)


def test_a_fit_does_not_depend_on_units():
    design, flow, cluster, _ = _bench(1)
    plain, scaled = fit(design, flow, cluster), fit(design * [1.0, 1e-9, 1e3], flow, cluster)
    assert scaled.value * [1.0, 1e-9, 1e3] == pytest.approx(plain.value, rel=1e-9, abs=0.0)
    assert scaled.half_width * [1.0, 1e-9, 1e3] == pytest.approx(plain.half_width, rel=1e-9, abs=0.0)


def test_what_cannot_be_told_apart_is_refused():
    design, flow, cluster, _ = _bench(1)
    with pytest.raises(ValueError, match="tell"):
        fit(np.column_stack([design, design[:, 0]]), flow, cluster)
    with pytest.raises(ValueError, match="clusters"):
        fit(design, flow, np.zeros_like(cluster))


def test_students_quantile():
    from scipy.stats import t

    for freedom in (3, 5, 10, 30, 1000):
        assert student(freedom) == pytest.approx(t.ppf(0.975, freedom), rel=6e-3)
    assert student(math.inf) == pytest.approx(1.96, abs=1e-3)


@pytest.mark.skipif(not (DATA / "FS1.csv.gz").exists(), reason="the data of the real pump are not here")
def test_a_real_pump_obeys_the_law(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(ROOT / "evaluation"), *sys.path])
    import real_oil

    found = real_oil.study(DATA)
    assert found["residual_percent"] <= 0.3
    assert abs(found["bias_percent"]) <= 0.5
    assert found["auc_0_1"] >= 0.99
    assert found["auc_1_2"] >= 0.99
    written = json.loads((ROOT / "results" / "study.json").read_text())["real_oil"]
    assert found == pytest.approx(written, rel=1e-6, abs=0.0)


def test_of_one_row_a_cluster_the_covariance_is_that_of_a_mean():
    """With a design of ones and every row for itself: the sum of squares over n (n - 1), Bessel's correction in it."""
    drawn = np.random.default_rng(3).standard_normal(7)
    residual = drawn - drawn.mean()
    found = sandwich(np.ones((7, 1)), residual, np.arange(7))
    assert found[0, 0] == pytest.approx(drawn.var(ddof=1) / 7, rel=1e-12)
