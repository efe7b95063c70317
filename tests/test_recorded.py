"""The self-calibrating sensor on recorded days of the independent simulator: errors, band, never wrong and ok."""

import json
from pathlib import Path

import numpy as np
import pytest

from evaluation.judged_errors import judge
from ramsight import machine
from ramsight.logs import read_log, read_truth
from ramsight.plant.build import build
from ramsight.sensor.kalman import kalman

FOLDER = Path(__file__).parent / "traces" / "person"
CASES = {case["name"]: case for case in json.loads((FOLDER / "cases.json").read_text())}
P95, LARGEST = 2.0e-3, 5.0e-3  # m
# Oil that went over a relief valve is not found again before a stop: then the errors that are said to be ok count.
OTHERS = {
    "obstacles": (2.5e-3, 6e-3), "coarse": (4e-3, 5e-3), "warming": (4.5e-3, 8e-3), "drift": (3e-3, 5e-3),
    "ground": (np.inf, np.inf),
}  # fmt: skip


@pytest.fixture(scope="module")
def sensors():
    loader = machine.load_machine("mining-loader")
    units = {name: build(loader.unit(name), name) for name in ("boom", "bucket")}
    return {name: (kalman(unit), unit.cylinder.stroke) for name, unit in units.items()}


@pytest.fixture(scope="module")
def judged(sensors):
    cache = {}

    def find(name):
        if name not in cache:
            sensor, stroke = sensors[CASES[name]["unit"]]
            log, truth = read_log(FOLDER / f"{name}.csv.gz"), read_truth(FOLDER / f"{name}_truth.csv.gz")
            position = np.interp(log["time"], truth["time"], truth["position"])
            sensor.start(float(position[0]))
            cache[name] = judge(sensor.track(log), log["motor_speed"].values, position, stroke)
        return cache[name]

    return find


@pytest.mark.parametrize("name", CASES)
def test_a_persons_day_is_tracked_after_three_stops(judged, name):
    p95, largest = next((limits for kind, limits in OTHERS.items() if kind in name), (P95, LARGEST))
    found = judged(name)
    obstacles = "obstacles" in name
    assert not (found.ok_p95 if obstacles else found.p95) > p95
    assert not (found.ok_largest if obstacles else found.largest) > largest


@pytest.mark.parametrize("name", CASES)
def test_the_band_of_every_day_holds(judged, name):
    assert judged(name).coverage > 0.93


@pytest.mark.parametrize("name", CASES)
def test_no_day_is_wrong_and_ok(judged, name):
    assert judged(name).wrong_and_ok <= 2e-3


@pytest.mark.parametrize("since", [0.0, 120.0])
@pytest.mark.parametrize("name", [name for name in CASES if "warming" in name])
def test_a_thermometer_that_is_stuck_costs_accuracy_and_not_honesty(sensors, name, since):
    """The oil warms by 30 K, which makes 2.5 times the leakage; read as steady, 0.65 to 0.8 of the band would hold."""
    sensor, stroke = sensors[CASES[name]["unit"]]
    log, truth = read_log(FOLDER / f"{name}.csv.gz"), read_truth(FOLDER / f"{name}_truth.csv.gz")
    first = int(np.searchsorted(log["time"], since))
    log["oil_temperature"][first:] = log["oil_temperature"][first]
    position = np.interp(log["time"], truth["time"], truth["position"])
    sensor.start(float(position[0]))
    found = judge(sensor.track(log), log["motor_speed"].values, position, stroke)
    assert found.coverage > 0.93
    assert found.wrong_and_ok <= 2e-3
    assert found.p95 < 15e-3


def test_ground_that_is_declared_is_a_stop_like_any_other():
    """The boom meets the ground 35 mm before the cylinder's end."""
    name = "person_boom_ground_stop"
    unit = build(machine.load_machine("mining-loader").unit("boom"), "boom")
    sensor = kalman(unit, unit.assumptions.replace({"stops.retracted": 0.035}))
    log, truth = read_log(FOLDER / f"{name}.csv.gz"), read_truth(FOLDER / f"{name}_truth.csv.gz")
    position = np.interp(log["time"], truth["time"], truth["position"])
    sensor.start(float(position[0]))
    track = sensor.track(log)
    met = np.flatnonzero(np.diff((position < 0.0351).astype(int)) == 1)
    error = np.abs(track["position"].values - position)[met[2] :]
    turns = np.abs(log["motor_speed"].values)[met[2] :] > 1.0
    assert np.percentile(error[turns], 95) < 2e-3
    found = judge(track, log["motor_speed"].values, position, unit.cylinder.stroke)
    assert found.coverage > 0.93
    assert found.wrong_and_ok < 0.005
    assert found.ok > 0.3


UNKNOWN = Path(__file__).parent / "traces" / "unknown"
SHORT = {
    "boom_exchange": {"beyond_bound": 2e-3},  # a first contact that was a load, for 0.8 s
}
"""What falls short of the other logs' limits, and by how much."""


@pytest.mark.parametrize("name", sorted(file.name[: -len("_truth.csv.gz")] for file in UNKNOWN.glob("*_truth.csv.gz")))
def test_a_log_whose_start_nobody_knows_is_never_wrong_and_ok(sensors, name):
    sensor, stroke = sensors[name.partition("_")[0]]
    log, truth = read_log(UNKNOWN / f"{name}.csv.gz"), read_truth(UNKNOWN / f"{name}_truth.csv.gz")
    position = np.interp(log["time"], truth["time"], truth["position"])
    sensor.start(None)
    found = judge(sensor.track(log), log["motor_speed"].values, position, stroke)
    limits = {"coverage": 0.93, "beyond_bound": 1e-4} | SHORT.get(name, {})
    assert found.wrong_and_ok <= 2e-3
    if name == "bucket_free_air":  # presses that nothing decides: it has no position
        assert np.isnan(found.coverage)
        return
    assert found.coverage >= limits["coverage"]
    assert found.beyond_bound <= limits["beyond_bound"]


def test_a_worn_mast_is_found_at_both_ends():
    """A fork that is set down shows its lower end by a load that has gone, though its pumps have less friction."""
    folder = Path(__file__).parent / "traces" / "mast"
    unit = build(machine.load_machine(folder / "mast.toml").unit("lift"), "lift")
    log, truth = read_log(folder / "lift_worn.csv.gz"), read_truth(folder / "lift_worn_truth.csv.gz")
    position = np.interp(log["time"], truth["time"], truth["position"])
    sensor = kalman(unit)
    sensor.start(None)
    found = judge(sensor.track(log), log["motor_speed"].values, position, unit.cylinder.stroke)
    assert found.coverage >= 0.93
    assert found.wrong_and_ok <= 2e-3
    assert found.ok_p95 <= 6e-3 * unit.cylinder.stroke
    assert found.ok >= 0.7
    assert found.std <= 8e-3
