"""The log of a live run: what `track` makes of it is what the sensor on the page said; and what the strips mark."""

import asyncio
import zipfile

import numpy as np
import pytest

import ramsight
from ramsight.errors import OutputError
from ramsight.machine import load_machine
from ramsight.studio.marks import Marks
from ramsight.studio.recorder import LONGEST, Recorder
from ramsight.studio.rig import Rig
from ramsight.studio.session import Session
from ramsight.studio.strips import saved_run

PERIOD = 0.02


def unpacked(recorder, folder, name="ram", toml="format = 1\n"):
    recorder.save(folder / "run.zip", name, toml)
    with zipfile.ZipFile(folder / "run.zip") as archive:
        archive.extractall(folder)
    return folder


def test_a_saved_run_is_tracked_as_the_page_did(tmp_path):
    rig = Rig(load_machine("press"))
    start = rig.step()["ram"].position
    rig.levers["ram"] = 0.8
    said = []
    for k in range(400):
        if k == 200:
            rig.refer("ram")
        row = rig.step()["ram"]
        said.append((row.time, row.position, row.estimates["kalman"].position))
    folder = unpacked(rig.recorders["ram"], tmp_path)
    log = ramsight.read_log(folder / "log.csv")
    track = ramsight.track("press", log, start=start)
    time, true, estimated = np.array(said).T
    assert np.interp(time, track["time"], track["position"]) == pytest.approx(estimated, abs=2e-5)  # 12 digits of a log
    assert int(np.isfinite(log["reference"]).sum()) == 1
    rows = (folder / "truth.csv").read_text().splitlines()
    assert rows[0] == "time_s,position_m"
    assert float(rows[-1].split(",")[1]) == pytest.approx(true[-1], abs=1e-6)
    assert f'--start "{1e3 * start:.1f} mm"' in (folder / "README.txt").read_text()
    assert (folder / "log.mcap").exists()


def test_without_a_reference_the_log_has_no_column_for_one(tmp_path):
    rig = Rig(load_machine("press"))
    rig.step()
    unpacked(rig.recorders["ram"], tmp_path)
    assert "reference" not in (tmp_path / "log.csv").read_text()


def test_the_newest_hour_is_kept():
    recorder = Recorder(100.0)
    for k in range(60):
        recorder.truth(100.0 * k, 0.1)
        recorder.report(100.0 * k, {"motor_speed": float(k)})
    kept = recorder._reports["time"]
    assert len(kept) <= 1.1 * LONGEST / 100.0
    assert kept[-1] == 5900.0
    assert kept[-1] - kept[0] >= LONGEST - 100.0
    assert len(recorder._reports["motor_speed"]) == len(kept)


def test_a_signal_that_is_missing_at_times_is_no_number_then():
    recorder = Recorder(PERIOD)
    recorder.report(0.0, {"motor_speed": 1.0})
    recorder.report(PERIOD, {"motor_speed": 2.0, "valve_command": 1.0})
    recorder.report(2 * PERIOD, {"motor_speed": 3.0})
    assert list(recorder._reports["motor_speed"]) == [1.0, 2.0, 3.0]
    assert np.isnan(recorder._reports["valve_command"]).tolist() == [True, False, True]


def test_nothing_is_saved_before_there_is_a_report(tmp_path):
    with pytest.raises(OutputError, match="ram: the drive has not reported anything yet"):
        Recorder(PERIOD).save(tmp_path / "run.zip", "ram", "")
    assert not list(tmp_path.iterdir())


def test_of_a_drive_that_was_silent_only_what_the_truth_covers_is_saved(tmp_path):
    recorder = Recorder(100.0)
    recorder.report(0.0, {"motor_speed": 1.0, "reference": np.nan})
    for k in range(60):
        recorder.truth(100.0 * k, 0.001 * k)
    with pytest.raises(OutputError, match="has not reported anything for 60 min"):
        recorder.save(tmp_path / "run.zip", "ram", "")
    report = {"motor_torque": 1.0, "oil_temperature": 313.0, "reference": np.nan}
    recorder.report(5500.0, {"motor_speed": 2.0, **report})
    folder = unpacked(recorder, tmp_path)
    assert [row.partition(",")[0] for row in (folder / "log.csv").read_text().splitlines()[1:]] == ["5500"]
    assert '--start "55.0 mm"' in (folder / "README.txt").read_text()


def test_runs_of_two_units_that_are_asked_for_at_once_are_not_mixed_up():
    session = Asked()
    boom, bucket = asyncio.run(both(session))
    assert (boom, bucket) == (b"boom", b"bucket")
    assert not session.saved  # a run is some megabytes


class Asked:
    """A session whose machine answers one after the other."""

    over = False

    def __init__(self):
        self.saved, self.waiting = {}, []

    def say(self, what, unit):
        assert what == "save"
        self.waiting.append(unit)

    def answer(self):
        unit = self.waiting.pop(0)
        Session._saved(self, (unit, unit.encode()))


async def both(session):
    asked = [asyncio.ensure_future(saved_run(session, unit)) for unit in ("boom", "bucket")]
    await asyncio.sleep(0)  # both have asked
    for _ in asked:
        session.answer()
        await asyncio.wait([one for one in asked if not one.done()], return_when=asyncio.FIRST_COMPLETED)
    return await asyncio.gather(*asked)


def test_an_end_stop_is_marked_once_until_the_piston_has_left_it():
    marks = Marks({"ram": 0.4})
    for time, place in enumerate([0.1, 0.0, 0.0, 0.004, 0.0, 0.006, 0.0, 0.2, 0.3999995, 0.4]):
        marks.moved(float(time), "ram", place)
    assert marks.taken() == [(time, "end stop", "ram") for time in (1.0, 6.0, 8.0)]
    assert marks.taken() == []


def test_faults_and_references_are_marked_when_they_change():
    rig = Rig(load_machine("press"))
    rig.fault("torque", on=True)
    rig.fault("torque", on=True)
    rig.refer("ram", 0.02)
    rig.fault("torque", on=False)
    rig.refer("ram")
    words = [(what, unit) for _, what, unit in rig.marks.taken()]
    frozen, over = ("torque frozen", ""), ("torque frozen: over", "")
    assert words == [frozen, ("wrong reference", "ram"), over, ("reference", "ram")]
