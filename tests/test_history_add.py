"""Logs become records: dated, followed once, resumed; refused where they are of another machine or description."""

import json
import math
import os
import shutil

import numpy as np
import pytest

import ramsight
from ramsight.errors import DescriptionError
from ramsight.histories.adding import add_logs, logs_in
from ramsight.histories.from_log import Following, relief_level, summary
from ramsight.histories.history_store import HistoryStore
from ramsight.histories.record import LEARNED_LEAST, Learned, MachineKey, begun, instant, named_time, shown
from ramsight.logs.drive_log import write_log
from ramsight.tracking.pressed import Press, Pressed

from .command import at_once
from .conftest import TRACES

DAY = TRACES / "boom_asbuilt1_workday.csv.gz"
SHORT = TRACES / "boom_441kN_40C.csv.gz"


def test_evidence_is_what_the_log_adds_to_the_description():
    value, std = Learned(1.1, 0.1 / math.sqrt(2.0), 1.0, 0.1).evidence
    assert (value, std) == (pytest.approx(1.2), pytest.approx(0.1)), "as sure as the description: twice as far away"
    assert Learned(0.99, 0.02).evidence == (0.99, 0.02), "without a prior all of it is the log's"
    at_least = 0.1 / math.sqrt(1.0 + LEARNED_LEAST)
    assert Learned(1.0, at_least * 1.001, 1.0, 0.1).evidence is None
    assert Learned(1.0, at_least * 0.999, 1.0, 0.1).evidence is not None
    assert Learned(1.0, 0.2, 1.0, 0.1).evidence is None
    assert Learned(math.nan, 0.1).evidence is None
    assert Learned(1.0, 0.0).evidence is None


@pytest.mark.parametrize(
    ("name", "when"),
    [
        ("boom_2026-03-01.csv", "2026-03-01"),
        ("boom 20260301T063015.mf4", "2026-03-01T06:30:15"),
        ("2026-03-01_06-30.csv", "2026-03-01T06:30"),
        ("a_2026-13-01_b_2026-02-03.csv", "2026-02-03"),
        ("boom_20261301.csv", None),
        ("boom_120260301.csv", None),
        ("boom.csv", None),
    ],
)
def test_a_date_in_a_name_is_found(name, when):
    assert named_time(name) == (None if when is None else instant(when))


def test_a_log_is_dated_by_what_is_passed_its_clock_its_name_and_its_file(tmp_path):
    file = tmp_path / "boom_2026-03-01.csv"
    file.touch()
    os.utime(file, (1e9, 1e9))
    assert begun(file, 1.7e9, 5.0) == (5.0, "option")
    assert begun(file, 1.7e9) == (1.7e9, "log")
    assert begun(file, 9.4e8) == (instant("2026-03-01"), "name"), "a clock that counts from its start"
    assert begun(file.rename(tmp_path / "boom.csv"), math.nan) == (1e9, "file")
    assert shown(instant("2026-03-01T23:59:59")) == "2026-03-01"


