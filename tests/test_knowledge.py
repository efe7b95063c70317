"""What was measured of a machine becomes what its sensor assumes: nothing more, nothing less, and never worse."""

import math

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

import ramsight
from ramsight import machine
from ramsight.calibration.identify import Estimate, Identification
from ramsight.calibration.identify_report import WORDS
from ramsight.calibration.knowledge import completed, of_identification, of_leak_test, of_sensor
from ramsight.calibration.leakage import LeakTest
from ramsight.calibration.tuned import tuned
from ramsight.machine import Assumptions
from ramsight.machine.assumption_description import SURE_START
from ramsight.normal import TWO_SIDED_95
from ramsight.plant.build import build
from ramsight.plant.limits import limits_of
from ramsight.sensor.kalman import kalman
from ramsight.study.commissioning.kept_values import Measured, over

from .test_assumptions import load, written

LOADER = machine.load_machine("mining-loader")
BOOM = LOADER.unit("boom")
ASSUMED = Assumptions()


def found_of(factor, reached=(0.1, 0.6), **told):
    """What `identify` might say: the leakage alone is told, unless more is."""
    factors = {name: Estimate(1.0, 0.9, 1.1, identified=False) for name in WORDS}
    factors |= {name: Estimate(0.0, -0.1, 0.1, identified=False) for name in ("orifice", "efficiency")}
    factors["leak"] = Estimate(factor, factor - 0.05, factor + 0.05, identified=True)
    late = Estimate(0.0, 0.0, 0.0, identified=False)
    return Identification(factors | told, late, 9, 3, 60.0, 1e-3, (1e5, 2e7), (300, 320), 5, 4, reached)


def tuned_by(found, described=LOADER):
    return tuned(described, "boom", of_identification(found, described.unit("boom")), "a test")


def assumed_by(found):
    return tuned_by(found).machine.unit("boom").assumptions


@settings(max_examples=20)
@given(share=st.floats(0.01, 0.99), leak=st.floats(0.7, 1.4))
def test_a_tuned_description_keeps_what_is_declared_and_declares_what_was_measured(share, leak):
    declared = {path: written(path, share)[0] for path in ("drive.torque", "machine.leak_walk", "stops.reference")}
    before = load("boom", declared)
    new = tuned_by(found_of(leak), before)
    if leak != 1.0:
        assert new.machine.unit("boom").pump_a != before.unit("boom").pump_a
    again = machine.loads(new.text).unit("boom").assumptions
    assert again == new.machine.unit("boom").assumptions
    known = min(0.05 / TWO_SIDED_95 / leak, before.unit("boom").assumptions.machine.leak)
    assert again.machine.leak == pytest.approx(known, rel=5e-3)
    new_ones = {"machine.leak", "machine.leak_exponent", "machine.leaks_otherwise"}
    assert {v.path for v in machine.walk(again) if v.given} == {*declared, *new_ones}
    assert "[units.bucket.assumptions" not in new.text


def test_a_thermometer_and_a_torque_that_are_off_count_in_how_well_a_factor_is_known():
    """1 K and the torque's 1 %, beside the interval; each of 1.25 as the factor is of one."""
    leak = Estimate(1.25, 1.25 - 0.05, 1.25 + 0.05, identified=True, per_kelvin=-0.04, per_torque=-0.01)
    assumed = assumed_by(found_of(1.25, leak=leak))
    expected = math.hypot(0.05 / TWO_SIDED_95, 0.04, 100.0 * assumed.drive.torque_gain * 0.01) / 1.25
    assert assumed.machine.leak == pytest.approx(expected, rel=5e-3)


def test_a_law_that_was_not_measured_widens_the_exponent():
    """The leakage is known, its growth with pressure is not: the exponents of both laws, by Bayes' theorem."""
    machine_ = ASSUMED.machine
    assert assumed_by(found_of(1.0)).machine.leaks_otherwise == 1e-3, "it has changed since"
    std = 0.05 / TWO_SIDED_95
    usual, other = (math.hypot(std, one) for one in (machine_.leak, machine_.other_leak))
    odds = machine_.leaks_otherwise / (1.0 - machine_.leaks_otherwise) * usual / other
    share = odds / (1.0 + odds)
    expected = math.sqrt((1.0 - share) * machine_.leak_exponent**2 + share * machine_.other_exponent**2)
    assert assumed_by(found_of(1.0)).machine.leak_exponent == pytest.approx(expected, rel=5e-3)
    # A machine that leaks twice as much leaks by who knows which law; one that leaks four times as much all the more.
    for leak in (2.0, 4.0):
        assert assumed_by(found_of(leak)).machine.leak_exponent == pytest.approx(machine_.other_exponent, rel=0.02)


