"""The study of drives that are not perfect: machines move, faults stop them, and its tables say what it found."""

import math
from pathlib import Path

import pytest

from ramsight.control.thresholds import STOPPING_TIME
from ramsight.sensor.status import Status

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
HARD = "all but the torque"


@pytest.fixture
def study(script):
    return script("drive_control")


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
    assert found.noticed <= 0.3 - STOPPING_TIME + drive.latency
    assert found.noticed <= found.told <= 0.3 + drive.latency + 1e-9
    assert found.told <= found.stood <= 0.3 + drive.latency + found.ramp + 1e-9
    # From 120 rad/s at most, by what the motor can.
    assert found.ramp <= max(120.0 / drive.response.acceleration - STOPPING_TIME, 0.0)


def test_a_speed_in_tenths_of_a_rpm_that_is_stuck_at_full_speed_stops_the_motor_in_time(study, boom):
    fine, coarse = (
        study.broken(boom, study.DRIVES[label], "speed stuck", 2.0) for label in ("speed in 0.1 rpm", "ideal")
    )
    assert fine.stood <= 0.3 < coarse.stood < 0.6
    assert fine.wrong is None, "the report is right until the command changes"


def test_a_motor_that_runs_on_is_told_in_time_from_when_it_does_not_do_as_it_is_told(study, boom):
    found = study.broken(boom, study.DRIVES["ideal"], study.RUNS_ON, 2.0)
    assert found.told > 1.0, "it did as it was told"
    assert 0.0 < found.since <= 0.4
    assert found.since == pytest.approx(found.told - found.wrong)


def test_a_double_rod_reaches_all_targets_with_references_as_they_are_due(study, monkeypatch):
    axis, ideal = study.catalogued(*study.UNITS["double rod"]), study.DRIVES["ideal"]
    found = study.moved(axis, ideal)
    assert (found["stopped"], found["reached"]) == ("", study.TARGETS)
    assert 1 <= found["visits"] <= 6
    assert found["largest"] < 2e-3
    monkeypatch.setattr(study, "Referencing", lambda visits: None)
    assert study.moved(axis, ideal)["largest"] < 2e-3, "so it does without them, where nothing has changed"


@pytest.mark.parametrize("label", ["ideal", "samples of 100 ms", HARD])
def test_the_watch_leaves_every_declared_drive_alone(study, boom, label):
    for noisy in (True, False):
        found = study.watched(boom, study.DRIVES[label], 0.1, noisy=noisy)
        assert (found["stops"], found["slow"], found["hours"]) == (0, 0, 0.1)


def test_what_is_asked_of_a_motor_alone_is_what_moves_ask(study):
    import itertools

    import numpy as np

    speeds = np.array(list(itertools.islice(study.asked(np.random.default_rng(0), 0.02), 20000)))
    changes = np.abs(np.diff(speeds))
    assert changes.max() <= 600.0 * 0.02 + 6.0 * study.TREMBLE
    assert 0.1 < np.mean(speeds == 0.0) < 0.8
    assert 100.0 < np.abs(speeds).max() <= 300.0 + 6.0 * study.TREMBLE
    assert np.mean((changes == 0.0) & (speeds[1:] != 0.0)) > 0.1, "commands that stand"
    assert np.mean((changes > 0.0) & (changes < 5.0 * study.TREMBLE)) > 0.1, "and commands that tremble"


def test_the_slowest_of_several_cases_is_judged_without_the_ramp_of_its_motor(study):
    one = study.Stop(noticed=0.1, told=0.26, stood=0.3, wrong=0.02)
    slow = study.Stop(noticed=0.1, told=0.26, stood=1.2, ramp=1.0, wrong=0.2)
    found = study.slowest([one, slow, study.Stop()])
    assert (found["stood"], found["told"], found["ramp"], found["never"]) == (1.2, 0.26, 1.0, 1)
    assert found["stood_less_ramp"] == 0.3
    assert found["since"] == pytest.approx(0.24)
    assert study.slowest([study.Stop()])["stood"] is None


