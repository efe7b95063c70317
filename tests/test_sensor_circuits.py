"""The self-calibrating sensor on every circuit of the catalogue, and on every option of a description."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from ramsight.plant.limits import limits_of
from ramsight.plant.pump import Pump
from ramsight.plant.valve import Orifice
from ramsight.sensor.kalman import kalman
from ramsight.sensor.status import Status

from .plant_bench import CIRCUITS, UNITS, tabulated
from .sensor_bench import Stepped, cycle, lowered, moves

BAND = 1.96
BOOM = UNITS["mining-loader boom"]


@lru_cache
def sensor_of(unit):
    return Stepped(kalman(unit))


def tracked(unit, run, log, *, start="known"):
    """What a unit's sensor says of a run, and by how much it is wrong [m]."""
    sensor = sensor_of(unit)
    sensor.start(float(run["position"][0]) if start == "known" else None)
    said = sensor.track(log)
    return said, said["position"] - run["position"].values


@pytest.mark.parametrize("name", CIRCUITS)
@pytest.mark.parametrize("share", [0.15, 0.4])
def test_a_cycle_of_every_unit_is_tracked_and_its_band_holds(name, share):
    unit = UNITS[name]
    run, log = cycle(unit, share)
    said, error = tracked(unit, run, log)
    assert np.abs(error).max() < 0.008 * unit.cylinder.stroke
    assert (np.abs(error) <= BAND * said["position_std"]).mean() >= 0.95
    assert np.isin(said["status"], [Status.OK, Status.REFERENCE_DUE]).all()
    moved = np.abs(run["velocity"].values) > 0.5 * np.abs(run["velocity"].values).max()
    late = said["velocity"][moved] - run["velocity"].values[moved]
    assert np.abs(np.median(late)) < 0.05 * np.abs(run["velocity"].values).max()


def mapped_pumps(unit, change):
    return unit.mapped(lambda part: change(part) if isinstance(part, Pump) else part)


def spoilt(pump):
    return tabulated(pump, lambda value: 0.96 * value)


OPTIONS = {
    "a loss table": lambda unit: mapped_pumps(unit, spoilt),
    "viscosity under pressure": lambda unit: replace(unit, oil=replace(unit.oil, pressure_viscosity=1.8e-8)),
    "seals that leak": lambda unit: replace(unit, cylinder=replace(unit.cylinder, seal_leak=5e-18)),
    "seals that press": lambda unit: replace(unit, cylinder=replace(unit.cylinder, pressure_friction=0.05)),
    "an orifice across the pump": lambda unit: replace(unit, extra=(Orifice("short", "manifold_a", "tank", 3e-9),)),
}


QUICK = ("a loss table", "seals that press")


@pytest.mark.parametrize(
    "option", [pytest.param(one, marks=() if one in QUICK else pytest.mark.slow) for one in OPTIONS]
)
def test_an_option_that_is_described_is_in_the_sensor_as_it_is_in_the_plant(option):
    unit = OPTIONS[option](BOOM)
    run, log = cycle(unit)
    said, error = tracked(unit, run, log)
    assert np.abs(error).max() < 0.5e-3
    assert (np.abs(error) <= BAND * said["position_std"]).mean() >= 0.95
    _, without = tracked(BOOM, run, log)
    assert np.abs(without).max() > 2.0 * np.abs(error).max(), "nobody would miss it"


@lru_cache
def both_ends(name):
    """From near the lowered end up to the other one, down again into the lower one, and off it."""
    unit = UNITS[name]
    stroke = unit.cylinder.stroke
    way = 0.93 * stroke / (0.3 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (0.5, 0.0), (0.8, 0.3), (0.8 + 1.2 * way, 0.3), (1.2 + 1.2 * way, 0.0)]
    corners += [(2.2 + 1.2 * way, 0.0), (2.5 + 1.2 * way, -0.3), (2.5 + 2.5 * way, -0.3), (2.9 + 2.5 * way, 0.0)]
    corners += [(3.9 + 2.5 * way, 0.0), (4.2 + 2.5 * way, 0.3), (5.0 + 2.5 * way, 0.3)]
    return moves(unit, corners, 0.3 * limits_of(unit).load, lowered(unit, 0.05 * stroke))