def test_a_law_that_was_measured_is_the_described_one():
    orifice = Estimate(0.0, 0.0, 0.02, identified=True)
    assumed = assumed_by(found_of(1.0, orifice=orifice))
    assert assumed.machine.leak_exponent == ASSUMED.machine.leak_exponent
    assert assumed.machine.leaks_otherwise == 1e-3


def test_a_machine_that_leaks_through_edges_alone_is_told_by_them():
    """No factor of zero is known to a share of itself; the sensor's description has the edges' leakage and no other."""
    gaps, edges = Estimate(0.0, 0.0, 0.05, identified=True), Estimate(0.8, 0.75, 0.85, identified=True)
    found = found_of(0.0, leak=gaps, orifice=edges)
    unit = tuned_by(found).machine.unit("boom")
    assert unit.assumptions.machine.leak == ASSUMED.machine.leak
    assert unit.pump_a.volumetric_efficiency == pytest.approx(1.0)
    assert unit.pump_a.orifice_leakage > 0.0
    values = {"identified leak": Measured(0.0, 0.01), "identified displacement": Measured(1.0, 0.01)}
    assert list(over(values, found)) == ["identified displacement"]


def test_a_law_that_cannot_leak_so_is_not_the_other_one():
    """With a narrow prior of the other law, leakage that is far off is the described law's, however far off it is."""
    narrow = load("boom", {"machine.other_leak": '"1 %"'})
    assumed = tuned_by(found_of(2.0), narrow).machine.unit("boom").assumptions.machine
    assert assumed.leak_exponent == ASSUMED.machine.leak_exponent


def test_how_likely_the_other_law_is_rests_on_the_deviation_of_the_factor_not_of_its_share():
    machine_ = ASSUMED.machine
    leak = Estimate(1.5, 1.5 - 0.6, 1.5 + 0.6, identified=True)
    usual, other = (math.hypot(0.6 / TWO_SIDED_95, one) for one in (machine_.leak, machine_.other_leak))
    prior = machine_.leaks_otherwise / (1.0 - machine_.leaks_otherwise)
    odds = prior * usual / other * math.exp(0.5 * 0.5**2 * (usual**-2 - other**-2))
    share = odds / (1.0 + odds)
    expected = math.sqrt((1.0 - share) * machine_.leak_exponent**2 + share * machine_.other_exponent**2)
    found = assumed_by(found_of(1.5, leak=leak)).machine.leak_exponent
    assert found == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize(
    ("reached", "sure"),
    [((0.0, 0.7), True), ((1.9e-3, 0.6981), True), ((2.1e-3, 0.7), False), ((0.0, 0.6979), False), ((0.1, 0.6), False)],
)
def test_ends_that_the_measured_position_reached_are_where_they_are_described(reached, sure):
    new = tuned_by(found_of(1.1, reached))
    assert new.machine.unit("boom").assumptions.stops.undeclared == (1e-4 if sure else ASSUMED.stops.undeclared)
    assert ("reached both ends" in new.text) == sure


def test_a_source_stays_with_a_declared_value():
    source = '{ value = "30 ms", source = "its manual" }'
    new = tuned_by(found_of(1.1), load("boom", {"drive.delay": source})).machine
    assert new.source_of("units.boom.assumptions.drive.delay") == "its manual"


def leak_test_of(factor=1.2, std=0.02):
    return LeakTest(factor, std, per_kelvin=-0.038 * factor, per_torque=-0.01 * factor, stretches=())


