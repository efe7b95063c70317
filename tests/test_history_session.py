"""A machine that runs leaves a record of each hour, and one when it is switched off."""

import threading

import pytest

import ramsight
from ramsight.errors import OutputError
from ramsight.histories.adding import Session, recorded, session_for, taking
from ramsight.histories.from_log import Following
from ramsight.histories.history_store import HistoryError, HistoryStore

from .conftest import TRACES
from .encoder_bus import Settings, boom, encoder_for, played, usual_map

DAY = TRACES / "boom_asbuilt1_workday.csv.gz"
NAMES = ("time", "motor_speed", "motor_torque", "oil_temperature")


@pytest.fixture(scope="module")
def rows():
    log = ramsight.read_log(DAY)
    return list(zip(*(log[name].values.tolist() for name in NAMES), strict=True))


def session(**more):
    kept = []
    return Session(boom(), kept.append, clock=lambda: 5.0, **more), kept


def test_a_session_is_the_record_of_its_log_in_whatever_pieces(rows):
    running, kept = session(every=1e9)
    for k, row in enumerate(rows):
        running.take(*row)
        if k % 5000 == 0:
            running.work()
    assert kept == []
    running.close()
    (found,) = kept
    log = Following(boom()).record(DAY, 0.0)
    sensed = [{name: one for name, one in each.quantities.items() if name != "relief"} for each in (found, log)]
    assert sensed[0] == sensed[1]
    assert found.quantities["relief"].value == pytest.approx(log.quantities["relief"].value, abs=0.01)
    assert (found.references, found.duration, found.begun, found.dated_by) == (5, log.duration, 5.0, "clock")


def test_each_hour_is_a_record_that_knows_nothing_of_the_one_before(rows):
    running, kept = session(every=150.0)
    for k, row in enumerate(rows):
        running.take(*row)
        if k % 500 == 0:
            running.work()
    running.close()
    running.close()
    assert [one.duration for one in kept] == pytest.approx([155.0, 155.0, 70.0], abs=6.0)
    assert len({one.log_digest for one in kept}) == 3
    assert sum(one.references for one in kept) <= 5, "each counts its own"
    assert all(one.quantities["leak"].prior_std == pytest.approx(0.16, rel=0.01) for one in kept[1:])
    assert session()[0].close() is None, "nothing was taken, and nothing is kept"


def test_what_cannot_be_kept_is_kept_later(rows):
    fails, kept = [True], []

    def keep(record):
        if fails[0]:
            raise OutputError("disk full")
        kept.append(record)

    running = Session(boom(), keep, every=10.0)
    for row in rows[:2000]:
        running.take(*row)
    running.work()
    assert (running.failure, kept) == ("disk full", [])
    fails[0] = False
    running.work()
    assert (running.failure, len(kept)) == ("", 1)


def test_an_encoder_leaves_a_record_in_the_store(tmp_path):
    loader = ramsight.load_machine("mining-loader")
    running = session_for(tmp_path / "fleet.db", loader, "boom", boom(), "4711")
    device = encoder_for(boom(), usual_map(), Settings(6, 5), record=taking(running))
    device.start(0.0)
    with recorded(running, 0.01):
        assert any(one.name == "history" for one in threading.enumerate())
        for at, frame in played(ramsight.read_log(DAY).isel(time=slice(0, 4000))):
            device.receive(at, frame)
    assert not any(one.name == "history" for one in threading.enumerate())
    with HistoryStore(tmp_path / "fleet.db") as store:
        (machine,) = store.machines()
        (found,) = store.records(machine.place)
    assert machine.key.text == "mining-loader, boom, 4711"
    assert found.duration == pytest.approx(80.0, abs=1.0)
    other = loader.replace({"units.boom.cylinder.stroke": "690 mm"})
    with pytest.raises(HistoryError, match="rest on another description"):
        session_for(tmp_path / "fleet.db", other, "boom", boom(), "4711")


def test_without_a_session_nothing_is_done():
    with recorded(None):
        assert taking(None)(object()) is None