def test_logs_are_found_in_folders_by_name(tmp_path):
    for name in ("b.csv", "a.CSV.gz", "notes.md", "deeper/c.mf4"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = logs_in([tmp_path, tmp_path / "b.csv", tmp_path / "notes.md"])
    assert [one.relative_to(tmp_path).as_posix() for one in found] == ["a.CSV.gz", "b.csv", "deeper/c.mf4", "notes.md"]
    with pytest.raises(DescriptionError, match="there is no such file or folder"):
        logs_in([tmp_path / "none.csv"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(DescriptionError, match="no log is there"):
        logs_in([tmp_path / "empty"])


@pytest.fixture(scope="module")
def following():
    return Following(ramsight.build("mining-loader", "boom"))


def test_a_record_has_what_the_sensor_learned_and_what_was_counted(following):
    found = following.record(DAY, 0.0)
    track = ramsight.track(following.unit, DAY)
    last = track.isel(time=-1)
    for name, key in (("leak", "leak_factor"), ("displacement", "displacement_factor"), ("exponent", "leak_exponent")):
        assert found.quantities[name].value == pytest.approx(float(last[key]), abs=1e-3)
        assert found.quantities[name].std == pytest.approx(float(last[f"{key}_std"]), rel=0.02)
    assert found.quantities["leak"].prior_std == pytest.approx(following.unit.assumptions.machine.leak)
    variance = found.covariances["leak exponent"]
    assert abs(variance) < found.quantities["leak"].std * found.quantities["exponent"].std
    time, speed, oil = (track[name].values for name in ("time", "motor_speed", "oil_temperature"))
    assert found.duration == pytest.approx(time[-1] - time[0])
    assert found.worked == pytest.approx(float(np.sum(np.diff(time)[np.abs(speed[1:]) > 1.0])), rel=0.05)
    assert (found.oil_low, found.oil_high) == (oil.min(), oil.max())
    assert found.references == 5
    assert found.available == pytest.approx(float(np.isfinite(track["position"]).mean())), "none of it is invalid"
    assert 0.0 <= found.consistency < 9.0
    assert found.quantities["relief"].value == pytest.approx(1.0, abs=0.05)
    assert "leak 1.148 ± 0.016" in summary(found)
    again = following.record(DAY, 0.0)
    assert again == found, "each log begins with a new sensor"


def test_relief_is_the_median_of_the_highest_plateaus_of_each_way(following):
    pressed = Pressed(following.unit)
    assert relief_level(pressed) is None
    pressed.presses += [Press(1, level, 1.0, 0.0) for level in (1.0, 0.98, 0.96, 0.5)] + [Press(-1, 1.1, 0.0, 0.0)]
    found = relief_level(pressed)
    assert found.value == pytest.approx((0.98 + 1.1) / 2.0)
    assert found.std == pytest.approx(0.02 / math.sqrt(2.0))


def test_the_command_adds_once_resumes_and_refuses(tmp_path):
    logs, store = tmp_path / "logs", tmp_path / "fleet.db"
    logs.mkdir()
    shutil.copy(SHORT, logs / "boom_2026-03-01.csv.gz")
    (logs / "boom_2026-03-02.csv").write_text("no log\n")
    words = ("history", "add", "mining-loader", logs, "--unit", "boom", "--serial", "7", "--store", store)
    done = at_once(*words)
    assert done.returncode == 1
    assert "boom_2026-03-02.csv" in done.stderr
    assert done.stdout.splitlines()[-1] == "1 added, 0 known, 1 refused"
    (logs / "boom_2026-03-02.csv").unlink()
    shutil.copy(logs / "boom_2026-03-01.csv.gz", logs / "copy_2026-03-09.csv.gz")
    shutil.copy(TRACES / "boom_441kN_60C.csv.gz", logs / "boom_2026-03-03.csv.gz")
    done = at_once(*words, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    said = json.loads(done.stdout)
    assert [one["file"] for one in said["added"]] == ["boom_2026-03-03.csv.gz"]
    assert len(said["known"]) == 2
    with HistoryStore(store) as kept:
        (machine,) = kept.machines()
        assert [shown(one.begun) for one in kept.records(machine.place)] == ["2026-03-01", "2026-03-03"]
    changed = ramsight.load_machine("mining-loader").replace({"units.boom.cylinder.stroke": "690 mm"})
    with pytest.raises(ramsight.RamsightError, match="rest on another description"):
        ramsight.history_add(store, changed, logs, unit="boom", serial="7")
    one = logs / "boom_2026-03-03.csv.gz"
    new = ramsight.history_add(store, changed, one, unit="boom", serial="7", new_description=True)
    assert len(new.records) == 1


def test_a_log_that_has_a_record_is_not_followed_again(tmp_path, monkeypatch):
    assert len(ramsight.history_add(tmp_path / "fleet.db", "mining-loader", SHORT, unit="boom").records) == 1
    monkeypatch.setattr(Following, "record", None)
    assert ramsight.history_add(tmp_path / "fleet.db", "mining-loader", SHORT, unit="boom").known == (SHORT,)


def test_a_log_of_another_machine_is_kept_and_marked(following, tmp_path):
    log = ramsight.read_log(DAY)
    log["motor_torque"] = 8.0 * log["motor_torque"]
    write_log(log, tmp_path / "scaled.csv")
    with pytest.warns(ramsight.LogWarning):
        found = following.record(tmp_path / "scaled.csv", 0.0)
    assert found.mistake
    assert "cannot be this machine's" in summary(found)


def test_what_is_out_of_range_is_refused(tmp_path):
    store = tmp_path / "fleet.db"
    with pytest.raises(DescriptionError, match="at = 'yesterday': is no time"):
        ramsight.history_add(store, "press", SHORT, at="yesterday")
    with pytest.raises(DescriptionError, match="is for a single log"):
        ramsight.history_add(store, "press", [SHORT, DAY], at="2026-03-01")
    with pytest.raises(DescriptionError, match="is no kind of event"):
        ramsight.history_event(store, "press", "party", "2026-03-01", unit="ram")
    assert not store.exists()


def test_a_cluster_gives_the_same_rows(following, tmp_path):
    """Of a client that works at once: what travels is the order, and a row comes back."""
    distributed = pytest.importorskip("distributed")
    with distributed.Client(processes=False, n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        found = []
        for use in (None, client):
            with HistoryStore(tmp_path / f"{use is None}.db", makes=True) as store:
                place = store.described(MachineKey("mining-loader", "boom"), "digest", "")
                add_logs(store, place, following, [SHORT], at=0.0, client=use)
                found.append(store.records(place))
    assert found[0] == found[1]