def test_a_leak_test_tells_the_leakage_alone():
    new = tuned(LOADER, "boom", of_leak_test(leak_test_of(), BOOM), "a test").machine.unit("boom")
    assert new.assumptions.machine.leak == pytest.approx(math.hypot(0.02 / 1.2, 0.038, 0.01), rel=5e-3)
    for left in ("displacement", "compliance"):
        assert getattr(new.assumptions.machine, left) == getattr(ASSUMED.machine, left)
    assert new.assumptions.stops == BOOM.assumptions.stops
    pump, was = (build(one, "boom").a.pump.leak_coefficient(32e-6, 872.0) for one in (new, BOOM))
    assert pump == pytest.approx(1.2 * was, rel=1e-6, abs=0.0)


def learned(described=BOOM, **changed):
    """The end of a track of a sensor that knows little: the values of the description, as well known as described."""
    machine_, stops = ASSUMED.machine, ASSUMED.stops
    last = {
        "leak_factor": 1.0, "leak_factor_std": machine_.leak, "displacement_factor": 1.0,
        "displacement_factor_std": machine_.displacement, "compliance_factor": 1.0,
        "compliance_factor_std": machine_.compliance, "leaks_probability": machine_.leaks_otherwise,
        "leak_exponent": 0.0, "leak_exponent_std": machine_.leak_exponent,
        "low_probability": stops.undeclared, "top_probability": stops.undeclared,
    } | changed  # fmt: skip
    track = xarray.Dataset({name: ("time", [np.nan, value]) for name, value in last.items()})
    return of_sensor(track, described, build(described, "boom"), 313.15)


def test_a_sensor_that_has_learned_nothing_changes_nothing():
    known = learned()
    assert known.assumed == {}
    assert tuned(LOADER, "boom", known, "a test").machine.unit("boom") == BOOM


def test_what_the_sensor_has_learned_is_its_prior_from_then_on():
    known = learned(
        leak_factor=1.15, leak_factor_std=0.02, displacement_factor=0.998, displacement_factor_std=0.001,
        compliance_factor=1.25, compliance_factor_std=0.05, leaks_probability=0.02, low_probability=3e-3,
        top_probability=2e-5,
    )  # fmt: skip
    new = tuned(LOADER, "boom", known, "a test").machine.unit("boom")
    oil = build(BOOM, "boom").oil
    per_kelvin = oil.viscosity(314.15) / oil.viscosity(313.15) - 1.0
    assumed = new.assumptions.machine
    assert assumed.leak == pytest.approx(math.hypot(0.02 / 1.15, per_kelvin, 0.01), rel=5e-3)
    assert assumed.displacement == pytest.approx(0.001 / 0.998, rel=5e-3)
    assert assumed.compliance == pytest.approx(0.05 / 1.25, rel=0.02)
    assert assumed.leaks_otherwise == 1e-3
    assert assumed.leak_exponent == pytest.approx(math.hypot(0.03, math.sqrt(0.02 * 0.98) * 0.15), rel=5e-3)
    assert new.assumptions.stops.undeclared == pytest.approx(3e-3)
    assert new.oil.bulk_modulus == pytest.approx(BOOM.oil.bulk_modulus / 1.25)
    assert new.pump_a.displacement == pytest.approx(0.998 * BOOM.pump_a.displacement)


def test_both_ends_met_leave_a_least_chance_that_they_are_elsewhere():
    assert learned(low_probability=1e-9, top_probability=1e-9).assumed["stops.undeclared"][0] == 1e-4
    for surer, other in (("low", "top"), ("top", "low")):
        ends = {f"{surer}_probability": 1e-9, f"{other}_probability": 3e-3}
        assert learned(**ends).assumed["stops.undeclared"][0] == 3e-3


def test_the_leakage_is_that_of_the_leak_test_where_the_sensor_has_not_learned_it():
    test = of_leak_test(leak_test_of(1.2, 0.01), BOOM)
    knows = learned(leak_factor=1.15, leak_factor_std=0.05)
    assert completed(knows, test) is knows
    both = completed(learned(displacement_factor_std=0.001), test)
    assert both.factors["leak"].value == 1.2
    assert both.assumed["machine.displacement"][0] == 0.001
    assert both.lines[-len(test.lines) :] == test.lines


