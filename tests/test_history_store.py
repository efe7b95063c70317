"""Where records are kept: whole or not at all, once, by several writers, and in one schema alone."""

import math
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

import ramsight
from ramsight.histories import history_store
from ramsight.histories.history_store import DescriptionChangedError, Event, HistoryError, HistoryStore
from ramsight.histories.record import Learned, MachineKey, description_digest

from .history_bench import KEY, record

ROOT = Path(__file__).parent.parent


@pytest.fixture
def store(tmp_path):
    with HistoryStore(tmp_path / "fleet.db", makes=True) as made:
        yield made


def begin_writer(url, first, last, pause=0.0):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "src")])}
    command = [sys.executable, "-m", "tests.history_bench", str(url), str(first), str(last), str(pause)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, cwd=ROOT)


def whole(store):
    """Numbers of the records in a store, each of which has all of its quantities."""
    (kept,) = store.machines()
    found = store.records(kept.place)
    assert all(one.quantities == record(0).quantities for one in found)
    return sorted(int(one.file.removesuffix(".csv")) for one in found)


def test_a_record_comes_back_as_it_was(store):
    place = store.described(KEY, "digest", "format = 1")
    odd = record(
        1, faults=("motor speed: stuck",), mistake="another machine's",
        quantities={"leak": Learned(1.0 / 3.0, 5e-324, 1.0, 0.16), "relief": Learned(0.99, 0.02)},
    )  # fmt: skip
    absent = dict.fromkeys(("oil_low", "oil_mean", "oil_high", "leak_per_kelvin", "leak_per_kelvin2"), math.nan)
    unknown = record(2, years=0.1, **absent)
    assert store.add(place, odd)
    assert store.add(place, unknown)
    first, second = store.records(place)
    assert first == odd
    assert all(math.isnan(getattr(second, name)) for name in absent)
    known = dict.fromkeys(absent, 0.0)
    assert replace(second, **known) == replace(unknown, **known)


def test_a_log_is_one_record_whatever_its_file_is(store):
    place = store.described(KEY, "digest", "")
    assert store.add(place, record(1))
    assert not store.add(place, record(1, file="other.csv", file_digest="other"))
    assert store.has_file(place, record(1).file_digest)
    assert not store.has_file(place, "other")
    assert len(store.records(place)) == 1


def test_records_come_in_the_order_of_their_times(store):
    place = store.described(KEY, "digest", "")
    for number, years in ((1, 0.3), (2, 0.1), (3, 0.2)):
        store.add(place, record(number, years=years))
    assert [one.file for one in store.records(place)] == ["2.csv", "3.csv", "1.csv"]


def test_another_description_is_refused_or_begins_a_history_of_its_own(store):
    place = store.described(KEY, "digest", "old")
    store.add(place, record(1))
    assert store.described(KEY, "digest", "old") == place
    with pytest.raises(DescriptionChangedError, match="--new-description"):
        store.described(KEY, "other", "new")
    assert store.described(MachineKey("mining-loader", "boom", "2"), "other", "new") != place
    new = store.described(KEY, "other", "new", has_changed=True)
    assert store.records(new) == []
    assert [(one.toml, one.descriptions) for one in store.machines() if one.key == KEY] == [("new", 2)]
    with pytest.raises(DescriptionChangedError, match="had this description before"):
        store.described(KEY, "digest", "old", has_changed=True)


def test_a_description_is_another_one_where_a_factor_rests_on_it():
    loader = ramsight.load_machine("mining-loader")
    asked = loader.replace({"units.boom.requirement": {"error": "5 mm"}})
    bored = loader.replace({"units.boom.cylinder.bore": "128 mm"})
    assert description_digest(loader, "boom") == description_digest(asked, "boom")
    assert description_digest(loader, "boom") != description_digest(bored, "boom")
    assert description_digest(loader, "bucket") == description_digest(bored, "bucket")


def test_events_are_kept_once_and_of_known_machines(store):
    store.described(KEY, "digest", "")
    event = Event(1e9, "oil change", "ISO VG 46")
    assert store.declare(KEY, event)
    assert not store.declare(KEY, event)
    assert store.events(KEY) == [event]
    with pytest.raises(HistoryError, match=r"has no records of press, ram \(known: mining-loader, boom, 1\)"):
        store.declare(MachineKey("press", "ram"), event)


def test_what_is_no_store_is_refused_in_one_line(tmp_path):
    with pytest.raises(HistoryError, match="there is no such file"):
        HistoryStore(tmp_path / "none.db")
    (tmp_path / "text.db").write_text("no database, but a text that is long enough to be looked into" * 20)
    with pytest.raises(HistoryError, match="file is not a database"):
        HistoryStore(tmp_path / "text.db")
    other = sqlite3.connect(tmp_path / "other.db")
    other.execute("CREATE TABLE songs (name TEXT)")
    other.close()
    with pytest.raises(HistoryError, match="is a database of something else"):
        HistoryStore(tmp_path / "other.db", makes=True)
    with pytest.raises(HistoryError, match="no known kind of store"):
        HistoryStore("mysql://host/fleet")
    with pytest.raises(ramsight.RamsightError, match="unable to open database file"):
        HistoryStore(tmp_path / "no" / "folder.db", makes=True)


