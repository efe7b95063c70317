"""Values of a description from runs with a measured position: they stay within what can be."""

from dataclasses import replace

import numpy as np
import pytest

import ramsight
from ramsight import machine
from ramsight.calibration import fit_track as fitting
from ramsight.calibration.fit_track import MeasuredRun
from ramsight.calibration.free_values import FreeValue, free_values, with_values
from ramsight.calibration.identify_report import map_with
from ramsight.logs.channel_map import load_map
from ramsight.logs.mapped import SensorCurve

RIG = machine.load_machine("eha-valve-rig")
GIVE = "parts.hose_a.effective_bulk_modulus"


def free(*keys):
    return free_of(RIG, *keys)


def free_of(described, *keys):
    return tuple(one for one in free_values(described.unit("axis")) if one.key in keys)


@pytest.fixture
def few_draws(monkeypatch):
    """Enough for what does not hang on how many there are."""
    monkeypatch.setattr(fitting, "DRAWS", 4)


@pytest.fixture(scope="module")
def run():
    """A run of the rig, with its position."""
    simulated = ramsight.simulate(RIG, unit="axis", load=2e3, cycles=1)
    return MeasuredRun("light", ramsight.drive_report(simulated, seed=1), simulated[["position"]])


def test_a_value_goes_no_further_than_a_description_may(run):
    (give,) = free(GIVE)
    model = fitting._Model(RIG, "axis", [run], (give,))
    near = np.array([0.3, 0.0, 0.0])
    np.testing.assert_array_equal(model.possible(near), near)
    far = model.possible(np.array([-20.0, 0.0, 0.0]))
    assert give.at(far[0]) == pytest.approx(1e6, rel=1e-3), "the least that a hose may have"
    with_values(RIG, "axis", {give.key: give.at(float(far[0]))})


@pytest.mark.slow
@pytest.mark.usefixtures("few_draws")
def test_no_interval_holds_what_cannot_be(run):
    bore = RIG.unit("axis").cylinder.bore
    narrow = RIG.replace({"units.axis.cylinder.rod": 0.98 * bore})
    found = fitting.fit_track(narrow, "axis", [run], free_of(narrow, "cylinder.rod"))
    value, low, high = found.values["cylinder.rod"]
    assert 0.0 < low < value <= high < bore
    assert high == pytest.approx(bore, rel=1e-3), "5 % of a rod reach beyond this bore"


def test_an_efficiency_is_found_by_what_it_lacks():
    one = FreeValue("parts.pump.volumetric_efficiency", 0.9, 0.7, loss=True)
    assert one.at(0.0) == pytest.approx(0.9)
    assert one.at(np.log(2.0)) == pytest.approx(0.8)


@pytest.fixture(scope="module")
def softer():
    """The rig with a hose that gives half as much again and a pump that moves 3 % more, light and heavily loaded."""
    true = RIG.replace({f"units.axis.{GIVE}": "10 MPa", "units.axis.parts.pump.displacement": "1.627 cm3/rev"})
    runs = [ramsight.simulate(true, unit="axis", load=load, cycles=1) for load in (2e3, 9e3)]
    logs = [
        ramsight.drive_report(one, torque_noise="0.01 N m", torque_step="0.01 N m", seed=k)
        for k, one in enumerate(runs)
    ]
    return [MeasuredRun(str(k), log, one[["position"]]) for k, (log, one) in enumerate(zip(logs, runs, strict=True))]


@pytest.mark.slow
def test_values_are_found_within_their_intervals(softer):
    shares = []
    found = fitting.fit_track(
        RIG, "axis", softer, free(GIVE, "parts.pump.displacement"), advance=lambda share: shares.append(share)
    )
    for key, true, worst in ((GIVE, 10e6, 0.1), ("parts.pump.displacement", 1.627e-6 / (2.0 * np.pi), 5e-3)):
        value, low, high = found.values[key]
        assert value == pytest.approx(true, rel=worst), key
        assert low < true < high, key
        assert key in found.identified
    assert found.rms < 0.15e-3
    assert sum(shares) == pytest.approx(1.0), "progress ends where it should"


