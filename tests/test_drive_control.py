"""The study of drives that are not perfect: machines move, faults stop them, and its tables say what it found."""

import importlib
import math
from pathlib import Path

import pytest

from ramsight.control.stopping import STOPPING_TIME
from ramsight.sensor.status import Status

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
HARD = "all but the torque"


@pytest.fixture
def study(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "evaluation")
    return importlib.import_module("drive_control")


@pytest.fixture
def boom(study):
    return study.catalogued("mining-loader", "boom")


@pytest.mark.parametrize("label", ["5 samples either way", "torque limited", "samples of 100 ms", HARD])
def test_a_machine_moves_with_a_drive_that_is_not_perfect(study, boom, monkeypatch, label):
    monkeypatch.setattr(study, "TARGETS", 3)
    found = study.moved(boom, study.DRIVES[label])
    assert found["stopped"] == ""
    assert found["reached"] == 3
    assert found["p95"] <= found["largest"] < 2e-3


@pytest.mark.parametrize("label", ["ideal", "5 samples either way", HARD])
@pytest.mark.parametrize(
    "kind", ["torque stuck", "speed stuck", "motor stands", "motor turns the other way", "no reports"]
)
def test_a_fault_stops_it_within_the_time_that_is_allowed(study, boom, label, kind):
    drive = study.DRIVES[label]
    found = study.broken(boom, drive, kind, 0.3)
    assert found["noticed"] <= 0.3 - STOPPING_TIME + drive.latency
    # From 120 rad/s at most, by what the motor can.
    ramp = max(120.0 / drive.response.acceleration - STOPPING_TIME, 0.0)
    assert found["noticed"] <= found["standstill"] <= 0.3 + drive.latency + ramp + 1e-9


@pytest.mark.parametrize("label", ["ideal", "samples of 100 ms", HARD])
def test_the_watch_leaves_every_declared_drive_alone(study, boom, label):
    found = study.watched(boom, study.DRIVES[label], 0.1)
    assert (found["stops"], found["slow"]) == (0, 0)


def test_what_is_asked_of_a_motor_alone_is_what_moves_ask(study):
    import itertools

    import numpy as np

    speeds = list(itertools.islice(study.asked(np.random.default_rng(0), 0.02), 20000))
    assert max(abs(now - before) for before, now in itertools.pairwise(speeds)) <= 600.0 * 0.02
    assert 0.1 < np.mean(np.array(speeds) == 0.0) < 0.8
    assert 100.0 < max(abs(speed) for speed in speeds) <= 300.0


def test_tables_say_what_was_found(study):
    unit = {"reached": 12, "p95": 1.95e-3, "largest": 2e-3, "sensor_p95": 1e-3, "time": 20.0, "stopped": ""}
    slow = unit | {"reached": 1, "time": 30.0, "p95": 4e-3, "largest": 4e-3, "stopped": "the drive is slow"}
    one, never = {"noticed": 0.1, "standstill": 0.25}, {"noticed": None, "standstill": None}
    some, none = study.slowest([one, never]), study.slowest([never])
    assert some == one | {"never": 1}
    loader = {"targets": 30, "p95": 1e-3, "largest": 2e-3, "tip_p95": 3e-3}
    found = {
        "moves": {"ideal": {"a": unit, "b": unit}, "late": {"a": unit | {"time": 22.0}, "b": slow}},
        "worked": {"ideal": {"stops": 0, "hours": 0.1}, "late": {"stops": 2, "hours": 0.1}},
        "watched": {"ideal": {"stops": 0, "hours": 10.0}},
        "faults": {
            "ideal": {
                "latency": 0.0,
                "kinds": {k: {"up": study.slowest([one, one]), "full": some} for k in study.FAULTS},
            },
            "late": {"latency": 0.2, "kinds": {k: {"up": some, "full": none} for k in study.FAULTS}},
        },
        "loader": {"ideal": loader, "late": loader | {"p95": 1.2e-3}},
    }
    rows = study.table(found)
    assert rows[2] == "| ideal | 24 of 24 | 1.95, 1.95 | 2.00 | 1.00 | 1.00 | 0 | 0 | 0.11 + 10 |"
    assert rows[3].startswith("| late | 13 of 24 | 2.98, 4.00 | 4.00 |")
    assert rows[3].endswith("| 1.10 | 0 | 3 | 0.11 + 0 |")
    found["moves"]["late"]["b"]["stopped"] = Status.TOO_UNCERTAIN.text
    assert study.table(found)[3].endswith("| 1.10 | 1 | 2 | 0.11 + 0 |")
    faults = study.fault_table(found)
    assert faults[2] == "| torque lost | 0.25, 0.25* | 0.25*, never |"
    assert faults[-1] == "| *0.3 s and the latency* | 0.30 | 0.50 |"
    assert study.loader_table(found)[-1] == "| late | 30 | 1.20 | 1.20 | 2.00 | 3.00 |"
    assert math.isclose(study.Drive().latency, 0.0)
