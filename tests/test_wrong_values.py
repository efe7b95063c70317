"""A wrong value of a description is named first, with what fits; a machine within its tolerances is no mistake."""

import numpy as np
import pytest
import xarray

import ramsight
from ramsight.machine.base import walk
from ramsight.study.commissioning.finding import Verdict
from ramsight.study.commissioning.log_checks import leakage
from ramsight.study.commissioning.wrong_values import (
    LEAK,
    RELIEF,
    STROKE,
    TRAVEL,
    TURN,
    Observation,
    description,
    judge,
    observed,
    predicted,
)
from ramsight.tracking.mistakes import probabilities

BUILT = ramsight.AsBuilt(leak=1.1, displacement=0.998, stiffness=0.9, friction=1.1)
UNITS = {"mining-loader": "boom", "forklift-mast": "lift"}
WRONG = [
    ("mining-loader", "pump_a.displacement", 1.094), ("mining-loader", "cylinder.bore", 1.06),
    ("mining-loader", "cylinder.stroke", 0.9), ("mining-loader", "relief_valve.setting", 1.2),
    ("mining-loader", "pump_a.belt", 0.9), ("forklift-mast", "parts.pump.displacement", 1.094),
    ("forklift-mast", "parts.pump.displacement", 0.85), ("forklift-mast", "cylinder.bore", 1.1),
    ("forklift-mast", "cylinder.stroke", 1.2), ("forklift-mast", "parts.relief.setting", 0.85),
]  # fmt: skip
"""Machine, value, and what is described over what is true."""
SECOND = {"pump_a.belt": "pump_a.displacement"}
"""Values of which only a product with another shows, and that other one, which is likelier."""


@pytest.fixture(scope="module")
def worked():
    """Of each machine its description, its drive's log, its run and the track by the right description."""
    found = {}
    for name, unit in UNITS.items():
        machine = ramsight.load_machine(name)
        run = ramsight.simulate(machine, "commissioning", unit=unit, as_built=BUILT)
        log = ramsight.drive_report(run)
        found[name] = (machine, log, run, ramsight.track(machine, log, unit=unit))
    return found


def with_wrong(machine, unit, path, factor):
    """The machine with one value of a unit off, and the true value."""
    true = next(one.value for one in walk(machine.unit(unit)) if one.path == path)
    return machine.replace({f"units.{unit}.{path}": true * factor}), true


def judged(machine, unit, log, track, truth):
    built = ramsight.build(machine, unit)
    _, test = leakage(built, log)
    return judge(unit, machine.unit(unit), built, observed(built, log, track, test, truth))


@pytest.mark.parametrize(("name", "path", "factor"), WRONG)
def test_a_wrong_value_is_named_first_with_the_one_that_fits(worked, name, path, factor):
    machine, log, run, track = worked[name]
    wrong, true = with_wrong(machine, UNITS[name], path, factor)
    found = judged(wrong, UNITS[name], log, track, run).wrong
    assert found is not None
    if path in SECOND:
        assert found.path == SECOND[path]
        assert path in found.others
        return
    assert found.path == path
    assert found.low <= true <= found.high, found.text
    assert abs(found.fits / true - 1.0) < 0.02
    assert found.high / found.low < 1.2, "the interval says something"


@pytest.mark.parametrize("name", UNITS)
def test_a_machine_within_its_tolerances_is_no_mistake(worked, name):
    machine, log, run, track = worked[name]
    for truth in (None, run):
        found = judged(machine, UNITS[name], log, track, truth)
        assert found.wrong is None
        assert found.probability > 0.9
        assert {TRAVEL, RELIEF[1], LEAK} <= set(found.off), "silence is no agreement"
        assert abs(found.off[TRAVEL]) < 0.02
    assert abs(found.off[TURN]) < 0.015
    assert abs(found.off[STROKE]) < 0.005