def test_draws_come_with_their_opposites(run):
    model = fitting._Model(RIG, "axis", [run], free("oil.free_air", GIVE))
    draws = list(fitting._draws(model))
    assert len(draws) == fitting.DRAWS
    np.testing.assert_array_equal(np.sum(draws, axis=0), 0.0)
    assert np.std(draws) == pytest.approx(1.0, abs=0.05)


@pytest.mark.usefixtures("few_draws")
def test_what_no_run_tells_stays_where_it_was_described(run):
    silent = MeasuredRun("short", run.log.isel(time=slice(0, 20)), run.measured.isel(time=slice(0, 20)))
    found = fitting.fit_track(RIG, "axis", [silent], free("parts.valve.switching_time"))
    value, low, high = found.values["parts.valve.switching_time"]
    assert value == pytest.approx(0.06, rel=0.05)
    assert low < 0.02
    assert high > 0.2
    assert not found.identified


BENT = SensorCurve(tuple(np.linspace(0.0, 0.06, 7)), (0.0, 0.3e-3, 0.2e-3, -0.1e-3, -0.3e-3, -0.1e-3, 0.0))


@pytest.fixture(scope="module")
def bent(softer):
    """The same runs, read by a position sensor with a curve."""
    return [
        replace(
            run, measured=run.measured.assign(position=("time", BENT.reading(run.measured["position"]))), linearity=3e-4
        )
        for run in softer
    ]


@pytest.mark.slow
@pytest.mark.usefixtures("few_draws")
def test_the_curve_of_a_position_sensor_is_told_from_a_hose_and_a_pump(bent):
    """It is the same both ways and under each load; the hose and the displacement are found in spite of it."""
    found = fitting.fit_track(RIG, "axis", bent, free(GIVE, "parts.pump.displacement"))
    read = np.concatenate([run.measured["position"].values for run in bent])
    at = np.linspace(read.min(), read.max(), 9)
    line = np.polynomial.Polynomial.fit(at, BENT.position(at) - found.curve.position(at), 1)
    left = BENT.position(at) - found.curve.position(at) - line(at)
    assert np.std(BENT.position(at) - at) > 0.18e-3
    assert np.std(left) < 0.08e-3, "a straight line is displacement, and its knots are elsewhere"
    assert found.values[GIVE][0] == pytest.approx(10e6, rel=0.1)
    assert found.values["parts.pump.displacement"][0] == pytest.approx(1.627e-6 / (2.0 * np.pi), rel=0.01)
    assert found.rms < 0.15e-3
    assert fitting.fit_track(RIG, "axis", bent[:1], free(GIVE)).curve.at[0] == pytest.approx(
        bent[0].measured["position"].values.min()
    )


def test_derivatives_of_a_curve_are_those_of_differences(bent):
    model = fitting._Model(RIG, "axis", bent[:1], free(GIVE))
    change = 1e-4 * np.arange(len(model.prior))
    slopes = model.slopes(change)
    assert slopes.shape[1] == len(model.prior) == 3 + fitting._KNOTS
    for k in range(3, len(model.prior)):
        step = np.zeros(len(change))
        step[k] = 1e-4
        by_difference = (model.residuals(change + step) - model.residuals(change - step)) / 2e-4
        np.testing.assert_allclose(slopes[:, k], by_difference, atol=1e-6 * np.abs(by_difference).max())


def test_a_sensor_that_is_declared_straight_has_no_curve(run):
    assert fitting._Model(RIG, "axis", [run], free(GIVE)).curve(np.zeros(3)) is None


def test_a_map_gets_the_curve_that_was_found_and_reads_by_it(tmp_path):
    text = """time = {channel = "t", unit = "s"}
speed = {channel = "n", unit = "rpm"}
torque = {channel = "m", unit = "N m"}
temperature = {constant = "40 degC"}
[measured]
position = {channel = "x", unit = "mm", linearity = "0.3 mm"}  # a comment
"""
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    made = map_with(text, load_map(tmp_path / "map.toml"), fitting.Torque(), BENT)
    assert "# a comment" in made
    (tmp_path / "made.toml").write_text(made, encoding="utf-8")
    curve = load_map(tmp_path / "made.toml").curve
    np.testing.assert_allclose(curve.at, BENT.at, atol=1e-6)
    np.testing.assert_allclose(curve.excess, BENT.excess, atol=1e-7)