@pytest.mark.parametrize("exponent", [0.01, 0.1, 0.3])
def test_a_learned_exponent_becomes_leakage_through_gaps_and_edges(exponent):
    """Value and slope over the pressure are those that were learned, where the exponent does nothing."""
    new = tuned(LOADER, "boom", learned(leak_factor=1.2, leak_factor_std=0.02, leak_exponent=exponent), "a test")
    pump, was = (build(one, "boom").a.pump for one in (new.machine.unit("boom"), BOOM))
    oil, reference = build(BOOM, "boom").oil, 0.3 * limits_of(build(BOOM, "boom")).pressure

    def leak(of, pressure):
        return float(of.leakage(150.0, pressure, oil.viscosity(313.15), oil.density))

    assert leak(pump, reference) == pytest.approx(1.2 * leak(was, reference), rel=1e-4)
    slope = math.log(leak(pump, 1.01 * reference) / leak(pump, 0.99 * reference)) / math.log(1.01 / 0.99)
    assert slope == pytest.approx(1.0 - exponent, abs=1e-3)


def test_how_well_both_leakages_are_known_follows_from_factor_and_exponent():
    known = learned(leak_factor=1.2, leak_factor_std=0.02, leak_exponent=0.1, leak_exponent_std=0.03)
    for name, share in (("leak", 0.02 / 1.2), ("orifice", 0.03 / 0.1)):
        one = known.factors[name]
        assert (one.high - one.low) / (2.0 * TWO_SIDED_95 * one.value) == pytest.approx(share)


def test_an_exponent_over_a_description_with_edges_stays_a_doubt():
    """The exponent is over the law that is described, which has both leakages already."""
    edges = Estimate(0.3, 0.2, 0.4, identified=True)
    described = tuned_by(found_of(1.0, orifice=edges)).machine.unit("boom")
    known = learned(described, leak_factor_std=0.01, leak_exponent=0.1, leak_exponent_std=0.02, leaks_probability=0.0)
    assert "orifice" not in known.factors
    assert known.assumed["machine.leak_exponent"][0] == pytest.approx(math.hypot(0.1, 0.02), rel=5e-3)


def test_leakage_through_edges_is_all_of_it_at_most():
    most, more = (learned(leak_factor_std=0.02, leak_exponent=exponent).factors for exponent in (0.5, 0.7))
    assert most["leak"].value == more["leak"].value == 0.0
    assert more["orifice"].value == most["orifice"].value


def test_an_exponent_that_the_description_cannot_state_stays_a_doubt():
    steeper = learned(leak_factor_std=0.02, leak_exponent=-0.05, leak_exponent_std=0.02, leaks_probability=0.0)
    assert "orifice" not in steeper.factors
    far = learned(leak_factor_std=0.02, leak_exponent=-0.9, leak_exponent_std=0.02)
    assert tuned(LOADER, "boom", far, "a test").machine.unit("boom").assumptions.machine.leak_exponent == 0.5
    assert steeper.assumed["machine.leak_exponent"][0] == pytest.approx(math.hypot(0.05, 0.02), rel=5e-3)


@pytest.fixture(scope="module")
def worn():
    """A worn boom: what its commissioning makes of it without a measured position, and a cycle of the next day."""
    built, as_built = ramsight.build(LOADER, "boom"), ramsight.AsBuilt(leak=1.15, displacement=0.998, stiffness=0.9)
    log = ramsight.drive_report(ramsight.simulate(built, "commissioning", as_built=as_built))
    run = ramsight.simulate(built, "lift-lower", as_built=as_built, load="441 kN")
    return log, ramsight.drive_report(run, seed=2), run["position"].values


def tracked(described, log, start):
    unit = ramsight.build(described, "boom")
    sensor = kalman(unit, unit.assumptions.replace(dict(SURE_START)))
    sensor.start(start)
    return sensor.track(log)


@pytest.mark.slow
def test_a_commissioned_sensor_is_sure_before_any_reference(worn, tmp_path):
    log, cycle, true = worn
    ramsight.commission(LOADER, log, unit="boom", tuned=tmp_path / "boom.toml")
    before, after = (tracked(one, cycle, true[0]) for one in (LOADER, tmp_path / "boom.toml"))
    assert after["position_std"].max() < 0.4 * before["position_std"].max()
    assert (after["status"] == 0).mean() > 0.95
    error = after["position"].values - true
    assert np.abs(error).max() < np.abs(before["position"].values - true).max()
    assert np.mean((true >= after["position_low"].values) & (true <= after["position_high"].values)) > 0.95