def test_a_later_schema_is_refused_and_an_earlier_one_migrated(tmp_path, monkeypatch):
    with HistoryStore(tmp_path / "fleet.db", makes=True) as store:
        store.add(store.described(KEY, "digest", ""), record(1))
    monkeypatch.setattr(history_store, "SCHEMA", 0)
    with pytest.raises(HistoryError, match=r"schema 1 is newer than this ramsight knows \(0\); update it"):
        HistoryStore(tmp_path / "fleet.db")
    monkeypatch.setattr(history_store, "SCHEMA", 3)
    done = []

    def fails(connection):
        connection.exec_driver_sql("UPDATE records SET file = 'lost'")
        raise RuntimeError("half way")

    monkeypatch.setitem(history_store.MIGRATIONS, 1, fails)
    with pytest.raises(RuntimeError, match="half way"):
        HistoryStore(tmp_path / "fleet.db")
    for number in (1, 2):
        monkeypatch.setitem(history_store.MIGRATIONS, number, lambda connection, n=number: done.append(n))
    for _ in range(2):
        with HistoryStore(tmp_path / "fleet.db") as store:
            assert whole(store) == [1]
    assert done == [1, 2], "in their order, and once"


def killed_and_finished(folder, kills, seed):
    """Kill a writer of 30 records again and again, then let one finish; the records in the store."""
    rng, path = random.Random(seed), Path(folder) / "fleet.db"
    for _ in range(kills):
        writer, said = begin_writer(path, 0, 30, 0.002), []
        last = rng.randrange(30)
        for line in writer.stdout:
            said.append(int(line))
            if said[-1] >= last:
                break
        time.sleep(0.004 * rng.random())
        writer.kill()
        said += [int(line) for line in writer.stdout]
        writer.wait()
        writer.stdout.close()
        with HistoryStore(path) as store:
            assert set(said) <= set(whole(store)), "what was said to be kept is kept"
    with begin_writer(path, 0, 30) as writer:
        assert writer.wait() == 0
    with HistoryStore(path) as store:
        return whole(store)


@pytest.mark.posix
def test_a_writer_that_is_killed_loses_nothing_and_doubles_nothing(tmp_path):
    assert killed_and_finished(tmp_path, 2, 1) == list(range(30))


def two_writers(url):
    """Two that write at once: 30 records of their own each, and 10 that both have."""
    writers = [begin_writer(url, 0, 40), begin_writer(url, 30, 70)]
    for one in writers:
        assert one.wait() == 0
        one.stdout.close()
    with HistoryStore(url) as store:
        return whole(store)


def test_two_writers_at_once_lose_nothing(tmp_path):
    assert two_writers(tmp_path / "fleet.db") == list(range(70))


def test_who_reads_and_then_writes_waits_for_the_others(tmp_path):
    """Eight at once that look for a description, and make it: in SQLite both needs one claim of the file."""
    with HistoryStore(tmp_path / "fleet.db", makes=True):
        pass

    def describe(number):
        with HistoryStore(tmp_path / "fleet.db") as store:
            return [store.described(MachineKey("loader", "boom", f"{number} {k}"), "digest", "") for k in range(6)]

    with ThreadPoolExecutor(8) as pool:
        places = [place for found in pool.map(describe, range(8)) for place in found]
    assert sorted(places) == list(range(1, 49))


def postgresql_programs():
    """Folder of initdb and pg_ctl; None without a server."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb")) or [
        Path(one) for one in [shutil.which("initdb")] if one
    ]
    return found[-1].parent if found else None


@pytest.fixture
def server(tmp_path_factory):
    """A PostgreSQL server of its own, with an empty database."""
    programs = postgresql_programs()
    if programs is None:
        pytest.skip("PostgreSQL is not installed")
    folder = tmp_path_factory.mktemp("postgresql")
    data, as_other = folder / "data", []
    if os.geteuid() == 0:  # PostgreSQL refuses to run as root
        as_other = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
        for place in (folder, *folder.parents[:3]):
            if place.owner() == "root":
                place.chmod(0o755)
        os.chown(folder, 65534, 65534)
    quiet = {"check": True, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    subprocess.run([*as_other, programs / "initdb", "-D", data, "-A", "trust", "-U", "fitter", "-E", "UTF8"], **quiet)
    options = f"-k {folder} -h '' -c fsync=off"
    control = [*as_other, programs / "pg_ctl", "-D", data, "-w"]
    subprocess.run([*control, "-o", options, "-l", folder / "log", "start"], **quiet)
    try:
        yield f"postgresql://fitter@/postgres?host={folder}"
    finally:
        subprocess.run([*control, "-m", "fast", "stop"], **quiet)


@pytest.mark.slow
@pytest.mark.posix
def test_postgresql_gives_the_same_as_sqlite_and_has_two_writers(server, tmp_path):
    assert two_writers(server) == list(range(70))
    places = (server, str(tmp_path / "fleet.db"))
    found = []
    for url in places:
        with HistoryStore(url, makes=True) as store:
            key = MachineKey("mining-loader", "boom", "bits")
            place = store.described(key, "digest", "format = 1")
            for number in range(20):
                rng = random.Random(number)
                store.add(place, record(number, years=rng.random(), leak=rng.random(), std=rng.random(), faults=("ä",)))
            store.declare(key, Event(rng.random(), "repair", "pump"))
            with pytest.raises(DescriptionChangedError):
                store.described(key, "other", "")
            found.append((store.records(place), store.events(key)))
    assert found[0] == found[1], "bit for bit"
    with pytest.raises(HistoryError, match="postgresql"):
        HistoryStore("postgresql://fitter@/postgres?host=/nowhere")