def test_tables_say_what_was_found(study):
    unit = {
        "reached": 12, "p95": 1.95e-3, "largest": 2e-3, "sensor_p95": 1e-3, "visits": 1, "time": 20.0, "stopped": "",
    }  # fmt: skip
    slow = unit | {"reached": 1, "time": 30.0, "p95": 4e-3, "largest": 4e-3, "stopped": "the drive is slow"}
    one = study.Stop(noticed=0.1, told=0.2, stood=0.25, wrong=0.02)
    some, none = study.slowest([one, study.Stop()]), study.slowest([study.Stop()])
    ramp = study.slowest([study.Stop(noticed=0.1, told=0.2, stood=0.8, ramp=0.5, wrong=0.02)])
    beyond = study.slowest([study.Stop(noticed=0.1, told=0.4, stood=0.6, wrong=0.02)])
    loader = {"targets": 30, "p95": 1e-3, "largest": 2e-3, "tip_p95": 3e-3}
    up, full = study.GOING
    found = {
        "moves": {"ideal": {"a": unit, "b": unit}, "late": {"a": unit | {"time": 22.0}, "b": slow}},
        "worked": {"ideal": {"stops": 0, "hours": 0.1}, "late": {"stops": 2, "hours": 0.1}},
        "watched": {"ideal": {"stops": 0, "hours": 10.0}},
        "silent": {"ideal": {"stops": 3, "hours": 10.0}},
        "faults": {
            "ideal": {"latency": 0.0, "kinds": {k: {up: study.slowest([one]), full: some} for k in study.FAULTS}},
            "late": {"latency": 0.2, "kinds": {k: {up: ramp, full: beyond} for k in study.FAULTS}},
        },
        "loader": {"ideal": loader, "late": loader | {"p95": 1.2e-3}},
    }
    rows = study.table(found)
    assert rows[2] == "| ideal | 24 of 24 | 1.95, 1.95 | 2.00 | 1.00 | 2 | 1.00 | 0 | 0 | 0.11 + 10 | 3 in 10 |"
    assert rows[3].startswith("| late | 13 of 24 | 2.98, 4.00 | 4.00 |")
    assert rows[3].endswith("| 1.10 | 0 | 3 | 0.11 + 0 | – |")
    found["moves"]["late"]["b"]["stopped"] = Status.TOO_UNCERTAIN.text
    assert study.table(found)[3].endswith("| 1.10 | 1 | 2 | 0.11 + 0 | – |")
    faults, commands = study.fault_table(found), study.command_table(found)
    assert faults[2] == "| torque lost | 0.25, 0.25\\* | 0.80, **0.60** |", "0.8 s is what the motor's ramp takes"
    assert faults[-2:] == [
        "| *0.3 s and the latency* | 0.30 | 0.50 |",
        "| *and the ramp of the motor* | 0.00, 0.00 | 0.50, 0.00 |",
    ]
    assert commands[2] == "| torque lost | 0.20, 0.20\\* | 0.20, 0.40 |"
    assert f"| {study.RUNS_ON}, from when it shows | 0.18, 0.18\\* | 0.18, 0.38 |" in commands
    assert study.longer(found)[0] == f"- {up}: none"
    assert study.longer(found)[1].startswith(f"- {full}: torque lost 0.10 s (late); torque stuck 0.10 s (late);")
    found["faults"]["late"]["kinds"]["no reports"][full] = none
    assert study.fault_table(found)[-3].endswith("| 0.80, **never**\\* |")
    assert study.missed({"moves": {"ideal": {"a": unit}}}) == ["- none"]
    assert study.missed(found) == ["- b, reached of its 12 targets: 12 (ideal); 1 (late)"]
    assert study.loader_table(found)[-1] == "| late | 30 | 1.20 | 1.20 | 2.00 | 3.00 |"
    for row in found["loader"].values():
        row |= {"drawn": 180, "groups": [1.1e-3, 1.4e-3, 0.9e-3]}
    assert study.loader_table(found)[0].startswith("| drive | targets | rod, p95 [mm] | of every 60 | over")
    assert study.loader_table(found)[-1] == "| late | 30 of 180 | 1.20 | 0.90 to 1.40 | 1.20 | 2.00 | 3.00 |"
    assert math.isclose(study.Drive().latency, 0.0)


def test_the_loaders_targets_count_together_and_in_groups(study, script, monkeypatch):
    """Targets and noise go by the seed, whatever the drive."""
    asked, of = [], script("loader_control").Arrival

    def arrivals(*_, seed, drive, **__):
        asked.append((seed, drive))
        return [of({"boom": 1e-3 * (seed + 1), "bucket": 0.0}, {"boom": 0.0, "bucket": 0.0}, 0.0)] * 30

    monkeypatch.setattr(study, "arrivals", arrivals)
    found = {name: study.loader(study.DRIVES[name], 4) for name in ("ideal", "3 samples late")}
    assert [seed for seed, _ in asked] == [0, 1, 2, 3] * 2
    assert {drive for _, drive in asked} == {study.DRIVES[name].response for name in found}
    assert found["ideal"]["targets"] == found["ideal"]["drawn"] == 120
    assert found["ideal"]["groups"] == pytest.approx([2e-3, 4e-3])
    assert found["ideal"]["p95"] == pytest.approx(4e-3)