def test_without_a_position_bore_and_stroke_are_both_named(worked):
    machine, log, _, track = worked["mining-loader"]
    wrong, _ = with_wrong(machine, "boom", "cylinder.bore", 1.06)
    found = judged(wrong, "boom", log, track, None).wrong
    assert {"cylinder.bore", "cylinder.stroke"} <= {found.path, *found.others}


@pytest.mark.parametrize("is_measured", [False, True])
def test_a_short_travel_may_be_an_obstacle_where_nobody_measured_it(worked, is_measured):
    machine, log, run, track = worked["mining-loader"]
    wrong, _ = with_wrong(machine, "boom", "cylinder.stroke", 1.15)
    built = ramsight.build(wrong, "boom")
    found, value = description(wrong.unit("boom"), built, log, track, None, run if is_measured else None)
    assert value.path == "cylinder.stroke"
    assert ("something stopped the rod" in found.remedy) is not is_measured


def test_commissioning_fails_with_the_value_to_correct(worked):
    machine, log, run, _ = worked["mining-loader"]
    wrong, _ = with_wrong(machine, "boom", "cylinder.stroke", 0.95)
    done = ramsight.commission(wrong, log, run, unit="boom", require="20 mm")
    found = {one.check: one for one in done.findings}
    assert done.verdict is Verdict.FAILED
    assert "cylinder.stroke: 69" in found["description"].remedy or "cylinder.stroke: 70" in found["description"].remedy
    assert done.wrong_value.path == "cylinder.stroke"
    for check in ("sensor", "requirement"):
        assert found[check].verdict is Verdict.PASSED or found[check].remedy == "correct the description first"
    assert found["learned by the sensor"].verdict is Verdict.OPEN, "what is learned of a wrong machine is not passed"
    assert found["data sheet"].verdict is Verdict.OPEN


def test_every_candidate_is_as_likely_as_its_observations(worked):
    """Of observations that are exactly those of another value, that value is found, in the middle of its interval."""
    machine = worked["mining-loader"][0]
    wrong, true = with_wrong(machine, "boom", "cylinder.bore", 1.1)
    built, right = ramsight.build(wrong, "boom"), predicted(ramsight.build(machine, "boom"))
    seen = {one: Observation(value, 0.005) for one, value in right.items()}
    found = judge("boom", wrong.unit("boom"), built, seen).wrong
    assert found.path == "cylinder.bore"
    assert found.fits == pytest.approx(true, rel=5e-3)
    assert not judge("boom", machine.unit("boom"), ramsight.build(machine, "boom"), seen).wrong
    assert judge("boom", machine.unit("boom"), built, {}).off == {}


def test_probabilities_do_not_overflow():
    assert probabilities([-5000.0, -5001.0])[0] == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))


def test_a_unit_whose_rod_a_valve_meters_is_not_compared(worked):
    metered = ramsight.load_machine("loader-valve-controlled").unit("boom")
    log = worked["mining-loader"][1]
    found, wrong = description(metered, ramsight.build(metered), log, log, None, None)
    assert (found.verdict, wrong) == (Verdict.OPEN, None)
    assert "a valve meters the rod" in found.found


def test_a_log_that_shows_no_end_is_not_compared_by_travel(worked):
    machine, log, _, track = worked["mining-loader"]
    boom = ramsight.build(machine, "boom")
    free: xarray.Dataset = track.assign(mode=("time", np.ones(track.sizes["time"])))
    assert TRAVEL not in observed(boom, log, free, None, None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "path", "factor"), [one for one in WRONG if one[1].endswith(("bore", "displacement"))]
)
def test_a_commissioning_with_a_wrong_value_fails_whatever_the_sensor_makes_of_it(worked, name, path, factor):
    """The whole way, with the track by the wrong description."""
    machine, log, run, _ = worked[name]
    wrong, true = with_wrong(machine, UNITS[name], path, factor)
    done = ramsight.commission(wrong, log, run, unit=UNITS[name], require="50 mm")
    assert done.verdict is Verdict.FAILED
    assert done.wrong_value.path == path
    assert done.wrong_value.low <= true <= done.wrong_value.high