@pytest.mark.parametrize("name", CIRCUITS)
def test_a_position_that_nobody_knows_is_found_at_the_stops(name):
    unit = UNITS[name]
    run, log = both_ends(name)
    said, error = tracked(unit, run, log, start="unknown")
    known = said["state_position_known"] > 0.0
    assert (said["status"][~known] == Status.NOT_REFERENCED).all()
    assert 0.1 < known.mean() < 0.95
    first = int(np.argmax(known))
    end = min(0.0, unit.cylinder.stroke, key=lambda place: abs(place - run["position"].values[first]))
    assert said["state_position"][first] == pytest.approx(end, abs=1e-4), "where it stood, not where it seems to be now"
    assert np.abs(error[known]).max() < 0.02 * unit.cylinder.stroke
    assert np.abs(error[-1]) < 0.005 * unit.cylinder.stroke
    assert (np.abs(error) <= BAND * said["position_std"])[known].mean() >= 0.95
    assert said["status"][-1] in (Status.OK, Status.REFERENCE_DUE), "a leakage that nothing has taught may be another"


@pytest.mark.parametrize("name", CIRCUITS)
def test_a_visit_to_the_lowered_end_does_no_harm_to_a_position_that_is_known(name):
    unit = UNITS[name]
    stroke = unit.cylinder.stroke
    way = 0.125 * stroke / (0.25 * unit.max_speed * unit.travel_per_radian)
    corners = [(0.0, 0.0), (0.5, 0.0), (0.9, -0.25), (0.9 + way, -0.25), (1.3 + way, 0.0), (2.0 + way, 0.0)]
    corners += [(2.4 + way, 0.25), (2.4 + 2.0 * way, 0.25), (2.8 + 2.0 * way, 0.0)]
    run, log = moves(unit, corners, 0.4 * limits_of(unit).load, lowered(unit, 0.1 * stroke))
    said, error = tracked(unit, run, log)
    assert np.abs(error).max() < 0.005 * stroke
    assert (np.abs(error) <= BAND * said["position_std"]).mean() >= 0.95
    wrong = (np.abs(error) > np.maximum(4.0 * said["position_std"], 1e-3)) & (said["status"] == Status.OK)
    assert not wrong.any()


def test_pressures_go_with_the_factors_that_a_reference_has_changed():
    run, log = cycle(BOOM)
    half = log.isel(time=slice(0, 250))
    sensor = sensor_of(BOOM)
    sensor.start(float(run["position"][0]))
    sensor.track(half)
    before, sample = sensor.state.copy(), log.isel(time=slice(250, 251))
    plain = sensor.track(sample)
    sensor.state = before
    told = sensor.track(sample.assign(reference=("time", plain["position"] + 1.5e-3)))
    names = ("leak", "displacement", "compliance")
    changes = [(told[f"{name}_factor"] - plain[f"{name}_factor"])[0] for name in names]
    assert abs(changes[0]) > 1e-3
    for state in ("load.load", "load.circuit.pressure_chamber_a", "load.circuit.pressure_manifold_b"):
        by = [plain[f"state_load.sensitivities.{name}.{state.rpartition('.')[2]}"][0] for name in names]
        expected = plain[f"state_{state}"][0] + np.dot(changes, by)
        assert told[f"state_{state}"][0] == pytest.approx(expected, rel=1e-9)
        assert told[f"state_{state}"][0] != plain[f"state_{state}"][0]


def test_a_graph_that_is_stepped_says_what_the_compiled_sensor_says():
    run, log = cycle(BOOM)
    said, _ = tracked(BOOM, run, log)
    sensor = kalman(BOOM)
    sensor.start(float(run["position"][0]))
    compiled = sensor.track(log)
    for name in ("position", "position_std", "load", "status"):
        same = np.isclose(said[name], compiled[name].values, rtol=1e-6, atol=1e-9)
        assert same.mean() > 0.99, name  # a comparison of two rounded numbers may go either way
        assert said[name][-1] == pytest.approx(compiled[name].values[-1], rel=1e-6), name
